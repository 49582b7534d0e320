"""Probability that something unknown acts beside or for named effects: three signs and a calibrated curve.

Two signs are shares of the base model's misfit, so that neither the number of rows nor the size of the noise
decides. An imperfect form of a right effect leaves a small share. The third is the evidence of a discrepancy
beside the names, in units of that by which their forms may be off: what they leave may be little, and yet no
chance. The curve was fitted to simulated campaigns whose truth is known: `make calibrate`.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from ..fit.evidence import evidence, inflation_of
from ..fit.misfit import scored, spread
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy_evidence import DiscrepancyEvidence
from .probabilities import imperfection_of

CHANCE = DEFAULT.chance
PROBABILITY = DEFAULT.probability
SHARE = DEFAULT.share
TABLE = "calibration.toml"


@dataclass(frozen=True)
class Signs:
    """What speaks for something unknown.

    Attributes:
        kept: share of the base model's misfit that the effects leave beyond chance, of fitted or of unseen
            recordings, whichever is larger; 0 to 1.
        outdone: share of the left-out misfit by which a function of one driver predicts better; 0 to 1.
        beside: log Bayes factor of a function of one driver beside the effects; 0 where it is negative. Its
            unit is that by which the forms of the effects may be off.
    """

    kept: float
    outdone: float
    beside: float

    @property
    def only_beside(self) -> bool:
        """True if something unknown may act beside the effects, and nothing says that it acts instead.

        The effects leave a small share of the misfit, and no function predicts clearly better than they do.
        A right effect in a form that is not quite nature's looks so, and one beside which another acts.
        """
        return self.kept <= SHARE.small and self.outdone <= SHARE.small

    @property
    def scaled(self) -> np.ndarray:
        """1 and the signs, (4,): shares as decades of hundredths, evidence as decades of its units."""
        shares = np.log10(1.0 + 100.0 * np.array([self.kept, self.outdone]))
        return np.array([1.0, *shares, np.log10(1.0 + self.beside)])


def signs_of(
    explanation: Explanation,
    discrepancy: DiscrepancyEvidence | None,
    beside: DiscrepancyEvidence | None,
    base: list[float],
    last: list[float],
    floors: list[float],
) -> Signs:
    """Signs of something unknown beside the effects of an explanation.

    Args:
        explanation: result of the search.
        discrepancy: discrepancy of largest evidence about the base model; None if there is none.
        beside: the one beside the effects.
        base, last: predictive reduced chi-squares without and with the effects, of fitted and of unseen
            recordings.
        floors: chi-square of noise of both, see `misfit.floor`.
    """
    program, kept = explanation.program, 0.0
    for mask, before, after, noise in zip(scored(program), base, last, floors, strict=True):
        beyond = after - noise - CHANCE.left_beside_names * spread(program, mask)
        kept = max(kept, _share(beyond, before - noise))
    alone, named = explanation.left_out
    outdone = 0.0 if discrepancy is None else _share(named - discrepancy.left_out, alone - 1.0)
    worth = evidence(program, explanation.base, explanation.final, inflation_of(program, explanation.final))
    further = 0.0 if beside is None else max(beside.bayes, 0.0) / imperfection_of(worth)
    return Signs(kept, outdone, further)


def _share(part: float, whole: float) -> float:
    """A part of a misfit, from 0 to 1; 0 for what was not computed, 1 for the whole of nothing."""
    if not part > 0.0 or np.isnan(whole):
        return 0.0
    return float(min(part / max(whole, part), 1.0))


def probability_of_unknown(signs: Signs) -> float:
    """Calibrated probability that something unknown acts.

    Effects that keep too much of the misfit to help have something unknown beside them in any case.
    """
    odds = float(curve() @ signs.scaled)
    least = PROBABILITY.beside if signs.kept > SHARE.most else PROBABILITY.least
    return float(np.clip(1.0 / (1.0 + np.exp(-odds)), least, PROBABILITY.sure))


@cache
def curve() -> np.ndarray:
    """Coefficients of the logarithm of the odds, (4,): constant, and by each of `Signs.scaled`."""
    table = tomllib.loads(files(__package__).joinpath(TABLE).read_text(encoding="utf-8"))
    return np.array([table["odds"][name] for name in ("constant", *Signs.__annotations__)])
