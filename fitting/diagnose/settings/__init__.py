"""Every number of the diagnosis, in groups: `DEFAULT` is what all of its modules read.

    >>> DEFAULT.evidence.minimum_first
    8.0

Three kinds of numbers are counted apart (`CATEGORIES`). Decisions say what is concluded. Numerical settings
say how much is computed, on which grids and to which tolerance. Assumptions say what instruments and tests
usually are. Each number has a sentence, a unit and the measurement that it rests on (`Threshold`). The
tables in `docs/thresholds.md` are made of them: `python -m fitting.diagnose.settings docs/thresholds.md`.
"""

from dataclasses import dataclass

from .assumptions import Drift, Instruments, NextExperiment
from .decisions import Chance, Evidence, Excess, Probability, Share, Values
from .effort import Candidates, CrossValidation, Discrepancy, Lists, Place, ScoreTest, Search
from .fits import BaseFit, LatentTrajectories, Noise, Optimiser, Scaling
from .threshold import Threshold, thresholds_of

__all__ = ["CATEGORIES", "DEFAULT", "Settings", "Threshold", "thresholds_of"]


@dataclass(frozen=True)
class Settings:
    """All groups: decisions, then numerical settings, then assumptions."""

    values: Values = Values()
    chance: Chance = Chance()
    evidence: Evidence = Evidence()
    excess: Excess = Excess()
    share: Share = Share()
    probability: Probability = Probability()

    noise: Noise = Noise()
    trajectories: LatentTrajectories = LatentTrajectories()
    scaling: Scaling = Scaling()
    optimiser: Optimiser = Optimiser()
    base_fit: BaseFit = BaseFit()
    lists: Lists = Lists()
    score_test: ScoreTest = ScoreTest()
    candidates: Candidates = Candidates()
    cross_validation: CrossValidation = CrossValidation()
    search: Search = Search()
    discrepancy: Discrepancy = Discrepancy()
    place: Place = Place()

    instruments: Instruments = Instruments()
    drift: Drift = Drift()
    next_experiment: NextExperiment = NextExperiment()


DEFAULT = Settings()

CATEGORIES = {
    "Decisions": ("values", "chance", "evidence", "excess", "share", "probability"),
    "Numerical settings": (
        "noise", "trajectories", "scaling", "optimiser", "base_fit", "lists", "score_test", "candidates",
        "cross_validation", "search", "discrepancy", "place",
    ),
    "Assumptions": ("instruments", "drift", "next_experiment"),
}  # fmt: skip
"""Names of the groups of each kind of number."""
