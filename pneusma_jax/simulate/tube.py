"""A pressurised tube without springs along a history, as an actuator with nothing attached."""

import equinox as eqx
from jaxtyping import Array, Float

from ..actuator import Actuator, Geometry, Layout, round_actuator
from ..actuator.result import Equilibrium
from ..pipeline import Effect
from ..silicone import SiliconeLaw
from .history import simulate_history


class TubeHistory(eqx.Module):
    """A simulated inflation.

    Attributes:
        rows: equilibrium of every row; arrays have a leading axis of rows.
        seen: instrument reading `length` [m], shape (rows,), and the contribution of a model discrepancy.
    """

    rows: Equilibrium
    seen: dict[str, Array]

    @property
    def converged(self) -> Array:
        """Mask of the rows with an equilibrium, shape (rows,)."""
        return self.rows.converged


def make_tube(geometry: Geometry, law: SiliconeLaw) -> Actuator:
    """Round tube of a geometry's length, outer diameter and wall, without springs or fibre.

    Raises:
        ValueError: for an impossible tube.
    """
    return round_actuator(Layout(), geometry, None, law)


def simulate_tube(
    tube: Actuator,
    pressure: Float[Array, "rows"],
    *,
    time: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
) -> TubeHistory:
    """A tube under a history of gauge pressure [Pa], shape (rows,); Eqs. 3.9 and 3.10 row by row.

    Args:
        tube: tube from `make_tube`.
        pressure: gauge pressure [Pa], shape (rows,).
        time: time [s], shape (rows,), for effects that depend on rate or duration.
        effects: effects beyond the base model; their memories start at rest.

    Raises:
        ValueError: as `simulate_history`.
    """
    history = simulate_history(tube, pressure, (), (), time=time, effects=effects)
    bent = ("curvature", "bend_angle")
    return TubeHistory(history.rows, {name: x for name, x in history.seen.items() if name not in bent})
