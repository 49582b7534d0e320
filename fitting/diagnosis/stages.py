"""What a search goes through and ends with."""

from dataclasses import dataclass, field

import numpy as np

from .program import Program
from .refit import Fit
from .screen import Screen
from .side_by_side import FITS
from .trials import Trial


@dataclass
class Stage:
    """One round of the search: the model so far, the screen, and the trials of a further effect.

    Attributes:
        base: the model so far.
        screen: of every effect that it does not have.
        trials: of further effects, strongest evidence first.
        left_out: reduced chi-square of the model so far on fitted recordings left out in turn; NaN if not
            asked.
        chosen: the effect that entered, if one did.
        beside: the other effects of a later model, beside which the trials were made again; None where they
            stand beside the model so far.
    """

    base: Fit
    screen: Screen
    trials: list[Trial]
    left_out: float = np.nan
    chosen: str | None = None
    beside: Fit | None = None

    @property
    def entered(self) -> Trial | None:
        """The trial of the effect that entered."""
        return next((t for t in self.trials if t.slug == self.chosen), None)


def left_out_scores(stages: list[Stage]) -> tuple[float, float]:
    """Reduced chi-square of fitted recordings left out in turn, by the base model and with what entered last;
    NaN where it was not asked for or nothing entered."""
    entered = [stage.entered.left_out for stage in stages if stage.chosen]
    return stages[0].left_out if stages else np.nan, entered[-1] if entered else np.nan


@dataclass
class Explanation:
    """What a campaign says.

    Attributes:
        program: of the final model.
        base: the base model refitted.
        final: the model with the effects that were found.
        stages: of the search.
        p_value, p_is_bound: of the base's misfit by chance.
        tries: models that were fitted to the campaign, those of a first look included.
        together: recordings for validation were fitted, too, because the others name nothing, or something
            that they contradict.
        contending: effects that together explain and predict the recordings better than `final`, but by no
            more than drift of the instruments explains.
    """

    program: Program
    base: Fit
    final: Fit
    stages: list[Stage]
    p_value: float
    p_is_bound: bool
    together: bool = False
    contending: list[tuple[str, ...]] = field(default_factory=list)

    @property
    def tries(self) -> int:
        """See the class."""
        return self.program.tally[FITS]

    @property
    def leading(self) -> Stage | None:
        """The stage that let the model's first effect in; the first of all where it has none."""
        return next((s for s in self.stages if s.chosen in self.final.slugs), next(iter(self.stages), None))
