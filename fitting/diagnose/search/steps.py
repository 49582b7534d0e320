"""Steps of a search, and the explanation that it ends with."""

import copy
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.parallel import FITS

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.cross_validation import HeldOutScores
from ..fit.evidence import inflation_of
from ..fit.misread import Misread
from ..fit.refit import Fit
from ..fit.score_test import ScoreTest


@dataclass
class Step:
    """One step of the search: the model so far, scores of all other effects, candidates for a further one.

    Attributes:
        base: the model so far.
        score_test: score test of every effect that it does not have.
        candidates: candidate fits of further effects, strongest evidence first.
        left_out: cross-validated reduced chi-square of the model so far; NaN if it was not computed.
        chosen: the effect that entered, if one did.
    """

    base: Fit
    score_test: ScoreTest
    candidates: list[CandidateFit]
    left_out: float = np.nan
    chosen: str | None = None


@dataclass
class LeaveOneOutEvidence:
    """Evidence of one effect of a model beside the model's other effects, and of its rivals in its place.

    Attributes:
        slug: name of the effect.
        base: the model with the others alone.
        candidates: candidate fits of the effect and of its rivals, strongest evidence first.
    """

    slug: str
    base: Fit
    candidates: list[CandidateFit]

    @property
    def own(self) -> CandidateFit:
        """The candidate of the effect itself."""
        return next(t for t in self.candidates if t.slug == self.slug)

    @property
    def net(self) -> float:
        """Log Bayes factor of the effect itself, less the part that noise of inputs explains."""
        return self.own.bayes - self.own.explained_by_inputs

    def worth(self, candidate: CandidateFit) -> float:
        """Log Bayes factor of a candidate, at most that of the effect itself.

        A rival with more evidence was refused, because drift explains it or other recordings contradict it.
        """
        return min(candidate.bayes, self.net)


@dataclass
class Named:
    """A model with effects that were found.

    Attributes:
        fit: the model.
        left_out: its cross-validated reduced chi-square, with gains counted by `cross_validation.gain`; NaN
            if it was not computed.
        leave_one_out: evidence of each of its effects.
    """

    fit: Fit
    left_out: float = np.nan
    leave_one_out: dict[str, LeaveOneOutEvidence] = field(default_factory=dict)


@dataclass
class Explanation:
    """The result of a search.

    Attributes:
        program: program of the final model.
        base: the base model refitted.
        named: the model with the effects that were found; the base model where none was.
        steps: steps of the search.
        p_value, p_is_bound: probability of the base's misfit by chance, and true if it is only a bound.
        tries: number of models that were fitted to the campaign.
        together: validation recordings were fitted, too. The others named nothing, or a contradicted effect.
        second_look: a search on all recordings that named nothing, although a score stood out.
        contending: sets that explain and predict more than `final`, but no more than drift explains. They
            are pairs and triples where effects are named, and the one of most evidence where none is.
        beyond_form: effects that would explain less beside `final` than a form is known by.
        of_all: effects that would remove most of what `final` leaves, and a small share of the whole misfit.
        nearest: fit of least objective of all sets that were tried; None where none was.
        misread: column whose unit or sign may be wrong; None where there is none.
        scores: cross-validation of models.
        weigh_effects: leave-one-effect-out evidence of another model of these recordings.
    """

    program: Program
    base: Fit
    named: Named
    steps: list[Step]
    p_value: float
    p_is_bound: bool
    together: bool = False
    beyond_form: list[str] = field(default_factory=list)
    of_all: list[str] = field(default_factory=list)
    second_look: "Explanation | None" = None
    contending: list[tuple[str, ...]] = field(default_factory=list)
    nearest: Fit | None = None
    misread: Misread | None = None
    weigh_effects: "Callable[[Explanation, Fit], Named] | None" = field(default=None, repr=False)
    scores: HeldOutScores = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.scores = HeldOutScores(self.program)

    def with_chance(self, p_value: float, is_bound: bool) -> "Explanation":
        """The same with another probability of the base's misfit by chance; what is known is shared."""
        if (p_value, is_bound) == (self.p_value, self.p_is_bound):
            return self
        other = copy.copy(self)
        other.p_value, other.p_is_bound = p_value, is_bound
        return other

    @property
    def tries(self) -> int:
        """See the class."""
        return self.program.tally[FITS]

    @property
    def tried(self) -> set[str]:
        """Effects that were fitted."""
        return {
            candidate.slug
            for one in (*self.steps, *self.named.leave_one_out.values())
            for candidate in one.candidates
        }

    @property
    def final(self) -> Fit:
        """The model with the effects that were found."""
        return self.named.fit

    @property
    def leave_one_out(self) -> list[LeaveOneOutEvidence]:
        """Leave-one-effect-out evidence of the effects that were found, as they entered."""
        return [self.named.leave_one_out[slug] for slug in self.final.slugs]

    @property
    def leading(self) -> "LeaveOneOutEvidence | Step | None":
        """Evidence of the model's first effect and its rivals; the first step where there is no effect."""
        return next(iter([*self.leave_one_out, *self.steps]), None)

    @property
    def first(self) -> CandidateFit | None:
        """The candidate of the first effect, or the best candidate of the first step, if any."""
        if self.leave_one_out:
            return self.leave_one_out[0].own
        return next(iter(self.steps[0].candidates), None) if self.steps else None

    @property
    def inflation(self) -> float:
        """Inflation of variances, at least 1, by which misfit counts less in the evidence of `leading`."""
        tried = [] if self.leading is None else self.leading.candidates
        best = min((t.fit for t in tried), key=lambda fit: fit.objective, default=self.base)
        return inflation_of(self.program, best)

    @property
    def left_out(self) -> tuple[float, float]:
        """Cross-validated reduced chi-squares of the base and the final model; NaN if not computed."""
        return self.steps[0].left_out if self.steps else np.nan, self.named.left_out
