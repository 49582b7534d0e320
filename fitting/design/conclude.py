"""The result of a study from its solved combinations of choices: designs, front, chances and notes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fitting.specimens.cautions import touching_angle, touching_cautions
from pneusma_jax.errors import InputError
from pneusma_jax.units import to_si

from .bodies import build_body, cautions_of, remarks_on_states
from .chances import chances_of, notes_on_draws
from .infeasible import why_infeasible
from .log import Evaluation, Log
from .optimality import conditions
from .optimise import JOINED, Outcome
from .pareto import share_of_box
from .program import Model
from .quantities import QUANTITIES
from .result import Choice, Design, DesignResult, Front
from .search import STILL, Solved, base_place, unchanging
from .study import Study
from .workspace import finer_area

ASIDE = 0.01
"""Part of a range by which neighbours of a design without slope lie aside [1]."""


def result_of(
    study: Study, solved: list[dict[str, Solved]], log: Log, progress: Callable[[str], object]
) -> DesignResult:
    """The best of all combinations of choices, with the others beside it.

    Args:
        study: the study that was solved.
        solved: `nominal` solution of each combination, and the `robust` one where there is uncertainty.
        log: all evaluations.
        progress: receives a few words where fresh draws are made.

    Raises:
        InputError: one line, if no combination keeps all constraints.
    """
    key = "nominal" if study.uncertainty is None else "robust"
    ways = [one[key] for one in solved]
    able = [w for w in ways if w.ideal.kept]
    if not able:
        first = ways[0]
        words = why_infeasible(first.problem, first.outcomes, first.evaluate)
        raise InputError(f"{study.path}: {words}")
    # by one size for all, since every combination scales its own objective
    best = min(able, key=lambda w: (not w.rounded, float(w.final.evaluation.values[0])))
    model = best.evaluate.model
    notes = [] if best.rounded else [
        "no design next to the continuous one that can be made keeps all constraints: widen a "
        "catalogue or a limit"
    ]  # fmt: skip
    notes += [*cautions_of(model.plan), *notes_on_model(study), *_notes_on_search(study, best)]
    notes += notes_on_touching(model, best.final.evaluation.place)
    base = _base_design(best)
    chances = {}
    if study.uncertainty is not None:
        progress("fresh draws")
        places = _to_compare(best, solved[ways.index(best)]["nominal"], base)
        chances = chances_of(model, places)
        notes += notes_on_draws(study, model.plan)
    front = _front(best) if best.pairs else None
    if front is not None and any(o.quantity == "failure_probability" for o in study.objectives):
        progress("fresh draws of the front")
        each = chances_of(model, {str(k): d.evaluation.place for k, d in enumerate(front.designs)})
        front = replace(front, chances=tuple(each.values()))
    return DesignResult(
        study=study,
        model=model,
        base=base,
        ideal=_design(best, best.ideal),
        made=_design(best, best.final),
        problem=best.problem,
        conditions=conditions(best.problem, best.ideal.evaluation),
        limits=best.limits,
        front=front,
        chances=chances,
        others=tuple(_design(w, w.final) for w in able if w is not best),
        starts=tuple(
            (float(study.objectives[0].sign * o.evaluation.values[0]), o.violation)
            for o in best.outcomes
            if o.evaluation is not None
        ),
        lost=sum(o.evaluation is None for o in best.outcomes),
        joined=sum(o.message == JOINED for o in best.outcomes),
        evaluations=len(log.known),
        equilibria=sum(w.evaluate.equilibria for one in solved for w in one.values()),
        finer_areas={} if study.uncertainty else _finer_areas(study, model, best.final, base),
        notes=notes,
    )


def design_at(model: Model, choice: Choice, one: Evaluation) -> Design:
    """The design of an evaluation."""
    signs = [o.sign for o in model.study.objectives]
    values = tuple(float(s * v) for s, v in zip(signs, one.values, strict=False))
    parameters = {n: float(x) for n, x in model.space.parameters(one.place).items()}
    rows = one.values[len(signs) : len(signs) + len(model.groups)]
    reached = {k: float(one.values[row]) for k, row in model.aims.items()}
    return Design(choice, parameters, values, float(np.max(rows, initial=-np.inf)), one, reached)


def _design(solved: Solved, outcome: Outcome) -> Design:
    model, one = solved.evaluate.model, outcome.evaluation
    return design_at(model, solved.choice, one)


def notes_on_model(study: Study) -> list[str]:
    """What a model of the study adds, and that its effects have no history in a state."""
    chosen = {"design": study.designs, "alloy": study.alloys, "material": study.materials}
    picks = [{key: table} for key, tables in chosen.items() for table in tables]
    said = list(dict.fromkeys(s for pick in picks for s in study.model.remarks(pick)))
    if study.model.added:
        said.append("effects act in every state as at the start of a recording: nothing is remembered")
    if study.model.specimens:
        name = study.model.shown_name
        said.append(f"numbers of single specimens of {name} are left out: a design is none of them")
    idle = (one for design in study.designs for one in remarks_on_states(study.model, design))
    return said + list(dict.fromkeys(idle))


def notes_on_touching(model: Model, place: np.ndarray) -> list[str]:
    """Caution where the body may touch itself in some states of a design; none elsewhere.

    Args:
        model: the study with its choices.
        place: the design, as a place in the box.
    """
    _, states = model.solve_states(place)
    turned = [sum(np.linalg.norm(segment.bend) for segment in state.segments) for state in states]
    bend = np.rad2deg(turned)
    if model.plan.chain is not None:
        free = np.array([QUANTITIES["clearance"].function(state, 0) for state in states])
        found = touching_cautions(bend, free < 0.0, rows="states")
        return [f"{one}; a constraint on clearance, at_least 0 mm, forbids it" for one in found]
    limit = touching_angle({}, model.plan.model)
    found = touching_cautions(bend, bend > limit, limit, rows="states")
    constraint = f"a constraint on bend_magnitude, at_most {limit:g} deg,"
    return [f"{one}; {constraint} forbids it" for one in found]


def _finer_areas(
    study: Study, model: Model, final: Outcome, base: Design | None
) -> dict[str, tuple[float, ...]]:
    """Areas of workspaces from finer polygons [m2], by objective: the design's, and those of the tables."""
    sweeps = {one.name: one.sweep for one in study.objectives if one.sweep is not None}
    if not sweeps:
        return {}
    places = [final.evaluation.place, *([] if base is None else [base.evaluation.place])]
    sizes = [{n: float(x) for n, x in model.space.parameters(place).items()} for place in places]
    bodies = [build_body(model.plan, own, model.materials) for own in sizes]
    table = model.plan.tables[0]
    return {name: tuple(finer_area(b, table, sweep) for b in bodies) for name, sweep in sweeps.items()}


