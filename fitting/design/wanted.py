"""The tables `[objective.NAME]` and `[constraint.NAME]` of a study."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pneusma_jax as pj
from pneusma_jax.documents import check_keys, finite_number
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.section.shapes import Disc
from pneusma_jax.units import UNITS, to_si

from . import fields
from .bodies import Plan, build_body
from .quantities import QUANTITIES, ROUND_ONLY, SAME_IN_EVERY_STATE
from .states import PRESSURES
from .study import Constraint, Objective, Pose, State, Sweep
from .workspace import edge_states

MORE = {
    "workspace_area": ("area", "mm2"),
    "stiffness_range": ("number", "1"),
    "tip_miss": ("length", "mm"),
    "failure_probability": ("number", "1"),
    "function": ("number", "1"),
}
"""Dimension and unit of what only objectives can be, or a function of the user's."""
GOALS = ("maximise", "minimise", "target")
MOST_OBJECTIVES = 3
_OBJECTIVE = ("quantity", "goal", "state", "states", "target", "segment")
_POSE = ("state", "target", "direction")
_SWEEP = ("pressure", "xi0_min", "points")
_FUNCTION = ("file", "function", "unit")
_CONSTRAINT = ("quantity", "at_most", "at_least", "states", "segment")


def read_objectives(
    table: Any, states: Mapping[str, State], plans: Sequence[Plan], path: Path
) -> tuple[Objective, ...]:
    """Objectives in the order of the file.

    Raises:
        InputError: one line, for an unknown quantity, goal or state, or one that a design cannot have.
    """
    table = fields.table_of(table, f"{path}: [objective]")
    if not table:
        raise InputError(f"{path}: there is no objective: add an [objective.NAME]")
    if len(table) > MOST_OBJECTIVES:
        raise InputError(
            f"{path}: {len(table)} objectives, but a front of more than {MOST_OBJECTIVES} cannot be drawn"
        )
    return tuple(
        _objective(name, fields.table_of(entry, f"{path}: [objective.{name}]"), states, plans, path)
        for name, entry in table.items()
    )


def _objective(
    name: str, entry: fields.Table, states: Mapping[str, State], plans: Sequence[Plan], path: Path
) -> Objective:
    where = f"{path}: [objective.{name}]"
    quantity = fields.word(entry, "quantity", [*QUANTITIES, *MORE], where)
    extra = _SWEEP if quantity == "workspace_area" else _FUNCTION if quantity == "function" else ()
    known = (*_OBJECTIVE, *extra)
    if quantity == "tip_miss":
        known = ("quantity", "goal", *(("poses",) if "poses" in entry else _POSE))
    check_keys(entry, known, where)
    usual = {"tip_miss": "minimise", "failure_probability": "minimise"}.get(quantity)
    goal = fields.word(entry, "goal", GOALS, where, usual)
    if usual and goal != usual:
        raise InputError(f"{where}: goal of a {quantity} must be {usual!r}")
    dimension, unit = _dimension(quantity, entry, where)
    target: tuple[float, ...] = ()
    poses: tuple[Pose, ...] = ()
    if quantity == "tip_miss":
        poses, unit = _poses(entry, states, where)
    elif goal == "target":
        value, unit = fields.quantity(entry.get("target"), dimension, f"{where}: target")
        target = (value,)
        if value < 0.0 and quantity in QUANTITIES and QUANTITIES[quantity].springs:
            raise InputError(
                f"{where}: target must not be negative: of {quantity} the largest size of all springs counts"
            )
    elif "target" in entry:
        raise InputError(f"{where}: 'target' goes with goal = \"target\"")
    if quantity in QUANTITIES or quantity == "stiffness_range":
        _check_plans(quantity, plans, where)
    return Objective(
        name=name,
        quantity=quantity,
        goal=goal,
        states=tuple(p.state for p in poses) or _states(quantity, entry, states, where),
        target=target,
        poses=poses,
        sweep=_sweep(entry, plans, where) if quantity == "workspace_area" else None,
        segment=_segment(entry, quantity, plans, where) or 1,
        file=fields.code_of(entry, path.parent, where) if quantity == "function" else None,
        function=_function(entry, name, where),
        unit=unit,
    )


def _function(entry: fields.Table, name: str, where: str) -> str:
    """Name of a user's function, by default that of its table."""
    function = entry.get("function", name)
    if not isinstance(function, str) or not function:
        raise InputError(f"{where}: function must be the name of a function, but it is {function!r}")
    return function


