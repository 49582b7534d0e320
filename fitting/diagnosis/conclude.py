"""From a search to a verdict: probabilities of every candidate, of nothing and of something unknown."""

from dataclasses import dataclass, field

import numpy as np
from scipy.stats import chi2

from pneusma_jax.effects import CATALOGUE
from pneusma_jax.remainder import WALL

from .designs import best_design
from .drift import DRIFTS
from .evaluation import Evaluation
from .explain import LEVEL
from .generic import Generic, race
from .locate import Place, locate
from .probabilities import (
    NOTHING_LEFT,
    UNMODELLED,
    Found,
    effects_found,
    explanation_set,
    probabilities,
    weights_of,
)
from .program import Program
from .prove import Correction, HeldOut, averaged, held_out
from .refit import Fit
from .remainder import Remainder, beside, remainder
from .stages import Explanation
from .trials import floor, foretold, reduced
from .words import separating

ASTRAY = 3.5
"""Standard deviations from nominal at which a base constant says that the explanation is wrong in form."""
DOUBTFUL, REFUTED = 0.2, 0.6
"""Probability of something unknown where a base constant is astray; and where left-out recordings are
predicted worse than without the effects, or than half as well as by a nameless correction."""
LEAST_WEIGHT = 0.02
"""Probability from which an explanation takes part in averaged predictions."""
MUCH_LEFT = 0.45
"""Share of a misfit that no right explanation leaves, of what was fitted or of what was not. Right ones, in
another form than nature's, left up to 0.19 of it and once 0.3; names that stood for something else 0.2 to 0.3
and more."""
LEFT, SIGNIFICANT = 0.15, 3.0
"""Excess of a reduced chi-square over 1 that counts as left over: this much, and as many of its standard
deviations."""
OVER, BESIDE = 0.3, 0.25
"""Excess of a reduced chi-square over 1, of what was fitted or of what was not, from which named effects
leave something unmodelled, if it is also more than the share that a right form may leave; and its probability
at least: of models that left as much one in four stood for something else."""
HELPS = 0.5
"""Share of the misfit of what was left out that a doubtful effect may leave to stay in the model."""
FAINT = 1.4
"""Reduced chi-square up to which a misfit that no effect explains, and no nameless correction either, is not
held against the model; less what slow drift of the instruments explains."""
MOST_DRIFT = 2.0 * DRIFTS[-1] ** 2
"""Part of a reduced chi-square that drift may explain at most."""
SURE = 3.5
"""Standard deviations of a reduced chi-square over 1 from which the same, where the noise is stated, no
chance makes a signature as strong and what was not fitted is not predicted as well as noise lets it."""
NAMELESS = 12.0
"""Log Bayes factor of a nameless correction from which a misfit that no effect explains is one."""
GROSS = 4.0
"""Reduced chi-square from which recordings contradict the model: fitted and left-out ones even where no
signature of an effect stands out, either where one does."""


@dataclass
class Conclusion:
    """Everything that a report says; `notes` is what to read with care, `asked` about effects asked for."""

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
    remainder: Remainder | None
    generic: Generic | None
    notes: list[str] = field(default_factory=list)
    asked: list[dict] = field(default_factory=list)

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


