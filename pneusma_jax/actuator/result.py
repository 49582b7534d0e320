"""A solved row: its configuration, what describes it, and a status that says in words how it went."""

import enum

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.ad_checkpoint import checkpoint_name
from jaxtyping import Array, Bool, Float, Int

from ..nitinol import SpringResponse
from ..nitinol.spring import MartensiteFraction, Resistance
from ..numerics.safe import as_array, frozen, is_concrete, namespace_of, safe_norm
from . import Actuator
from .balance import (
    Problem,
    all_finite,
    at_phases,
    configuration,
    freedoms,
    joint_residual,
    measured,
    spring_responses,
    zeros_for_nan,
)
from .root_find import BALANCED, Ended

SHORTEST = -0.95  # side strain below which a solution is no tube any more
KEPT = "good"
"""Name of the flag whether a row has a result. Reverse derivatives compute all else of a row again."""
MOST_SUCTION = 10.0
"""Suction, over the one at which a long round tube buckles, from which a state has no result [1]. End caps
and springs stiffen a tube, by less than this. PneuSMA2 buckles at 1.9 kPa by that formula."""


OTHER_SPRING = 2.0
"""Ratio of a measured resistance to that of its spring, or its inverse, from which it belongs to no such
spring [1]. Phase and strain change the resistance of the shipped designs' springs by less than 14 %."""


class Status(enum.IntEnum):
    """Outcome of one row; `sentence` says it in words. The first two have a result."""

    converged = 0
    several_equilibria = 1
    no_equilibrium = 2
    input_not_finite = 3
    collapsed = 4
    beyond_wire = 5
    fraction_out_of_range = 6
    flattened = 7
    resistance_out_of_range = 8

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return _SENTENCES[self]


_SENTENCES = {
    Status.converged: "Force and moment balance.",
    Status.several_equilibria: (
        "Force and moment balance in several configurations, of which this is one; "
        "`solve_all` gives all that the resistances allow."
    ),
    Status.no_equilibrium: (
        "No configuration was found in which force and moment balance; "
        "check the pressure and the springs' activation, or start from a neighbouring solution."
    ),
    Status.input_not_finite: (
        "The pressure, activation or a dimension is not a finite number, or a wall leaves no bore."
    ),
    Status.collapsed: "Force and moment only balance with a side shorter than 5 % of its length.",
    Status.beyond_wire: "Force and moment only balance with a spring longer than its wire.",
    Status.fraction_out_of_range: "A martensite fraction is not between 0 and 1.",
    Status.resistance_out_of_range: (
        "A measured resistance is more than twice what its spring has in that state, or less than half."
    ),
    Status.flattened: "The pressure is so far below ambient that the wall would be sucked flat.",
}


def solved(status: Array) -> Array:
    """True for rows with a result."""
    return status <= int(Status.several_equilibria)


class Validity(eqx.Module):
    """Properties of a solved row that lie outside the range for which the laws were made; every entry is a
    boolean.

    Attributes:
        silicone: some of the wall is strained beyond the silicone's tests.
        shear: a wire is sheared beyond `gamma_max`, the largest strain of its alloy's tests, or its spring is
            shorter than unloaded, shape (springs,).
        suction: the pressure is so far below ambient that a long round tube of as much wall and bore would
            buckle inwards. The model's section keeps its shape.
        contact: the tip has come round to the base, or the inner side meets itself. No force is modelled.
    """

    silicone: Array
    shear: Bool[Array, "springs"]
    suction: Array
    contact: Array

    @property
    def good(self) -> Array:
        """True if none of these holds."""
        return ~(self.silicone | jnp.any(self.shear, axis=-1) | self.suction | self.contact)