def _notes_on_search(study: Study, best: Solved) -> list[str]:
    """Cautions on starts that were lost, and on objectives that have no slope at the design."""
    notes, lost = [], sum(o.evaluation is None for o in best.outcomes)
    if lost:
        notes.append(
            f"{lost} of {len(best.outcomes)} starts were not solved, since their dimensions have no "
            "equilibrium in all states; the search went on from the others"
        )
    one = best.final.evaluation
    names = unchanging(study, [one])
    if names:  # an optimum inside all ranges has no slope, either, but its neighbours differ from it
        steps = [sign * ASIDE * axis for axis in np.eye(one.place.size) for sign in (1.0, -1.0)]
        around = best.evaluate([np.clip(one.place + step, 0.0, 1.0) for step in steps])
        names = [name for name in names if _all_alike(study, name, [one, *around])]
    for name in names:
        notes.append(f"objective {name!r} has no slope at the design: nothing that is free changes it there")
    return notes


def _all_alike(study: Study, name: str, at: list[Evaluation]) -> bool:
    """True if an objective is the same, to rounding error, in some designs, those without equilibrium left
    out."""
    j = next(k for k, one in enumerate(study.objectives) if one.name == name)
    values = [one.values[j] for one in at if one.finite]
    unit = abs(float(to_si(1.0, study.objectives[j].unit, True)))
    return float(np.ptp(values)) <= STILL * max(unit, *np.abs(values))


def _to_compare(robust: Solved, nominal: Solved, base: Design | None) -> dict[str, np.ndarray]:
    """Places of the designs whose failures are counted, by name."""
    found = {"robust design": robust.final.evaluation.place}
    if nominal.ideal.kept:
        found["nominal design"] = nominal.final.evaluation.place
    return found | ({} if base is None else {"design of the tables": base.evaluation.place})


def _base_design(best: Solved) -> Design | None:
    place = base_place(best.evaluate.model)
    if place is None or np.any(place < -1e-9) or np.any(place > 1.0 + 1e-9):
        return None
    one = best.evaluate([np.clip(place, 0.0, 1.0)])[0]
    return design_at(best.evaluate.model, best.choice, one) if one.finite else None


def _front(best: Solved) -> Front:
    count = len(best.evaluate.model.study.objectives)
    values = np.array([o.evaluation.values[:count] for o, _ in best.pairs])
    share, reference = share_of_box(values)
    signs = [o.sign for o in best.evaluate.model.study.objectives]
    designs = tuple(_design(best, o) for o, _ in best.pairs)
    made = best.made is not None or not any(f.discrete for f in best.evaluate.model.space.free)
    return Front(designs, share, tuple(float(s * r) for s, r in zip(signs, reference, strict=True)), made)
