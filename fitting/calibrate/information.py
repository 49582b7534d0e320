"""Fisher information: how much recordings say about each free parameter, beside its prior."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameters


@dataclass(frozen=True)
class Information:
    """Fisher information of recordings about the free parameters, at the values found.

    Attributes:
        names: names of the free parameters.
        matrix: information of the data alone, in SI, shape (n, n).
        scale: 1-sigma of each parameter's prior, shape (n,); its magnitude where it has none.
        prior: precision of the priors, shape (n,).
        fixed: parameters that stand at a bound, of shape (n,); they are left out of covariances.
    """

    names: tuple[str, ...]
    matrix: np.ndarray
    scale: np.ndarray
    prior: np.ndarray
    fixed: np.ndarray

    def covariance(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Covariance with the priors, and with further information if there is any; SI."""
        scaled = (self.matrix + more + np.diag(self.prior)) * np.outer(self.scale, self.scale)
        scaled = np.where(
            self.fixed[:, None] | self.fixed[None, :], np.diag(np.full(len(self.names), 1e12)), scaled
        )
        return np.linalg.pinv(scaled, rcond=1e-14, hermitian=True) * np.outer(self.scale, self.scale)

    def sd(self, more: np.ndarray | float = 0.0) -> np.ndarray:
        """Standard deviations with the priors, shape (n,)."""
        return np.sqrt(np.maximum(np.diag(self.covariance(more)), 0.0))

    def alone(self) -> np.ndarray:
        """Standard deviations with the priors if all other parameters were known, shape (n,)."""
        return self.scale / np.sqrt((np.diag(self.matrix) + self.prior) * self.scale**2 + 1e-300)

    def gain(self, more: np.ndarray) -> float:
        """Expected information of further data [nats]."""
        before, after = (
            np.linalg.slogdet((self.matrix + m + np.diag(self.prior)) * np.outer(self.scale, self.scale))[1]
            for m in (0.0, more)
        )
        return 0.5 * float(after - before)


def with_errors(result: FitResult, inform: Callable[[Parameters], Information]) -> FitResult:
    """A fit that ended without standard errors, with those of the information where it ended.

    If a rule decides otherwise from one row to the next, the misfit has small steps. A fit can stop on one of
    them; its status still says so.

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
    errors = dict.fromkeys(parameters) | dict(zip(names, map(float, sd), strict=True))
    for name, error in errors.items():
        parameters[name].set(standard_error=error)
    uncertainty = Uncertainty(errors, names, covariance, covariance / np.outer(sd, sd), ())
    return replace(result, parameters=parameters, uncertainty=uncertainty)
