"""A study from its start to its result."""

import hashlib
import inspect
import itertools
import json
import secrets
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

import numpy as np

import pneusma_jax as pj
from pneusma_jax.calibration import named_table
from pneusma_jax.errors import InputError
from pneusma_jax.pipeline import Effect
from pneusma_jax.program_cache import of_package
from pneusma_jax.units import to_si

from .bodies import alloy_of, build_body, material_of, plan_of, remarks_on_states
from .chances import chances_of, notes_on_draws
from .discrete import blocked_steps, made_from
from .infeasible import why_infeasible, why_nothing
from .log import Evaluation, Log, LoggedModel
from .neighbours import jumps, search_past_jumps
from .optimise import (
    JOINED,
    ON_FRONTS,
    Outcome,
    Problem,
    best_of,
    better_seen,
    conditions,
    from_starts,
    from_within,
    optimise,
)
from .pareto import as_point, front_of, none_better, share_of_box
from .program import Model
from .result import Choice, Design, DesignResult, Front, Limits
from .study import Study
from .uncertain import sampler_of
from .workspace import finer_area

STILL = 1e-10
"""Change of an objective over the whole range of a parameter that is rounding error [1]. It is part of the
objective's size, or of one in its unit; equilibria are exact to 1e-10."""
ASIDE = 0.01
"""Part of a range by which neighbours of a design without slope lie aside [1]."""
LEAST_SIZE = 8
"""Least number of places that go through the program at once."""


@dataclass
class _Solved:
    """A combination of choices, solved."""

    choice: Choice
    evaluate: LoggedModel
    problem: Problem
    starts: list[np.ndarray]
    outcomes: list[Outcome]
    ideal: Outcome
    made: tuple[Outcome, Problem] | None = None
    pairs: list[tuple[Outcome, Problem]] | None = None
    rounded: bool = True

    @property
    def final(self) -> Outcome:
        """The design that can be made, or the continuous one where no neighbour keeps the constraints."""
        return self.made[0] if self.made else self.ideal

    @property
    def limits(self) -> Limits:
        """Conditions at the final design."""
        outcome, problem = self.made or (self.ideal, self.problem)
        blocked = blocked_steps(outcome, problem, self.evaluate) if self.made else []
        return Limits(conditions(problem, outcome.evaluation), tuple(blocked))


def run_study(
    study: Study, log: Path | None = None, progress: Callable[[str], object] = lambda text: None
) -> DesignResult:
    """Solve a study.

    Args:
        study: study from `reading.read_study`.
        log: file of the evaluations, from which a killed study goes on; None keeps them in memory.
        progress: called with a few words after every lot of evaluations.

    Raises:
        InputError: one line, if nothing can be evaluated, or constraints contradict each other. The file of
            the evaluations is removed then, unless an earlier run made some of them.
    """
    kept = Log(log, fingerprint(study))
    try:
        return _solved_study(study, kept, progress)
    except InputError:
        kept.discard()
        raise


def _solved_study(study: Study, kept: Log, progress: Callable[[str], object]) -> DesignResult:
    """Solve every combination of choices, and take the best."""
    choices = [Choice(*one) for one in itertools.product(study.designs, study.alloys, study.materials)]
    solved = []
    for number, choice in enumerate(choices):
        words = f"choice {number + 1} of {len(choices)}: " if len(choices) > 1 else ""
        said = lambda text, words=words: progress(words + text)  # noqa: E731
        solved.append(_solve_choice(study, choice, number, kept, said))
    return _result(study, solved, kept, progress)


