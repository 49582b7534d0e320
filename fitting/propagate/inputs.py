"""All inputs of a study together: from independent standard normal scores to values of the model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from scipy.special import ndtr, ndtri

from pneusma_jax.errors import InputError

from .distributions import Empirical, Marginal

POSTERIOR = "posterior"
"""Name of the one input that picks a draw of a posterior."""


@dataclass(frozen=True)
class Draws:
    """Joint draws of several numbers.

    Attributes:
        names: names of the numbers.
        table: [SI], shape (draws, names).
        source: file.
        caution: what the file says they do not count; empty where they count everything.
    """

    names: tuple[str, ...]
    table: Float[np.ndarray, "draws names"]
    source: str = ""
    caution: str = ""


@dataclass(frozen=True, eq=False)
class Inputs:
    """Varied inputs with their distributions.

    Attributes:
        marginals: distribution of each input, by its name.
        correlation: correlation of the normal scores, shape (inputs, inputs). The last input is `posterior`
            where `draws` are picked, and depends on no other.
        draws: draws of which one row is picked for each row of the study, or None.
    """

    marginals: Mapping[str, Marginal]
    correlation: Float[np.ndarray, "inputs inputs"]
    draws: Draws | None = None
    lower: Float[np.ndarray, "inputs inputs"] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", np.linalg.cholesky(self.correlation))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the inputs, one for each score."""
        return (*self.marginals, *((POSTERIOR,) if self.draws else ()))

    @property
    def value_names(self) -> tuple[str, ...]:
        """Names of the numbers that the model is given."""
        return (*self.marginals, *(self.draws.names if self.draws else ()))

    @property
    def correlated(self) -> bool:
        """True if any scores are correlated."""
        return bool(np.any(self.correlation != np.eye(len(self.correlation))))

    def values(self, z: Float[np.ndarray, "rows inputs"]) -> Float[np.ndarray, "rows values"]:
        """Values of the model [SI] at correlated scores."""
        columns = [marginal.at(z[:, k]) for k, marginal in enumerate(self.marginals.values())]
        if self.draws is None:
            return np.stack(columns, axis=1)
        return np.concatenate([np.stack(columns, 1) if columns else z[:, :0], self._picked(z[:, -1])], axis=1)

    def _picked(self, z: np.ndarray) -> np.ndarray:
        count = len(self.draws.table)
        return self.draws.table[np.minimum((ndtr(z) * count).astype(int), count - 1)]

    def slopes(self, z: Float[np.ndarray, "rows inputs"]) -> Float[np.ndarray, "rows inputs"]:
        """Derivative of each value by its own score.

        Raises:
            InputError: where draws are picked, which has none.
        """
        if self.draws is not None:
            raise InputError(
                "draws of a posterior are picked one by one, which has no gradient: set posterior_as = "
                "'copula'"
            )
        return np.stack([m.slope(z[:, k]) for k, m in enumerate(self.marginals.values())], axis=1)


def normal_scores(u: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Normal scores of points of the unit cube, its faces moved inwards by less than a sampler's grid."""
    return ndtri(np.clip(u, 2.0**-34, 1.0 - 2.0**-34))


def copula_of(draws: Draws) -> tuple[dict[str, Empirical], Float[np.ndarray, "names names"]]:
    """Marginals and correlation of normal scores that joint draws have.

    Numbers that never change are left at their value: their marginal is flat and correlates with nothing.
    """
    count = len(draws.table)
    ranks = np.argsort(np.argsort(draws.table, axis=0, kind="stable"), axis=0, kind="stable")
    scores = ndtri((ranks + 0.5) / count)
    still = np.ptp(draws.table, axis=0) == 0.0
    correlation = np.atleast_2d(np.corrcoef(scores, rowvar=False))
    correlation[still], correlation[:, still] = 0.0, 0.0
    np.fill_diagonal(correlation, 1.0)
    marginals = {name: Empirical(np.sort(draws.table[:, k])) for k, name in enumerate(draws.names)}
    return marginals, correlation


def correlation_matrix(
    names: Sequence[str], pairs: Sequence[tuple[str, str, float]], start: np.ndarray, where: str
) -> Float[np.ndarray, "inputs inputs"]:
    """Correlation of all scores.

    Args:
        names: names of the inputs.
        pairs: correlations that are stated, of Gaussian scores.
        start: correlations that are known in advance, shape (inputs, inputs).
        where: file and key, for messages.

    Raises:
        InputError: if no distribution can have these.
    """
    matrix = start.copy()
    for first, second, value in pairs:
        i, j = names.index(first), names.index(second)
        matrix[i, j] = matrix[j, i] = value
    if np.linalg.eigvalsh(matrix)[0] < 1e-10:
        worst = max(pairs, key=lambda pair: abs(pair[2]), default=("", "", 0.0))
        raise InputError(
            f"{where}: no inputs can have all of these correlations at once (the matrix is not positive "
            f"definite); the largest is {worst[2]:g} between {worst[0]!r} and {worst[1]!r}"
        )
    return matrix