class Equilibrium(eqx.Module):
    """A solved row.

    Attributes:
        delta_centre: elongation of the centre line [m].
        bend: bend angle vector theta [rad], shape (2,).
        length: length of the centre line [m], Eq. 3.16.
        radius: half the distance between side 1 and side 2 [m].
        middle: coordinate midway between them, from the centre line towards side 1 [m]; 0 for a round tube.
        spring_elongations: elongation at each spring [m], shape (springs,).
        springs: response of each spring.
        unknowns: the scaled free coordinates, a `guess` for a neighbouring row [1].
        residual: largest scaled imbalance [1].
        steps: number of steps of the root-find.
        status: a `Status` code. Where there is no result, the configuration is NaN.
        equilibria: number of configurations known to balance. With measured resistances, it is counted by
            `solve`, `solve_batch` and `solve_all`; a history counts 2 where others are near or were.
        stable: true if the stiffness has a positive determinant, as in every unique equilibrium. Measured
            resistances are held fixed for it. Without loads, an equilibrium at given phases is always stable.
        validity: quantities outside the range for which the laws were made.
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
    equilibria: Int[Array, ""] = eqx.field(converter=as_array, default=1)
    stable: Bool[Array, ""] = eqx.field(converter=as_array, default=True)
    validity: Validity | None = None
    side_direction: tuple[float, float] = eqx.field(static=True, default=(0.0, 1.0))

    @property
    def converged(self) -> Array:
        """True if there is a result, unique or not."""
        return solved(self.status)

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
        return namespace_of(self.bend).arctan2(self.bend[..., 1], self.bend[..., 0])


def equilibrium_of(
    problem: Problem,
    unknowns: Array,
    steps: Array,
    equilibria: Array | int = 1,
    stable: Array | bool = True,
    held: Array | None = None,
    good: Array | None = None,
) -> Equilibrium:
    """Result of a root, with its status; NaN where it is none.

    Args:
        problem: one row.
        unknowns: joint unknowns, see `actuator.balance.joint_residual`.
        steps: number of steps of the root-find.
        equilibria: number of roots that are known.
        stable: see `Equilibrium`.
        held: true for fractions of measured springs that are given, shape (measured,).
        good: true if the row has a result, where that is known. Its status is then not found out again.
    """
    actuator, count, finite = problem.actuator, freedoms(problem), all_finite(problem)
    real = finite & jnp.all(jnp.isfinite(unknowns))
    problem, unknowns = zeros_for_nan(problem, unknowns)
    row, problem = problem, at_phases(problem, unknowns[count:])
    delta_centre, bend = configuration(actuator, unknowns[:count])
    slimmest = (delta_centre - _reach(actuator, bend)) / actuator.length
    side_1, side_2 = actuator.section.sides(jnp.asarray(actuator.side_direction))
    elongations = delta_centre + actuator.spring_places @ bend
    responses = spring_responses(problem, delta_centre, bend)
    suction = _suction(*frozen((actuator, problem.pressure)))
    if good is None:
        # what is left unbalanced is a check: without tangents it costs a third less to differentiate a row
        own, row, shown = frozen((unknowns, row, responses))
        given = None if held is None else (held, own[count:])
        size = jnp.max(jnp.abs(joint_residual(own, row, 1, given, shown)))
        status = _first_of({
            Status.input_not_finite: ~finite,
            Status.fraction_out_of_range: _out_of_range(problem),
            Status.resistance_out_of_range: _no_resistance_of_it(row, shown, held),
            Status.no_equilibrium: ~(real & (size < BALANCED)),
            Status.collapsed: slimmest < SHORTEST,
            Status.beyond_wire: _straight(actuator, elongations),
            Status.flattened: suction > MOST_SUCTION,
            Status.several_equilibria: jnp.asarray(equilibria) > 1,
        })
    else:
        size, status = jnp.zeros(()), jnp.where(good, int(Status.converged), int(Status.no_equilibrium))
    result = Equilibrium(
        delta_centre=delta_centre,
        bend=bend,
        length=actuator.length + delta_centre,
        radius=0.5 * (side_1 - side_2),
        middle=0.5 * (side_1 + side_2),
        spring_elongations=elongations,
        springs=responses,
        unknowns=unknowns[:count],
        residual=size,
        steps=steps,
        status=status,
        equilibria=equilibria,
        stable=stable,
        validity=_validity(actuator, delta_centre, bend, responses, suction),
        side_direction=tuple(float(x) for x in actuator.side_direction),
    )
    good = checkpoint_name(solved(status), KEPT)
    return jax.tree.map(lambda x: jnp.where(good, x, jnp.nan) if eqx.is_inexact_array(x) else x, result)


def _first_of(conditions: dict[Status, Array]) -> Array:
    """Number of the first status whose condition holds; `converged` if none does."""
    return jnp.select(list(conditions.values()), list(map(int, conditions)), int(Status.converged))


def count_and_stability(problem: Problem, ended: Ended) -> tuple[Array | int, Array | bool]:
    """Number of equilibria at given phases, and whether the one that was found is stable.

    Without loads there is one, and it is stable. Under loads, one with a stiffness that is not positive is
    one of three at least, as of a buckled column.
    """
    if not problem.actuator.loads:
        return 1, True
    stable = ended.signs[0] > 0.0
    return jnp.where(stable, 1, 3), stable


def _out_of_range(problem: Problem) -> Array:
    """True if a given fraction is not between 0 and 1."""
    given = [a.value for a in problem.activations if isinstance(a, MartensiteFraction)]
    wrong = [(value < 0.0) | (value > 1.0) for value in given]
    return jnp.any(jnp.stack(wrong)) if wrong else jnp.asarray(False)


def _no_resistance_of_it(
    problem: Problem, springs: tuple[SpringResponse, ...], held: Array | None
) -> Array:
    """True if a measured resistance is far from that of its spring, as the equilibrium has it.

    A spring whose fraction is given, as those of the grid of starts, does not have to have the resistance.
    """
    free = jnp.ones(len(measured(problem)), bool) if held is None else ~held
    pairs = zip(problem.activations, springs, strict=True)
    read = [(a.value, spring.resistance) for a, spring in pairs if isinstance(a, Resistance)]
    wrong = [
        free[j] & ((value > OTHER_SPRING * ohms) | (OTHER_SPRING * value < ohms))
        for j, (value, ohms) in enumerate(read)
    ]
    return jnp.any(jnp.stack(wrong)) if wrong else jnp.asarray(False)


def _straight(actuator: Actuator, elongations: Array) -> Array:
    """True if a spring would be longer than its wire."""
    pairs = zip(actuator.springs, elongations, strict=True)
    wrong = [s.attached_length + x >= s.geometry.wire_length for s, x in pairs]
    return jnp.any(jnp.stack(wrong)) if wrong else jnp.asarray(False)


def _validity(
    actuator: Actuator, delta_centre: Array, bend: Array, springs: tuple[SpringResponse, ...], suction: Array
) -> Validity:
    """See `Validity`; without derivatives."""
    actuator, delta_centre, bend, springs = frozen((actuator, delta_centre, bend, springs))
    longest = (delta_centre + _reach(actuator, -bend)) / actuator.length
    shortest = (delta_centre - _reach(actuator, bend)) / actuator.length
    low, high = actuator.silicone.tested
    angle, length = safe_norm(bend), actuator.length + delta_centre
    pairs = zip(actuator.springs, springs, strict=True)
    shear = [(r.gamma > s.alloy.gamma_max) | (r.gamma < 0.0) for s, r in pairs]
    return Validity(
        silicone=(longest > high) | (shortest < low),
        shear=jnp.stack(shear) if shear else jnp.zeros(0, bool),
        suction=suction > 1.0,
        contact=(angle > 2.0 * jnp.pi) | (_reach(actuator, bend) > length),
    )


def _suction(actuator: Actuator, pressure: Array) -> Array:
    """Suction over the one at which a long round tube of as much wall and bore buckles inwards [1].

    That pressure is `E / (4 (1 - nu^2)) (t / R)^3` (M. Bresse), with `nu` one half, the stiffness `E` of the
    unstrained silicone, and the mean radius `R` and thickness `t` of the tube.
    """
    area, bore = actuator.section.moments()[0], actuator.section.enclosed_area
    inner, outer = jnp.sqrt(bore), jnp.sqrt(bore + area)
    step = 1e-3
    stiffness = (actuator.silicone(jnp.asarray(step)) - actuator.silicone(jnp.asarray(-step))) / (2.0 * step)
    return -3.0 * pressure / (stiffness * (2.0 * (outer - inner) / (outer + inner)) ** 3)


def _reach(actuator: Actuator, bend: Array) -> Array:
    """Elongation of the centre line over that of the section's shortest side [m]."""
    size = safe_norm(bend)
    bent = size > 0.0
    towards = jnp.where(bent, -bend / jnp.where(bent, size, 1.0), jnp.asarray([0.0, 1.0]))
    return size * actuator.section.sides(towards)[0]


def raise_unless_converged(result: Equilibrium) -> Equilibrium:
    """Raise the status's sentence; under `jit` by a check, which the disk cache cannot keep."""
    if is_concrete(result.status):
        if not bool(solved(result.status)):
            raise RuntimeError(Status(int(result.status)).sentence)
        return result
    bad = ~solved(result.status)
    return eqx.branched_error_if(result, bad, result.status, [s.sentence for s in Status])
