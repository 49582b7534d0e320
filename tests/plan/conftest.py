"""Plans know how they look."""

import fitting.characterise  # noqa: F401  results know how they look
