"""What a diagnosis concludes, as data."""

from dataclasses import dataclass, field

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..evaluate.start import Start
from ..fit.refit import Fit
from ..search.steps import Explanation
from .discrepancy import Discrepancy
from .discrepancy_evidence import DiscrepancyEvidence
from .held_out import HeldOut
from .locate import Place
from .probabilities import UNMODELLED, Found


@dataclass
class Conclusion:
    """Everything that a report says; `notes` is what to read with care, `asked` about effects asked for,
    `start` what the recordings were compared with."""

    explanation: Explanation
    mismatch: bool
    place: Place
    component: str
    found: list[Found]
    candidates: dict[str, tuple[float, float]]
    nothing: float
    unknown: float
    explanation_set: list[str]
    before: HeldOut
    after: HeldOut
    mean: HeldOut
    members: dict[str, float]
    next_experiment: dict | None
    remainder: Discrepancy | None
    generic: DiscrepancyEvidence | None
    notes: list[str] = field(default_factory=list)
    asked: list[dict] = field(default_factory=list)
    start: Start = field(default_factory=Start)

    @property
    def model(self) -> tuple[Program, Fit]:
        """What enters the augmented model, less a remainder: the base model alone where nothing is named."""
        x, named = self.explanation, any(f.slug != UNMODELLED for f in self.found)
        return x.program, x.final if named else x.base

    @property
    def shown(self) -> Evaluation:
        """What the augmented model predicts of every recording."""
        evaluation = self.model[1].evaluation
        return evaluation if self.remainder is None else self.remainder.shown(evaluation)
