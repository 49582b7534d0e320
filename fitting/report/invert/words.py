"""Sentences and tables of inversions, trajectories and passages."""

import numpy as np

from fitting.inference.notes import joined
from fitting.invert.goals import GOALS
from fitting.invert.passage import CLOSE, Passage
from fitting.invert.result import Inversion, spring_name
from fitting.invert.trajectory import Trajectory
from pneusma_jax.errors import counted
from pneusma_jax.units import UNITS, amount, from_si, to_si, unit_of_column, written

from ..cells import number
from ..table import Table

SHOWN = 20
"""Maximum number of targets in a table; `targets.csv` has all."""
HELD_BY_CURRENT = "The current holds the spring's temperature in still air of 22 degC."
NEAR_ZERO = 0.01
"""Maximum size of targets, over the largest value that is reached, that is near zero [1]."""
MEANT = 0.05
"""Minimum size of the same in a unit that may have been meant [1]."""
SAME = 5e-4
"""Difference of martensite fractions that is not told [1]: half of the last digit shown."""


def unit_of(column: str) -> str:
    """Unit of a column of targets. A direction is a pure number."""
    return "1" if column.startswith("direction") else unit_of_column(column)[1]


def _goals(result: Inversion) -> str:
    return joined([name.replace("_", " ") for name in result.goals])


def subtitle(result: Inversion) -> str:
    """Subtitle: targets and actuator."""
    count = result.met.size
    return f"Drives for {counted(count, 'target')} of {_goals(result)}"


def verdict(result: Inversion) -> list[str]:
    """Sentence on the number of targets that are met; for a single one, on its errors. Last, on springs that
    are left alone, and on fractions that no heating gives."""
    met, count = int(result.met.sum()), result.met.size
    springs = [*_near_zero(result), *_left_alone(result), *_without_heat(result)]
    if count > 1:
        return [f"{met} of {count} targets are met.", *springs]
    drives = f"Drives: {drive_words(result, 0)}."
    wanted, reached = value_words(result.goals, result.wanted[0]), value_words(result.goals, result.values[0])
    if met:
        return [f"The target is met: {wanted}.", drives, *_least_heat(result), *springs]
    if not np.isfinite(result.values[0]).all():
        return [f"The target is out of reach: {wanted}.",
                "The search ended where springs at rest find no equilibrium.", drives, *springs]  # fmt: skip
    return [f"The target is out of reach: {wanted}.", f"The nearest is {reached}: it misses "
            f"{missed_words(result, 0)}.", drives, f"It is held by: {result.held[0]}.", *_reaches(result),
            *springs]  # fmt: skip


def _reach(result: Inversion, name: str) -> str:
    """Range of a goal in words, such as `-93 to 93 1/m`."""
    unit = unit_of(GOALS[name].columns[0])
    ends = " to ".join(f"{from_si(end, unit):.3g}" for end in result.reach[name])
    return amount(ends, unit)


def _reaches(result: Inversion) -> list[str]:
    """Sentences on the ranges of a single target's goals, where nothing else says them."""
    if _near_zero(result):
        return []
    return [f"Within the limits {n.replace('_', ' ')} is {_reach(result, n)}." for n in result.reach]


def _near_zero(result: Inversion) -> list[str]:
    """Sentences on targets that are all near zero: the range of the goal, and units that may be meant."""
    said, at = [], 0
    for name in result.goals:
        columns = GOALS[name].columns
        largest = float(np.max(np.abs(result.wanted[:, at])))
        at += len(columns)
        if name not in result.reach:
            continue
        most = max(abs(end) for end in result.reach[name])
        if not 0.0 < largest < NEAR_ZERO * most:
            continue
        unit, goal = unit_of(columns[0]), name.replace("_", " ")
        number = from_si(largest, unit)
        which = "The target is" if result.met.size == 1 else f"All targets of {goal} are"
        said.append(
            f"{which} near zero: {goal} {amount(f'{number:.4g}', unit)}, and within the limits it is"
            f" {_reach(result, name)}."
        )
        if largest <= GOALS[name].tolerance and result.reach[name][0] <= 0.0:
            least = amount(f"{from_si(GOALS[name].tolerance, unit):.3g}", unit)
            said.append(f"Every {goal} below {least} counts as met, so that 0 meets it, too.")
        said += _meant(number, unit, goal, result.reach[name])
    return said


def _meant(number: float, unit: str, goal: str, reach: tuple[float, float]) -> list[str]:
    """Question whether a number is in another unit, in which it is well within reach."""
    alike = [u for u, one in UNITS.items() if one.dimension == UNITS[unit].dimension and u == written(u)]
    sizes = {u: float(to_si(number, u)) for u in alike}
    fits = [
        f"{number:.4g} {u} (a {goal} of {amount(f'{from_si(size, unit):.4g}', unit)})"
        for u, size in sizes.items()
        if max(MEANT * reach[1], reach[0]) <= size <= reach[1]
    ]
    return [f"Was {joined(fits, 'or')} meant?"] if fits else []