def fingerprint(study: Study) -> str:
    """Fingerprint of everything that the evaluations of a study depend on."""
    seen = [study.path.read_bytes(), version("pneusma-jax").encode()]
    files = {f.file for f in (*study.objectives, *study.constraints) if f.file is not None}
    seen += [path.read_bytes() for path in sorted(files)]
    if study.uncertainty is not None and study.uncertainty.posterior is not None:
        seen.append(study.uncertainty.posterior.read_bytes())
    if study.model.path is not None:
        seen.append(study.model.path.read_bytes())
    seen += [_source(type(effect)) for effect in study.model.effects]
    for one in itertools.product(study.designs, study.alloys, study.materials):
        plan = plan_of(*one, study.model)
        with_springs = [t for t in plan.tables if pj.layout(t).spring_numbers]
        alloys = {plan.alloy or named_table(t, "alloy"): alloy_of(plan, t) for t in with_springs}
        tables = [*plan.tables, *(alloys[name] for name in sorted(alloys))]
        tables += [material_of(plan, k) for k in range(len(plan.tables))]
        seen += [
            json.dumps([t.name, sorted(t.values().items()), sorted(t.text.items())]).encode() for t in tables
        ]
        seen.append(repr(plan.chain).encode())
    return hashlib.sha256(b"\0".join(seen)).hexdigest()


def _source(effect: type) -> bytes:
    """Text of an effect that is not of the package, with what it inherits; empty for one of the package."""
    own = [law for law in effect.__mro__ if not of_package(law) and issubclass(law, Effect)]
    try:
        return "".join(map(inspect.getsource, own)).encode()
    except (OSError, TypeError):  # typed in at a prompt: it cannot be told from another one
        return secrets.token_bytes()


def _solve_choice(study: Study, choice: Choice, number: int, log: Log, said: Callable[[str], object]) -> dict:
    """The nominal solution of a combination of choices, and the one under uncertainty."""
    plan = plan_of(choice.design, choice.alloy, choice.material, study.model)
    if study.uncertainty is None:
        return {"nominal": _search(study, choice, Model(study, plan), number, log, said, [])}
    calm = _without_uncertainty(study)
    nominal = _search(
        calm, choice, Model(calm, plan), -1 - number, log, lambda text: said("nominal, " + text), []
    )
    begin = [o.evaluation.place for o in (nominal.ideal,) if o.evaluation is not None]
    draws = sampler_of(study, plan).draw(study.uncertainty.draws, study.seed, spread_out=True)
    robust = _search(study, choice, Model(study, plan, draws), number, log, said, begin)
    return {"nominal": nominal, "robust": robust}


def _without_uncertainty(study: Study) -> Study:
    """The same study with everything nominal; objectives that only uncertainty has are left out."""
    import_free = [o for o in study.objectives if o.quantity != "failure_probability"]
    return Study(**{**study.__dict__, "uncertainty": None, "objectives": tuple(import_free)})


def start_places(study: Study, model: Model) -> list[np.ndarray]:
    """The tables' own design, where it is one, and a Latin hypercube.

    SciPy's sequences would spread as few places no better, and its statistics take half a second to load.
    """
    base = base_place(model)
    count = study.starts - (base is not None)
    random = np.random.default_rng(study.seed)
    cells = np.stack([random.permutation(count) for _ in range(len(model.space))], axis=1)
    spread = (cells + random.random(cells.shape)) / max(count, 1)
    return [*([np.clip(base, 0.0, 1.0)] if base is not None else []), *spread]


def base_place(model: Model) -> np.ndarray | None:
    """Place of the tables' own dimensions in the box; None if a parameter has no such value."""
    table, values = model.plan.tables[0].values(), {}
    for one in model.space.free:
        plain = one.name.partition(".")[2] if one.name[0].isdecimal() else one.name
        if plain not in table:
            return None
        values[one.name] = table[plain]
    return model.space.place(values)