def _dimension(quantity: str, entry: fields.Table, where: str) -> tuple[str, str]:
    if quantity == "function":
        unit = entry.get("unit", "1")
        if not fields.known_unit(unit):
            raise InputError(f"{where}: unit {unit!r} is not known")
        return UNITS[unit].dimension, unit
    if quantity in MORE:
        return MORE[quantity]
    return QUANTITIES[quantity].dimension, QUANTITIES[quantity].unit


def _poses(entry: fields.Table, states: Mapping[str, State], where: str) -> tuple[tuple[Pose, ...], str]:
    """The poses of a `tip_miss`: one in the table itself, or a list of them; and the unit of the first."""
    tables = entry.get("poses", [{key: entry[key] for key in _POSE if key in entry}])
    if not isinstance(tables, list) or not tables:
        raise InputError(f"{where}: poses must be a list of tables with {', '.join(_POSE)}")
    found, units = [], []
    for number, table in enumerate(tables, 1):
        at = f"{where}: pose {number}" if "poses" in entry else where
        table = fields.table_of(table, at)
        check_keys(table, _POSE, at)
        if "state" not in table:
            raise InputError(f"{at}: 'state' is missing: in which state is it wanted?")
        names = fields.names_of(table["state"], f"{at}: state")
        if len(names) > 1:
            raise InputError(f"{at}: state names several; a pose is that of one, and 'poses' lists several")
        _check_states(names, states, at)
        tip, unit = _place(table.get("target"), f"{at}: target")
        found.append(
            Pose(names[0], tip, _direction(table["direction"], at) if "direction" in table else None)
        )
        units.append(unit)
    twice = {p.state for p in found if sum(q.state == p.state for q in found) > 1}
    if twice:
        raise InputError(f"{where}: poses name state {min(twice)!r} twice; a state has one tip")
    return tuple(found), units[0]


def _direction(value: Any, where: str) -> tuple[float, ...]:
    """A unit vector of three numbers of any length."""
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(f"{where}: direction must be three numbers [x, y, z], but it is {value!r}")
    numbers = [finite_number(x, f"{where}: direction") for x in value]
    length = math.hypot(*numbers)
    if length == 0.0:
        raise InputError(f"{where}: direction has no length")
    return tuple(x / length for x in numbers)


def _place(value: Any, where: str) -> tuple[tuple[float, ...], str]:
    table = fields.table_of(value, where)
    check_keys(table, ("value", "unit"), where)
    unit, point = fields.unit_of(table, "length", where), table.get("value")
    if not isinstance(point, list) or len(point) != 3:
        raise InputError(f"{where}: value must be three numbers [x, y, z], but it is {point!r}")
    return tuple(to_si(finite_number(x, where), unit) for x in point), unit


def _states(quantity: str, entry: fields.Table, states: Mapping[str, State], where: str) -> tuple[str, ...]:
    """States that an objective looks at."""
    if quantity in ("workspace_area", "failure_probability", "function"):
        if "state" in entry or "states" in entry:
            raise InputError(f"{where}: a {quantity} names no state")
        return ()
    if quantity == "stiffness_range":
        if "state" in entry:
            raise InputError(f"{where}: 'state' has no meaning; a stiffness_range needs two 'states'")
        names = fields.names_of(entry.get("states"), f"{where}: states")
        if len(names) != 2:
            raise InputError(f"{where}: states must be two, the soft and the stiff one")
    else:
        given = [key for key in ("state", "states") if key in entry]
        if len(given) > 1:
            raise InputError(f"{where}: 'state' and 'states' are both given; name one or the other")
        if not given:
            raise InputError(f"{where}: 'state' is missing: in which state is it wanted?")
        names = fields.names_of(entry[given[0]], f"{where}: {given[0]}")
        if given[0] == "state" and len(names) > 1:
            raise InputError(f"{where}: state names several; the mean over them is that of 'states'")
    _check_states(names, states, where)
    return names


def _check_states(names: Sequence[str], states: Mapping[str, State], where: str) -> None:
    for name in names:
        if name not in states:
            raise InputError(f"{where}: there is no [state.{name}], {nearest(name, states)}")


def _sweep(entry: fields.Table, plans: Sequence[Plan], where: str) -> Sweep:
    if "pressure" not in entry:
        raise InputError(f"{where}: 'pressure' is missing; it needs {{from = .., to = .., unit = \"..\"}}")
    low, high, _ = fields.span(entry["pressure"], "pressure", f"{where}: pressure")
    if not PRESSURES[0] < low < high < PRESSURES[1]:
        raise InputError(f"{where}: pressure must be gauge pressures between -100 and 1000 kPa")
    sweep = Sweep(
        low, high, fields.share(entry, "xi0_min", 0.1, where), fields.whole(entry, "points", 8, 2, 100, where)
    )
    for plan in plans:
        if plan.chain is not None:
            raise InputError(f"{where}: a workspace area is that of one actuator, not of a chain")
        edge_states(plan.tables[0], sweep)
    return sweep


