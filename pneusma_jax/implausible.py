"""A warning of numbers of a Python call that rather are in another unit than that of their argument."""

import warnings
from typing import Any

import jax
import numpy as np

from .errors import Implausible
from .numerics.safe import is_concrete

LEAST_PA, MOST_PA = 100.0, 5e6
"""Largest pressure of a call below which a person rather means kPa, and above which silicone has long burst
[Pa]. Soft gels inflate at 1 kPa."""
SMALLEST_PA = 1e-3
"""Smallest pressure of a call that may be meant in another unit [Pa]. Steps of derivatives are smaller."""
WRITTEN_DIGITS = 4
"""Maximum number of significant digits of most numbers that a person writes."""


def warn_of_pressure(given: Any) -> None:
    """Warn of a pressure that rather is in kPa, or a thousand times too large, where it is a known number.

    A small pressure counts if a person may have written it: a number of few digits, or the last one of a row
    of evenly spaced ones. A sensor's readings about zero are neither.

    Args:
        given: pressures of a call [Pa].

    Raises:
        Implausible: as a warning, which names the unit of the argument.
    """
    if not is_concrete(given) or not jax.tree.leaves(given):
        return
    values = np.abs(np.asarray(given, dtype=float))
    most = float(np.max(values, initial=0.0, where=np.isfinite(values)))
    steps = np.diff(np.ravel(values))
    even = steps.size == 0 or bool(np.ptp(steps) <= 1e-9 * most)
    if SMALLEST_PA <= most < LEAST_PA and even and most == float(f"{most:.{WRITTEN_DIGITS}g}"):
        said = f"which hardly moves any actuator: this argument is in Pa. For kPa give {most:g}e3"
    elif most > MOST_PA:
        said = f"and silicone bursts far below: this argument is in Pa. Is the number {most / 1e3:g} Pa?"
    else:
        return
    warnings.warn(f"The largest pressure is {most:g} Pa, {said}", Implausible, stacklevel=3)
