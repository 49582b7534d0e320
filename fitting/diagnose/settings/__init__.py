"""Every threshold of the diagnosis, in groups: `DEFAULT` is what all of its modules read.

    >>> DEFAULT.evidence.minimum_first
    8.0

Each threshold has a sentence, a unit and the measurement that it rests on (`Threshold`). The table in
`docs/diagnosis.md` is made of them: `python -m fitting.diagnose.settings`.
"""

from dataclasses import dataclass

from .conclusions import Discrepancy, Misread, NextExperiment, Place, Verdict
from .decisions import CrossValidation, Drift, Entry, Evidence, ScoreTest, Search
from .fits import BaseFit, Candidates, Optimiser, Scaling
from .recordings import Campaigns, LatentTrajectories, Noise, Outliers
from .threshold import Threshold, thresholds_of

__all__ = ["DEFAULT", "Settings", "Threshold", "thresholds_of"]


@dataclass(frozen=True)
class Settings:
    """All groups, in the order in which a diagnosis meets them."""

    campaigns: Campaigns = Campaigns()
    noise: Noise = Noise()
    outliers: Outliers = Outliers()
    trajectories: LatentTrajectories = LatentTrajectories()
    scaling: Scaling = Scaling()
    optimiser: Optimiser = Optimiser()
    base_fit: BaseFit = BaseFit()
    score_test: ScoreTest = ScoreTest()
    candidates: Candidates = Candidates()
    evidence: Evidence = Evidence()
    cross_validation: CrossValidation = CrossValidation()
    entry: Entry = Entry()
    drift: Drift = Drift()
    search: Search = Search()
    discrepancy: Discrepancy = Discrepancy()
    place: Place = Place()
    misread: Misread = Misread()
    verdict: Verdict = Verdict()
    next_experiment: NextExperiment = NextExperiment()


DEFAULT = Settings()
