"""What can be made: ends of ranges at which nothing can, and constraints that keep a search to what can.

A traced program does not refuse impossible dimensions. So where the box holds some, such as turns that
overlap, what forbids them becomes a constraint like those of the user.
"""

import itertools
from collections.abc import Sequence

import numpy as np

import pneusma_jax as pj
from pneusma_jax.actuator import SLACK
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.calibration import Calibration
from pneusma_jax.errors import InputError
from pneusma_jax.late import Late
from pneusma_jax.nitinol.geometry import OVERLAP
from pneusma_jax.units import amount, from_si

from .bodies import Plan, sizes_of
from .space import Space
from .study import Constraint, Free

optimize = Late("scipy.optimize")

MOST_CORNERS = 256
"""Maximum number of combinations of the other parameters' ends that are tried for an end: all of eight."""
MOST_CORNERS_OF_ALL = 4 * MOST_CORNERS
"""Maximum number of combinations of all parameters' ends for the least values of a box: all of ten."""
MOST_BETWEEN = 64
"""Maximum number of combinations with middles of ranges that are tried for an end after those."""
MOST_STEPS = 50
"""Maximum number of SLSQP's steps towards the place with most room. Chosen: its answer is checked anyway."""

LEAST_BORE = 1e-4
"""Minimum diameter of a bore that can be made [m]. It is chosen, not measured."""
LIMITS = {
    "pitch_ratio": ("turns do not overlap", 1.0 - OVERLAP, "1"),
    "stretch_ratio": ("springs are no longer than their place", 1.0 - SLACK, "1"),
    "bore_diameter": ("the wall leaves a bore", LEAST_BORE, "mm"),
}
"""Name of the constraint, least value [SI] and unit, by quantity."""
LIMITED_DIMENSIONS = (
    "wire_diameter", "initial_pitch", "active_coils", "free_length", "attached_length", "length",
    "outer_diameter", "wall_thickness",
)  # fmt: skip
"""Dimensions on which these quantities depend."""

Reasons = dict[tuple, str]
"""Reasons why segments cannot be made, empty for those that can, by plan and dimensions."""
Values = dict[tuple, dict[str, float]]
"""Values of the quantities that `LIMITS` names, by plan, table and dimensions of a segment."""


def implied(space: Space, plans: Sequence[Plan]) -> tuple[Constraint, ...]:
    """Constraints without which the box would hold designs that cannot be made.

    Args:
        space: box of the free parameters.
        plans: plans of every combination of choices.
    """
    some = [k for k, one in enumerate(space.free) if one.name.rpartition(".")[2] in LIMITED_DIMENSIONS]
    some.sort(key=lambda k: space.names[k])  # so that their order in the file makes no difference
    if not some:
        return ()
    least: dict[str, float] = {}
    known: Values = {}
    for corner in corners(len(some), MOST_CORNERS_OF_ALL):
        place = np.full(len(space), 0.5)
        place[some] = corner
        sizes = {name: float(x) for name, x in space.parameters(place).items()}
        for plan in plans:
            for name, value in _least_values(plan, sizes, known).items():
                least[name] = min(value, least.get(name, np.inf))
    everywhere = set.intersection(*(set(_least_values(plan, {}, known)) for plan in plans))
    return tuple(
        Constraint(LIMITS[name][0], name, False, LIMITS[name][1], unit=LIMITS[name][2])
        for name in LIMITS
        if name in everywhere and least[name] < LIMITS[name][1]
    )


def _least_values(plan: Plan, sizes: dict[str, float], known: Values) -> dict[str, float]:
    """Least values over the segments of the quantities that `LIMITS` names, where all segments have them."""
    found = _values_by_segment(plan, sizes, known)
    return {name: min(values) for name, values in found.items() if len(values) == len(plan.tables)}


def _values_by_segment(plan: Plan, sizes: dict[str, float], known: Values) -> dict[str, list[float]]:
    """Values of the quantities that `LIMITS` names in every segment that has them."""
    found: dict[str, list[float]] = {}
    for k, table in enumerate(plan.tables, 1):
        own = {n: x for n, x in sizes_of(sizes, k).items() if n in GEOMETRY_KEYS}
        # segments may be alike; the plans outlive this table, so that none takes the identity of another
        key = (id(plan), table.name, *sorted(own.items()))
        if key not in known:
            known[key] = _of_segment(table, own)
        for name, value in known[key].items():
            found.setdefault(name, []).append(value)
    return found


def _of_segment(table: Calibration, own: dict[str, float]) -> dict[str, float]:
    """Those of the quantities that `LIMITS` names which a segment of these dimensions has."""
    geometry, found = pj.design_geometry(table, **own), {}
    size = lambda name: float(getattr(geometry, name))  # noqa: E731
    if pj.layout(table).spring_numbers:
        found["pitch_ratio"] = size("initial_pitch") / size("wire_diameter")
        found["stretch_ratio"] = size("attached_length") / size("free_length")
    if "outer_diameter" in table.quantities:
        found["bore_diameter"] = size("outer_diameter") - 2.0 * size("wall_thickness")
    return found


def check_ends(space: Space, drives: Sequence[str], plans: Sequence[Plan], path: str) -> None:
    """Refuse an end of a range at which no design can be made, wherever the other parameters are.

    Args:
        space: box of the free parameters.
        drives: names of those that are drives of states and no dimensions.
        plans: plans of every combination of choices; an end is refused if none of them can be made there.
        path: path of the file, for messages.

    Raises:
        InputError: naming the parameter, its end and what is impossible.
    """
    sizes = [k for k, one in enumerate(space.free) if one.name not in drives]
    tried: Reasons = {}
    for end in (0.0, 1.0):  # where both these corners can be made, no end is impossible
        if _impossible(space, plans, np.full(len(space), end), tried):
            break
    else:
        return
    for k in sizes:
        others = [j for j in sizes if j != k]
        for end in (0.0, 1.0):
            reason = _never_possible(space, plans, k, end, others, tried)
            if reason:
                one = space.free[k]
                raise InputError(
                    f"{path}: [free] {one.name}: nothing can be made {_end_in_words(one, end)}: {reason}"
                )