def value_words(goals: tuple[str, ...], row: np.ndarray, named: bool = True) -> str:
    """Values of goals in words, such as `curvature 40 1/m` or `tip 40, 30, 150 mm`.

    Args:
        goals: names; row: their values in SI, shape (columns,).
        named: false to leave out the names.
    """
    words, at = [], 0
    for name in goals:
        columns = GOALS[name].columns
        unit = unit_of(columns[0])
        values = from_si(np.asarray(row[at : at + len(columns)]), unit)
        shown = ", ".join(f"{round(float(x), 9) + 0.0:.4g}" if np.isfinite(x) else "none" for x in values)
        name = f"{name.replace('_', ' ')} " if named else ""
        words.append(amount(f"{name}{shown}", unit))
        at += len(columns)
    return joined(words)


def _least_heat(result: Inversion) -> list[str]:
    """Sentence on the heat of a single target's drives, where there are other ways."""
    count = len(result.ways[0]) + 1
    if count == 1 or not result.springs:
        return []
    return [f"They need {result.heat[0]:.3g} W of heat, the least of the {count} ways that were found."]


def _left_alone(result: Inversion) -> list[str]:
    """Sentence on the fraction of springs that no drive names."""
    alone = result.fractions >= result.left_alone - SAME
    fractions = result.left_alone[alone.any(axis=0)]
    if not fractions.size:
        return []
    where = joined(sorted({f"{x:.3f}" for x in fractions}))
    natural = np.all(fractions <= result.unheated[alone.any(axis=0)] + SAME)
    why = ", their fraction without a current in air of 22 degC" if natural else ""
    return [f"Springs that are not named stay at {where}{why}."]


def _without_heat(result: Inversion) -> list[str]:
    """Sentence on fractions above that of a spring without a current, which is not quite 1."""
    above = (result.fractions > result.unheated + SAME) & (result.fractions < 1.0 - SAME)
    rows, springs = np.flatnonzero(above.any(axis=1)), np.flatnonzero(above.any(axis=0))
    if not rows.size:
        return []
    if result.met.size == 1:
        what = joined([f"xi0_{result.spring_name(j)} {result.fractions[0, j]:.3f}" for j in springs])
    else:
        names = joined([f"xi0_{result.spring_name(j)}" for j in springs])
        what = f"{names} of {counted(rows.size, 'target')}"
    air = joined(sorted({f"{result.unheated[j]:.3f}" for j in springs}))
    return [f"No heating gives {what}: a spring without a current is at {air} in air of 22 degC, and what "
            "lies between that and 1 needs cooling or less stress."]  # fmt: skip


def misses_of(result: Inversion, k: int) -> list[tuple[str, float, str]]:
    """Distance from every goal of a target: name, value and unit."""
    found = []
    for name, miss in result.misses.items():
        if name == "direction":  # the miss is the chord between two unit vectors
            found.append((name, float(np.degrees(2.0 * np.arcsin(min(0.5 * miss[k], 1.0)))), "deg"))
        else:
            unit = unit_of(GOALS[name].columns[0])
            found.append((name, float(from_si(miss[k], unit)), unit))
    return found


def missed_words(result: Inversion, k: int) -> str:
    """Distances from those goals of a target that are missed by more than counts as met, in words."""
    words = []
    for name, value, unit in misses_of(result, k):
        if result.misses[name][k] > GOALS[name].tolerance:
            size = f"{value:.3g}" if value < 1e3 else f"{value:.0f}"
            words.append(f"{name.replace('_', ' ')} by {size} {written(unit)}")
    return joined(words)


def drive_words(result: Inversion, k: int) -> str:
    """Drives of one target, in words."""
    springs = heated_words(result, result.fractions[k])
    pressure = f"{from_si(result.pressure[k], 'kPa'):.3f} kPa"
    return f"{pressure}, {springs or 'no spring heated'}" if result.springs else pressure


def heated_words(result: Inversion, fractions: np.ndarray) -> str:
    """Martensite fractions of the springs that are not left alone, in words."""
    heated = np.flatnonzero(fractions < result.left_alone - SAME)
    pairs = [f"xi0_{result.spring_name(j)} {fractions[j]:.3f}" for j in heated]
    return ", ".join(pairs)


def target_table(result: Inversion, time: np.ndarray | None = None) -> Table:
    """Table of every target with its drives and its result."""
    clock = [] if time is None else ["time [s]"]
    rows = []
    for k in range(min(result.met.size, SHOWN)):
        outcome = "met" if result.met[k] else f"misses {missed_words(result, k)}"
        outcome = outcome if np.isfinite(result.values[k]).all() else "no equilibrium"
        at = [] if time is None else [number(time[k])]
        pressure, springs = f"{from_si(result.pressure[k], 'kPa'):.3f}", result.fractions[k]
        named = len(result.goals) > 1
        ends = [value_words(result.goals, row[k], named) for row in (result.wanted, result.values)]
        drives = [pressure, heated_words(result, springs)]
        rows.append([str(k + 1), *at, *ends, *drives, outcome, result.held[k]])
    more = result.met.size - SHOWN
    note = f"{more} more are in targets.csv." if more > 0 else ""
    header = ["target", *clock, "wanted", "reached", "pressure [kPa]", "heated springs", "result", "held by"]
    return Table(header, rows, note)