def _search(
    study: Study, choice: Choice, model: Model, number: int, log: Log, said: Callable[[str], object],
    begin: list[np.ndarray],
) -> _Solved:  # fmt: skip
    """Solve one model: continuous, front, rounded."""
    phase = ["starts"]
    evaluate = LoggedModel(model, log, number, max(study.starts + len(begin), LEAST_SIZE))
    evaluate.said = lambda: said(f"{phase[0]}: {evaluate.asked} evaluations")
    starts = [*begin, *start_places(study, model)]
    first = evaluate(starts)
    good = [one for one in first if one.finite]
    if not good:
        raise InputError(f"{study.path}: {why_nothing(model, first[0], choice.words(study))}")
    still = _unchanging(study, good)
    if still and len(study.designs) * len(study.alloys) * len(study.materials) == 1:  # a choice may change it
        raise InputError(
            f"{study.path}: objective {still[0]!r} changes with nothing that is free: its derivative is "
            f"zero at all {len(good)} starts"
        )
    count = len(study.objectives)
    sizes = np.array([max(abs(float(np.median([o.values[j] for o in good]))), 1e-12) for j in range(count)])
    total = good[0].values.size
    rows = np.arange(count, count + len(model.groups))
    problems = [
        Problem(np.eye(total)[j] / sizes[j], rows, np.zeros(rows.size), np.ones(rows.size))
        for j in range(count)
    ]
    phase[0] = "continuous design"
    outcomes = [from_starts(problem, starts, evaluate, study.optimiser) for problem in problems]
    if rows.size and not any(one.kept for one in outcomes[0]):
        inside = [one.place for one in good]
        found_inside = [from_within(problem, inside, evaluate, study.optimiser) for problem in problems]
        outcomes = [ended + more for ended, more in zip(outcomes, found_inside, strict=True)]
    anchors = [best_of(ended) for ended in outcomes]
    past = lambda best, rest: search_past_jumps(best, rest, evaluate, study.optimiser)  # noqa: E731
    beyond = past if jumps(study) else None
    for j, problem in enumerate(problems):
        if anchors[j].kept and beyond:
            phase[0] = "beyond jumps"
            anchors[j] = beyond(anchors[j], problem)
        anchors[j] = _none_better(anchors[j], problem, evaluate, study.optimiser)
    found = _Solved(choice, evaluate, problems[0], starts, outcomes[0], anchors[0])
    if not all(anchor.kept for anchor in anchors):
        return found
    discrete = any(one.discrete for one in model.space.free)
    if count == 1:
        phase[0] = "rounding"
        if discrete:
            found.made = made_from(found.ideal, found.problem, evaluate, study.optimiser, beyond=beyond)
            found.rounded = found.made is not None
        return found
    phase[0] = "front"
    found.pairs = front_of(anchors, problems[0], evaluate, study.points, study.optimiser)
    if not discrete:
        found.pairs = none_better(found.pairs, evaluate, count)
    chosen = found.pairs[_knee([o for o, _ in found.pairs], count)]
    found.ideal, found.problem = chosen
    if discrete:
        phase[0] = "rounding"
        once = {"further": False, "ends": ON_FRONTS, "objectives": count}
        made = [made_from(o, p, evaluate, study.optimiser, **once) for o, p in found.pairs]
        if not any(made):  # the limits on the other objectives may leave no room, as where a front is a point
            own = zip(anchors, problems, strict=True)
            alone = [made_from(o, p, evaluate, study.optimiser) for o, p in own]
            made = [as_point(pair, problems[0], count) for pair in alone if pair]
        found.rounded = any(made)
        if found.rounded:
            found.pairs = none_better([pair for pair in made if pair], evaluate, count)
            found.made = found.pairs[_knee([o for o, _ in found.pairs], count)]
    return found


def _none_better(best: Outcome, problem: Problem, evaluate: LoggedModel, method: str) -> Outcome:
    """The end of a search, or of one from a better design that another search has evaluated."""
    while (seen := better_seen(best, problem, evaluate)) is not None:
        best = best_of([seen, *optimise([problem], [seen.evaluation.place], evaluate, method)])
    return best


