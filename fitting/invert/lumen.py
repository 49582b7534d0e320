"""A chain in a lumen: as close to the centre line as it can be, without touching the lumen's wall."""

import csv
from dataclasses import dataclass
from pathlib import Path

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
from pneusma_jax.units import to_si, unit_of_column

from .csv_file import number, records
from .forward import Memories, first_guess, fresh, state_of
from .run import Inverse
from .search import Box

stats = Late("scipy.stats")

POINTS = 12
"""Number of points on every segment whose clearance is constrained: 5 mm apart on a segment of 56 mm."""
STARTS = 8
"""Number of starting points of the search."""
ENDS = Ends(precision=1e-5)
"""Stopping rule of a search. The objective is a mean square distance in radii of the tube, so 1e-5 is 0.02 mm
for a tube of 10 mm. Smallest distances have kinks, on which an exact search goes to and fro."""
PICKED = 8_000
"""Number of states of the atlas that are compared with the line; the search starts from the nearest ones."""


@dataclass(frozen=True)
class Lumen:
    """A tube to pass through, in the frame of the chain's base: z along the straight chain.

    Attributes:
        name: name of the file.
        points: points of its centre line [m], shape (points, 3); the chain begins at the first.
        diameter: diameter at these points [m], shape (points,).
    """

    name: str
    points: np.ndarray
    diameter: np.ndarray

    @property
    def lengths(self) -> np.ndarray:
        """Distance along the centre line at every point [m]."""
        return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(self.points, axis=0), axis=1)))

    @property
    def tortuosity(self) -> float:
        """Length of the centre line over the distance of its ends [1]."""
        return float(self.lengths[-1] / np.linalg.norm(self.points[-1] - self.points[0]))


@dataclass(frozen=True)
class Passage(Result):
    """A chain in a lumen.

    Attributes:
        design: name of the chain.
        lumen: the lumen.
        springs: segment and number of every spring.
        pressure: gauge pressure [Pa]; fractions: martensite fractions of all springs [1].
        offset: root mean square distance of the chain's centre line from the lumen's [m].
        clearance: least distance between the walls [m], negative where they would overlap.
        line: points of the chain's centre line [m], shape (points, 3).
        solved: the solved state of the chain.
    """

    design: str
    lumen: Lumen
    springs: tuple[tuple[int, int], ...]
    pressure: float
    fractions: np.ndarray
    offset: float
    clearance: float
    line: np.ndarray
    solved: Solved

    @property
    def passes(self) -> bool:
        """True if the chain is clear of the lumen's wall everywhere."""
        return self.clearance >= -1e-9


def read_lumen(path: str | Path) -> Lumen:
    """Read a centre line from a CSV with columns `x_mm, y_mm, z_mm, diameter_mm`, any unit of length.

    Raises:
        InputError: one line with file, row and column.
    """
    path = Path(path)
    rows = records(path, csv.DictReader)
    if len(rows) < 2:
        raise InputError(f"{path}: a centre line needs at least two points")
    columns = {}
    for wanted in ("x", "y", "z", "diameter"):
        named = [n for n in rows[0] if n and n.rpartition("_")[0] == wanted]
        if not named:
            raise InputError(f"{path}: column {wanted}_mm is missing")
        _, unit = unit_of_column(named[0])
        columns[wanted] = [
            to_si(number(row[named[0]], f"{path}: row {k}, column {named[0]}"), unit)
            for k, row in enumerate(rows, 2)
        ]
    points = np.column_stack([columns[n] for n in "xyz"])
    if np.any(np.linalg.norm(np.diff(points, axis=0), axis=1) <= 0.0):
        raise InputError(f"{path}: two points of the centre line that follow each other are the same")
    if np.any(np.array(columns["diameter"]) <= 0.0):
        raise InputError(f"{path}: every diameter must be positive")
    return Lumen(path.stem, points, np.array(columns["diameter"]))


def distances(points: Array, lumen: tuple[Array, Array]) -> tuple[Array, Array]:
    """Distance of points from a centre line, and the lumen's radius where each is nearest [m].

    Args:
        points: shape (points, 3).
        lumen: the centre line's points and diameters.
    """
    line, diameter = lumen
    begin, along = line[:-1], jnp.diff(line, axis=0)
    still = jax.lax.stop_gradient(points)  # the choice of the nearest piece has no derivative
    share = jnp.einsum("psk,sk->ps", still[:, None] - begin, along) / jnp.sum(along**2, axis=1)
    aside = still[:, None] - begin - jnp.clip(share, 0.0, 1.0)[..., None] * along
    nearest = jnp.argmin(jnp.sum(aside**2, axis=-1), axis=1)
    begin, along, wide, change = (
        begin[nearest],
        along[nearest],
        diameter[:-1][nearest],
        jnp.diff(diameter)[nearest],
    )
    share = jnp.clip(jnp.sum((points - begin) * along, axis=1) / jnp.sum(along**2, axis=1), 0.0, 1.0)
    away = jnp.sqrt(jnp.sum((points - begin - share[:, None] * along) ** 2, axis=1) + 1e-18)
    return away, 0.5 * (wide + share * change)


