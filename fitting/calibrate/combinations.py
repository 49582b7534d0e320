"""Quantities that recordings tell although single constants may be open: their intervals, by propagation.

The delta method carries the fit's covariance over. Its interval is too narrow where the misfit is no
parabola, so every constrained fit of the profiles widens it. A set of constants whose chi-square is higher by
r shows how far the quantity can go for r. That distance is scaled by the square root to the rise of the
interval.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.least_squares.covariance import Uncertainty
from pneusma_jax.numerics.safe import as_arrays

from .profile_likelihood import RISES, WIDTH_90, Profile

NEARLY = (0.1, 3.0)
"""Smallest and largest rise of a constrained fit that is used, as factors on the rise of a 90 % interval.
Nearer fits are rounding; further ones are another place of the law."""


@dataclass(frozen=True)
class Combination:
    """A quantity made of several constants.

    Attributes:
        name: name in words.
        value: value at the fit; low, high: ends of its 90 % interval.
        unit: unit of all three.
    """

    name: str
    value: float
    low: float
    high: float
    unit: str


def propagated(
    labels: Sequence[tuple[str, str]],
    law: Callable[[Mapping[str, Array]], Array],
    values: Mapping[str, float],
    uncertainty: Uncertainty,
    profiles: Mapping[str, Profile],
    covariance: np.ndarray | None = None,
) -> list[Combination]:
    """Quantities of a law with their 90 % intervals.

    Args:
        labels: name and unit of each quantity.
        law: all quantities at free parameters by name, SI, shape (quantities,), in those units.
        values: free parameters at the fit, SI.
        uncertainty: uncertainty of the fit.
        profiles: profiles with the constrained fits that they went through.
        covariance: covariance of the constants that `uncertainty` names, in place of its own. Zeros of
            instruments that are off or drift widen it, and correlate the constants anew.
    """
    if not labels:
        return []
    point = as_arrays(values)
    here = np.asarray(law(point))
    names = uncertainty.names
    slopes = jax.jacfwd(lambda free: law({**point, **free}))({name: point[name] for name in names})
    columns = [np.asarray(slopes[name]) for name in names]
    slope = np.stack(columns, axis=-1) if names else np.zeros((len(here), 0))
    covariance = uncertainty.covariance if covariance is None else covariance
    variance = np.einsum("qi,ij,qj->q", slope, covariance, slope)
    half = WIDTH_90 * np.sqrt(np.maximum(variance, 0.0))
    below, above = half.copy(), half.copy()
    for profile in profiles.values():
        limit = RISES[90] * profile.rise_per_sd
        for visited, rise in zip(profile.visited, profile.rise, strict=False):
            if not NEARLY[0] * limit < rise < NEARLY[1] * limit:
                continue
            there = np.asarray(law({**point, **{n: jnp.asarray(float(visited[n])) for n in point}}))
            reach = (there - here) * np.sqrt(limit / rise)
            reach = np.where(np.isfinite(reach), reach, 0.0)
            above, below = np.maximum(above, reach), np.maximum(below, -reach)
    return [
        Combination(name, float(here[k]), float(here[k] - below[k]), float(here[k] + above[k]), shown)
        for k, (name, shown) in enumerate(labels)
    ]
