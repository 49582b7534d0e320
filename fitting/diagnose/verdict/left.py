"""Misfit that a model leaves beyond noise, and its rows. If it is large, no name is to be trusted.

Large is more than `excess.clear`, and more than a small share of the base model's misfit. A form that is
right to a few percent leaves a small share, which is many noise variances where the misfit is large.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fitting.inference.notes import joined
from fitting.inference.numbers import number

from ..evaluate.program import Program
from ..fit.misfit import floor, scored
from ..fit.prediction import predictive_chi_square, with_shown
from ..fit.refit import Fit
from ..search.decision import kept_of
from ..settings import DEFAULT
from .discrepancy import Discrepancy
from .regime import Regime, regime_of

EXCESS = DEFAULT.excess
SHARE = DEFAULT.share


@dataclass(frozen=True)
class Left:
    """Misfit beyond noise that names and a saved discrepancy leave.

    Attributes:
        reduced_chi2: predictive, per value.
        noise: part of it that noise explains.
        held_out: true if it is that of validation recordings.
        names: effects that leave it.
        regime: regime of most of it; None if no regime is confirmed.
        explained: predictive reduced chi-square, where the uncertainty of fitted numbers explains the misfit:
            `reduced_chi2` is then not predictive. None where it does not.
        stated: true if the size of the noise is stated. Otherwise it is a guess, and often too small.
        kept: share of the base model's misfit that the effects alone leave, see `kept_of`; 1 for none.
        supports: false if the base model misses values that were not fitted clearly less, see `assess`.
    """

    reduced_chi2: float
    noise: float
    held_out: bool
    names: tuple[str, ...]
    regime: Regime | None
    explained: float | None = None
    stated: bool = True
    kept: float = 1.0
    supports: bool = True

    @property
    def open(self) -> bool:
        """True if the uncertainty of fitted numbers explains the misfit."""
        return self.explained is not None

    @property
    def trusted(self) -> bool:
        """True if it is so little that the form of a right effect, or an open number, may have left it.

        That is a little of the noise, or a small share of what the effects explain. Much of an unstated noise
        may be little of the true one.
        """
        little = self.reduced_chi2 - self.noise <= EXCESS.clear or self.kept <= SHARE.small
        return self.open or not self.stated or little

    @property
    def text(self) -> str:
        """Size and place in sentences, one idea each; with the reason where open numbers explain it."""
        if self.explained is not None:
            nor = "" if self.supports else (
                f" Nor does it support {joined(self.names)}: the base model misses these recordings less."
            )  # fmt: skip
            return (
                f"Recordings that were not fitted are missed by {self._times} their noise (reduced "
                f"chi-square {number(self.reduced_chi2)}, where noise alone would leave "
                f"{number(self.noise, '.2g')}). This does not contradict the model: its numbers are "
                f"uncertain, and other values within their errors leave {number(self.explained, '.2g')} "
                f"there.{nor}"
            )
        among = "recordings that were not fitted" if self.held_out else "fitted recordings"
        leaves = number(self.noise, ".2g")
        said = [
            f"A reduced chi-square of {number(self.reduced_chi2)} is left in {among}, where noise alone "
            f"would leave {leaves}."
        ]
        if leaves != "1":
            said.append("Neighbouring rows differ by more than the noise that they are judged by.")
        if self.held_out:
            said.append("The uncertainty of the fitted numbers does not explain it.")
        if self.regime is not None:
            said.append(f"Of it, {100.0 * self.regime.share:.0f} % is where {self.regime.text}.")
        return " ".join(said)

    @property
    def _times(self) -> str:
        """Root mean square of the misfit over the noise, in words."""
        return f"{number(float(np.sqrt(self.reduced_chi2)), '.2g')} times"


def left_of(
    program: Program,
    fit: Fit,
    rest: Discrepancy | None = None,
    score: float | None = None,
    base: Fit | None = None,
) -> Left | None:
    """Misfit that a model leaves, with a saved discrepancy beside it; None if that is about noise.

    Args:
        program: program of the campaign.
        fit: model.
        rest: saved discrepancy.
        score: reduced chi-square of values that were not fitted, by predictions without their uncertainty.
        base: the base model, to tell which share of its misfit the effects leave; None to count all of it.
    """
    shown = None if rest is None else rest.shown
    seen = with_shown(fit, shown)
    excess: Sequence[tuple[float, float, np.ndarray]] = [
        (predictive_chi_square(program, fit, mask, shown), floor(program, seen, mask), mask)
        for mask in scored(program)
    ]
    square, noise, mask = max(excess, key=lambda one: one[0] - one[1])
    if square - noise <= EXCESS.little:
        square, noise, _ = excess[-1]  # of the recordings that the score is about
        if score is None or score - noise <= EXCESS.clear:
            return None
        return Left(float(score), float(noise), True, fit.slugs, None, explained=float(square))
    held_out = bool(not np.any(mask & program.fitted))
    regime = regime_of(program, seen, mask)
    kept = 1.0 if base is None or not fit.slugs else kept_of(program, base, fit)
    return Left(
        float(square), float(noise), held_out, fit.slugs, regime, stated=program.noise_stated, kept=kept
    )
