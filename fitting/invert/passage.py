"""A chain in a lumen: as close to the centre line as it can be, without touching the lumen's wall."""

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.design.bodies import Body, Solved
from fitting.design.log import Evaluation
from fitting.design.optimise import ALLOWED, Ends, Outcome, Problem, best_of, optimise
from fitting.design.quantities import QUANTITIES
from fitting.inference.results import Result
from pneusma_jax.errors import InputError
from pneusma_jax.late import Late
from pneusma_jax.numerics.rows import filled
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.kinematics import arc_points
from pneusma_jax.serial_chain.segments import chain_shape
from pneusma_jax.units import from_si

from .electrical import electrical
from .forward import Memories, first_guess, fresh, state_of
from .lumen import Lumen, distances, progress, refined
from .run import Inverse
from .search import Box
from .tables import Table, looked_up
from .touching import Touch, held_drives, touch_of

stats = Late("scipy.stats")

POINTS = 12
"""Number of points on every segment whose clearance is constrained: 5 mm apart on a segment of 56 mm."""
STARTS = 8
"""Number of starting points of the search, and of evaluations side by side."""
IN_TABLES = 12
"""Number of starting points where tables of the segments make an evaluation cheap."""
CORRECTIONS = 3
"""Maximum of times that the clearance is widened by what the exact model lacks."""
ENDS = Ends(precision=1e-5)
"""Stopping rule of a search. The objective is a mean square distance in radii of the tube, so 1e-5 is 0.02 mm
for a tube of 10 mm. Smallest distances have kinks, on which an exact search goes to and fro."""
REACH = 10.0
"""Weight of the square of the share of the lumen beyond the tip [1]. A tenth of the lumen counts as much as a
mean distance of a third of the tube's radius. With a weight of 1 a chain shortened until it fitted: of
a gentle lumen of 230 mm it left 72 mm."""
CLOSE = 1e-6
"""Distance up to which a wanted clearance counts as kept [m]."""
AT_THE_END = 1e-3
"""Distance from a lumen's end at which a tip counts as there [m]."""
PICKED = 8_000
"""Number of states of the atlas that are compared with the line; the search starts from the nearest ones."""


@dataclass(frozen=True)
class Passage(Result):
    """A chain in a lumen.

    Attributes:
        design: name of the chain.
        lumen: the lumen.
        springs: segment and number of every spring.
        pressure: gauge pressure [Pa]; fractions: martensite fractions of all springs [1].
        resistances: [ohm]; currents: those that hold them in still air of 22 degC [A]; shape (springs,).
        offset: root mean square distance of the chain's centre line from the lumen's [m].
        clearance: least distance between the walls [m], negative where they would overlap.
        wanted: least distance to keep [m].
        reached: distance along the lumen to the tip [m].
        line: points of the chain's centre line [m], shape (points, 3).
        solved: the solved state of the chain.
        touch: where it comes nearest to the wall.
        apart: least distance between parts of the chain itself [m].
        held: ends of the drives that keep it from more room, in words; empty where it passes, or where none
            does.
        alone: true for a single actuator.
    """

    design: str
    lumen: Lumen
    springs: tuple[tuple[int, int], ...]
    pressure: float
    fractions: np.ndarray
    resistances: np.ndarray
    currents: np.ndarray
    offset: float
    clearance: float
    wanted: float
    reached: float
    line: np.ndarray
    solved: Solved
    touch: Touch
    apart: float = np.inf
    held: str = ""
    alone: bool = False

    @property
    def to_the_end(self) -> bool:
        """True if the tip gets to the end of the lumen."""
        return self.reached >= float(self.lumen.lengths[-1]) - AT_THE_END

    @property
    def passes(self) -> bool:
        """True if the body keeps the wanted distance from the wall as far as it reaches, and does not touch
        itself."""
        return self.clearance >= self.wanted - CLOSE and self.apart >= -CLOSE


class _Task(eqx.Module):
    """The task of passing a lumen.

    Attributes:
        body, box, memories: the driven body, the box of its drives, and the memories of its springs.
        line: points and diameters of the lumen [m].
        clearance: least distance to keep between the walls [m].
        tables: tables of the segments of a chain without loads, or None.
    """

    body: Body
    box: Box
    memories: Memories
    line: tuple[Array, Array]
    clearance: Array
    tables: tuple[Table, ...] | None

    def state(self, place: Array) -> Solved:
        """State at a place in the box; from tables it has a shape and no segments."""
        x = self.box.drives(place)
        if self.tables is None:
            return state_of(self.body, x[0], x[1:], self.memories, first_guess(self.body))
        found = looked_up(self.tables, x)
        shape = chain_shape(self.body.chain, found[:, :2], found[:, 2])
        return Solved(self.body, x[0], (), shape.end_pose, pj.ChainEquilibrium((), shape))


def _left(end_pose: Array, line: Array) -> Array:
    """Share of a centre line that lies beyond a tip [1]."""
    whole = jnp.sum(jnp.linalg.norm(jnp.diff(line, axis=0), axis=1))
    return 1.0 - progress(end_pose[:3, 3], line) / whole


