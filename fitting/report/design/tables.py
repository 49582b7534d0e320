"""Tables of a design study."""

import numpy as np

from fitting.design.discrete import Step
from fitting.design.infeasible import limit_words
from fitting.design.optimise import ALLOWED
from fitting.design.result import DesignResult
from fitting.design.study import Constraint, Free
from fitting.inference.notes import joined
from pneusma_jax.units import amount, from_si, to_si

from ..cells import with_unit
from ..table import Table
from .words import label_of, objective_shown, parameter_value, row_words, sensitivities, shown, step_of

LOOSER = 0.01
"""Relaxation of a limit in the table of limits, as part of it [1]."""
NO_CHANGE = 1e-12
"""Change of a value that is rounding error, as part of it, or of one unit where it is smaller [1]. Changes
by parameters without effect were at most 1e-24; the smallest real ones, of hundredths, are above 1e-6."""


def step_table(result: DesignResult) -> Table:
    """Table of the steps of discrete parameters that would help, and of what forbids them."""
    rows = []
    for step in result.limits.blocked:
        free = result.model.space.free[step.parameter]
        broken = list(dict.fromkeys(row_words(result, row) for row in step.rows))
        why = f"breaks {joined(broken)}" if broken else f"{shown(_end_of(free, step), free.unit)} is the last"
        why = "no equilibrium there" if step.lost else why
        rows.append([free.name, "up" if step.up else "down", why])
    note = "Each step would help the objective, the rest left as it is."
    return Table(["parameter", "one step", "why it is not taken"], rows, note)


def _end_of(free: Free, step: Step) -> float:
    return free.values[-1 if step.up else 0]


def other_table(result: DesignResult) -> Table:
    """Table of the best designs of other choices."""
    one = result.study.objectives[0]
    rows = [[d.choice.words(result.study), objective_shown(one, d.objectives[0])] for d in result.others]
    return Table(["choice", label_of(one)], rows)


def parameter_table(result: DesignResult) -> Table:
    """Table of every parameter: value, range, and effect of a step."""
    study, made = result.study, result.made
    steps = sensitivities(result, made)
    values_of = [made.reached.get(k, value) for k, value in enumerate(made.objectives)]
    header = ["parameter", "made", "value", "before rounding", "range"]
    header += ["step", *(f"changes {o.name} by" for o in study.objectives)]
    rows = []
    for k, free in enumerate(result.model.space.free):
        ends = f"{_bound(free.low, free.unit)} to {_bound(free.high, free.unit)}"
        changes = [
            change_words(x, value, o.unit)
            for x, value, o in zip(steps[k], values_of, study.objectives, strict=True)
        ]
        ends_at = (parameter_value(free, d.parameters[free.name]) for d in (made, result.ideal))
        values = [shown(x, free.unit) for x in ends_at]
        rows.append([free.name, free.made, *values, ends, step_of(free)[1], *changes])
    return Table(header, rows)


def change_words(change: float, value: float, unit: str) -> str:
    """A change of a value in words; none where it is rounding error."""
    size = max(abs(value), abs(float(to_si(1.0, unit, True))))
    if abs(change) <= NO_CHANGE * size:
        return "nothing"
    return amount(f"{from_si(change, unit, difference=True):+.3g}", unit)


def _bound(bound: object, unit: str) -> str:
    if bound.parameter is None:
        return f"{from_si(bound.value, unit):.4g}"
    return f"{bound.times:g} {bound.parameter} {from_si(bound.value, unit):+.4g}"


def limit_table(result: DesignResult) -> Table:
    """Table of every constraint: limit, margin, and benefit of its relaxation."""
    study, model = result.study, result.model
    groups, first = model.groups, study.objectives[0]
    values = result.made.evaluation.values[len(study.objectives) :]
    size = 1.0 / float(np.max(np.abs(result.problem.weights)))
    rows = []
    for k in range(len(study.constraints)):
        own = [i for i, row in enumerate(groups) if row.constraint == k]
        if not own:
            rows.append([study.constraints[k].name, limit_words(study, k), "", "counted only", ""])
            continue
        tight = max(own, key=lambda i: values[i])
        gain = float(np.sum(result.limits.conditions.rows[own])) * LOOSER * size
        row = groups[tight]
        where = (
            row.state
            + (f", segment {row.segment}" if row.segment > 1 else "")
            + (f", spring {row.part}" if row.part else "")
        )
        worth = amount(f"{from_si(gain, first.unit, difference=True):.3g}", first.unit) if gain > 0.0 else ""
        if worth and study.constraints[k].limit == 0.0:
            worth += f" per {amount(f'{LOOSER:g}', study.constraints[k].unit)}"
        room = _room_words(study.constraints[k], float(-values[tight]))
        rows.append([study.constraints[k].name, limit_words(study, k), where, room, worth])
    header = ["constraint", "limit", "tightest in", "room, of the limit", f"worth of 1 % in {first.name}"]
    return Table(header, rows, "A room of 0 % is an active constraint.")


def _room_words(one: Constraint, room: float) -> str:
    """Room below or above a limit in words: as part of the limit, or in its unit where that is zero.

    Args:
        one: the constraint.
        room: scaled room [1], see `Seen.violation`.
    """
    room = 0.0 if abs(room) <= ALLOWED else room
    if one.limit == 0.0 and room:
        return amount(f"{room:.3g}", one.unit)
    return f"{100.0 * room:.3g} %"


def front_table(result: DesignResult) -> Table:
    """Table of the designs on the Pareto front."""
    study = result.study
    header = [
        *(with_unit(label_of(o), o.unit) for o in study.objectives),
        *(with_unit(f.name, f.unit) for f in study.free),
        *(["fails in fresh draws"] if result.front.chances else []),
    ]
    rows = [
        [
            *(f"{o.in_unit(x):.4g}" for x, o in zip(d.objectives, study.objectives, strict=True)),
            *(f"{from_si(parameter_value(f, d.parameters[f.name]), f.unit):.4g}" for f in study.free),
            *([f"{100.0 * result.front.chances[k].probability:.3g} %"] if result.front.chances else []),
        ]
        for k, d in enumerate(result.front.designs)
    ]
    chosen = next(
        (k for k, d in enumerate(result.front.designs) if d.evaluation is result.made.evaluation), None
    )
    note = (
        "A probability of failure among the objectives is a smooth share of the search's draws; the last "
        "column counts fresh ones."
    )
    return Table(header, rows, note if result.front.chances else "", chosen=chosen)


def chance_table(result: DesignResult) -> Table:
    """Table of the results over fresh draws, design by design."""
    study, first = result.study, result.study.objectives[0]
    header = ["design", "draws", "fails", "95 % interval", "without equilibrium"]
    header += [f"median of {label_of(first)}"]
    header += [f"misses {c.name}" for c in study.constraints]
    rows = []
    for name, c in result.chances.items():
        low, high = (f"{100.0 * x:.3g}" for x in c.interval)
        middle = objective_shown(first, float(np.median(c.values))) if c.values.size else ""
        each = [f"{100.0 * n / c.draws:.3g} %" for n in c.by_constraint]
        rows.append(
            [
                name,
                str(c.draws),
                f"{100.0 * c.probability:.3g} %",
                f"{low} to {high} %",
                str(c.lost),
                middle,
                *each,
            ]
        )
    return Table(header, rows)
