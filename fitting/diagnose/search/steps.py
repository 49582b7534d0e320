"""What a search goes through and ends with."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.parallel import FITS

from ..evaluate.program import Program
from ..fit.candidates import CandidateFit
from ..fit.cross_validation import HeldOutScores
from ..fit.refit import Fit
from ..fit.score_test import Screen


@dataclass
class Step:
    """One round of the search: the model so far, the screen, and the trials of a further effect.

    Attributes:
        base: the model so far.
        screen: of every effect that it does not have.
        trials: of further effects, strongest evidence first.
        left_out: reduced chi-square of the model so far on fitted recordings left out in turn; NaN if not
            asked.
        chosen: the effect that entered, if one did.
    """

    base: Fit
    screen: Screen
    trials: list[CandidateFit]
    left_out: float = np.nan
    chosen: str | None = None


@dataclass
class LeaveOneOutEvidence:
    """What an effect of a model is worth beside the model's other ones, and its rivals in its place there.

    Attributes:
        slug: of the effect.
        base: the model with the others alone.
        trials: of the effect and of rivals, strongest evidence first.
    """

    slug: str
    base: Fit
    trials: list[CandidateFit]

    @property
    def own(self) -> CandidateFit:
        """The trial of the effect itself."""
        return next(t for t in self.trials if t.slug == self.slug)

    @property
    def net(self) -> float:
        """Log Bayes factor of the effect itself, less noise of inputs that it averages away: a rival without
        that luck is as good as it is without."""
        return self.own.bayes - self.own.averaged

    def worth(self, trial: CandidateFit) -> float:
        """Log Bayes factor of a trial: what a rival has more was refused, for drift of the instruments
        explains it or other recordings contradict it, and may be as likely at most."""
        return min(trial.bayes, self.net)


@dataclass
class Named:
    """A model with effects that were found.

    Attributes:
        fit: the model.
        left_out: its reduced chi-square of fitted recordings left out in turn, as `folds.gain` counts what it
            gains on the base model; NaN if not asked.
        standings: of its effects.
    """

    fit: Fit
    left_out: float = np.nan
    standings: dict[str, LeaveOneOutEvidence] = field(default_factory=dict)


@dataclass
class Explanation:
    """What a campaign says.

    Attributes:
        program: of the final model.
        base: the base model refitted.
        named: the model with the effects that were found; the base model where none was.
        stages: of the search.
        p_value, p_is_bound: of the base's misfit by chance.
        tries: models that were fitted to the campaign, those of a first look included.
        together: recordings for validation were fitted, too, because the others name nothing, or something
            that they contradict.
        contending: effects that together explain and predict the recordings better than `final`, but by no
            more than drift of the instruments explains.
        scores: of recordings left out in turn.
        stood: weighs the effects of another model of these recordings, see `standings.stood`.
    """

    program: Program
    base: Fit
    named: Named
    stages: list[Step]
    p_value: float
    p_is_bound: bool
    together: bool = False
    contending: list[tuple[str, ...]] = field(default_factory=list)
    stood: "Callable[[Explanation, Fit, float, list[Step]], Named] | None" = field(default=None, repr=False)
    scores: HeldOutScores = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self.scores = HeldOutScores(self.program)

    @property
    def tries(self) -> int:
        """See the class."""
        return self.program.tally[FITS]

    @property
    def tried(self) -> set[str]:
        """Effects that were fitted."""
        return {trial.slug for one in (*self.stages, *self.named.standings.values()) for trial in one.trials}

    @property
    def final(self) -> Fit:
        """The model with the effects that were found."""
        return self.named.fit

    @property
    def standings(self) -> list[LeaveOneOutEvidence]:
        """Of the effects that were found, as they entered."""
        return [self.named.standings[slug] for slug in self.final.slugs]

    @property
    def leading(self) -> "LeaveOneOutEvidence | Step | None":
        """What the model's first effect is worth, and its rivals; where it has none, the first trials."""
        return next(iter([*self.standings, *self.stages]), None)

    @property
    def first(self) -> CandidateFit | None:
        """The trial of the first effect; where none was found, the best of the first trials, if any."""
        if self.standings:
            return self.standings[0].own
        return next(iter(self.stages[0].trials), None) if self.stages else None

    @property
    def left_out(self) -> tuple[float, float]:
        """Reduced chi-square of fitted recordings left out in turn, by the base model and with what was
        found; NaN where it was not asked for or nothing was found."""
        return self.stages[0].left_out if self.stages else np.nan, self.named.left_out
