"""The result of a fit: parameters with standard errors, measures of fit, and an honest status."""

import enum
import math
from dataclasses import dataclass, field

import numpy as np

from ..parameters import Parameters, format_estimate
from .covariance import Uncertainty


class Status(enum.Enum):
    """End of a fit; the value is the sentence."""

    CONVERGED = "The fit converged: the next step would be a negligible part of a standard error."
    AT_PRECISION = "The fit reached the precision of the arithmetic: further progress drowns in rounding."
    MAX_STEPS = "The fit used all its steps before it converged; allow more, or start elsewhere."
    LINGERING = (
        "The fit ended before it converged: its last steps lowered chi-square by less than was asked for."
    )
    STALLED = (
        "The fit stopped where no step lowers chi-square although its slope is not zero: the model has a "
        "kink or numerical noise there. These values are the lowest that were found."
    )
    NON_FINITE = (
        "The residual or its derivative is not finite at the starting values; start elsewhere, or set bounds."
    )
    NO_DEGREES_OF_FREEDOM = (
        "There are no more residuals than free parameters: nothing is left to judge the fit by; "
        "fix parameters, or add data or priors."
    )

    @property
    def success(self) -> bool:
        """True if the parameters are a minimum."""
        return self in (Status.CONVERGED, Status.AT_PRECISION)


class FitError(RuntimeError):
    """A failed fit, raised on request; `result` holds its last state."""

    def __init__(self, result: "FitResult"):
        super().__init__(" ".join([result.status.value, *result.notes]))
        self.result = result


@dataclass(frozen=True)
class FitResult:
    """Outcome of `fit_least_squares`.

    Attributes:
        parameters: copy with fitted values, standard errors, correlations and initial values.
        status: end of the fit.
        notes: sentences on undetermined parameters, bounds, and other findings.
        residual: weighted residuals of the data at the solution, in the order of the residual function, shape
            (m,).
        prior_residual: residuals of the priors, in standard deviations, shape (p,).
        observations: number of residuals that count (without padding), priors included.
        degrees_of_freedom: observations less free parameters.
        uncertainty: covariance of the free parameters, and undetermined directions.
        scaled: true if standard errors were multiplied by the root of reduced chi-square.
        steps: number of evaluations of the residual with its derivative, from the best start.
        start_chi_squares: final chi-square of each start, in order; NaN for one that failed.
    """

    parameters: Parameters
    status: Status
    notes: tuple[str, ...]
    residual: np.ndarray
    prior_residual: np.ndarray
    observations: int
    degrees_of_freedom: int
    uncertainty: Uncertainty
    scaled: bool
    steps: int
    start_chi_squares: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def success(self) -> bool:
        """True if the parameters are a minimum."""
        return self.status.success

    @property
    def values(self) -> dict[str, float]:
        """All values by name."""
        return self.parameters.valuesdict()

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """Standard errors by name; None where there is none."""
        return {name: parameter.standard_error for name, parameter in self.parameters.items()}

    @property
    def chi_square(self) -> float | None:
        """Sum of squared residuals, priors included; None if they are not finite."""
        total = float(np.sum(self.residual**2) + np.sum(self.prior_residual**2))
        return total if math.isfinite(total) else None

    @property
    def reduced_chi_square(self) -> float | None:
        """Chi-square per degree of freedom; None without one."""
        if self.chi_square is None or self.degrees_of_freedom <= 0:
            return None
        return self.chi_square / self.degrees_of_freedom

    @property
    def aic(self) -> float | None:
        """Akaike's criterion: -2 log-likelihood + 2 k, up to a constant; see `_deviance`."""
        deviance = self._deviance()
        return None if deviance is None else deviance + 2 * self._free()

    @property
    def bic(self) -> float | None:
        """Schwarz's criterion: -2 log-likelihood + k log n, up to a constant; see `_deviance`."""
        deviance = self._deviance()
        return None if deviance is None else deviance + math.log(self.observations) * self._free()

    def _free(self) -> int:
        return sum(parameter.free for parameter in self.parameters.values())

    def _deviance(self) -> float | None:
        """Chi-square if sigma is known; lmfit's n log(chi-square / n) if not; None if that is infinite."""
        if self.chi_square is None or not self.scaled:
            return self.chi_square
        if self.chi_square == 0:
            return None
        return self.observations * math.log(self.chi_square / self.observations)

    def report(self, correlations_above: float = 0.1) -> str:
        """The whole result as text, in the manner of lmfit's `fit_report`."""

        def shown(number: float | None) -> str:
            return "none" if number is None else f"{number:.6g}"

        lines = [
            self.status.value,
            *self.notes,
            "",
            f"observations {self.observations}, free parameters {self._free()}, "
            f"degrees of freedom {self.degrees_of_freedom}, evaluations {self.steps}",
            f"chi-square {shown(self.chi_square)}, reduced {shown(self.reduced_chi_square)}, "
            f"AIC {shown(self.aic)}, BIC {shown(self.bic)}",
            "standard errors "
            + ("scaled by the root of reduced chi-square" if self.scaled else "from the stated sigma"),
            "",
            self.parameters.table(correlations_above),
        ]
        return "\n".join(lines)

    def estimate(self, name: str) -> str:
        """One parameter as text, e.g. `"0.0885 +/- 0.0012"`."""
        parameter = self.parameters[name]
        return format_estimate(parameter.value, parameter.standard_error)