def refined(lumen: Lumen) -> tuple[np.ndarray, np.ndarray]:
    """The same line and diameters with a power of two of points, so that few compiled programs serve all
    lumens.

    The longest pieces are halved; the line between the points stays as it is.
    """
    points, diameter = lumen.points, lumen.diameter
    wanted = 1 << (len(points) - 1).bit_length()
    for _ in range(wanted - len(points)):
        k = int(np.argmax(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        points = np.insert(points, k + 1, points[k : k + 2].mean(axis=0), axis=0)
        diameter = np.insert(diameter, k + 1, diameter[k : k + 2].mean())
    return points, diameter


class _Task(eqx.Module):
    """The task of passing a lumen.

    Attributes:
        body, box, memories: the driven body, the box of its drives, and the memories of its springs.
        line: points and diameters of the lumen [m].
        clearance: least distance to keep between the walls [m].
    """

    body: Body
    box: Box
    memories: Memories
    line: tuple[Array, Array]
    clearance: Array


def _numbers(task: _Task, place: Array) -> Array:
    """Mean square distance, then violations of the clearances to the lumen and of the chain to itself, in
    radii of the tube [1]."""
    radius = jnp.max(jnp.stack([s.section.radius for s in task.body.segments]))
    drives = task.box.drives(place)
    solved = state_of(task.body, drives[0], drives[1:], task.memories, first_guess(task.body))
    away, room = distances(_line(solved), task.line)
    own = QUANTITIES["clearance"].function(solved, 0)
    return jnp.concatenate(
        [
            jnp.mean(away**2)[None] / radius**2,
            (away + radius + task.clearance - room) / radius,
            -own[None] / radius,
        ]
    )


@eqx.filter_jit
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
        filled = np.stack([*places, *[places[-1]] * (-len(places) % STARTS)])
        found = [np.asarray(x) for x in _evaluated(self.task, jnp.asarray(filled))]
        return [Evaluation(np.array(p), found[0][k], found[1][k]) for k, p in enumerate(places)]


def _line(solved: Solved) -> Array:
    """Points along a chain [m]."""
    if solved.chain is not None:
        return solved.chain.shape.polyline(POINTS)
    one = solved.only
    share = jnp.linspace(0.0, 1.0, POINTS)
    return pj.serial_chain.kinematics.arc_points(one.bend, one.length, share)


def pass_through(inverse: Inverse, lumen: Lumen, clearance: float = 0.0) -> Passage:
    """Drives that keep a chain along a lumen.

    The mean square distance of the centre lines is minimised by SLSQP from several starts, with the
    clearances of all points as inequalities. Where they cannot be kept, the least overlap is looked for.

    Args:
        inverse: inverse of a chain, or of one actuator.
        lumen: lumen to pass through; the chain begins at its first point, along z.
        clearance: least distance to keep between the walls [m].
    """
    line = tuple(jnp.asarray(x) for x in refined(lumen))
    task = _Task(inverse.body, inverse.box(), fresh(inverse.body), line, jnp.asarray(clearance))
    evaluate, starts = _Numbers(task), _starts(inverse, line)
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
    drives = np.asarray(inverse.box().drives(jnp.asarray(best.evaluation.place)))
    state = jax.tree.map(lambda x: x[0], _parts(inverse.verified(drives[None])))
    state = Solved(inverse.body, *state)
    drawn = np.asarray(_line(state))
    away, room = distances(jnp.asarray(drawn), line)
    radius = max(float(s.section.radius) for s in inverse.body.segments)
    return Passage(
        inverse.design, lumen, inverse.springs, float(drives[0]), drives[1:],
        float(np.sqrt(np.mean(np.asarray(away) ** 2))),
        float(np.min(np.asarray(room - away)) - radius), drawn, state,
    )  # fmt: skip


def _parts(solved: Solved) -> tuple:
    return solved.pressure, solved.segments, solved.end_pose, solved.chain


def _starts(inverse: Inverse, line: tuple[Array, Array]) -> list[np.ndarray]:
    """Places in the box: states of the atlas whose segments' ends lie nearest to the line, spread out."""
    atlas, box = inverse.atlas, inverse.box()
    some = np.linspace(0, len(atlas.drives) - 1, min(PICKED, len(atlas.drives))).astype(int)
    part = jax.tree.map(lambda x: x[some], (atlas.solved.segments, atlas.solved.end_pose))
    away = np.asarray(_offsets(inverse.body, line, part))
    order = some[np.argsort(np.where(np.isfinite(away), away, np.inf))]
    places = [np.asarray(box.place(jnp.asarray(atlas.drives[k]))) for k in order[: STARTS - 2]]
    even = stats.qmc.Sobol(len(places[0]), seed=np.random.default_rng(inverse.seed)).random(2)
    return [*(np.clip(p, 0.0, 1.0) for p in places), *even]


@eqx.filter_jit
def _offsets(body: Body, line: tuple[Array, Array], states: tuple) -> Array:
    """Mean square distance of states from a line [m2]."""

    def offset(segments: tuple, end_pose: Array) -> Array:
        if body.chain is None:
            points = _line(Solved(body, jnp.zeros(()), segments, end_pose, None))
        else:
            bends = jnp.stack([x.bend for x in segments])
            lengths = jnp.stack([x.length for x in segments])
            points = pj.serial_chain.segments.chain_shape(body.chain, bends, lengths).polyline(4)
        return jnp.mean(distances(points, line)[0] ** 2)

    return jax.lax.map(lambda row: offset(*row), states, batch_size=256)