def conclude(explanation: Explanation) -> Conclusion:
    """Weigh a search."""
    program = explanation.program
    masks = program.fitted, program.unseen
    base, alone = ([f(program, explanation.base, mask) for mask in masks] for f in (foretold, reduced))
    last, kept = ([f(program, explanation.final, mask) for mask in masks] for f in (foretold, reduced))
    floors = [floor(program, explanation.final, mask) for mask in masks]
    named = bool(explanation.final.slugs)
    if min(base) > GROSS and explanation.p_value > LEVEL:
        explanation.p_value = _tail(program, base[0])
    generic = race(program, explanation.base)
    mismatch = named or _misfits(explanation, base, generic)
    limits = [1.0 + max(LEFT, SIGNIFICANT * _spread(program, mask)) for mask in masks]
    unknown = _unknown(alone, last, floors, limits) if mismatch else 0.0
    if named:
        unknown = max(unknown, _refuted(explanation, generic, limits[0]))
    if mismatch and not named:
        unknown = max(unknown, 0.9)
    if not mismatch:  # no candidate survived being fitted; what is left is judged as a whole
        explanation.p_value = max(explanation.p_value, _tail(program, _steady(base[0], generic)))
        explanation.p_is_bound = False
    over = named and unknown <= 0.5 and (_over(alone, last, floors) or _idle(alone, kept, floors))
    unknown = max(unknown, BESIDE) if over else unknown
    candidates, nothing = probabilities(explanation, mismatch, unknown)
    unknown = max(0.0, 1.0 - nothing - sum(p for p, _ in candidates.values()))
    found = effects_found(explanation, unknown) if named else []
    place, rest, members = locate(explanation), None, _members(explanation)
    if mismatch and (unknown > 0.5 or not named):
        if generic is not None and generic.bayes > NAMELESS:
            place = place.led_by(generic.driver)
        seen = None if generic is None else generic.quantity
        found, model, rest, before, after = _described(explanation, place, seen, unknown, found)
        share = unknown if named else 1.0
        members = [(s, p, f, (1.0 - share) * w, more) for s, p, f, w, more in members if s != "base"]
        members.insert(0, (UNMODELLED, *model, share, rest and rest.corrected))
    else:
        before, after = held_out(explanation)
        if named and (over or last[0] > limits[0]):
            rest = beside(program, explanation.final)
        if rest is not None:
            after = averaged([(program, explanation.final, 1.0, rest.corrected)])
            members = [(*member[:4], rest.corrected) for member in members]
        if over:
            found.append(_left_over(explanation, unknown, last, found))
        found.sort(key=lambda f: -f.probability)
    return Conclusion(
        explanation,
        mismatch,
        place,
        _component(explanation, found, generic),
        found,
        candidates,
        nothing,
        unknown,
        explanation_set(candidates, unknown) if mismatch else [],
        before,
        after,
        averaged([member[1:] for member in members]) if len(members) > 1 else after,
        {slug: w for slug, _, _, w, _ in members},
        _next(explanation, found),
        rest,
        generic,
    )


def _misfits(explanation: Explanation, base: list[float], generic: Generic | None) -> bool:
    """Whether recordings contradict the base model although no effect explains it.

    Args:
        explanation: of the campaign.
        base: reduced chi-square of the base model, of what was fitted and, as `foretold`, of what scores.
        generic: the best nameless correction.
    """
    program = explanation.program
    if generic is not None and generic.bayes > NAMELESS:
        return True
    if explanation.p_value > LEVEL:
        return False
    sure = explanation.p_is_bound and program.noise_stated and base[1] > 1.0
    chance = 1.0 + SURE * _spread(program, program.fitted)
    steady = _steady(base[0], generic)
    return min(steady, base[1]) > FAINT or max(base) > GROSS or (sure and steady > chance)


def _steady(left: float, generic: Generic | None) -> float:
    """What is left of a reduced chi-square less what slow drift of the instruments explains, of a size that
    passes for noise."""
    return left if generic is None else min(left, max(generic.adrift, left - MOST_DRIFT))


def _tail(program: Program, reduced_chi2: float) -> float:
    """Probability of a chi-square of the fitted recordings as large as this by chance."""
    count = program.observations(program.fitted)
    return float(chi2.sf(reduced_chi2 * count, count))


def _spread(program: Program, chosen: np.ndarray) -> float:
    """Standard deviation of the reduced chi-square of some recordings by chance."""
    return float(np.sqrt(2.0 / max(program.observations(chosen), 1)))


