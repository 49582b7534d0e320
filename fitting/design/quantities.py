"""Quantities of a solved state by which designs are judged; each is a differentiable function with a unit.

A quantity of a segment gives one number, or one for every spring. Quantities of the tip are those of the
whole body. To add one, write a function of `Solved` and a segment's index, and give it a line in
`QUANTITIES`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array

from pneusma_jax.actuator import Actuator
from pneusma_jax.actuator.balance import Problem, imbalance
from pneusma_jax.actuator.result import Equilibrium
from pneusma_jax.late import optimistix as optx
from pneusma_jax.nitinol import MartensiteFraction, Spring
from pneusma_jax.numerics.linear import solve_small
from pneusma_jax.numerics.newton import BoundedNewton
from pneusma_jax.numerics.safe import safe_norm
from pneusma_jax.section.shapes import Disc
from pneusma_jax.serial_chain.kinematics import sinc_root
from pneusma_jax.simulate.rest import problem_at_rest

from .bodies import Solved

STEPS = 30
"""Largest number of Newton steps of a blocked actuator. Its force over elongation rises all along; 4 to 8
are needed."""
WARMEST = 1e-3
"""Least fraction of which a temperature is computed [1]: the curve of Section 2.4.3 reaches 0 at no
temperature."""


@dataclass(frozen=True)
class Quantity:
    """Function of a quantity, and its presentation.

    Attributes:
        function: computes it from a solved state and the index of a segment, from 0.
        dimension: key of `units.INTERNAL_UNITS`; unit: unit in which it is shown.
        what: description in words.
        springs: true if there is one number for every spring.
        whole: true if it belongs to the whole body.
        tested: end of the range in which the material was tested, from a solved state and a segment; None
            where there is no such range.
        planar: true if it needs bending in a plane.
        jumps: true if it jumps with a design, as a tangent does at a corner of the springs' law.
    """

    function: Callable[[Solved, int], Array]
    dimension: str
    unit: str
    what: str
    springs: bool = False
    whole: bool = False
    tested: Callable[[Solved, int], Array] | None = None
    planar: bool = False
    jumps: bool = False


def _of(name: str) -> Callable[[Solved, int], Array]:
    return lambda solved, k: getattr(solved.segments[k], name)


def _per_spring(name: str) -> Callable[[Solved, int], Array]:
    return lambda solved, k: jnp.stack([getattr(spring, name) for spring in solved.segments[k].springs])


def _tip(axis: int) -> Callable[[Solved, int], Array]:
    return lambda solved, k: solved.end_pose[axis, 3]


def _extreme(actuator: Actuator, bend: Array, end: int) -> Array:
    """Elongation of the longest (1) or shortest (-1) side over that of the centre line [m]."""
    if actuator.planar:
        side_1, side_2 = actuator.section.sides(jnp.asarray(actuator.side_direction))
        angle = bend @ jnp.asarray(actuator.side_direction)
        return jnp.where(end * angle > 0.0, angle * side_1, angle * side_2)
    size = safe_norm(bend)
    held = jax.lax.stop_gradient(bend) + jnp.asarray([0.0, 1e-12])  # any direction, where it is straight
    return end * size * actuator.section.sides(end * held / safe_norm(held))[0]


def _silicone(end: int) -> Callable[[Solved, int], Array]:
    """Largest (1) or smallest (-1) strain of the wall."""

    def strain(solved: Solved, k: int) -> Array:
        body, found = solved.body.segments[k], solved.segments[k]
        return (found.delta_centre + _extreme(body, found.bend, end)) / body.length

    return strain


def clearance(solved: Solved, k: int) -> Array:
    """Free space between parts of the body [m]; see `serial_chain.clearance`."""
    if solved.chain is not None:
        return solved.chain.shape.clearance().smallest
    found, body = solved.segments[0], solved.body.segments[0]
    square = jnp.sum(found.bend**2)
    apart = found.length * sinc_root(0.25 * square) - 2.0 * body.section.radius
    return jnp.minimum(apart, found.length + _extreme(body, found.bend, -1))


def bending_stiffness(solved: Solved, k: int) -> Array:
    """Moment over bend angle at the held phases [N m/rad]; the elongation follows as the segment lets it.

    It is free but for an inextensible fibre, which ties it to the bend. The stiffness is a tangent, so it
    jumps where a spring's strain passes the corner of its stress law.
    """
    problem, found = balance_of(solved, k)
    side, ways = jnp.asarray(problem.actuator.side_direction), _ways(problem.actuator)

    def pull(x: Array) -> Array:
        force, moment = imbalance(problem, x[0], x[1:])
        return jnp.concatenate([force[None], moment])

    slope = jax.jacfwd(pull)(jnp.concatenate([found.delta_centre[None], found.bend]))
    turned = side @ ways[1:]  # bend in the plane by each way
    return 1.0 / (turned @ solve_small(ways.T @ slope @ ways, turned))


def _ways(actuator: Actuator) -> Array:
    """Elongation [m] and bend [rad] by each way in which a segment can move, shape (3, freedoms)."""
    length = actuator.length
    return jnp.stack([length, *(length / actuator.section.radius,) * 2])[:, None] * actuator.basis


def blocking_force(solved: Solved, k: int) -> Array:
    """Force across the tip that keeps a segment straight at its pressure and phases [N].

    An arc's tip moves across by half its length times the bend angle, so the force is the moment over half
    the length. An inextensible fibre keeps the length; its pull adds to the moment.
    """
    problem, _ = balance_of(solved, k)
    side = jnp.asarray(problem.actuator.side_direction)
    length, held = problem.actuator.length, jnp.zeros(())
    if problem.actuator.freedoms == 1:
        (along, *across), straight = _ways(problem.actuator)[:, 0], 0.0 * side
        force, moment = imbalance(problem, held, straight)
        return jnp.abs(moment @ side + force * along / (jnp.stack(across) @ side)) / (0.5 * length)
    excess = lambda share, p: imbalance(p, share[0] * length, 0.0 * side)[0][None]  # noqa: E731
    found = optx.root_find(  # type: ignore[var-annotated]
        excess, BoundedNewton(), jnp.zeros(1), problem, max_steps=STEPS, throw=False
    )
    held = jnp.where(found.result == optx.RESULTS.successful, found.value[0] * length, jnp.nan)
    moment = imbalance(problem, held, 0.0 * side)[1] @ side
    return jnp.abs(moment) / (0.5 * (length + held))


def balance_of(solved: Solved, k: int) -> tuple[Problem, Equilibrium]:
    """The balance of a segment at its phases, effects included, and its equilibrium."""
    body, segment, found = solved.body, solved.body.segments[k], solved.segments[k]
    drives = tuple(MartensiteFraction(spring.xi0) for spring in found.springs)
    at = solved.pressure, drives, segment.fresh_states(), body.gravity
    return problem_at_rest(segment, body.effects, *at), found


def hoop_stress(solved: Solved, k: int) -> Array:
    """Largest circumferential stress of a round wall, at the bore: Lamé's [Pa]."""
    outer, inner = _radii(solved, k)
    return solved.pressure * (outer**2 + inner**2) / (outer**2 - inner**2)