def _segment(entry: fields.Table, quantity: str, plans: Sequence[Plan], where: str) -> int:
    """The segment that a table names, from 1; 0 if it names none."""
    if "segment" not in entry:
        return 0
    of_whole = quantity not in QUANTITIES or QUANTITIES[quantity].whole
    if of_whole and quantity != "stiffness_range":
        raise InputError(f"{where}: 'segment' has no meaning, since a {quantity} is not that of one segment")
    return fields.whole(entry, "segment", 1, 1, min(len(plan.tables) for plan in plans), where)


def _check_plans(quantity: str, plans: Sequence[Plan], where: str) -> None:
    """Check that every design has a quantity; a stiffness range is one of bending stiffnesses."""
    kind = QUANTITIES["bending_stiffness" if quantity == "stiffness_range" else quantity]
    for plan in plans:
        name = plan.tables[0].name
        if kind.springs and not plan.springs:
            raise InputError(f"{where}: {quantity} is one of springs, but {name!r} has none")
        if kind.planar and any(pj.layout(t).bending_plane is None for t in plan.tables):
            raise InputError(f"{where}: {quantity} needs bending in a plane, but {name!r} bends freely")
        if quantity in ROUND_ONLY:
            body = build_body(plan, {}, plan.materials())
            if not all(all(isinstance(s, Disc) for s in a.section.shapes) for a in body.segments):
                raise InputError(f"{where}: {quantity} is one of round tubes, but {name!r} is none")


def read_constraints(
    table: Any, states: Mapping[str, State], plans: Sequence[Plan], path: Path
) -> tuple[Constraint, ...]:
    """Constraints in the order of the file; one with both limits becomes two.

    Raises:
        InputError: one line, as `read_objectives`, and for a limit that is missing or impossible.
    """
    found: list[Constraint] = []
    for name, entry in fields.table_of(table, f"{path}: [constraint]").items():
        where = f"{path}: [constraint.{name}]"
        found += _constraint(name, fields.table_of(entry, where), states, plans, path, where)
    return tuple(found)


def _constraint(
    name: str, entry: fields.Table, states: Mapping[str, State], plans: Sequence[Plan], path: Path, where: str
) -> list[Constraint]:
    quantity = fields.word(entry, "quantity", [*QUANTITIES, "function"], where)
    users = quantity == "function"
    check_keys(entry, (*_CONSTRAINT, *(_FUNCTION if users else ())), where)
    dimension, unit = _dimension(quantity, entry, where)
    limits = [key for key in ("at_most", "at_least") if key in entry]
    if not limits:
        raise InputError(f"{where}: a limit is missing: 'at_most' or 'at_least'")
    if not users:
        _check_plans(quantity, plans, where)
    if "states" in entry and (users or quantity in SAME_IN_EVERY_STATE):
        why = "a function gets all states" if users else f"{quantity} is the same in every state"
        raise InputError(f"{where}: 'states' has no meaning, since {why}")
    names = fields.names_of(entry["states"], f"{where}: states") if "states" in entry else ()
    _check_states(names, states, where)
    values, found = {}, []
    for key in limits:
        limit, own = _limit(entry[key], quantity, key, dimension, f"{where}: {key}")
        values[key] = limit
        found.append(
            Constraint(
                name=name if len(limits) == 1 else f"{name} ({key.replace('_', ' ')})",
                quantity=quantity,
                most=key == "at_most",
                limit=limit,
                states=names,
                segment=_segment(entry, quantity, plans, where),
                file=fields.code_of(entry, path.parent, where) if users else None,
                function=_function(entry, name, where),
                unit=own or unit,
            )
        )
    if len(limits) == 2 and None not in values.values() and values["at_least"] > values["at_most"]:
        raise InputError(f"{where}: bounds are crossed: at least is more than at most")
    return found


def _limit(value: Any, quantity: str, key: str, dimension: str, where: str) -> tuple[float | None, str]:
    if value != "tested":
        return fields.quantity(value, dimension, where)
    kind = QUANTITIES.get(quantity)
    if kind is None or kind.tested is None:
        have = [name for name, q in QUANTITIES.items() if q.tested]
        raise InputError(f"{where}: {quantity} has no range that was tested; {', '.join(have)} have")
    if (key == "at_least") != (quantity == "silicone_strain_min"):
        raise InputError(f"{where}: 'tested' is the other end of {quantity}")
    return None, ""