def _numbers(task: _Task, place: Array) -> Array:
    """Two objectives, then the constraints, in radii of the tube [1].

    The objectives are the mean square distance and the square of what the tip lacks to the lumen's end. The
    constraints are violations of the clearances to the lumen and of the chain to itself.
    """
    radius = jnp.max(jnp.stack([s.section.radius for s in task.body.segments]))
    solved = task.state(place)
    away, room = distances(_line(solved), task.line)
    own = QUANTITIES["clearance"].function(solved, 0)
    left = _left(solved.end_pose, task.line[0])
    return jnp.concatenate(
        [
            (jnp.mean(away**2) / radius**2 + REACH * left**2)[None],
            (away + radius + task.clearance - room) / radius,
            -own[None] / radius,
        ]
    )


@stored_jit()
def _evaluated(task: _Task, places: Array) -> tuple[Array, Array]:
    """The numbers and their exact derivatives; one program for all lumens of as many points."""

    def one(place: Array) -> tuple[Array, Array]:
        push = lambda tangent: jax.jvp(lambda u: _numbers(task, u), (place,), (tangent,))  # noqa: E731
        return jax.vmap(push, out_axes=(None, 1))(jnp.eye(place.size))

    return jax.lax.map(one, places, batch_size=STARTS)


@dataclass(frozen=True)
class _Numbers:
    """Evaluates places for the optimiser."""

    task: _Task

    def __call__(self, places: list[np.ndarray]) -> list[Evaluation]:
        size = -(-len(places) // STARTS) * STARTS
        found = [np.asarray(x) for x in _evaluated(self.task, jnp.asarray(filled(np.stack(places), size)))]
        return [Evaluation(np.array(p), found[0][k], found[1][k]) for k, p in enumerate(places)]


def _line(solved: Solved) -> Array:
    """Points along a chain [m]."""
    if solved.chain is not None:
        return solved.chain.shape.polyline(POINTS)
    one = solved.only
    share = jnp.linspace(0.0, 1.0, POINTS)
    return arc_points(one.bend, one.length, share)


def pass_through(inverse: Inverse, lumen: Lumen, clearance: float = 0.0) -> Passage:
    """Drives that keep a chain along a lumen.

    SLSQP minimises two terms from several starts. One is the mean square distance of the centre lines, in
    radii of the tube. The other is the square of the share of the lumen beyond the tip. The clearances of all
    points are inequalities. Where they cannot be kept, the least overlap is looked for. A chain without loads
    is searched in tables of its segments; what is reported is the exact model's.

    Args:
        inverse: inverse of a chain, or of one actuator.
        lumen: lumen to pass through; the chain begins at its first point, along z.
        clearance: least distance to keep between the walls [m].

    Raises:
        InputError: if the clearance is at least half of the lumen's width, or the lumen is narrower than the
            body where it begins or all along. Also if the chain is longer than the lumen in every state, or
            nothing can be computed.
    """
    widest = float(lumen.diameter.max())
    if 2.0 * clearance >= widest:
        raise InputError(
            f"{lumen.name}: no chain keeps {from_si(clearance, 'mm'):g} mm from the wall, since the lumen is "
            f"at most {from_si(widest, 'mm'):g} mm wide"
        )
    _check_wide(inverse, lumen)
    _check_long(inverse, lumen)
    searches = inverse.by_tables
    tables = None if searches is None else searches.tables
    line = tuple(jnp.asarray(x) for x in refined(lumen))
    task = _Task(inverse.body, inverse.box(), fresh(inverse.body), line, jnp.asarray(clearance), tables)
    starts = _starts(inverse, line, STARTS if tables is None else IN_TABLES)
    best = _searched(task, starts)
    if best.evaluation is None:
        raise InputError(f"{lumen.name}: no state of {inverse.design} could be computed from any start")
    found = _passage(inverse, lumen, clearance, line, best.evaluation)
    for _ in range(CORRECTIONS if tables is not None and best.kept else 0):
        short = clearance - found.clearance
        if short <= CLOSE:
            break
        # the tables promise more room than the exact model has
        wider = eqx.tree_at(lambda t: t.clearance, task, task.clearance + 1.1 * short)
        again = _searched(wider, [best.evaluation.place])
        task, new = wider, _passage(inverse, lumen, clearance, line, again.evaluation)
        best, found = (again, new) if new.clearance > found.clearance else (best, found)
    return found


def _searched(task: _Task, starts: list[np.ndarray]) -> Outcome:
    """The best of all starts: close to the line with the clearances kept, else with the least overlap."""
    evaluate = _Numbers(task)
    size = evaluate(starts[:1])[0].values.size
    rows = np.arange(1, size)
    problem = Problem(np.eye(size)[0], rows, np.zeros(rows.size), np.ones(rows.size))
    outcomes: list[Outcome] = optimise([problem] * len(starts), starts, evaluate, ends=ENDS)
    best = best_of(outcomes)
    if not best.kept:
        slack = Problem(np.eye(size)[0], rows, np.zeros(rows.size), np.ones(rows.size), slack=True)
        best = best_of(optimise([slack] * len(starts), starts, evaluate, ends=ENDS))
        if best.objective <= ALLOWED:  # it can be kept after all: from there
            again = optimise([problem], [best.evaluation.place], evaluate, ends=ENDS)
            best = best_of([*again, *([] if best_of(again).kept else [best])])
    return best


def _passage(
    inverse: Inverse, lumen: Lumen, wanted: float, line: tuple[Array, Array], one: Evaluation
) -> Passage:
    """The passage of a place in the box, on the exact model."""
    drives = np.asarray(inverse.box().drives(jnp.asarray(one.place)))
    row = inverse.verified(drives[None])
    resistances, currents = electrical(row)
    state = Solved(inverse.body, *jax.tree.map(lambda x: x[0], row.parts))
    drawn = np.asarray(_line(state))
    away, room = distances(jnp.asarray(drawn), line)
    gaps = np.asarray(room - away) - max(float(s.section.radius) for s in inverse.body.segments)
    found = Passage(
        inverse.design, lumen, inverse.springs, float(drives[0]), drives[1:], resistances[0], currents[0],
        float(np.sqrt(np.mean(np.asarray(away) ** 2))), float(np.min(gaps)), wanted,
        float(progress(state.end_pose[:3, 3], line[0])), drawn, state,
        touch_of(drawn, gaps, line[0], len(inverse.body.segments), wanted - CLOSE),
        float(QUANTITIES["clearance"].function(state, 0)), alone=inverse.body.chain is None,
    )  # fmt: skip
    if found.passes:
        return found
    return replace(found, held=inverse.bound_words(*held_drives(one, np.arange(1, one.values.size))))


def _check_wide(inverse: Inverse, lumen: Lumen) -> None:
    """Refuse a lumen that no drive lets the body into: it is narrower than the body where it begins, or all
    along.

    Raises:
        InputError: with both diameters.
    """
    sizes = [2.0 * float(segment.section.radius) for segment in inverse.body.segments]
    first, widest = float(lumen.diameter[0]), float(lumen.diameter.max())
    body, wide, where = sizes[0], first, "where it begins"
    if first >= sizes[0]:
        body, wide, where = max(sizes), widest, "at most"
    if wide < body:
        raise InputError(
            f"{lumen.name}: the lumen is {from_si(wide, 'mm'):.4g} mm wide {where}, but the body of "
            f"{inverse.design} has a diameter of {from_si(body, 'mm'):.4g} mm; no drive lets it in"
        )


def _check_long(inverse: Inverse, lumen: Lumen) -> None:
    """Refuse a lumen beyond whose end the chain reaches in every state, where nothing is said of the walls.

    Raises:
        InputError: with both lengths.
    """
    shortest = np.sum([np.nanmin(np.asarray(x.length)) for x in inverse.atlas.solved.segments])
    chain = inverse.body.chain
    shortest += 0.0 if chain is None else float(np.sum(chain.connectors))
    length, half = float(lumen.lengths[-1]), 0.5 * float(lumen.diameter[-1])
    if shortest > length + half:
        raise InputError(
            f"{lumen.name}: the lumen is {from_si(length, 'mm'):.4g} mm long, but {inverse.design} at least "
            f"{from_si(shortest, 'mm'):.4g} mm; of what lies beyond the lumen's end the file must tell, too"
        )


def _starts(inverse: Inverse, line: tuple[Array, Array], count: int) -> list[np.ndarray]:
    """Places in the box: states of the atlas that lie nearest to the line and reach far, and spread ones."""
    atlas, box = inverse.atlas, inverse.box()
    some = np.linspace(0, len(atlas.drives) - 1, min(PICKED, len(atlas.drives))).astype(int)
    part = jax.tree.map(lambda x: x[some], (atlas.solved.segments, atlas.solved.end_pose))
    away = np.asarray(_offsets(inverse.body, line, part))
    order = some[np.argsort(np.where(np.isfinite(away), away, np.inf))]
    places = [np.asarray(box.place(jnp.asarray(atlas.drives[k]))) for k in order[: count - 2]]
    even = stats.qmc.Sobol(len(places[0]), seed=np.random.default_rng(inverse.seed)).random(2)
    return [*(np.clip(p, 0.0, 1.0) for p in places), *even]


@stored_jit()
def _offsets(body: Body, line: tuple[Array, Array], states: tuple) -> Array:
    """Mean square distance of states from a line, and what the tip lacks to its end, as in `_numbers` [1]."""
    radius = jnp.max(jnp.stack([s.section.radius for s in body.segments]))

    def offset(segments: tuple, end_pose: Array) -> Array:
        if body.chain is None:
            points = _line(Solved(body, jnp.zeros(()), segments, end_pose, None))
        else:
            bends = jnp.stack([x.bend for x in segments])
            lengths = jnp.stack([x.length for x in segments])
            points = chain_shape(body.chain, bends, lengths).polyline(4)
        away = jnp.mean(distances(points, line)[0] ** 2)
        return away / radius**2 + REACH * _left(end_pose, line[0]) ** 2

    return jax.lax.map(lambda row: offset(*row), states, batch_size=256)