def _radii(solved: Solved, k: int) -> tuple[Array, Array]:
    discs = [shape for shape in solved.body.segments[k].section.shapes if isinstance(shape, Disc)]
    return discs[0].radius, discs[1].radius


def temperature(solved: Solved, k: int) -> Array:
    """Temperature of every wire at its fraction, by the reversible curve [degC]."""
    pairs = zip(solved.body.segments[k].springs, solved.segments[k].springs, strict=True)
    return jnp.stack([wire_temperature(spring, found.xi0) for spring, found in pairs])


def wire_temperature(spring: Spring, xi0: Array) -> Array:
    """Temperature of a wire at a fraction, clipped at `WARMEST`, by the reversible curve [degC]."""
    alloy, xi0 = spring.alloy, jnp.clip(xi0, WARMEST, 1.0 - WARMEST)
    return alloy.T_mid + alloy.T_width * jnp.log((1.0 - xi0) / xi0)


def convected(spring: Spring, warm: Array) -> Array:
    """Power that a wire gives to the air, at a rise over its temperature [K] -> [W]."""
    geometry = spring.geometry
    surface = jnp.pi * geometry.wire_diameter * geometry.wire_length
    return spring.alloy.convection * surface * warm


def heating_power(solved: Solved, k: int) -> Array:
    """Electrical power that keeps all springs at their temperatures in air of 22 degC [W]; 0 for a cold
    one."""
    total = jnp.zeros(())
    for j, body in enumerate(solved.body.segments):
        if not body.springs:
            continue
        for spring, found, degrees in zip(
            body.springs, solved.segments[j].springs, temperature(solved, j), strict=True
        ):
            power = convected(spring, jnp.maximum(degrees - AMBIENT, 0.0))
            total = total + jnp.where(found.xi0 < 1.0, power, 0.0)
    return total


AMBIENT = 22.0
"""Temperature of the air [degC], as the springs' heat balance has it where nothing else is given."""


def _spring(function: Callable) -> Callable[[Solved, int], Array]:
    return lambda solved, k: jnp.stack([function(spring) for spring in solved.body.segments[k].springs])


def _outer(solved: Solved, k: int) -> Array:
    return 2.0 * _radii(solved, k)[0]


def _bore(solved: Solved, k: int) -> Array:
    return 2.0 * _radii(solved, k)[1]


