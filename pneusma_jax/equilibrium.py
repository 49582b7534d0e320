"""The balance of force and moment on the end cap, and the one root-find that solves it: Section 3.5.

The configuration is `(delta_c, theta)`; scaled by length and radius it is `B z` with `B` the actuator's basis
of free directions. The residual is the resultant force and moment about the centre line, non-dimensional,
projected on the same basis (virtual work), so that an inextensible fibre's unknown pull drops out. For two
opposing springs this is Eqs. 3.35 and 3.36 with the signs of correction 8: sides pull back, pressure pushes.
"""

import enum
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Float, Int, PyTree

from ._linear import SmallDense, solve_small
from ._numerics import is_concrete, safe_norm
from .actuator import Actuator
from .chain import PLAIN, Chain
from .nitinol import SpringResponse, SpringState
from .nitinol.spring import Activation, MartensiteFraction, Resistance
from .precision import require_float64

REFERENCE_MODULUS = 1e5  # Pa, of the order of the silicone's; makes the residual of order one
MOST_STEPS = 30  # of Newton, per attempt
PHASE_TRIES = (0.9, 0.6, 0.3)  # first trial phases of measured springs where Newton fails from the start
LOAD_STEPS = 16  # in which the load is brought on where Newton fails from the start
BALANCED = 1e-9  # largest scaled residual that counts as equilibrium
START_BEND = 10.0 / 56.0  # (delta_1 - delta_2) / L0 of the first trial: sides at +5 and -5 mm, as tried out
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


class Problem(eqx.Module):
    """One row to be solved.

    Attributes:
        actuator: what is loaded.
        pressure: gauge [Pa].
        activations: one per spring.
        states: what each spring remembers.
        chain: effects beyond the base model, with their memories.
    """

    actuator: Actuator
    pressure: Array
    activations: tuple[Activation, ...]
    states: tuple[SpringState, ...]
    chain: Chain = PLAIN


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
        return self.bend @ jnp.asarray(self.side_direction)

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


def spring_responses(problem: Problem, delta_centre: Array, bend: Array) -> tuple[SpringResponse, ...]:
    """Response of every spring in a configuration [m, rad]."""
    body = problem.actuator
    elongations = delta_centre + body.spring_places @ bend
    rows = zip(body.spring_numbers, body.springs, elongations, problem.activations, problem.states, strict=True)
    return tuple(
        spring.respond(x, activation, state, problem.chain.knowing(number=number))
        for number, spring, x, activation, state in rows
    )


def spring_pulls(problem: Problem, delta_centre: Array, bend: Array) -> tuple[Array, ...]:
    """Pull of every spring in a configuration [N]: `spring_responses` without what a balance does not need."""
    body = problem.actuator
    elongations = delta_centre + body.spring_places @ bend
    rows = zip(body.spring_numbers, body.springs, elongations, problem.activations, problem.states, strict=True)
    return tuple(
        spring.pull(x, activation, state, problem.chain.knowing(number=number))
        for number, spring, x, activation, state in rows
    )


def imbalance(problem: Problem, delta_centre: Array, bend: Array) -> tuple[Array, Array]:
    """Unbalanced pull and moment about the section's centre, Eqs. 3.35 and 3.36.

    Args:
        problem: the row.
        delta_centre: elongation of the centre line [m].
        bend: bend angle vector [rad], shape (2,).

    Returns:
        Force [N] and first moments of the pulls [N m], shape (2,); both zero in equilibrium.
    """
    body = problem.actuator
    strain, gradient = delta_centre / body.length, bend / body.length
    if body.planar:
        towards = body.side_direction
        force, moment = body.section.integrate_in_plane(body.silicone, strain, gradient @ towards, towards)
    else:
        force, moment = body.section.integrate(body.silicone, strain, gradient)
    push = problem.pressure * body.section.enclosed_area
    force, moment = force - push, moment - push * body.section.enclosed_centroid
    for place, pull in zip(body.spring_places, spring_pulls(problem, delta_centre, bend), strict=True):
        force, moment = force + pull, moment + pull * place
    if body.fibre_stiffness is not None:
        pull = body.fibre_stiffness * (delta_centre + body.fibre_place @ bend)
        force, moment = force + pull, moment + pull * body.fibre_place
    for load in body.loads:
        pull, turn = load.generalised_force(body.length + delta_centre, bend)
        force, moment = force + pull, moment + turn
    chain = problem.chain.knowing(actuator=body, delta_centre=delta_centre, bend=bend)
    if chain.acts_at("wall"):
        more = wall_excess(body, chain, delta_centre, bend)
        force, moment = force + more[0], moment + more[1]
    return chain.through("load", (force, moment), pressure=problem.pressure)


