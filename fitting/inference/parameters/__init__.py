"""Free, fixed, tied and bounded parameters that behave as lmfit's do, and the vector that a fit sees of them.

Differences from lmfit, on purpose: a value outside its bounds is refused, not clipped; bounds are a box
around the fit instead of a folded sine; a parameter may be fitted by its logarithm; a tie is plain
arithmetic.
"""

from pneusma_jax.calibration.records import Prior

from .collection import Layout, Parameters
from .parameter import Parameter
from .table import format_estimate

__all__ = ["Layout", "Parameter", "Parameters", "Prior", "format_estimate"]
