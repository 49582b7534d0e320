"""The one root-find: Newton's method, what is tried where it fails, and implicit derivatives of the root."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from ._linear import SmallDense, solve_small
from ._numerics import frozen
from .balance import Problem, all_finite, configuration, residual, start
from .nitinol.spring import MartensiteFraction, Resistance

MOST_STEPS = 30  # of Newton, per attempt
PHASE_TRIES = (0.9, 0.6, 0.3)  # first trial phases of measured springs where Newton fails from the start
LOAD_STEPS = 16  # in which the load is brought on where Newton fails from the start
BALANCED = 1e-9  # largest scaled residual that counts as equilibrium


def find_root(problem: Problem, guess: Array) -> tuple[Array, Array]:
    """Root of `residual` with implicit derivatives, and the number of Newton steps."""
    held = frozen(problem)

    def search(_: object, guess: Array) -> tuple[Array, Array]:
        unknowns, steps = _search(held, guess)
        return unknowns, steps.astype(unknowns.dtype)  # custom_root gives integers no tangent

    def tangent(linear: Callable[[Array], Array], vector: Array) -> Array:
        return solve_small(jax.jacfwd(linear)(vector), vector)

    unknowns, steps = jax.lax.custom_root(
        lambda z: residual(z, problem), guess, search, tangent, has_aux=True
    )
    return unknowns, jax.lax.stop_gradient(steps).astype(int)


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
    possible = all_finite(problem)

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
    wanted = all_finite(problem) & ~good

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
