"""The specimens of the statements, and the simulations that several statements share.

Everything is computed on first use and stored, so that one statement costs no more than it needs. Laws have
NumPy's numbers: their curves are computed without compiling anything.
"""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

import pneusma_jax as pj
from fitting.simulate.workspace import Workspace, compute_workspace
from pneusma_jax.numerics.safe import as_numpy

ALLOYS = ("krl35", "krl45")
PRESTRAIN = (
    0.1924  # shear strain to which the source stretches its springs before they are attached (Section 3.4.1)
)
FULL_PRESSURE = 60e3  # Maximum test pressure of the actuators [Pa] (Section 3.7.3)
SWEEP_ROWS = 61  # Number of rows of a pressure sweep and of a thermal cycle; one compiled program serves both
HOT = 0.1  # Martensite fraction of a strongly heated spring
SETPOINTS = (10e3, 30e3, 50e3)  # Pressures of the thermal cycles [Pa]; the source's are lost

T = TypeVar("T")


def pressure_sweep() -> np.ndarray:
    """Gauge pressure up to 60 kPa and back in equal steps [Pa], shape (SWEEP_ROWS,)."""
    up = np.linspace(0.0, FULL_PRESSURE, SWEEP_ROWS // 2 + 1)
    return np.concatenate([up, up[-2::-1]])


def thermal_cycle() -> np.ndarray:
    """Martensite fraction from cold to hot, held, and back to cold [1], shape (SWEEP_ROWS,)."""
    corners = np.asarray([0.0, 0.05, 0.4, 0.6, 0.95, 1.0]) * (SWEEP_ROWS - 1)
    return np.interp(np.arange(SWEEP_ROWS), corners, [1.0, 1.0, HOT, HOT, 1.0, 1.0])


class Bench:
    """Alloys, silicone and actuators, by default as shipped.

    Attributes:
        alloys: the two alloys by name.
        silicone: law of the actuators' wall.
    """

    def __init__(self, alloys: dict[str, pj.Alloy] | None = None, silicone: object = None) -> None:
        """A bench.

        Args:
            alloys: replacements by name, `"krl35"` (the actuators' springs) or `"krl45"`.
            silicone: replacement of Dragon Skin 10 FAST.

        Raises:
            ValueError: for another name.
        """
        unknown = sorted(set(alloys or ()) - set(ALLOYS))
        if unknown:
            raise ValueError(f"Argument `alloys` must name alloys of {ALLOYS}, but it has {unknown}.")
        alloys = {name: pj.load_alloy(name) for name in ALLOYS} | (alloys or {})
        self.alloys = {name: as_numpy(alloy) for name, alloy in alloys.items()}
        self.silicone = as_numpy(pj.load_silicone() if silicone is None else silicone)
        self._kept: dict[tuple, object] = {}

    def keep(self, key: tuple, compute: Callable[[], T]) -> T:
        """Result of `compute`, which is called once for a key."""
        if key not in self._kept:
            self._kept[key] = compute()
        return self._kept[key]

    def actuator(self, design: str) -> pj.Actuator:
        """A design of Table 3.3."""
        return self.keep(
            ("actuator", design), lambda: pj.make_actuator(design, self.alloys["krl35"], self.silicone)
        )

    def sweep(self, design: str, heated: float = 1.0, opposite: float = 1.0) -> pj.History:
        """A pressure sweep up and down at constant heat, from fresh springs.

        Args:
            design: name of a design of Table 3.3.
            heated: martensite fraction of the spring on side 2 [1].
            opposite: martensite fraction of the spring on side 1 [1].
        """
        return self.keep(
            ("sweep", design, heated, opposite),
            lambda: self._history(design, pressure_sweep(), np.full(SWEEP_ROWS, heated), opposite),
        )

    def cycle(self, design: str, pressure: float) -> pj.History:
        """A thermal cycle of the spring on side 2 at a constant gauge pressure [Pa], from fresh springs."""
        return self.keep(
            ("cycle", design, pressure),
            lambda: self._history(design, np.full(SWEEP_ROWS, pressure), thermal_cycle(), 1.0),
        )

    def _history(self, design: str, pressure: np.ndarray, heated: np.ndarray, opposite: float) -> pj.History:
        body = self.actuator(design)
        phases = {1: np.full(SWEEP_ROWS, opposite), 2: heated}
        activations = tuple(pj.MartensiteFraction(phases[n]) for n in body.spring_numbers)
        history = pj.simulate_history(body, pressure, activations)
        if not np.all(np.asarray(history.converged)):
            raise RuntimeError(
                f"A history of {design} must have an equilibrium in every row, but it has not."
            )
        return history

    def workspace(self, design: str) -> Workspace:
        """States of a design over 0 to 60 kPa and activations from cold to hot (Fig. 3.25)."""
        return self.keep(
            ("workspace", design),
            lambda: compute_workspace(
                design, np.linspace(0.0, FULL_PRESSURE, 25), np.linspace(1.0, HOT, 13),
                self.alloys["krl35"], self.silicone,
            ),
        )  # fmt: skip


def rising_share(values: np.ndarray) -> float:
    """Share of the steps of a sequence that rise [%]."""
    return float(100.0 * np.mean(np.diff(np.asarray(values)) > 0.0))


def listed(values: np.ndarray, digits: int = 1) -> str:
    """List of numbers for a sentence."""
    return ", ".join(f"{round(float(v), digits) + 0.0:.{digits}f}" for v in np.ravel(values))
