"""Fisher information: how much recordings say about each free parameter, beside its prior."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameters

HELD = 1e12
"""Scaled information that stands for a parameter held at a bound: its variance is then as good as zero."""
SINGULAR = 1e-14
"""Eigenvalue of the scaled information that is taken as zero, as a share of the largest [1]: rounding."""
NO_INFORMATION = 1e-300
"""Scaled information added where a division by zero threatens; it changes no other result."""


@dataclass(frozen=True)
class Information:
    """Fisher information of recordings about the free parameters, at the values found.

    Attributes:
        names: names of the free parameters.
        matrix: information of the data alone, in SI, shape (n, n).
        scale: natural size of each parameter, shape (n,): 1-sigma of its prior where it has one. Matrices are
            inverted in units of these, since in SI parameters differ by many orders of magnitude.
        prior: precision of the priors, shape (n,).
        fixed: parameters that stand at a bound, of shape (n,); they are left out of covariances.
        jumping: parameters within whose error the prediction jumps. Their slopes hold at the fit alone, and
            tell no error of theirs. Errors of the others allow for any value of them, along these slopes and
            within their priors, but for those that are `unfollowed`.
    """

    names: tuple[str, ...]
    matrix: np.ndarray
    scale: np.ndarray
    prior: np.ndarray
    fixed: np.ndarray
    jumping: tuple[str, ...] = ()

    def covariance(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Covariance with the priors, and with further information if there is any; SI."""
        held = self.fixed[:, None] | self.fixed[None, :]
        scaled = np.where(held, np.diag(np.full(len(self.names), HELD)), self._scaled(more))
        return np.linalg.pinv(scaled, rcond=SINGULAR, hermitian=True) * np.outer(self.scale, self.scale)

    def sd(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Standard deviations with the priors, and with further information if there is any, shape (n,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance(more)), 0.0))

    def sd_if_others_were_known(self) -> np.ndarray:
        """Standard deviation of each parameter, with its prior, if all others were known, shape (n,)."""
        own = (np.diag(self.matrix) + self.prior) * self.scale**2
        return self.scale / np.sqrt(own + NO_INFORMATION)

    @property
    def told(self) -> np.ndarray:
        """Mask of the parameters whose slopes describe an error, shape (n,): they neither jump nor are at a
        bound."""
        return ~self.fixed & ~self._jumps

    @property
    def unfollowed(self) -> tuple[str, ...]:
        """Jumping parameters whose slope at the fit says less than their prior, as one of 0 on a stair.

        Errors of the others hold only if the true values are those found: no slope tells how to allow for
        other ones.
        """
        said = np.diag(self.matrix) * self.scale**2
        weak = self._jumps & ~self.fixed & ~(said >= 1.0)
        return tuple(name for name, one in zip(self.names, weak, strict=True) if one)

    def log_volume(self, names: Sequence[str]) -> float:
        """Log-determinant of the covariance of some parameters, in units of their `scale`, without bounds.

        Args:
            names: names of the parameters; those that are not free count for nothing.
        """
        chosen = [k for k, name in enumerate(self.names) if name in names]
        free = replace(self, fixed=np.zeros(len(self.names), bool)).covariance()
        scaled = free / np.outer(self.scale, self.scale)
        return float(np.linalg.slogdet(scaled[np.ix_(chosen, chosen)])[1])

    def gain(self, more: np.ndarray) -> float:
        """Expected information of further data about all parameters that do not jump [nats].

        Those at a bound are included.
        """
        steady = ~self._jumps
        before, after = (
            np.linalg.slogdet(self._beside_jumps(self._scaled(added), steady))[1] for added in (0.0, more)
        )
        return 0.5 * float(after - before)

    def by_data(self, names: Sequence[str]) -> np.ndarray:
        """Information of the data alone about some parameters, in units of `scale`, shape (names, names).

        Those that jump are marginalised over with their priors; any others are known.
        """
        data = self.matrix + np.diag(np.where(self._jumps, self.prior, 0.0))
        chosen = np.array([name in names for name in self.names], bool)
        return self._beside_jumps(data * np.outer(self.scale, self.scale), chosen & ~self._jumps)

    @property
    def _jumps(self) -> np.ndarray:
        """Mask of the parameters within whose error the prediction jumps, shape (n,)."""
        return np.array([name in self.jumping for name in self.names], bool)

    def _beside_jumps(self, scaled: np.ndarray, kept: np.ndarray) -> np.ndarray:
        """Block of some parameters of a scaled information, marginalised over those that jump."""
        jumps = self._jumps & ~self.fixed
        across = scaled[np.ix_(kept, jumps)]
        own = np.linalg.pinv(scaled[np.ix_(jumps, jumps)], rcond=SINGULAR, hermitian=True)
        return scaled[np.ix_(kept, kept)] - across @ own @ across.T

    def _scaled(self, more: np.ndarray | float) -> np.ndarray:
        """Information of data and priors, and further information, in units of `scale`."""
        return (self.matrix + more + np.diag(self.prior)) * np.outer(self.scale, self.scale)


def with_errors(result: FitResult, inform: Callable[[Parameters], Information]) -> FitResult:
    """A fit that ended without standard errors, with those of the information where it ended.

    A misfit has small steps where a rule of the model, such as which branch a row is on, switches with the
    parameters. A fit can stop at such a step. Its status still says so.

    Args:
        result: result of the fit.
        inform: information at parameters; not called where the fit has errors.
    """
    if result.uncertainty.names or result.chi_square is None:
        return result
    parameters = result.parameters.copy()
    fisher = inform(parameters)
    kept = [k for k, fixed in enumerate(fisher.fixed) if not fixed]
    names = tuple(fisher.names[k] for k in kept)
    covariance = fisher.covariance()[np.ix_(kept, kept)]
    sd = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
    errors: dict[str, float | None] = dict.fromkeys(parameters)  # None for all others
    errors |= dict(zip(names, map(float, sd), strict=True))
    for name, error in errors.items():
        parameters[name].set(standard_error=error)
    correlation = covariance / np.outer(sd, sd)
    uncertainty = Uncertainty(errors, names, covariance, correlation, undetermined=())
    return replace(result, parameters=parameters, uncertainty=uncertainty)