def _with_springs(solved: Solved, k: int) -> Array:
    """Diameter of a round tube with the coils of its springs outside on it [m]."""
    outer, _ = _radii(solved, k)
    coils = [s.geometry.coil_diameter + s.geometry.wire_diameter for s in solved.body.segments[k].springs]
    return 2.0 * outer + 2.0 * (jnp.max(jnp.stack(coils)) if coils else 0.0)


def _mass(solved: Solved, k: int) -> Array:
    """Mass of a segment's wires [kg]."""
    springs = solved.body.segments[k].springs
    area = lambda s: 0.25 * jnp.pi * s.geometry.wire_diameter**2  # noqa: E731
    return sum((s.alloy.density * area(s) * s.geometry.wire_length for s in springs), jnp.zeros(()))


def _wound(spring: Spring) -> Array:
    return spring.geometry.coil_diameter / spring.geometry.wire_diameter


def _pitch(spring: Spring) -> Array:
    return spring.geometry.initial_pitch / spring.geometry.wire_diameter


def _stretch(spring: Spring) -> Array:
    return spring.attached_length / spring.geometry.free_length


_tested_wall = lambda end: lambda solved, k: jnp.asarray(solved.body.segments[k].silicone.tested[end])  # noqa: E731

QUANTITIES: dict[str, Quantity] = {
    "curvature": Quantity(_of("curvature"), "curvature", "1/m", "curvature of the centre line"),
    "bend_angle": Quantity(_of("bend_angle"), "angle", "deg", "bend angle"),
    "bend_magnitude": Quantity(_of("bend_magnitude"), "angle", "deg", "size of the bend angle"),
    "length": Quantity(_of("length"), "length", "mm", "length of the centre line"),
    "tip_x": Quantity(_tip(0), "length", "mm", "place of the tip across", whole=True),
    "tip_y": Quantity(_tip(1), "length", "mm", "place of the tip, towards side 1", whole=True),
    "tip_z": Quantity(_tip(2), "length", "mm", "place of the tip along the straight tube", whole=True),
    "shear_strain": Quantity(
        _per_spring("gamma"), "number", "1", "shear strain of the wire", springs=True,
        tested=lambda solved, k: jnp.stack([s.alloy.gamma_max for s in solved.body.segments[k].springs]),
    ),
    "silicone_strain_max": Quantity(
        _silicone(1), "number", "1", "largest strain of the wall", tested=_tested_wall(1)
    ),
    "silicone_strain_min": Quantity(
        _silicone(-1), "number", "1", "smallest strain of the wall", tested=_tested_wall(0)
    ),
    "clearance": Quantity(clearance, "length", "mm", "free space between parts", whole=True),
    "spring_force": Quantity(_per_spring("force"), "force", "N", "pull of a spring", springs=True),
    "resistance": Quantity(_per_spring("resistance"), "resistance", "ohm", "resistance of a spring", True),
    "temperature": Quantity(temperature, "temperature", "degC", "temperature of a wire", springs=True),
    "heating_power": Quantity(heating_power, "power", "W", "power that keeps the springs warm", whole=True),
    "bending_stiffness": Quantity(
        bending_stiffness, "moment per angle", "N mm/rad", "bending stiffness at held phases", planar=True,
        jumps=True,
    ),
    "blocking_force": Quantity(blocking_force, "force", "mN", "force that keeps it straight", planar=True),
    "hoop_stress": Quantity(hoop_stress, "pressure", "kPa", "circumferential stress at the bore"),
    "outer_diameter": Quantity(_outer, "length", "mm", "outer diameter of the tube"),
    "outer_diameter_with_springs": Quantity(_with_springs, "length", "mm", "diameter over the springs"),
    "bore_diameter": Quantity(_bore, "length", "mm", "diameter of the bore"),
    "spring_index": Quantity(_spring(_wound), "number", "1", "coil over wire diameter", springs=True),
    "pitch_ratio": Quantity(_spring(_pitch), "number", "1", "pitch over wire diameter", springs=True),
    "stretch_ratio": Quantity(_spring(_stretch), "number", "1", "attached over free length", springs=True),
    "wire_mass": Quantity(_mass, "mass", "g", "mass of the wires"),
}  # fmt: skip
"""Quantities by the name that studies use."""

SAME_IN_EVERY_STATE = (
    "outer_diameter", "outer_diameter_with_springs", "bore_diameter", "spring_index", "pitch_ratio",
    "stretch_ratio", "wire_mass",
)  # fmt: skip
"""Quantities that are the same in every state."""
ROUND_ONLY = ("hoop_stress", "outer_diameter", "outer_diameter_with_springs", "bore_diameter")
"""Quantities that only round tubes have."""