def _described(
    explanation: Explanation, place: Place, seen: str | None, unknown: float, doubtful: list[Found]
) -> tuple[list[Found], tuple[Program, Fit], Remainder | None, HeldOut, HeldOut]:
    """What enters the model where something is unmodelled, and the scores of the base model and of it.

    Doubtful effects do if what was left out needs them, a smooth term if it is predicted better with it.
    """
    alone = [_unmodelled(unknown, doubtful, explanation)]
    program = explanation.program
    before = averaged([(program, explanation.base, 1.0)])
    options = [(before, alone, explanation.base, None)]
    if doubtful:
        score = averaged([(program, explanation.final, 1.0)])
        if score.reduced_chi2 - 1.0 < HELPS * max(before.reduced_chi2 - 1.0, 0.0):
            options.append((score, [*alone, *doubtful], explanation.final, None))
    for _, found, fit, _ in tuple(options):
        rest = remainder(program, fit, place, seen)
        if rest is not None:
            options.append((averaged([(program, fit, 1.0, rest.corrected)]), found, fit, rest))
    after, found, fit, rest = min(options, key=lambda option: option[0].reduced_chi2)
    return found, (program, fit), rest, before, after


def _members(explanation: Explanation) -> list[tuple[str, Program, Fit, float, Correction | None]]:
    """Explanations that predictions average over: those of the last effect, by their probabilities."""
    stage = next((s for s in reversed(explanation.stages) if s.chosen), None)
    if stage is None:
        return [("base", explanation.program, explanation.base, 1.0, None)]
    weights = weights_of(np.array([t.bayes for t in stage.trials]))
    kept = [
        (t, w)
        for t, w in zip(stage.trials, weights, strict=True)
        if w >= LEAST_WEIGHT or t.slug == stage.chosen
    ]
    total = sum(w for _, w in kept)
    program, final = explanation.program, explanation.final
    return [
        (t.slug, program, final if t.slug == stage.chosen else t.fit, float(w / total), None)
        for t, w in kept
    ]


def _refuted(explanation: Explanation, generic: Generic | None, limit: float) -> float:
    """Probability of something unknown, from what speaks against the effects that were found.

    A nameless correction that predicts left-out recordings better does, where the effects leave more than
    noise, a reduced chi-square of `limit`, of fitted ones, too.
    """
    program, fit = explanation.program, explanation.final
    doubt = 0.0
    if np.max(np.abs(fit.u[program.unknowns.base]), initial=0.0) > ASTRAY:
        doubt = DOUBTFUL
    entered = [stage.entered for stage in explanation.stages if stage.chosen]
    before, after = explanation.stages[0].left_out, entered[-1].left_out
    worse = after >= before
    left = min(after, reduced(program, fit, program.fitted)) > limit
    if generic is not None and left and after - 1.0 > NOTHING_LEFT * (before - 1.0):
        worse |= generic.left_out - 1.0 < 0.5 * (after - 1.0)
    return REFUTED if worse else doubt


def _unknown(base: list[float], last: list[float], floors: list[float], limits: list[float]) -> float:
    """Probability that what is left is none of the candidates, from how much is left over noise."""
    worst = 0.0
    for before, after, noise, limit in zip(base, last, floors, limits, strict=True):
        if after > limit and before > noise:
            share = (after - noise) / max(before - noise, 1e-6)
            worst = max(worst, (share - NOTHING_LEFT) / (MUCH_LEFT - NOTHING_LEFT))
    return float(np.clip(worst, 0.01, 0.97))


def _over(base: list[float], last: list[float], floors: list[float]) -> bool:
    """Whether named effects leave more than noise and than a right form may: their model does not hold."""
    return any(
        after > noise + OVER and after - noise > NOTHING_LEFT * (before - noise)
        for before, after, noise in zip(base, last, floors, strict=True)
    )