def _end_in_words(one: Free, end: float) -> str:
    """An end of a parameter's range, or of its catalogue, as the end of a sentence."""
    if one.made != "catalogue":
        return f"at the {'upper' if end else 'lower'} end of its range"
    value = from_si(max(one.values) if end else min(one.values), one.unit)
    size = amount(f"{value:.6g}", one.unit)
    return f"with {size}, the {'largest' if end else 'smallest'} of its values"


def corners(count: int, most: int) -> np.ndarray:
    """Combinations of the ends of parameters, 0 or 1 each, in a seeded random order.

    Args:
        count: number of parameters.
        most: even maximum of combinations. Where there are more, as many random ones are taken, each with
            its opposite: so every parameter is at both of its ends equally often.

    Returns:
        Shape (combinations, count).
    """
    random = np.random.default_rng(0)
    if 2**count <= most:
        return random.permutation(np.array(list(itertools.product((0.0, 1.0), repeat=count))))
    half = random.integers(0, 2, (most // 2, count)).astype(float)
    return np.concatenate([half, 1.0 - half])


def _with_middles(count: int, most: int) -> np.ndarray:
    """Combinations of ends and middles, at least one of them a middle; random where there are more."""
    parts = (0.0, 0.5, 1.0)
    if 3**count <= most:
        some = np.array(list(itertools.product(parts, repeat=count)))
    else:
        some = np.random.default_rng(1).choice(parts, (most, count))
    return some[np.any(some == 0.5, axis=1)]


def _never_possible(
    space: Space, plans: Sequence[Plan], k: int, end: float, others: list[int], tried: Reasons
) -> str:
    """Reason why nothing can be made at an end of a parameter, by the last place; empty if something can.

    Args:
        space: box of the free parameters.
        plans: plans of every combination of choices.
        k, end: index of the parameter, and its end, 0 or 1.
        others: indices of the other dimensions.
        tried: what was tried, which grows.
    """
    others = sorted(others, key=lambda j: space.names[j])  # their order in the file makes no difference
    many = 2 ** len(others) > MOST_CORNERS
    if many:  # the one combination that can be made may not be among the random ones
        for plan in plans:
            if not _impossible(space, [plan], _with_most_room(space, plan, k, end, others), {}):
                return ""
    reason = ""
    for corner in (*corners(len(others), MOST_CORNERS), *_with_middles(len(others), MOST_BETWEEN)):
        place = np.full(len(space), 0.5)
        place[others], place[k] = corner, end
        reason = _impossible(space, plans, place, tried)
        if not reason:
            return ""
    where = f" (so it is at all of {MOST_CORNERS} random combinations of the others' ends)"
    return reason + where if many else reason


def _with_most_room(space: Space, plan: Plan, k: int, end: float, others: list[int]) -> np.ndarray:
    """Place in the box at which all segments of a plan are as far within `LIMITS` as they can be.

    The least room is maximised by SLSQP from the middle of the box, every segment's quantity a constraint.
    The quantities are ratios and differences of dimensions, and rise or fall with each of them all along.

    Args:
        space: box of the free parameters.
        plan: tables of a combination of choices.
        k, end: parameter that is held at an end; others: indices of the other dimensions.
    """

    known: Values = {}

    def at(x: np.ndarray) -> np.ndarray:
        place = np.full(len(space), 0.5)
        place[others], place[k] = np.clip(x[:-1], 0.0, 1.0), end
        return place

    def room(x: np.ndarray) -> np.ndarray:
        sizes = {name: float(value) for name, value in space.parameters(at(x)).items()}
        found = _values_by_segment(plan, sizes, known)
        parts = [np.array(values) / LIMITS[name][1] - 1.0 for name, values in found.items()]
        return np.concatenate([*parts, [1.0]]) - x[-1]

    middle = np.append(np.full(len(others), 0.5), 0.0)
    middle[-1] = np.min(room(middle))  # the last unknown is the least room, which all constraints reach
    ended = optimize.minimize(
        lambda x: -x[-1], middle, bounds=[(0.0, 1.0)] * len(others) + [(None, None)], method="SLSQP",
        constraints=[{"type": "ineq", "fun": room}], options={"maxiter": MOST_STEPS},
    )  # fmt: skip
    return at(ended.x)


def _impossible(space: Space, plans: Sequence[Plan], place: np.ndarray, tried: Reasons) -> str:
    """Reason why no plan can be made at a place in the box; empty if one can."""
    sizes = {name: float(x) for name, x in space.parameters(place).items()}
    reason = ""
    for number, plan in enumerate(plans):
        for k, table in enumerate(plan.tables, 1):
            own = sizes_of(sizes, k)
            key = (number, table.name, *sorted(own.items()))  # segments may be alike
            if key not in tried:
                tried[key] = _why_not(plan, table, own)
            if tried[key]:
                reason = tried[key]
                break
        else:
            return ""
    return reason


def _why_not(plan: Plan, table: Calibration, own: dict[str, float]) -> str:
    """Reason why a segment of these dimensions cannot be made; empty if it can."""
    try:
        pj.make_actuator(table, plan.alloy, plan.silicone, **own)
    except ValueError as error:
        return str(error).removeprefix("Argument ").rstrip(".")
    return ""
