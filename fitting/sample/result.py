"""A sampled posterior: draws, summaries of each parameter, and the judgement of convergence."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import jax
import numpy as np
from jaxtyping import Float

from .comparison import Disagreement, compare
from .convergence import EFFECTIVE, LENGTHS, R_HAT, Convergence
from .hamiltonian import ENERGY
from .laplace import Laplace
from .settings import Settings
from .target import Target

LEVELS = (0.05, 0.5, 0.95)


@dataclass(frozen=True)
class Summary:
    """One parameter's posterior.

    Attributes:
        mean, sd: mean and standard deviation of the draws.
        low, median, high: quantiles at 5, 50 and 95 %.
        skewness: third standardised moment.
        effective: effective number of independent draws; NaN for a tied parameter.
        mcse: Monte Carlo standard error of the mean; NaN for a tied parameter.
        r_hat: R-hat between ensembles; NaN for a tied parameter.
    """

    mean: float
    sd: float
    low: float
    median: float
    high: float
    skewness: float
    effective: float
    mcse: float
    r_hat: float


@dataclass(frozen=True)
class Posterior:
    """Draws from a target.

    Attributes:
        target: sampled target.
        settings: settings of the run.
        chains: coordinates, burn-in included, shape (ensembles, steps, walkers, n).
        log_probabilities: log-densities of the same points, up to a constant, shape (ensembles, steps,
            walkers).
        convergence: judgement of the chains.
        laplace: Gaussian approximation for comparison.
        acceptance: accepted fraction of each ensemble's proposals.
        evaluations: number of evaluations of the model.
        failures: number of points inside the bounds without a finite answer; they count as impossible.
        seconds: sampling time in this session [s].
        why: sentence about the choice of the sampler.
        diagnostics: diagnostics of the sampler, by name.
    """

    target: Target
    settings: Settings
    chains: Float[np.ndarray, "ensembles steps walkers n"]
    log_probabilities: Float[np.ndarray, "ensembles steps walkers"]
    convergence: Convergence
    laplace: Laplace
    acceptance: tuple[float, ...]
    evaluations: int
    failures: int
    seconds: float
    why: str = ""
    diagnostics: dict[str, Any] = field(default_factory=dict)

    @property
    def converged(self) -> bool:
        """True if the chains are long enough and agree."""
        return self.convergence.converged

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sampled parameters."""
        return self.target.names

    @property
    def verdict(self) -> list[str]:
        """Judgement of the chains, in sentences."""
        state = self.convergence
        worst = self.names[int(np.argmax(np.max(state.tau, axis=0)))]
        length = f"{state.lengths:.1f} autocorrelation times after a burn-in of {state.burn_in} steps"
        if self.converged:
            sentences = [
                f"Converged: {self._who} ran {state.steps} steps, {length} (more than {LENGTHS:.0f} are "
                f"wanted), and agree (largest R-hat {state.r_hat.max():.4f}, below {R_HAT}); "
                f"{state.effective.min():.0f} effective samples or more."
            ]
        else:
            reasons = []
            if not state.long_enough:
                reasons.append(f"the slowest chain ({worst}) is only {length}, and {LENGTHS:.0f} are wanted")
            if not state.agree:
                name = self.names[int(np.argmax(state.r_hat))]
                reasons.append(
                    f"{self._who} disagree on {name} (R-hat {state.r_hat.max():.3f}, wanted below {R_HAT})"
                )
            if not state.enough:
                reasons.append(
                    f"there are {state.effective.min():.0f} effective samples, and {EFFECTIVE:.0f} are wanted"
                )
            sentences = [
                f"NOT CONVERGED after {state.steps} steps: {'; '.join(reasons)}. Do not quote these numbers.",
                f"Go on with `--resume --max-steps {self._enough_steps}` or more (in Python resume=True). If "
                f"that does not help, the data hardly determine {worst}: state a prior, hold it, or leave a "
                "term of the model out.",
            ]
        if self.settings.sampler == "nuts":
            sentences += self._of_gradients()
        elif self.failures:
            share = 100.0 * self.failures / self.evaluations
            sentences.append(
                f"The model had no finite answer at {self.failures} of {self.evaluations} proposed points "
                f"({share:.2g} %); they count as impossible."
            )
        return [*sentences, *([f"Sampler: {self.why}"] if self.why else [])]

    @property
    def _enough_steps(self) -> int:
        """Number of steps after which chains as slow as these would be long enough, with two digits."""
        state = self.convergence
        shares = state.lengths / LENGTHS, float(state.effective.min()) / EFFECTIVE, 0.5
        return int(float(f"{state.steps / max(min(shares), 1.0 / EFFECTIVE):.1e}"))

    @property
    def _who(self) -> str:
        count = self.settings.ensembles
        if self.settings.sampler == "nuts":
            return f"{count} independent chains that follow gradients"
        return f"{count} independent ensembles of {self.settings.walkers} walkers"

    def _of_gradients(self) -> list[str]:
        """Warnings about chains that follow gradients."""
        draws, sentences = self.chains.shape[0] * self.chains.shape[1], []
        if self.failures:
            sentences.append(
                f"{self.failures} of {draws} transitions diverged: the integration of a trajectory went "
                "astray there, so that sharply curved or kinked regions may be visited too rarely."
            )
        fractions = self.diagnostics.get("energy_fraction", [])
        if fractions and min(fractions) < ENERGY:
            sentences.append(
                f"Chains move slowly between levels of energy (fraction {min(fractions):.2f}, {ENERGY} or "
                "more are wanted): tails may be visited too rarely."
            )
        return sentences

    @property
    def thinned(self) -> Float[np.ndarray, "ensembles draws walkers n"]:
        """Coordinates after burn-in, about two in each autocorrelation time."""
        return self.chains[:, self.convergence.burn_in :: self.convergence.thin]

    @cached_property
    def draws(self) -> dict[str, Float[np.ndarray, "ensembles draws walkers"]]:
        """Thinned draws of every sampled parameter and of those tied to them."""
        return self.target.all_values(self.thinned)

    @property
    def thinned_log_probabilities(self) -> Float[np.ndarray, "ensembles draws walkers"]:
        """Log-densities of the thinned draws."""
        return self.log_probabilities[:, self.convergence.burn_in :: self.convergence.thin]

    def flat(self, most: int | None = None) -> Float[np.ndarray, "draws n"]:
        """Thinned coordinates of all ensembles in one table; evenly spaced ones if there are more than
        `most`."""
        table = self.thinned.transpose(1, 0, 2, 3).reshape(-1, self.target.dimension)
        if most is None or len(table) <= most:
            return table
        return table[np.linspace(0, len(table) - 1, most).round().astype(int)]

    @cached_property
    def summary(self) -> dict[str, Summary]:
        """Summary of every parameter, from all draws after burn-in."""
        values = self.target.all_values(self.chains[:, self.convergence.burn_in :])
        return {name: self._summary(name, found.ravel()) for name, found in values.items()}

    def _summary(self, name: str, values: np.ndarray) -> Summary:
        mean, sd = float(values.mean()), float(values.std())
        low, median, high = (float(q) for q in np.quantile(values, LEVELS))
        skewness = float(np.mean(((values - mean) / sd) ** 3)) if sd > 0.0 else 0.0
        effective = r_hat = math.nan
        if name in self.names:
            k = self.names.index(name)
            effective, r_hat = float(self.convergence.effective[k]), float(self.convergence.r_hat[k])
        mcse = sd / math.sqrt(effective) if effective > 0.0 else math.nan
        return Summary(mean, sd, low, median, high, skewness, effective, mcse, r_hat)

    @cached_property
    def disagreements(self) -> dict[str, Disagreement]:
        """Comparison of the Laplace approximation with the draws, parameter by parameter."""
        return {
            name: compare(s.mean, s.sd, s.skewness, self.laplace.value[name], self.laplace.sd[name])
            for name, s in self.summary.items()
        }

    def log_likelihoods(self) -> Float[np.ndarray, "ensembles draws walkers"]:
        """Log-likelihoods of the thinned draws, up to a constant: log-probability without the prior."""
        points = self.thinned.reshape(-1, self.target.dimension)
        prior = np.asarray(jax.jit(jax.vmap(self.target.log_prior))(points))
        return self.thinned_log_probabilities - prior.reshape(self.thinned.shape[:-1])