def wall_excess(body: Actuator, chain: Chain, delta_centre: Array, bend: Array) -> tuple[Array, Array]:
    """Force [N] and first moments [N m] of what effects add to the wall's stress, over fixed fibres."""
    places, area = chain.known["fibres"] if "fibres" in chain.known else body.fibres()
    strain = (delta_centre + places @ bend) / body.length
    base = body.silicone(strain)
    excess = area * (chain.through("wall", base, strain=strain, base=base) - base)
    return jnp.sum(excess), excess @ places


def configuration(actuator: Actuator, unknowns: Array) -> tuple[Array, Array]:
    """Elongation of the centre line [m] and bend angle vector [rad] of scaled unknowns."""
    scaled = actuator.basis @ unknowns
    return scaled[0] * actuator.length, scaled[1:] * actuator.length / actuator.section.radius


def residual(unknowns: Array, problem: Problem) -> Array:
    """Scaled imbalance in the free directions [1]; the function whose root is the equilibrium."""
    actuator = problem.actuator
    force, moment = imbalance(problem, *configuration(actuator, unknowns))
    radius = actuator.section.radius
    area, _, _ = actuator.section.moments()
    scaled = jnp.concatenate([force[None], moment / radius]) / (REFERENCE_MODULUS * area)
    return actuator.basis.T @ scaled


def start(actuator: Actuator) -> Array:
    """First trial: sides at +5 and -5 mm on a 56 mm actuator, as far as the free directions allow."""
    target = jnp.asarray([0.0, *(0.5 * START_BEND * actuator.side_direction)])
    basis = jax.lax.stop_gradient(actuator.basis)
    return solve_small(basis.T @ basis, basis.T @ target)


def solve(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
    *,
    guess: Array | None = None,
    throw: bool = True,
) -> Equilibrium:
    """Configuration in which force and moment balance.

    Newton's method first; what it leaves unsolved is tried again from rest with pressure, heat and loads
    brought on in steps, or, where a resistance was measured, with the phase as an unknown of its own.
    Derivatives come from the implicit function theorem, not from the iterations.

    Args:
        actuator: what is loaded.
        pressure: gauge [Pa], scalar (use `jax.vmap` or `solve_batch` for many).
        activations: one per spring, in the order of `actuator.spring_numbers`; cold where empty.
        states: what each spring remembers; fresh with the source's pre-strain 0.1924 where None.
        guess: scaled unknowns to start from, such as a neighbouring solution's.
        throw: raise where there is no solution; otherwise return NaN with a `status`.

    Raises:
        RuntimeError: if float64 is off, or, with `throw`, the sentence of the status.
        ValueError: if the number of activations or states is not the number of springs.
    """
    require_float64()
    count = len(actuator.springs)
    activations = tuple(activations) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = states if states is not None else tuple(SpringState.fresh(0.1924) for _ in range(count))
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
    problem = Problem(actuator, jnp.asarray(pressure, dtype=float), activations, tuple(states))
    result = _solve(problem, guess)
    return _raise_unless_converged(result) if throw else result


@eqx.filter_jit
def _solve(problem: Problem, guess: Array | None) -> Equilibrium:
    """`solve` after its arguments are checked: one compiled program per design."""
    guess = start(problem.actuator) if guess is None else guess
    unknowns, steps = _find_root(problem, guess)
    return _equilibrium(problem, unknowns, steps)


