"""Conclusion of a diagnosis, as data."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..evaluate.start import Start
from ..fit.misfit import accurate
from ..fit.refit import Fit
from ..fit.standard_errors import standard_errors
from ..search.steps import Explanation
from ..settings import DEFAULT
from .discrepancy import Discrepancy
from .discrepancy_evidence import DiscrepancyEvidence
from .exchangeable import Exchange, exchanges_of
from .held_out import HeldOut
from .left import Left
from .locate import Place
from .probabilities import UNMODELLED, Found
from .repeats import Repeats
from .unknown import Signs

CHANCE = DEFAULT.chance
EXCESS = DEFAULT.excess


@dataclass(frozen=True)
class WithoutTurns:
    """Effects that explain a campaign as well as turning points between rows do.

    Attributes:
        found: the effects, with their probabilities beside turning points.
        turns: log evidence of the base model with turning points over the one without [nat].
        effects: log evidence of the effects without turning points over the same base model [nat].
        probability: probability of turning points, if one of the two acts.
    """

    found: list[Found]
    turns: float
    effects: float
    probability: float


@dataclass
class Conclusion:
    """The result of a diagnosis.

    Attributes:
        explanation: result of the search.
        mismatch: the recordings contradict the base model.
        place: place of the misfit.
        component: part of the specimen or stand that is concerned.
        found: named effects and `unmodelled`, most likely first.
        candidates: probability as the strongest explanation and log Bayes factor, by effect.
        nothing, unknown: probability that nothing is missing, and of something outside the catalogue.
        explanation_sets: for each effect, the fewest candidates of which it is one.
        before, after: held-out scores of the base model and of the augmented model.
        mean: held-out score of the mean prediction of several explanations.
        members: weights of these explanations.
        next_experiment: the experiment to record next.
        remainder: the saved discrepancy, if there is one.
        discrepancy: the discrepancy of largest evidence.
        notes: sentences about what is to be read with care.
        asked: answers about effects that were asked for.
        start: model that the recordings were compared with.
        left: misfit beyond noise that names and the remainder leave.
        signs: what speaks for something unknown beside names; None where none was found.
        without_turns: effects that explain as much as turning points between rows; None if there are none.
        repeats: period of a misfit that no name explains; None where there is none.
        moving: the discrepancy beside named effects that moves their numbers; None where it has no evidence.
    """

    explanation: Explanation
    mismatch: bool
    place: Place
    component: str
    found: list[Found]
    candidates: dict[str, tuple[float, float]]
    nothing: float
    unknown: float
    explanation_sets: list[list[str]]
    before: HeldOut
    after: HeldOut
    mean: HeldOut
    members: dict[str, float]
    next_experiment: dict | None
    remainder: Discrepancy | None
    discrepancy: DiscrepancyEvidence | None
    notes: list[str] = field(default_factory=list)
    asked: list[dict] = field(default_factory=list)
    start: Start = field(default_factory=Start)
    left: Left | None = None
    signs: Signs | None = None
    without_turns: WithoutTurns | None = None
    repeats: Repeats | None = None
    moving: DiscrepancyEvidence | None = None

    @property
    def reported(self) -> list[Found]:
        """What was found, then effects that explain as much as turning points between rows."""
        return [*self.found, *(self.without_turns.found if self.without_turns else ())]

    @property
    def explanation_set(self) -> list[str]:
        """Members of all of `explanation_sets`, each once."""
        return list(dict.fromkeys(slug for one in self.explanation_sets for slug in one))

    @property
    def untestable(self) -> dict[str, str]:
        """Effects that these recordings cannot show, with the reason in words."""
        steps = self.explanation.steps
        return steps[0].score_test.untestable if steps and steps[0].score_test else {}

    @property
    def missed_validation(self) -> bool:
        """True if validation recordings are missed by the base model, by more than faintly."""
        return not self.explanation.program.fitted.all() and self.before.reduced_chi2 > 1.0 + EXCESS.little

    @cached_property
    def within_accuracy(self) -> bool:
        """True if recordings agree though their misfit is more than chance: instruments err as much."""
        program, base = self.explanation.program, self.explanation.base
        if self.mismatch or not accurate(program, base):
            return False
        return self.explanation.p_value <= CHANCE.level or self.missed_validation

    @property
    def named(self) -> bool:
        """True if an effect has a name first."""
        return bool(self.found) and self.found[0].slug != UNMODELLED

    @property
    def model(self) -> tuple[Program, Fit]:
        """Model that enters the augmented model, less a remainder: the base model alone if nothing is
        named."""
        x, named = self.explanation, any(f.slug != UNMODELLED for f in self.found)
        return x.program, x.final if named else x.base

    def sd(self, index: int) -> float:
        """Scaled standard deviation of a number of the model, see `standard_errors`; 0 if it was not free."""
        return float(self._standard_errors[index])

    @cached_property
    def _standard_errors(self) -> np.ndarray:
        program, fit = self.model
        beside = self.moving if fit is self.explanation.final else None
        return standard_errors(program, fit, beside and beside.moved)

    @cached_property
    def exchanges(self) -> list[Exchange]:
        """Constants within their tolerances and errors of instruments that explain the same.

        There are none where something unmodelled comes first: no number is to be trusted then.
        """
        return [] if self.mismatch and not self.named else exchanges_of(*self.model)

    @property
    def changed(self) -> bool:
        """True if effects or a model discrepancy were added to the base model."""
        return self.shown is not self.explanation.base.evaluation

    @property
    def shown(self) -> Evaluation:
        """Predictions of the augmented model for every recording."""
        evaluation = self.model[1].evaluation
        return evaluation if self.remainder is None else self.remainder.shown(evaluation)