def _idle(base: list[float], last: list[float], floors: list[float]) -> bool:
    """Whether named effects leave recordings that were not fitted more than half of what they are missed by,
    whatever the uncertainty of the constants could excuse: the names help nobody there."""
    before, after, noise = base[1], last[1], floors[1]
    return after > noise + OVER and after - noise > HELPS * (before - noise)


def _left_over(explanation: Explanation, unknown: float, last: list[float], found: list[Found]) -> Found:
    """What named effects leave, as an entry of its own beside them."""
    program, names = explanation.program, [f.slug for f in found]
    masks = program.fitted, program.unseen
    excess = [(left - 1.0) * program.observations(mask) for left, mask in zip(last, masks, strict=True)]
    text = (
        f"{' and '.join(names)} {'leaves' if len(names) == 1 else 'leave'} more than noise: the form is not "
        "quite nature's, or something else acts as well or instead."
    )
    return Found(UNMODELLED, float(unknown), float(0.5 * max(excess)), {}, names, text)


def _unmodelled(unknown: float, found: list[Found], explanation: Explanation) -> Found:
    base = reduced(explanation.program, explanation.base, explanation.program.fitted)
    text = (
        "What the recordings show is none of the effects that are known here; nothing named explains "
        "enough of it."
    )
    if found:
        text += f" Nearest is {found[0].slug}, which leaves too much."
    return Found(
        UNMODELLED,
        float(unknown),
        float(0.5 * (base - 1.0) * explanation.program.observations(explanation.program.fitted)),
        {},
        [f.slug for f in found],
        text,
    )


def _component(explanation: Explanation, found: list[Found], generic: Generic | None) -> str:
    """Where a report locates the misfit; springs of an actuator by their number."""
    if not found:
        return "none"
    named = [f.slug for f in found if f.slug != UNMODELLED]
    if not named or found[0].slug == UNMODELLED:
        softened = generic is not None and generic.quantity == WALL and generic.bayes > NAMELESS
        return "elastomer" if softened else _guess(explanation)
    component = CATALOGUE[named[0]].component
    if component == "spring" and explanation.program.kind == "wire":
        return "wire"
    if component == "spring" and explanation.program.kind == "actuator":
        recordings = explanation.program.recordings
        measured = [n for n in (1, 2, 3) if any(r.has(f"resistance_{n}") for r in recordings)]
        others = [n for n in (1, 2, 3) if n not in measured]
        driven = measured[0] if measured else 2
        if named[0] == "opposing_spring_heating" and driven in (1, 2):
            return f"spring_{3 - driven if 3 - driven in others else driven}"
        return f"spring_{driven}"
    return component


def _guess(explanation: Explanation) -> str:
    """Component of a misfit that no effect explains: that of the best candidate."""
    stage = explanation.leading
    if stage and stage.trials:
        component = CATALOGUE[stage.trials[0].slug].component
        if component == "spring" and explanation.program.kind in ("actuator", "wire"):
            return "spring_2" if explanation.program.kind == "actuator" else "wire"
        return component
    return "unknown"


def _next(explanation: Explanation, found: list[Found]) -> dict | None:
    """The experiment that separates the best explanation from its nearest rival."""
    stage = explanation.leading
    if not stage or not stage.trials or not found:
        return None
    first, *rivals = stage.trials
    names = [first.slug, *(t.slug for t in rivals[:1])]
    if not rivals:
        return {
            "text": separating(names),
            "separates": names,
            "expected_log_bayes_factor": max(first.bayes, 0.0),
        }
    design = best_design(explanation.program, first, rivals[0])
    if design is None:
        return {"text": separating(names), "separates": names, "expected_log_bayes_factor": 0.0}
    text = (
        f"Repeat {design.recording} {design.change}: it would tell {names[0]} from {names[1]} by a log Bayes "
        f"factor of about {design.log_bayes:.3g}. {separating(names)}"
    )
    return {"text": text, "separates": names, "expected_log_bayes_factor": float(design.log_bayes)}
