"""Standard errors and correlations from the Jacobian at a solution, and its undetermined directions."""

from collections.abc import Container, Iterable
from dataclasses import dataclass

import numpy as np

from ..parameters import Layout

NEGLIGIBLE = 1e-11
"""Maximum singular value of the column-scaled Jacobian, relative to the largest, that counts as zero. Along
such a direction the standard error exceeds that of a parameter known alone by eleven decades. Derivatives of
solved equations are not more exact than that."""
PARTICIPATION = 1e-6
"""Maximum component of a determined quantity along an undetermined direction."""


@dataclass(frozen=True)
class Uncertainty:
    """Linear propagation of a fit's uncertainty to all its parameters.

    Attributes:
        standard_errors: standard errors by name; None where there is none.
        names: names of the free parameters with a standard error, in order.
        covariance: covariance of those, shape (k, k).
        correlation: correlation of those, shape (k, k).
        undetermined: parameters and their weights, for each undetermined direction.
    """

    standard_errors: dict[str, float | None]
    names: tuple[str, ...]
    covariance: np.ndarray
    correlation: np.ndarray
    undetermined: tuple[dict[str, float], ...]

    @classmethod
    def none(cls, names: Iterable[str]) -> "Uncertainty":
        """Empty result, as for a failed fit."""
        return cls({name: None for name in names}, (), np.zeros((0, 0)), np.zeros((0, 0)), ())


def propagate(
    triangle: np.ndarray,
    derivatives: np.ndarray,
    layout: Layout,
    at_bound: Container[str],
    variance: float,
) -> Uncertainty:
    """Covariance of all parameters, by the delta method from the fitting coordinates.

    Parameters on a bound count as exactly there: they have no standard error, and the others' are conditional
    on them. An undetermined direction is left out of the covariance, and quantities that depend on it have no
    standard error. A tied quantity that does not depend on it keeps one: if only a + b is known, a tie `a +
    b` is.

    Args:
        triangle: R of the Jacobian by the fitting coordinates, shape (k, n).
        derivatives: derivatives of all parameters by the fitting coordinates, shape (all, n).
        layout: names of both.
        at_bound: names of free parameters on a bound.
        variance: variance of a residual: 1 for residuals in units of sigma, reduced chi-square to estimate
            it.
    """
    names, free = layout.names, layout.free
    inner = [i for i, name in enumerate(free) if name not in at_bound]
    jacobian, slopes = triangle[:, inner], derivatives[:, inner]
    norms = np.linalg.norm(jacobian, axis=0)
    norms = np.where(norms > 0, norms, 1.0)
    _, singular, right = np.linalg.svd(jacobian / norms, full_matrices=True)
    singular = np.concatenate([singular, np.zeros(len(inner) - len(singular))])
    nonzero = singular > NEGLIGIBLE * max(singular.max(initial=0.0), np.finfo(float).tiny)

    scaled = slopes / norms
    length = np.linalg.norm(scaled, axis=1)
    blind = np.linalg.norm(scaled @ right[~nonzero].T, axis=1) > PARTICIPATION * length
    root = scaled @ right[nonzero].T / singular[nonzero]
    spread = np.linalg.norm(root, axis=1)
    usable = {name: bool(length[i] > 0 and not blind[i]) for i, name in enumerate(names)}
    determined = tuple(name for name in free if name not in at_bound and usable[name])
    rows = root[[names.index(name) for name in determined]]
    directions = rows / np.linalg.norm(rows, axis=1, keepdims=True)
    return Uncertainty(
        standard_errors={
            name: float(spread[i] * np.sqrt(variance)) if usable[name] else None
            for i, name in enumerate(names)
        },
        names=determined,
        covariance=rows @ rows.T * variance,
        correlation=directions @ directions.T,
        undetermined=tuple(_members(direction, [free[i] for i in inner]) for direction in right[~nonzero]),
    )


def _members(direction: np.ndarray, names: list[str]) -> dict[str, float]:
    return {name: float(weight) for name, weight in zip(names, direction, strict=True) if abs(weight) > 0.01}
