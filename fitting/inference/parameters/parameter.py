"""One parameter: a number, and its role in a fit."""

import keyword
import math
from dataclasses import dataclass, field, fields
from typing import Any, Literal

from pneusma_jax.calibration.records import Prior
from pneusma_jax.errors import InputError, nearest

from .ties import RESERVED, names_in

FLAT = math.sqrt(12.0)
"""Width of a flat distribution in its standard deviations [1]."""


@dataclass
class Parameter:
    """One number of a model, and its role in a fit. Setting a field checks the whole.

    Attributes:
        name: Python identifier, used by ties and as the key of a residual's values.
        value: value of the parameter; computed for a tied one.
        min: lower bound; by default the cut of the prior, or none.
        max: upper bound; by default the cut of the prior, or none.
        vary: False to hold the value fixed.
        tie: expression of other parameters that gives the value, e.g. `"2*mu"`; None for none.
        unit: unit of the value, a label.
        prior: Gaussian prior of the value, which a fit may use as one more residual.
        scale: `"linear"`, or `"log"` to fit the logarithm of a positive quantity.
        standard_error: standard error from a fit; None if there is none or the value is undetermined.
        initial_value: start value of the last fit; None before.
        correlations: correlations by name of the other parameter, from a fit.
    """

    name: str
    value: float | None = None
    min: float = -math.inf
    max: float = math.inf
    vary: bool = True
    tie: str | None = None
    unit: str = "1"
    prior: Prior | None = None
    scale: Literal["linear", "log"] = "linear"
    standard_error: float | None = None
    initial_value: float | None = None
    correlations: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.prior is not None:
            self.__dict__["min"] = self.prior.min if self.min == -math.inf else self.min
            self.__dict__["max"] = self.prior.max if self.max == math.inf else self.max
        self._check()

    def __setattr__(self, name: str, value: Any) -> None:
        if "correlations" in self.__dict__:  # The last field: until it is there, the object is being made.
            self.set(**{name: value})
        else:
            self.__dict__[name] = value

    def set(self, **changes: Any) -> None:
        """Change fields together, e.g. `set(value=2.0, min=1.0, max=3.0)`; nothing changes if they do not
        fit.

        Raises:
            InputError: if the result would be unusable, or a field does not exist.
        """
        before = dict(self.__dict__)
        known = {entry.name for entry in fields(self)} - {"name"}
        for name in changes:
            if name not in known:
                raise InputError(
                    f"parameter {self.name!r}: there is no {name!r} to set; {nearest(name, known)}"
                )
        try:
            self.__dict__.update(changes)
            self._check()
        except InputError:
            self.__dict__.update(before)
            raise

    def _check(self) -> None:
        where = f"parameter {self.name!r}"
        if not str(self.name).isidentifier() or keyword.iskeyword(self.name) or self.name in RESERVED:
            raise InputError(f"{where}: a name must be a Python identifier and none of {sorted(RESERVED)}")
        for name in ("value", "min", "max"):
            self.__dict__[name] = self._number(name)
        if self.scale not in ("linear", "log"):
            raise InputError(f"{where}: scale {self.scale!r} must be 'linear' or 'log'")
        if self.min >= self.max:
            raise InputError(f"{where}: min {self.min:g} must be below max {self.max:g}")
        if self.prior is not None and not (self.prior.sd > 0 and math.isfinite(self.prior.mean)):
            raise InputError(f"{where}: its prior needs a finite mean and sd > 0, not {self.prior}")
        if self.tie is not None:
            names_in(self.tie, self.name)
            return
        if self.value is None or not math.isfinite(self.value):
            raise InputError(f"{where}: value must be a finite number, not {self.value}")
        if not self.min <= self.value <= self.max:
            raise InputError(
                f"{where}: value {self.value:g} lies outside its bounds [{self.min:g}, {self.max:g}]"
            )
        if self.scale == "log" and self.value <= 0:
            raise InputError(f"{where}: value {self.value:g} must be positive for scale 'log'")

    def _number(self, name: str) -> float | None:
        given = self.__dict__[name]
        if given is None and name == "value":
            return None
        try:
            number = float(given)
        except (TypeError, ValueError):
            raise InputError(f"parameter {self.name!r}: {name} must be a number, not {given!r}") from None
        if math.isnan(number):
            raise InputError(f"parameter {self.name!r}: {name} must be a number, not NaN")
        return number

    @property
    def free(self) -> bool:
        """True if a fit adjusts it."""
        return self.vary and self.tie is None

    @property
    def prior_sd(self) -> float:
        """Standard deviation of the prior; without one that of a flat prior between the bounds."""
        return self.prior.sd if self.prior is not None else (self.max - self.min) / FLAT

    @property
    def at_bound(self) -> bool:
        """True if the value lies on a bound (to 1e-9 of its magnitude or interval), or past it if it is tied.
        """
        if self.value is None:
            return False
        width = self.max - self.min
        slack = 1e-9 * (width if math.isfinite(width) else abs(self.value))
        return self.value - self.min <= slack or self.max - self.value <= slack
