"""What every effect of a model is worth beside the others, and which of its rivals takes its place there.

An effect that entered alone may have stood for two. So each is looked for again, from a screen on, wherever
the others are not those beside which it entered: an idle one goes, and one that a rival surpasses gives way.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from .choose import FURTHER, surpassed
from .drift import explained_by_drift
from .evidence import inflation_of
from .folds import gain, left_out
from .program import Program
from .pruning import idle, without
from .refit import Fit
from .stages import Named, Stage, Standing
from .trials import Trial, weigh

EXCHANGES = 2
"""How often each effect may give way, on average."""
Fill = Callable[[Fit], Stage]
"""Screens the effects that a model does not have and fits the most promising."""


def stood(program: Program, fit: Fit, left: float, stages: list[Stage], fill: Fill) -> Named:
    """A model whose effects hold their places beside each other, with what each is worth there.

    Args:
        program: of the campaign.
        fit: the model.
        left: its reduced chi-square of fitted recordings left out in turn.
        stages: rounds of searches, whose trials are used again where they stand beside the same effects.
        fill: makes another one.
    """
    named, known, exchanges = Named(fit, left), list(stages), EXCHANGES * len(fit.slugs)
    while True:
        slug = next((s for s in named.fit.slugs if s not in named.standings), None)
        if slug is None:
            return named
        stage = _beside(known, [s for s in named.fit.slugs if s != slug])
        rest = stage.base if stage else without(program, named.fit, slug)
        if rest.slugs and idle(program, rest, named.fit):
            before = left_out(program, named.fit)
            named = Named(rest, named.left_out - gain(before, left_out(program, rest))[0])
            continue
        if stage is None:
            stage = fill(rest)
            known.append(stage)
        standing = _standing(program, named, slug, stage)
        own = standing.own
        if own.fit.objective < named.fit.objective:
            named.fit = replace(own.fit, slugs=named.fit.slugs)  # as they entered
        entered = stage.chosen == slug  # `choice` weighed it against its rivals there
        rival = None if entered or not exchanges else _successor(program, standing)
        if rival is None:
            named.standings[slug] = standing
            continue
        exchanges -= 1
        slugs = tuple(rival.slug if s == slug else s for s in named.fit.slugs)
        named = Named(replace(rival.fit, slugs=slugs), rival.left_out)
        named.standings[rival.slug] = replace(standing, slug=rival.slug)


def _beside(known: list[Stage], slugs: list[str]) -> Stage | None:
    """The round that tried effects beside some others."""
    return next((s for s in known if s.trials and set(s.base.slugs) == set(slugs)), None)


def _standing(program: Program, named: Named, slug: str, stage: Stage) -> Standing:
    """What an effect of a model and the trials of a round are worth."""
    standing = Standing(slug, stage.base, [replace(trial) for trial in stage.trials])
    if all(trial.slug != slug for trial in standing.trials):
        standing.trials.append(Trial(slug, named.fit, 0.0, np.nan))
    own = standing.own
    own.fit = min(own.fit, named.fit, key=lambda fit: fit.objective)
    own.returned = float(np.max(np.abs(own.fit.u[program.unknowns.base]), initial=0.0))
    own.left_out = named.left_out
    weigh(program, stage.base, standing.trials)
    own.adrift = _adrift(program, stage.base, own)
    return standing


def _adrift(program: Program, base: Fit, trial: Trial) -> float:
    return explained_by_drift(program, base, trial.fit) / inflation_of(program, trial.fit)


def _successor(program: Program, standing: Standing) -> Trial | None:
    """The rival that takes the place of an effect: one within its bounds that has more evidence, which drift
    does not explain, and predicts recordings no worse."""
    own, before = standing.own, None
    for rival in standing.trials:
        if rival is own:
            return None
        rival.adrift = 0.0 if rival.stopped else _adrift(program, standing.base, rival)
        if rival.stopped or rival.bayes - rival.adrift < FURTHER or not surpassed(program, own, rival):
            continue
        before = left_out(program, own.fit) if before is None else before
        gained, _ = gain(before, left_out(program, rival.fit))
        if gained >= 0.0:
            rival.left_out = own.left_out - gained
            return rival
    return None
