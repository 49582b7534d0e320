"""A solved row: its configuration, what describes it, and a status that says in words how it went."""

import enum

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from ._numerics import frozen, is_concrete, safe_norm
from .actuator import Actuator
from .balance import Problem, all_finite, configuration, residual, spring_responses
from .nitinol import SpringResponse
from .root_find import BALANCED

SHORTEST = -0.95  # side strain below which a solution is no tube any more


class Status(enum.IntEnum):
    """Outcome of one row; `sentence` says it in words."""

    converged = 0
    no_equilibrium = 1
    input_not_finite = 2
    collapsed = 3

    @property
    def sentence(self) -> str:
        """What happened, for a person."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.converged: "Force and moment balance.",
    Status.no_equilibrium: (
        "No configuration was found in which force and moment balance; "
        "check the pressure and the springs' activation, or start from a neighbouring solution."
    ),
    Status.input_not_finite: "The pressure, activation or a dimension is not a finite number.",
    Status.collapsed: "Force and moment only balance with a side shorter than 5 % of its length.",
}


class Equilibrium(eqx.Module):
    """A solved row.

    Attributes:
        delta_centre: elongation of the centre line [m].
        bend: bend angle vector theta [rad], shape (2,).
        length: of the centre line [m], Eq. 3.16.
        radius: half the distance between side 1 and side 2 [m].
        middle: coordinate midway between them, from the centre line towards side 1 [m]; 0 for a round tube.
        spring_elongations: at each spring [m], shape (springs,).
        springs: response of each spring.
        unknowns: the scaled free coordinates, a `guess` for a neighbouring row [1].
        residual: largest scaled imbalance [1].
        steps: of the root-find.
        status: a `Status` code. Where it is not `converged`, the configuration is NaN.
        side_direction: static; unit vector towards side 1, in which `bend_angle` and `curvature` are counted.
    """

    delta_centre: Array
    bend: Float[Array, "2"]
    length: Array
    radius: Array
    middle: Array
    spring_elongations: Array
    springs: tuple[SpringResponse, ...]
    unknowns: Array
    residual: Array
    steps: Int[Array, ""]
    status: Int[Array, ""]
    side_direction: tuple[float, float] = eqx.field(static=True, default=(0.0, 1.0))

    @property
    def delta_1(self) -> Array:
        """Elongation of side 1 (beta = d_o) [m]."""
        return self.delta_centre + self.bend_angle * (self.middle + self.radius)

    @property
    def delta_2(self) -> Array:
        """Elongation of side 2 (beta = 0) [m]."""
        return self.delta_centre + self.bend_angle * (self.middle - self.radius)

    @property
    def bend_angle(self) -> Array:
        """Planar bend angle, positive when side 1 is the longer, Eq. 3.19 [rad]."""
        return self.bend @ np.asarray(self.side_direction)

    @property
    def curvature(self) -> Array:
        """Planar curvature of the centre line, theta / L (correction 7) [1/m]."""
        return self.bend_angle / self.length

    @property
    def printed_curvature(self) -> Array:
        """Eq. 3.21 as printed, the curvature of side 2's edge [1/m]."""
        return self.bend_angle / (self.length + self.bend_angle * (self.middle - self.radius))

    @property
    def bend_magnitude(self) -> Array:
        """Size of the bend angle vector [rad]."""
        return safe_norm(self.bend)

    @property
    def bend_direction(self) -> Array:
        """Direction of the longest side, from the x axis [rad]."""
        return jnp.arctan2(self.bend[..., 1], self.bend[..., 0])


def equilibrium_of(problem: Problem, unknowns: Array, steps: Array) -> Equilibrium:
    """Result of a root, with its status; NaN where it is none."""
    actuator = problem.actuator
    delta_centre, bend = configuration(actuator, unknowns)
    # what is left unbalanced is a check: without tangents it costs a third less to differentiate a row
    size = jnp.max(jnp.abs(residual(*frozen((unknowns, problem)))))
    slimmest = (delta_centre - _reach(actuator, bend)) / actuator.length
    side_1, side_2 = actuator.section.sides(jnp.asarray(actuator.side_direction))
    status = jnp.select(
        [~all_finite(problem), ~(size < BALANCED), slimmest < SHORTEST],
        [int(Status.input_not_finite), int(Status.no_equilibrium), int(Status.collapsed)],
        int(Status.converged),
    )
    good = status == int(Status.converged)
    responses = spring_responses(problem, delta_centre, bend)
    result = Equilibrium(
        delta_centre=delta_centre,
        bend=bend,
        length=actuator.length + delta_centre,
        radius=0.5 * (side_1 - side_2),
        middle=0.5 * (side_1 + side_2),
        spring_elongations=delta_centre + actuator.spring_places @ bend,
        springs=responses,
        unknowns=unknowns,
        residual=size,
        steps=steps,
        status=status,
        side_direction=tuple(float(x) for x in actuator.side_direction),
    )
    return jax.tree.map(lambda x: jnp.where(good, x, jnp.nan) if eqx.is_inexact_array(x) else x, result)


def _reach(actuator: Actuator, bend: Array) -> Array:
    """Elongation of the centre line over that of the section's shortest side [m]."""
    size = safe_norm(bend)
    bent = size > 0.0
    towards = jnp.where(bent, -bend / jnp.where(bent, size, 1.0), jnp.asarray([0.0, 1.0]))
    return size * actuator.section.sides(towards)[0]


def raise_unless_converged(result: Equilibrium) -> Equilibrium:
    """Raise the status's sentence; under `jit` by a check, which the disk cache cannot keep."""
    if is_concrete(result.status):
        if int(result.status) != Status.converged:
            raise RuntimeError(Status(int(result.status)).sentence)
        return result
    bad = result.status != int(Status.converged)
    return eqx.branched_error_if(result, bad, result.status, [s.sentence for s in Status])
