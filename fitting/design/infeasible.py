"""Why a study has no result: what cannot be computed, and constraints that contradict each other."""

import dataclasses
from collections.abc import Sequence

import numpy as np

import pneusma_jax as pj
from fitting.inference.notes import joined
from pneusma_jax.units import amount, from_si, to_si

from .log import Evaluation, LoggedModel
from .optimise import ALLOWED, Outcome, Problem, least_violation
from .program import Model
from .study import Study


def contradiction(
    problem: Problem, owners: np.ndarray, starts: Sequence[np.ndarray], evaluate: LoggedModel
) -> tuple[list[int], float] | None:
    """A smallest set of constraints that no design in the box keeps together.

    The largest violation is minimised from all starts. Then each constraint is left out in turn; where the
    rest still cannot be kept, it stays out.

    Args:
        problem: whose rows are all constraints.
        owners: index of the constraint of every row.
        starts: places in the box.
        evaluate: evaluator of the model.

    Returns:
        Indices of the constraints, and the least scaled violation of their worst [1]; None if all can be
        kept.
    """

    def least(kept: list[int]) -> Outcome:
        rows = np.flatnonzero(np.isin(owners, kept))
        part = dataclasses.replace(
            problem, rows=problem.rows[rows], limits=problem.limits[rows], scales=problem.scales[rows]
        )
        return least_violation(part, starts, evaluate)

    kept = sorted({int(k) for k in owners})
    missed = least(kept).objective
    if missed <= ALLOWED:
        return None
    for k in list(kept):
        others = [j for j in kept if j != k]
        if others and (left := least(others).objective) > ALLOWED:
            kept, missed = others, left
    return kept, missed


def why_nothing(model: Model, first: Evaluation, words: str) -> str:
    """Reason in words why no start could be evaluated."""
    names = [o.name for o in model.study.objectives]
    whom = f" of {words}" if words else ""
    bad = [n for n, v in zip(names, first.values, strict=False) if not np.isfinite(v)]
    _, states = model.solve_states(first.place)
    for name, solved in zip(model.states.names, states, strict=True):
        for k, segment in enumerate(solved.segments, 1):
            if not bool(segment.converged):
                sentence = pj.Status(int(segment.status)).sentence
                where = f"state {name!r}, segment {k}: {sentence}"
                return f"no start{whom} has an equilibrium in all states; {where}"
    if model.uncertain and (lost := _lost_draws(model, first.place)):
        return (
            f"no start{whom} has an equilibrium in all {model.draws.count} draws: at the first one {lost} of "
            f"them have none{_or_function(model.study)}; narrow what is uncertain, or the bounds"
        )
    what = f"objective {bad[0]!r}" if bad else "a constraint or a derivative"
    count = model.study.starts
    return f"{what} is not a number at any of the {count} starts{whom}; check its function and bounds"


def _or_function(study: Study) -> str:
    """The other cause that draws may have in a study with functions of the user's own, in words."""
    own = [one.name for one in (*study.objectives, *study.constraints) if one.file is not None]
    return f", or the function of {own[0]!r} is no number" if own else ""


def _lost_draws(model: Model, place: np.ndarray) -> int:
    """Number of draws of the search in which some number of a design is not finite."""
    values, margins = model.spread(place, model.draws)
    return int(np.sum(~np.all(np.isfinite(np.hstack([values, margins])), axis=1)))


def _missed_words(study: Study, k: int, missed: float) -> str:
    """How far a constraint is missed, in its own unit.

    Args:
        study: study with the constraint.
        k: index of the constraint.
        missed: violation as the optimiser scales it, by the limit [1].
    """
    one = study.constraints[k]
    if one.limit is None:
        return f"{100.0 * missed:.2g} % of what was tested"
    size = abs(one.limit) or float(to_si(1.0, one.unit, True))
    return amount(f"{from_si(missed * size, one.unit, True):.2g}", one.unit)


def limit_words(study: Study, k: int) -> str:
    """Limit of a constraint in its unit."""
    one = study.constraints[k]
    end = "at most" if one.most else "at least"
    value = (
        "what was tested"
        if one.limit is None
        else amount(f"{from_si(one.limit, one.unit):.6g}", one.unit)
    )
    return f"{one.quantity} {end} {value}"


def why_infeasible(problem: Problem, outcomes: Sequence[Outcome], evaluate: LoggedModel) -> str:
    """Constraints that contradict each other, in words."""
    study = evaluate.model.study
    owners = np.array([row.constraint for row in evaluate.model.groups], dtype=int)
    finite = [o.evaluation.place for o in outcomes if o.evaluation is not None]
    found = contradiction(problem, owners, finite, evaluate)
    if found is None:
        return "no start keeps all constraints, but none contradict each other: raise `starts`"
    kept, missed = found
    names = [f"{study.constraints[k].name!r} ({limit_words(study, k)})" for k in kept]
    gaps = [_missed_words(study, k, missed) for k in kept]
    if len(names) == 1:
        return f"no design within the bounds keeps constraint {names[0]}: it is missed by at least {gaps[0]}"
    either = " or ".join(f"{study.constraints[k].name!r} by {gap}" for k, gap in zip(kept, gaps, strict=True))
    return (
        f"constraints {joined(names)} contradict each other within the bounds: the nearest design "
        f"misses {either}"
    )
