"""Reachable bends of a design: curvature and bend angle over pressure and activation (Fig. 3.25)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax
import numpy as np

import pneusma_jax as pj
from fitting.simulate.unmodelled import marked
from fitting.specimens.cautions import CLEARANCE_DEG, actuator_cautions, touching_angle
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import of_states_at_rest
from pneusma_jax.actuator.designs import design_gravity
from pneusma_jax.actuator.result import Validity
from pneusma_jax.calibration import named_table
from pneusma_jax.model_discrepancy import CHANNELS
from pneusma_jax.nitinol.spring import SpringResponse
from pneusma_jax.pipeline import Effect
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.simulate.rest import solve_at_rest
from pneusma_jax.units import from_si

DESIGNS = ("pneuflex_s", "pneusma1", "pneusma2")
MIXES = (0.5, 1.0)  # Ratios of the second spring's heat to the first's, where two are heated
CHUNK = 512  # Number of rows that are solved at once


@dataclass
class Workspace:
    """States of one design on a grid of pressures and activations.

    Attributes:
        design: name of the design.
        springs: numbers of its springs.
        heat: share of the activation that each spring gets in a branch, shape (branches, springs); see
            `fractions_of`.
        pressure: gauge pressure [Pa], shape (pressures,).
        xi0: martensite fraction of a spring with the full share [1], shape (activations,).
        curvature: curvature [1/m], non-negative for a design that bends freely; shape (branches, activations,
            pressures), NaN where there is no result. The next five have the same shape.
        bend: bend angle [rad].
        direction: direction of the bend, from the x axis [rad].
        length: length of the centre line [m].
        delta_1, delta_2: elongations of the sides [m].
        status: `Status` codes, shape (branches, activations, pressures).
        cautions: warnings in words.
        outer_diameter: outer diameter of the tube [m].
        planar: true if it bends in one plane.
        marks: contribution of a model discrepancy, and its range flag, by column; shape as the others.
        touching_deg: bend angle past which the tip may touch the base [deg], see `cautions.touching_angle`.
    """

    design: str
    springs: tuple[int, ...]
    heat: np.ndarray
    pressure: np.ndarray
    xi0: np.ndarray
    curvature: np.ndarray
    bend: np.ndarray
    direction: np.ndarray
    length: np.ndarray
    delta_1: np.ndarray
    delta_2: np.ndarray
    status: np.ndarray
    cautions: list[str]
    outer_diameter: float
    planar: bool = True
    marks: dict[str, np.ndarray] = field(default_factory=dict)
    touching_deg: float = CLEARANCE_DEG

    @property
    def heated(self) -> tuple[int, ...]:
        """Number of the spring that is heated alone in each branch; 0 where there is none or more than
        one."""
        alone = [np.flatnonzero(row) for row in self.heat]
        return tuple(self.springs[k[0]] if len(k) == 1 else 0 for k in alone)

    @property
    def solved(self) -> int:
        """Number of states with a result."""
        return int(np.sum(self.status <= pj.Status.several_equilibria))

    def extreme(self, largest: bool) -> tuple[int, int, int]:
        """Index of the state of largest or smallest curvature.

        Raises:
            ValueError: if no state was found.
        """
        find = np.nanargmax if largest else np.nanargmin
        return tuple(int(i) for i in np.unravel_index(find(self.curvature), self.curvature.shape))

    def fractions(self) -> np.ndarray:
        """Martensite fraction of each spring [1], shape (branches, activations, springs)."""
        return fractions_of(self.heat, self.xi0)

    def activation_of(self, index: tuple[int, int, int]) -> dict[int, float]:
        """Martensite fraction of each spring in a state."""
        branch, level, _ = index
        return dict(zip(self.springs, self.fractions()[branch, level].tolist(), strict=True))

    def columns(self) -> dict[str, np.ndarray]:
        """The states as columns of a CSV; an `xi0` of a missing spring is NaN."""
        shape = self.curvature.shape
        fractions = dict(zip(self.springs, np.moveaxis(self.fractions(), -1, 0), strict=True))
        spread = {n: values[:, :, None] for n, values in fractions.items()}
        table: dict[str, Any] = {
            "design": self.design,
            "pressure_kPa": from_si(self.pressure, "kPa")[None, None, :],
            **{f"xi0_{n}": spread.get(n, np.nan) for n in sorted({1, 2, *self.springs})},
            "status": np.vectorize(lambda code: pj.Status(code).name)(self.status),
            "curvature_1pm": self.curvature,
            "bend_angle_deg": from_si(self.bend, "deg"),
            "length_mm": from_si(self.length, "mm"),
            "delta_1_mm": from_si(self.delta_1, "mm"),
            "delta_2_mm": from_si(self.delta_2, "mm"),
        }
        if not self.planar:
            table["bend_direction_deg"] = from_si(self.direction, "deg") % 360.0
        table |= self.marks
        return {name: np.broadcast_to(values, shape).ravel() for name, values in table.items()}


def compute_workspace(
    design: str,
    pressure: np.ndarray,
    xi0: np.ndarray,
    alloy: Any = None,
    silicone: Any = None,
    model: AugmentedModel = BASE,
    progress: Callable[[int], object] = lambda rows: None,
) -> Workspace:
    """Solve a design on a grid.

    In a plane, one spring is heated at a time. For free bending, every pair is heated too, in proportions
    `MIXES`.

    Args:
        design: name or path of a table of kind actuator.
        pressure: gauge pressure [Pa], ascending, shape (pressures,).
        xi0: martensite fractions of the hottest spring [1], shape (activations,); ignored without springs.
        alloy, silicone: tables as for `make_actuator`; the design's own where None.
        model: model in place of the base model; its effects act as at the start of a recording.
        progress: function that is called with the number of rows after each batch.

    Returns:
        The states. A row without result is NaN, with the reason in its status.

    Raises:
        InputError: for a table that cannot be used.
    """
    actuator = modelled_actuator(design, alloy, silicone, model)
    heat = branches_of(actuator)
    xi0 = np.asarray(xi0, dtype=float) if actuator.springs else np.ones(1)
    pressure = np.asarray(pressure, dtype=float)
    shape = (len(heat), len(xi0), len(pressure))
    fractions = fractions_of(heat, xi0)
    loads = np.broadcast_to(pressure, shape).ravel()
    count = heat.shape[1]
    rows = np.broadcast_to(fractions[:, :, None, :], (*shape, count)).reshape(loads.size, count)
    gravity = design_gravity(model.table("actuator", design))
    found, added = _in_chunks(actuator, loads, rows, model.effects, gravity, progress)
    grid = lambda values: np.asarray(values).reshape(shape)  # noqa: E731
    planar = actuator.planar
    bend = found.bend_angle if planar else np.linalg.norm(np.asarray(found.bend), axis=-1)
    curvature = bend / found.length
    more = lambda name: added.get(f"unmodelled_{name}", 0.0)  # noqa: E731
    marks, sentences = marked(model, added, "actuator", () if planar else ("curvature", "bend_angle"))
    if planar:
        curvature, bend = curvature + more("curvature"), bend + more("bend_angle")
    touching_deg = touching_angle({}, model)
    return Workspace(
        design=Path(design).name.removesuffix(".toml"),
        springs=actuator.spring_numbers,
        heat=heat,
        pressure=pressure,
        xi0=xi0,
        curvature=grid(curvature),
        bend=grid(bend),
        direction=grid(found.bend_direction),
        length=grid(found.length + more("length")),
        delta_1=grid(found.delta_1),
        delta_2=grid(found.delta_2),
        status=grid(found.status),
        cautions=[*actuator_cautions(actuator, found, touching_deg), *sentences,
                  *of_states_at_rest(model)],
        outer_diameter=2.0 * float(actuator.section.radius),
        planar=planar,
        marks={name: grid(values) for name, values in marks.items()},
        touching_deg=touching_deg,
    )


def fractions_of(heat: np.ndarray, xi0: np.ndarray) -> np.ndarray:
    """Martensite fraction of each spring [1], shape (branches, activations, springs).

    Args:
        heat: share of the activation that each spring gets, shape (branches, springs).
        xi0: martensite fraction of a spring with the full share [1], shape (activations,).
    """
    return (1.0 - heat)[:, None, :] + heat[:, None, :] * xi0[None, :, None]


def modelled_actuator(design: str, alloy: Any, silicone: Any, model: AugmentedModel) -> pj.Actuator:
    """A design with a model's constants.

    Raises:
        InputError: for a table that cannot be used, or impossible dimensions.
    """
    table = model.table("actuator", design)
    if model.quantities("alloy") and not isinstance(alloy, pj.Alloy):
        alloy = model.table("alloy", named_table(table, "alloy") if alloy is None else alloy)
    if model.quantities("silicone") and (silicone is None or isinstance(silicone, str)):
        silicone = model.table("silicone", named_table(table, "material") if silicone is None else silicone)
    return pj.make_actuator(table, alloy, silicone)


def branches_of(actuator: pj.Actuator) -> np.ndarray:
    """Share of the activation that each spring gets in each branch, shape (branches, springs)."""
    count = len(actuator.springs)
    if not count:
        return np.zeros((1, 0))
    single = np.eye(count)[::-1]  # as drawn in Fig. 3.25: spring 2 first
    if actuator.planar:
        return single
    pairs = []
    for i in range(count):
        for j in range(i):
            for less in MIXES:
                pairs += [single[i] + less * single[j]] + (
                    [less * single[i] + single[j]] if less < 1.0 else []
                )
    return np.stack([*single, *pairs])


def _in_chunks(
    actuator: pj.Actuator,
    pressure: np.ndarray,
    fractions: np.ndarray,
    effects: tuple[Effect, ...],
    gravity: np.ndarray,
    progress: Callable[[int], object],
) -> tuple[pj.Equilibrium, dict[str, Any]]:
    """All rows, in chunks through one compiled program. The last chunk is padded with its last row."""
    size = min(CHUNK, len(pressure))
    found = []
    for start in range(0, len(pressure), size):
        rows = np.minimum(np.arange(start, start + size), len(pressure) - 1)
        activations = tuple(pj.MartensiteFraction(column) for column in fractions[rows].T)
        lot = _at_rest(actuator, pressure[rows], activations, effects, gravity) if effects else (
            (pj.solve_batch(actuator, pressure[rows], activations), {})
        )  # fmt: skip
        count = min(size, len(pressure) - start)
        found.append(jax.tree.map(lambda leaf, count=count: np.asarray(leaf)[:count], lot))
        progress(count)
    return jax.tree.map(lambda *lots: np.concatenate(lots), *found)


@stored_jit(pj.Equilibrium, Validity, SpringResponse)
def _at_rest(
    actuator: pj.Actuator, pressure: Any, given: tuple, effects: tuple[Effect, ...], gravity: Any
) -> tuple[pj.Equilibrium, dict[str, Any]]:
    """States of a batch, each at rest under a model's effects; and the model discrepancies."""

    def one(pressure: Any, given: tuple) -> tuple[pj.Equilibrium, dict[str, Any]]:
        rest = solve_at_rest(actuator, pressure, given, effects=effects, gravity=gravity)
        return rest.found, {name: x for name, x in rest.seen.items() if name.startswith(CHANNELS)}

    return jax.vmap(one)(pressure, given)


def join_columns(workspaces: Sequence[Workspace]) -> dict[str, np.ndarray]:
    """Columns of all workspaces below each other; NaN where a workspace lacks a column."""
    tables = [workspace.columns() for workspace in workspaces]
    names = list(dict.fromkeys(name for table in tables for name in table))
    names.sort(key=lambda name: (name != "design", name != "pressure_kPa", not name.startswith("xi0_")))
    blank = lambda table: np.full(len(table["design"]), np.nan)  # noqa: E731
    return {n: np.concatenate([table.get(n, blank(table)) for table in tables]) for n in names}