def _unchanging(study: Study, at: list[Evaluation]) -> list[str]:
    """Names of objectives whose derivatives are zero, to rounding error, in all of some designs."""
    found = []
    for j, one in enumerate(study.objectives):
        size = max(abs(float(to_si(1.0, one.unit, True))), *(abs(o.values[j]) for o in at))
        if one.quantity != "failure_probability" and all(
            np.max(np.abs(o.jacobian[j])) <= STILL * size for o in at
        ):
            found.append(one.name)
    return found


def _knee(outcomes: list[Outcome], count: int) -> int:
    """The point nearest to the best of every objective, each measured by its range on the front."""
    values = np.array([o.evaluation.values[:count] for o in outcomes])
    span = np.ptp(values, axis=0)
    away = (values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0)
    return int(np.argmin(np.linalg.norm(away, axis=1)))


def _design(solved: _Solved, outcome: Outcome) -> Design:
    model, one = solved.evaluate.model, outcome.evaluation
    return design_at(model, solved.choice, one)


def design_at(model: Model, choice: Choice, one: Evaluation) -> Design:
    """The design of an evaluation."""
    signs = [o.sign for o in model.study.objectives]
    values = tuple(float(s * v) for s, v in zip(signs, one.values, strict=False))
    parameters = {n: float(x) for n, x in model.space.parameters(one.place).items()}
    rows = one.values[len(signs) : len(signs) + len(model.groups)]
    reached = {k: float(one.values[row]) for k, row in model.aims.items()}
    return Design(choice, parameters, values, float(np.max(rows, initial=-np.inf)), one, reached)


def _result(study: Study, solved: list[dict], log: Log, progress: Callable[[str], object]) -> DesignResult:
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
    notes += [*notes_on_model(study), *_notes_on_search(study, best)]
    base = _base_design(best)
    chances = {}
    if study.uncertainty is not None:
        progress("fresh draws")
        places = _to_compare(best, solved[ways.index(best)]["nominal"], base)
        chances = chances_of(model, places)
    front = _front(best) if best.pairs else None
    if front is not None and any(o.quantity == "failure_probability" for o in study.objectives):
        progress("fresh draws of the front")
        each = chances_of(model, {str(k): d.evaluation.place for k, d in enumerate(front.designs)})
        front = replace(front, chances=tuple(each.values()))
        notes += notes_on_draws(study, model.plan)
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


def _notes_on_search(study: Study, best: _Solved) -> list[str]:
    """Cautions on starts that were lost, and on objectives that have no slope at the design."""
    notes, lost = [], sum(o.evaluation is None for o in best.outcomes)
    if lost:
        notes.append(
            f"{lost} of {len(best.outcomes)} starts were not solved, since their dimensions have no "
            "equilibrium in all states; the search went on from the others"
        )
    one = best.final.evaluation
    names = _unchanging(study, [one])
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


def _to_compare(robust: _Solved, nominal: _Solved, base: Design | None) -> dict[str, np.ndarray]:
    """Places of the designs whose failures are counted, by name."""
    found = {"robust design": robust.final.evaluation.place}
    if nominal.ideal.kept:
        found["nominal design"] = nominal.final.evaluation.place
    return found | ({} if base is None else {"design of the tables": base.evaluation.place})


def _base_design(best: _Solved) -> Design | None:
    place = base_place(best.evaluate.model)
    if place is None or np.any(place < -1e-9) or np.any(place > 1.0 + 1e-9):
        return None
    one = best.evaluate([np.clip(place, 0.0, 1.0)])[0]
    return design_at(best.evaluate.model, best.choice, one) if one.finite else None


def _front(best: _Solved) -> Front:
    count = len(best.evaluate.model.study.objectives)
    values = np.array([o.evaluation.values[:count] for o, _ in best.pairs])
    share, reference = share_of_box(values)
    signs = [o.sign for o in best.evaluate.model.study.objectives]
    designs = tuple(_design(best, o) for o, _ in best.pairs)
    made = best.made is not None or not any(f.discrete for f in best.evaluate.model.space.free)
    return Front(designs, share, tuple(float(s * r) for s, r in zip(signs, reference, strict=True)), made)