def _raise_unless_converged(result: Equilibrium) -> Equilibrium:
    """Raise the status's sentence; under `jit` by a check, which the disk cache cannot keep."""
    if is_concrete(result.status):
        if int(result.status) != Status.converged:
            raise RuntimeError(Status(int(result.status)).sentence)
        return result
    bad = result.status != int(Status.converged)
    return eqx.branched_error_if(result, bad, result.status, [s.sentence for s in Status])


def _find_root(problem: Problem, guess: Array) -> tuple[Array, Array]:
    """Root of `residual` with implicit derivatives, and the number of Newton steps."""
    frozen = _frozen(problem)

    def search(_: object, guess: Array) -> tuple[Array, Array]:
        unknowns, steps = _search(frozen, guess)
        return unknowns, steps.astype(unknowns.dtype)  # custom_root gives integers no tangent

    def tangent(linear: Callable[[Array], Array], vector: Array) -> Array:
        return solve_small(jax.jacfwd(linear)(vector), vector)

    unknowns, steps = jax.lax.custom_root(
        lambda z: residual(z, problem), guess, search, tangent, has_aux=True
    )
    return unknowns, jax.lax.stop_gradient(steps).astype(int)


def _frozen(tree: PyTree) -> PyTree:
    """The same numbers without derivatives."""
    return jax.tree.map(lambda x: jax.lax.stop_gradient(x) if eqx.is_array(x) else x, tree)


def _newton(problem: Problem, guess: Array) -> tuple[Array, Array, Array]:
    """Newton's method: unknowns, number of steps, and whether force and moment balance there."""
    solver = optx.Newton(rtol=1e-9, atol=1e-9, linear_solver=SmallDense())
    found = optx.root_find(residual, solver, guess, problem, max_steps=MOST_STEPS, throw=False)
    good = jnp.max(jnp.abs(residual(found.value, problem))) < BALANCED
    return found.value, found.stats["num_steps"], good


def _search(problem: Problem, guess: Array) -> tuple[Array, Array]:
    """Newton from the guess; where that fails, `_by_phase` for measured springs, `_by_load` for others.

    A row that is not finite ends at once: its first linear solve reports a singular matrix.
    """
    if any(isinstance(activation, Resistance) for activation in problem.activations):
        return _search_by_phase(problem, guess)
    return _search_by_load(problem, guess)


def _search_by_load(problem: Problem, guess: Array) -> tuple[Array, Array]:
    """Newton from the guess; where that fails, from rest with the load brought on in `LOAD_STEPS` steps.

    Both are passes of one loop, so that one Newton is compiled and a batch without failures makes one pass.
    """
    cold = tuple(MartensiteFraction(jnp.ones_like(a.value)) for a in problem.activations)
    unloaded = problem.actuator.with_loads(*jax.tree.map(jnp.zeros_like, problem.actuator.loads))
    rest = Problem(unloaded, jnp.zeros_like(problem.pressure), cold, problem.states, problem.chain)
    possible = _all_finite(problem)

    def attempt(carry: tuple) -> tuple:
        stage, unknowns, steps, _ = carry
        share = jnp.where(stage == 0, 1.0, stage / LOAD_STEPS)
        mix = lambda a, b: a + share * (b - a) if eqx.is_inexact_array(a) else a  # noqa: E731
        found, more, good = _newton(jax.tree.map(mix, rest, problem), unknowns)
        unsolved = jnp.where(stage == 0, start(problem.actuator), unknowns)
        done = good & (share == 1.0)
        return stage + 1, jnp.where(good, found, unsolved), steps + more, done

    def unfinished(carry: tuple) -> Array:
        return (carry[0] <= LOAD_STEPS) & ~carry[3] & possible

    first = (jnp.asarray(0), guess, jnp.asarray(0), jnp.asarray(False))
    _, unknowns, steps, _ = jax.lax.while_loop(unfinished, attempt, first)
    return unknowns, steps


