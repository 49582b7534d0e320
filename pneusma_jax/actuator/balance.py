"""The balance of force and moment on the end cap: Section 3.5.

The configuration is `(delta_c, theta)`. Scaled by length and radius it is `B z`, with `B` the actuator's
basis of free directions. The residual is the resultant force and moment about the centre line. It is
non-dimensional and projected on the same basis (virtual work), so that the unknown pull of an inextensible
fibre drops out. For two opposing springs this is Eqs. 3.35 and 3.36 with the signs of correction 8: springs
pull back, pressure pushes.
"""

from collections.abc import Callable, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol import SpringResponse, SpringState
from ..nitinol.spring import Activation, LocatedFraction, MartensiteFraction, Resistance, Spring
from ..numerics.alike import map_alike
from ..numerics.linear import solve_small
from ..pipeline import PLAIN, WALL, Pipeline
from . import Actuator

REFERENCE_MODULUS = 1e5
"""Modulus that scales the residual [Pa], of the order of the silicone's: the residual is of order one."""
END_TOLERANCE = 1e-6
"""Tolerance on the resistance of a fully cold or fully hot spring, as a part of the contrast between the
phases [1]. It is about half a micro-ohm of a spring; instruments read to 1e-4 ohm."""
END_DEVIATIONS = 3.0
"""Number of standard deviations of a noisy reading by which the resistance of such a spring may miss it."""
START_BEND = 10.0 / 56.0
"""Difference of the sides' elongations in the first trial, over the rest length [1]; 5 mm on 56 mm each."""


class Problem(eqx.Module):
    """One row to be solved.

    Attributes:
        actuator: the actuator that is loaded.
        pressure: gauge [Pa].
        activations: one per spring.
        states: memory of each spring.
        pipeline: effects beyond the base model, with their memories.
    """

    actuator: Actuator
    pressure: Array
    activations: tuple[Activation, ...]
    states: tuple[SpringState, ...]
    pipeline: Pipeline = PLAIN


def spring_responses(problem: Problem, delta_centre: Array, bend: Array) -> tuple[SpringResponse, ...]:
    """Response of every spring in a configuration [m, rad]."""
    return _each_spring(Spring.respond, problem, delta_centre, bend)


def spring_pulls(problem: Problem, delta_centre: Array, bend: Array) -> tuple[Array, ...]:
    """Pull of every spring in a configuration [N], without the rest of its response, which costs more."""
    if _plain(problem):
        return tuple(_each_plain(Spring.plain_pull, problem, delta_centre, bend))
    return _each_spring(Spring.pull, problem, delta_centre, bend)


def _plain(problem: Problem) -> bool:
    """True if no effect acts, and the phases of all springs are given fractions."""
    given = all(isinstance(a, MartensiteFraction) for a in problem.activations)
    return given and not problem.pipeline.effects


def _each_plain(method: Callable, problem: Problem, delta_centre: Array, bend: Array) -> list:
    """Results of a method for every spring of a row as in `_plain`, from elongation, fraction and state."""
    body = problem.actuator
    fractions = [a.value for a in problem.activations]
    elongations = delta_centre + body.spring_places @ bend
    return map_alike(method, list(zip(body.springs, elongations, fractions, problem.states, strict=True)))


def _each_spring(method: Callable, problem: Problem, delta_centre: Array, bend: Array) -> tuple:
    """Results of a method for every spring, from its elongation, activation, state and pipeline."""
    body = problem.actuator
    elongations = delta_centre + body.spring_places @ bend
    rows = list(zip(body.springs, elongations, problem.activations, problem.states, strict=True))
    if not problem.pipeline.effects:
        return tuple(map_alike(method, rows))
    # effects ask for a spring by its number
    numbered = zip(body.spring_numbers, rows, strict=True)
    return tuple(method(*row, problem.pipeline.with_known(number=number)) for number, row in numbered)


