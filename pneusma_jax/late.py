"""Libraries that take long to load and that most runs do without: loaded when they are first used."""

import importlib
from typing import Any


class Late:
    """Stands for a module, and imports it at the first look at one of its names.

        >>> optimize = Late("scipy.optimize")  # nothing is loaded
        >>> optimize.brentq(lambda x: x - 1.0, 0.0, 2.0)
        1.0
    """

    def __init__(self, module: str) -> None:
        self._module = module

    def __getattr__(self, name: str) -> Any:
        if "_module" not in vars(self):  # a copy that is being made
            raise AttributeError(name)
        return getattr(importlib.import_module(self._module), name)


optimistix = Late("optimistix")
"""Finds roots in programs that are traced, and takes 130 ms to load. A program from disk is not traced."""
tomlkit = Late("tomlkit")
"""Writes TOML, and takes 50 ms to load. What only reads TOML uses `tomllib`."""