def _search_by_phase(problem: Problem, guess: Array) -> tuple[Array, Array]:
    """Newton from the guess; where that fails, from what `_by_phase` finds with several trial phases."""
    unknowns, steps, good = _newton(problem, guess)
    wanted = _all_finite(problem) & ~good

    def attempt(carry: tuple) -> tuple:
        count, _, steps, _ = carry
        trial, more = _by_phase(problem, jnp.asarray(PHASE_TRIES)[count])
        unknowns, last, good = _newton(problem, trial)
        return count + 1, unknowns, steps + more + last, wanted & ~good

    def unfinished(carry: tuple) -> Array:
        return (carry[0] < len(PHASE_TRIES)) & carry[3]

    first = (jnp.asarray(0), unknowns, steps, wanted)
    _, unknowns, steps, _ = jax.lax.while_loop(unfinished, attempt, first)
    return unknowns, steps


def _by_phase(problem: Problem, phase: Array) -> tuple[Array, Array]:
    """Newton with the phase of each measured spring as an unknown of its own, from a trial phase."""
    actuator = problem.actuator
    free = actuator.basis.shape[1]

    def joint(trial: Array, problem: Problem) -> Array:
        unknowns, phases = trial[:free], jnp.abs(trial[free:])
        assumed = tuple(
            MartensiteFraction(x) if isinstance(a, Resistance) else a
            for x, a in zip(phases, problem.activations, strict=True)
        )
        centre, bend = configuration(actuator, unknowns)
        elongations = centre + actuator.spring_places @ bend
        numbers = actuator.spring_numbers
        rows = zip(numbers, actuator.springs, problem.activations, elongations, phases, strict=True)
        told = [
            a.mismatch(spring, x, xi0, problem.chain.knowing(number=number))
            if isinstance(a, Resistance)
            else xi0 - a.value
            for number, spring, a, x, xi0 in rows
        ]
        given = Problem(actuator, problem.pressure, assumed, problem.states, problem.chain)
        return jnp.concatenate([residual(unknowns, given), jnp.stack(told)])

    guess = jnp.concatenate([start(actuator), jnp.full(len(actuator.springs), phase)])
    newton = optx.Newton(rtol=1e-9, atol=1e-9)
    found = optx.root_find(joint, newton, guess, problem, max_steps=2 * MOST_STEPS, throw=False)
    return found.value[:free], found.stats["num_steps"]


def _all_finite(problem: Problem) -> Array:
    """Whether every number of the row is finite: zero times a number is zero only then."""
    leaves = jax.tree.leaves(eqx.filter(problem, eqx.is_inexact_array))
    return sum(jnp.sum(0.0 * leaf) for leaf in leaves) == 0.0


def _equilibrium(problem: Problem, unknowns: Array, steps: Array) -> Equilibrium:
    """Result of a root, with its status; NaN where it is none."""
    actuator = problem.actuator
    delta_centre, bend = configuration(actuator, unknowns)
    # what is left unbalanced is a check: without tangents it costs a third less to differentiate a row
    size = jnp.max(jnp.abs(residual(*_frozen((unknowns, problem)))))
    slimmest = (delta_centre - _reach(actuator, bend)) / actuator.length
    side_1, side_2 = actuator.section.sides(jnp.asarray(actuator.side_direction))
    status = jnp.select(
        [~_all_finite(problem), ~(size < BALANCED), slimmest < SHORTEST],
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


@eqx.filter_jit
def solve_batch(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
) -> Equilibrium:
    """`solve` for many rows at once; a row without solution reports its `status` and stops no other.

    Args:
        actuator: the same for every row.
        pressure: gauge [Pa], shape (rows,).
        activations: one per spring, their arrays of shape (rows,).
        states: one per spring, their arrays of shape (rows,) or (); fresh where None.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of rows.
    """
    rows = jnp.shape(pressure)[0]
    spread = lambda tree: jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *jnp.shape(x)[1:])), tree)  # noqa: E731
    return jax.vmap(lambda p, a, s: solve(actuator, p, a, s, throw=False))(
        jnp.asarray(pressure), spread(activations), None if states is None else spread(states)
    )