def imbalance(
    problem: Problem,
    delta_centre: Array,
    bend: Array,
    orders: int = 3,
    pulls: Sequence[Array] | None = None,
    wall: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Unbalanced pull and moment about the section's centre, Eqs. 3.35 and 3.36.

    Args:
        problem: the row.
        delta_centre: elongation of the centre line [m].
        bend: bend angle vector [rad], shape (2,).
        orders: static; up to which derivatives by the configuration are exact, 1 to 3.
        pulls: pulls of the springs [N], where they are known.
        wall: force [N] and first moments [N m] of the wall's axial stress, where they are known.

    Returns:
        Force [N] and first moments of the pulls [N m], shape (2,); both zero in equilibrium.
    """
    body = problem.actuator
    strain, gradient = delta_centre / body.length, bend / body.length
    if wall is not None:
        force, moment = wall
    elif body.planar:
        towards = body.side_direction
        force, moment = body.section.integrate_in_plane(body.silicone, strain, gradient @ towards, towards)
    else:
        force, moment = body.section.integrate(body.silicone, strain, gradient, orders)
    push = problem.pressure * body.section.enclosed_area
    force, moment = force - push, moment - push * body.section.enclosed_centroid
    pulls = spring_pulls(problem, delta_centre, bend) if pulls is None else pulls
    for place, pull in zip(body.spring_places, pulls, strict=True):
        force, moment = force + pull, moment + pull * place
    if body.fibre_stiffness is not None:
        pull = body.fibre_stiffness * (delta_centre + body.fibre_place @ bend)
        force, moment = force + pull, moment + pull * body.fibre_place
    for load in body.loads:
        pull, turn = load.generalised_force(body.length + delta_centre, bend)
        force, moment = force + pull, moment + turn
    pipeline = problem.pipeline.with_known(actuator=body, delta_centre=delta_centre, bend=bend)
    if pipeline.acts_at(WALL):
        none = jnp.zeros_like(force), jnp.zeros_like(moment)
        excess = lambda *at: wall_excess(body, pipeline, *at)  # noqa: E731
        more = pipeline.where_acting(WALL, excess, lambda *_: none, delta_centre, bend)
        force, moment = force + more[0], moment + more[1]
    return pipeline.apply("load", (force, moment), pressure=problem.pressure)


def wall_excess(body: Actuator, pipeline: Pipeline, delta_centre: Array, bend: Array) -> tuple[Array, Array]:
    """Force [N] and first moments [N m] of what effects add to the wall's stress, over fixed fibres."""
    places, area = pipeline.known["fibres"] if "fibres" in pipeline.known else body.fibres()
    strain = (delta_centre + places @ bend) / body.length
    base = body.silicone(strain)
    excess = area * (pipeline.wall_stress(base, strain) - base)
    return jnp.sum(excess), excess @ places


def configuration(actuator: Actuator, unknowns: Array) -> tuple[Array, Array]:
    """Elongation of the centre line [m] and bend angle vector [rad] of scaled unknowns."""
    scaled = actuator.basis @ unknowns
    return scaled[0] * actuator.length, scaled[1:] * actuator.length / actuator.section.radius


def residual(
    unknowns: Array,
    problem: Problem,
    orders: int = 3,
    pulls: Sequence[Array] | None = None,
    wall: tuple[Array, Array] | None = None,
) -> Array:
    """Scaled imbalance in the free directions [1], phases as the activations read them; see `imbalance`."""
    actuator = problem.actuator
    force, moment = imbalance(problem, *configuration(actuator, unknowns), orders, pulls, wall)
    radius = actuator.section.radius
    area, _, _ = actuator.section.moments()
    scaled = jnp.concatenate([force[None], moment / radius]) / (REFERENCE_MODULUS * area)
    return actuator.basis.T @ scaled


def freedoms(problem: Problem) -> int:
    """Number of scaled coordinates of the configuration."""
    return problem.actuator.freedoms


def measured(problem: Problem) -> tuple[int, ...]:
    """Indices of the springs whose phase follows from a measured resistance."""
    return tuple(k for k, a in enumerate(problem.activations) if isinstance(a, Resistance))


def at_phases(problem: Problem, phases: Array, kind: Callable = LocatedFraction) -> Problem:
    """The problem with the fractions of its measured springs given.

    Args:
        problem: one row.
        phases: fractions, shape (measured,).
        kind: class of the activations; `MartensiteFraction` has no flags about the reading, and the balance
            asks for none.
    """
    activations = list(problem.activations)
    for k, xi0 in zip(measured(problem), phases, strict=True):
        more = () if kind is MartensiteFraction else (activations[k],)
        activations[k] = kind(xi0, *more)
    return eqx.tree_at(lambda p: p.activations, problem, tuple(activations))


def joint_residual(
    unknowns: Array,
    problem: Problem,
    orders: int = 3,
    held: tuple[Array, Array] | None = None,
    responses: tuple[SpringResponse, ...] | None = None,
) -> Array:
    """Scaled imbalance, and for every measured spring what its resistance misses [1].

    The unknowns are the scaled configuration and the fractions of the measured springs, limited to [0, 1]. So
    full heat and both ends are regular. A fraction stays at an end while the resistance lies beyond the range
    of the phases, within `END_TOLERANCE`. Its equation then says that it is at that end (correction 14).

    Args:
        unknowns: shape (freedoms + measured,).
        problem: one row.
        orders: see `imbalance`.
        held: fractions that are given whatever the resistances: true for each that is, and their values, both
            of shape (measured,).
        responses: responses of the springs at these unknowns, where they are known.
    """
    count, given = freedoms(problem), at_phases(problem, unknowns[freedoms(problem) :], MartensiteFraction)
    springs = _pulls_and_resistances(unknowns[:count], given, bool(measured(problem)), responses)
    pulls = None if springs is None else [pull for pull, _, _ in springs]
    unbalanced = residual(unknowns[:count], given, orders, pulls)
    if not measured(problem):
        return unbalanced
    if springs is not None and not problem.pipeline.effects:
        missed = jnp.stack([
            _missed(problem.actuator.springs[k], problem.activations[k], xi0, *springs[k][1:])
            for k, xi0 in zip(measured(problem), unknowns[count:], strict=True)
        ])  # fmt: skip
    else:
        missed = jnp.stack(_missed_with_effects(unknowns, problem, count))
    if held is not None:
        missed = jnp.where(held[0], unknowns[count:] - held[1], missed)
    return jnp.concatenate([unbalanced, missed])


def _pulls_and_resistances(
    unknowns: Array, given: Problem, needed: bool, responses: tuple[SpringResponse, ...] | None
) -> list | None:
    """Pull [N], resistance and contrast of the phases [ohm] of every spring; None where effects change them.

    Args:
        unknowns: scaled configuration, shape (freedoms,).
        given: one row, with the fractions of its measured springs given.
        needed: true if they are asked for where no responses are known.
        responses: see `joint_residual`.
    """
    if responses is not None:
        pairs = zip(given.actuator.springs, responses, strict=True)
        return [(r.force, r.resistance, spring.contrast(r.gamma)) for spring, r in pairs]
    if not (needed and _plain(given)):
        return None
    return _each_plain(Spring.plain_pull_and_resistance, given, *configuration(given.actuator, unknowns))


def _missed_with_effects(unknowns: Array, problem: Problem, count: int) -> list[Array]:
    """What the resistance of every measured spring misses [1], with effects; see `joint_residual`."""
    actuator = problem.actuator
    centre, bend = configuration(actuator, unknowns[:count])
    elongations = centre + actuator.spring_places @ bend
    rows = []
    for k, xi0 in zip(measured(problem), unknowns[count:], strict=True):
        spring, activation = actuator.springs[k], problem.activations[k]
        pipeline = problem.pipeline.with_known(number=actuator.spring_numbers[k])
        excess, contrast = activation.excess(spring, elongations[k], xi0, pipeline)
        rows.append(_missed(spring, activation, xi0, excess + activation.value, contrast))
    return rows


def _missed(spring: Spring, activation: Resistance, xi0: Array, ohms: Array, contrast: Array) -> Array:
    """What the resistance of a spring misses of the measured one [1].

    Args:
        spring: the spring.
        activation: its measured resistance.
        xi0: its martensite fraction [1].
        ohms: resistance that it has [ohm].
        contrast: resistance of martensite less that of austenite, at its strain [ohm].
    """
    scale = jax.lax.stop_gradient(spring.contrast_at_rest)
    missed = (ohms - activation.value) / scale
    missed = missed * jax.lax.stop_gradient(jnp.where(contrast < 0.0, -1.0, 1.0))
    surplus = jax.lax.stop_gradient(missed)
    within = END_TOLERANCE + END_DEVIATIONS * activation.noise / scale
    cold = (xi0 >= 1.0) & (surplus <= within)
    hot = (xi0 <= 0.0) & (surplus >= -within)
    end = jnp.where(cold, 1.0, 0.0)
    return jnp.where(cold | hot, xi0 - end, missed)


def first_trial(actuator: Actuator) -> Array:
    """First trial: sides at +5 and -5 mm on a 56 mm actuator, as far as the free directions allow."""
    target = jnp.asarray([0.0, *(0.5 * START_BEND * actuator.side_direction)])
    basis = jax.lax.stop_gradient(actuator.basis)
    return solve_small(basis.T @ basis, basis.T @ target)


def all_finite(problem: Problem) -> Array:
    """True if every number of the row is finite: zero times their sum is zero only then."""
    leaves = jax.tree.leaves(eqx.filter(problem, eqx.is_inexact_array))
    return 0.0 * sum(jnp.sum(leaf) if jnp.ndim(leaf) else leaf for leaf in leaves) == 0.0


def zeros_for_nan(problem: Problem, unknowns: Array) -> tuple[Problem, Array]:
    """The row with zeros for what is not finite.

    A NaN that is discarded later would still reach every reverse gradient.
    """
    safe = lambda x: jnp.where(jnp.isfinite(x), x, 0.0) if eqx.is_inexact_array(x) else x  # noqa: E731
    row = jax.tree.map(safe, (problem.pressure, problem.activations, problem.states, problem.pipeline))
    return Problem(problem.actuator, *row), safe(unknowns)