def spring_table(result: Inversion) -> Table:
    """Table of the resistance and the current that hold every heated spring."""
    rows = []
    for k in range(min(result.met.size, SHOWN)):
        for j in np.flatnonzero(result.fractions[k] < result.left_alone - SAME):
            electrical = (result.resistances[k, j], result.currents[k, j])
            rows.append([str(k + 1), result.spring_name(j), *(number(x, ".4g") for x in electrical)])
    header = ["target", "spring", "resistance [ohm]", "current [A]"]
    return Table(header, rows, HELD_BY_CURRENT)


def way_table(result: Inversion) -> Table:
    """Table of other solutions for each target."""
    rows = [
        [
            str(k + 1),
            f"{from_si(drives[0], 'kPa'):.3f}",
            heated_words(result, drives[1:]),
            number(watts, ".3g"),
        ]
        for k, (ways, heat) in enumerate(zip(result.ways, result.way_heat, strict=True))
        for drives, watts in zip(ways, heat, strict=True)
    ]
    note = "The answer needs the least heat of all ways that were found, to 1 %." if rows else ""
    return Table(["target", "pressure [kPa]", "heated springs", "heat [W]"], rows, note)


def agreement(result: Trajectory) -> str:
    """Sentence on the agreement of the search's model with the exact history."""
    return f"The exact history agrees with the search to {result.disagreement:.2g} of a goal's size."


def passage_verdict(result: Passage) -> list[str]:
    """Sentences on a body in a lumen, where it is tightest, how far it gets, and on its drives."""
    springs = [f"xi0_{spring_name(result.springs, k)} {x:.3f}" for k, x in enumerate(result.fractions)]
    pressure = f"{from_si(result.pressure, 'kPa'):.3f} kPa"
    return [
        f"{result.lumen.name}, tortuosity {result.lumen.tortuosity:.3f}: the "
        f"{'actuator' if result.alone else 'chain'} {_fit_words(result)}.",
        *([] if result.passes else _held_words(result)),
        f"Its centre line is {from_si(result.offset, 'mm'):.2f} mm from the lumen's (root mean square).",
        _reach_words(result),
        f"Drives: {', '.join([pressure, *springs])}.",
    ]


def _fit_words(result: Passage) -> str:
    """How much room there is, or by how much and where it lacks."""
    gap = from_si(result.clearance, "mm")
    at = f"at {from_si(result.touch.along, 'mm'):.0f} mm along the lumen"
    at += "" if result.alone else f" (segment {result.touch.segment})"
    if result.passes:
        how = "passes" if result.to_the_end else "fits as far as it reaches,"
        return f"{how} with {gap:.2f} mm to the wall, least {at}"
    if result.clearance >= result.wanted - CLOSE:
        return f"does not fit: it overlaps itself by {-from_si(result.apart, 'mm'):.2f} mm"
    how = f"overlaps the wall by {-gap:.2f} mm" if gap < 0.0 else f"comes within {gap:.2f} mm of the wall"
    wider = 2.0 * from_si(result.wanted - result.clearance, "mm")
    return f"does not fit: it {how}, most {at}; a lumen {wider:.2f} mm wider would let it"


def _reach_words(result: Passage) -> str:
    """How far the tip gets, and which part of the lumen is beyond it."""
    tip, end = (from_si(x, "mm") for x in (result.reached, float(result.lumen.lengths[-1])))
    if result.to_the_end:
        return f"Its tip is at the lumen's end, {end:.0f} mm along it."
    beyond = f"Nothing is said of the {end - tip:.0f} mm beyond."
    return f"Its tip is at {tip:.0f} of the lumen's {end:.0f} mm. {beyond}"


def passage_table(result: Passage) -> Table:
    """Table of every spring: fraction, resistance and current."""
    rows = [
        [spring_name(result.springs, k), *(number(x, ".4g") for x in values)]
        for k, values in enumerate(zip(result.fractions, result.resistances, result.currents, strict=True))
    ]
    header = ["spring", "martensite fraction [1]", "resistance [ohm]", "current [A]"]
    return Table(header, rows, HELD_BY_CURRENT)


def _held_words(result: Passage) -> list[str]:
    """Every stretch that is too near to the wall, and the bounds that keep the chain there."""
    parts = [f"{a:.0f}" if b - a < 0.5 else f"{a:.0f} to {b:.0f}" for a, b in 1e3 * result.touch.stretches]
    short = "It touches" if result.wanted <= 0.0 else "It is too near to the wall"
    near = [f"{short} at {joined(parts)} mm along the lumen."] if parts else []
    if result.held:
        return [*near, f"This is the least that was found. It is held by: {result.held}."]
    why = "where it is tightest, no drive gives room without taking it elsewhere"
    return [*near, f"This is the least that was found. No bound holds it: {why}."]
