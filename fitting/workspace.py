"""Where the designs can bend: curvature and bend angle over pressure and activation (Fig. 3.25)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import pneusma_jax as pj
from fitting.simulation.cautions import actuator_cautions
from pneusma_jax.units import from_si

DESIGNS = ("pneuflex_s", "pneusma1", "pneusma2")


@dataclass
class Workspace:
    """States of one design on a grid of pressures and activations.

    Attributes:
        design: its name.
        heated: number of the heated spring of each branch, 0 where there is none. A design with springs on
            both sides has two branches; the spring that is not heated is cold.
        pressure: gauge [Pa], shape (pressures,).
        xi0: martensite fraction of the heated spring [1], shape (activations,).
        curvature: [1/m], bend: angle [rad], length: of the centre line [m], delta_1, delta_2: of the sides
            [m]; all of shape (branches, activations, pressures), NaN where there is no result.
        status: `Status` codes, the same shape.
        cautions: in words.
        outer_diameter: of the tube [m].
    """

    design: str
    heated: tuple[int, ...]
    pressure: np.ndarray
    xi0: np.ndarray
    curvature: np.ndarray
    bend: np.ndarray
    length: np.ndarray
    delta_1: np.ndarray
    delta_2: np.ndarray
    status: np.ndarray
    cautions: list[str]
    outer_diameter: float

    @property
    def solved(self) -> int:
        """How many states were found."""
        return int(np.sum(self.status == pj.Status.converged))

    def extreme(self, largest: bool) -> tuple[int, int, int]:
        """Index of the state of largest or smallest curvature.

        Raises:
            ValueError: if no state was found.
        """
        find = np.nanargmax if largest else np.nanargmin
        return tuple(int(i) for i in np.unravel_index(find(self.curvature), self.curvature.shape))

    def activation_of(self, index: tuple[int, int, int]) -> dict[int, float]:
        """Martensite fraction of each spring in a state."""
        springs = pj.layout(self.design).spring_numbers
        branch, level, _ = index
        return {n: float(self.xi0[level]) if n == self.heated[branch] else 1.0 for n in springs}

    def columns(self) -> dict[str, np.ndarray]:
        """The states as columns of a CSV; an `xi0` of a spring that is not there is NaN."""
        shape = self.curvature.shape
        springs = pj.layout(self.design).spring_numbers
        heated = np.asarray(self.heated)[:, None, None]
        level, pressure = self.xi0[None, :, None], from_si(self.pressure, "kPa")[None, None, :]
        xi0 = {n: np.where(heated == n, level, 1.0) if n in springs else np.nan for n in (1, 2)}
        table = {
            "design": self.design,
            "pressure_kPa": pressure,
            "xi0_1": xi0[1],
            "xi0_2": xi0[2],
            "status": np.vectorize(lambda code: pj.Status(code).name)(self.status),
            "curvature_1pm": self.curvature,
            "bend_angle_deg": from_si(self.bend, "deg"),
            "length_mm": from_si(self.length, "mm"),
            "delta_1_mm": from_si(self.delta_1, "mm"),
            "delta_2_mm": from_si(self.delta_2, "mm"),
        }
        return {name: np.broadcast_to(values, shape).ravel() for name, values in table.items()}


def compute_workspace(
    design: str,
    pressure: np.ndarray,
    xi0: np.ndarray,
    alloy: str = "krl35",
    silicone: str = "dragon_skin_10_fast",
) -> Workspace:
    """Solve a design on a grid, all rows at once.

    Args:
        design: a planar design by name.
        pressure: gauge [Pa], ascending, shape (pressures,).
        xi0: martensite fractions of the heated spring [1], shape (activations,); ignored without springs.
        alloy, silicone: names or paths of tables.

    Returns:
        The states; a row without result is NaN and says why in its status.

    Raises:
        InputError: for a table that cannot be used.
    """
    actuator = pj.make_actuator(design, alloy, silicone)
    heated = actuator.spring_numbers[::-1] or (0,)
    xi0 = np.asarray(xi0, dtype=float) if actuator.springs else np.ones(1)
    shape = (len(heated), len(xi0), len(pressure))
    spread = lambda values: np.broadcast_to(values, shape).ravel()  # noqa: E731
    branch = np.asarray(heated)[:, None, None]
    activations = tuple(
        pj.MartensiteFraction(spread(np.where(branch == n, xi0[None, :, None], 1.0)))
        for n in actuator.spring_numbers
    )
    found = pj.solve_batch(actuator, spread(np.asarray(pressure, dtype=float)), activations)
    grid = lambda values: np.asarray(values).reshape(shape)  # noqa: E731
    return Workspace(
        design=design,
        heated=heated,
        pressure=np.asarray(pressure, dtype=float),
        xi0=xi0,
        curvature=grid(found.curvature),
        bend=grid(found.bend_angle),
        length=grid(found.length),
        delta_1=grid(found.delta_1),
        delta_2=grid(found.delta_2),
        status=grid(found.status),
        cautions=actuator_cautions(actuator, found),
        outer_diameter=2.0 * float(actuator.section.radius),
    )


def join_columns(workspaces: Sequence[Workspace]) -> dict[str, np.ndarray]:
    """Columns of all workspaces below each other."""
    tables = [workspace.columns() for workspace in workspaces]
    return {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
