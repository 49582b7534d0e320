"""Equilibrium of a loaded chain: force and moment of every segment at once, coupled by the loads between
them.

The unknowns are those of all segments, each as in `actuator.balance`. A segment's residual is the single
actuator's, under a generalised force (`actuator.loads.HeldLoad`). This force stands for all loads on the
segment and beyond it, and depends on the shape of the whole chain (`loads`). Segments of equal structure are
rows of one batch. The Jacobian consists of the segments' own blocks and the dense derivative of the loads.
Each block comes by forward differentiation. The derivative of the loads needs kinematics only.

Newton's method starts from the chain at rest: cold, without pressure and without load. First it applies
pressure, heat and loads at once. If that fails, or ends in an unstable equilibrium, it applies them in steps
of adaptive size. It thus follows the branch connected with rest. Every Newton step is a pass of one flat
loop, so a batch compiles one of them.

The method of `numerics.newton` is not used: it solves for at most three unknowns, and differentiates all
segments by all unknowns. A Jacobian then takes 14 % longer for 16 segments, and 30 % longer for 32.

A spring driven by its resistance has no known resistance at rest. Then the segments without loads take the
place of rest. `actuator.equilibrium.solve` finds them one by one.
"""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ..actuator.balance import Problem, configuration, residual
from ..actuator.loads import HeldLoad
from ..actuator.result import Equilibrium, Status, equilibrium_of, solved
from ..actuator.root_find import BALANCED
from ..nitinol import MartensiteFraction
from ..numerics.safe import as_array, frozen
from .loads import ChainLoad, generalised_forces

CONVERGED_STEP = 1e-10
"""Maximum Newton step in scaled unknowns at which an attempt ends. Steps shrink quadratically, so the
remaining error is far below the accuracy of the section's quadrature, 1e-10."""
MOST_STEPS = 40
"""Maximum number of Newton steps of one attempt; successful ones take 4 to 12."""
LONGEST_TURN = 2.0
"""Maximum rotation of the tip by one Newton step, summed over all segments' bends [rad]. Beyond it the loads
are no longer nearly linear in the shape. Five loaded chains of 16 segments were solved with limits of 1, 2, 4
and 8 and with none. The limit 2 took fewest steps (21 to 67, without limit 70 to 183), and 8 once ended in
another equilibrium."""
LONGEST_STRAIN = 0.3
"""Maximum change of a scaled unknown by one Newton step [1], a strain; as `longest` of `BoundedNewton`."""
LEAST_STRIDE = 1.0 / 512.0
"""Minimum share of the load that is applied at once; Newton fails there only where the branch ends."""
MOST_STEPS_IN_ALL = 1000
"""Maximum number of Newton steps of one chain, over all attempts."""


class ChainProblem(eqx.Module):
    """A loaded chain to be solved.

    Attributes:
        parts: segments without loads, those of one kind stacked along a leading axis.
        members: static; indices of the segments of each part, from 0.
        angles: mounting angles of the segments [rad], shape (n,).
        connectors: length of the rigid connector after each segment [m], shape (n,).
        loads: loads on the chain.
        share: share of the loads that acts [1].
    """

    parts: tuple[Problem, ...]
    members: tuple[tuple[int, ...], ...] = eqx.field(static=True)
    angles: Float[Array, "n"]
    connectors: Float[Array, "n"]
    loads: tuple[ChainLoad, ...]
    share: Array = eqx.field(converter=jnp.asarray, default=1.0)

    @property
    def order(self) -> np.ndarray:
        """Position of each segment when the parts are concatenated."""
        return np.argsort(np.concatenate([np.asarray(m) for m in self.members]))

    @property
    def rest_lengths(self) -> Float[Array, "n"]:
        """Rest lengths of the segments [m]."""
        return jnp.concatenate([part.actuator.length for part in self.parts])[self.order]


class ChainRoot(eqx.Module):
    """Unknowns at which the search for an equilibrium ended, and how it ended.

    Attributes:
        unknowns: unknowns of all segments, part after part.
        steps: number of Newton steps.
        found: true if force and moment of every segment balance under the whole load.
        stable: true if the equilibrium is stable: the symmetric part of the stiffness is positive definite.
    """

    unknowns: Float[Array, "unknowns"]
    steps: Array
    found: Array
    stable: Array


def split(problem: ChainProblem, unknowns: Float[Array, "unknowns"]) -> list[Float[Array, "members each"]]:
    """Unknowns of every part, one row per segment."""
    counts = [len(members) for members in problem.members]
    each = _sizes(problem, unknowns.shape[0])
    ends = np.cumsum([count * size for count, size in zip(counts, each, strict=True)])
    pieces = jnp.split(unknowns, ends[:-1])
    return [x.reshape(count, size) for x, count, size in zip(pieces, counts, each, strict=True)]


def _sizes(problem: ChainProblem, total: int) -> list[int]:
    """Number of unknowns of a segment of each part: its free directions."""
    sizes = [part.actuator.freedoms for part in problem.parts]
    if sum(size * len(members) for size, members in zip(sizes, problem.members, strict=True)) != total:
        raise ValueError("The unknowns must be the free directions of all segments, but their number is not.")
    return sizes


def load_forces(problem: ChainProblem, unknowns: Float[Array, "unknowns"]) -> Float[Array, "n 3"]:
    """Pull [N] and moments [N m] of all loads on each segment's own coordinates."""
    configured = [
        jax.vmap(lambda part, z: configuration(part.actuator, z))(part, z)
        for part, z in zip(problem.parts, split(problem, unknowns), strict=True)
    ]
    stretch = jnp.concatenate([each[0] for each in configured])[problem.order]
    bends = jnp.concatenate([each[1] for each in configured])[problem.order]
    rest = problem.rest_lengths
    pull, turn = generalised_forces(
        problem.loads, rest + stretch, bends, problem.angles, problem.connectors, rest
    )
    return problem.share * jnp.concatenate([pull[:, None], turn], axis=1)


def loaded(part: Problem, force: Float[Array, "3"]) -> Problem:
    """One segment under the generalised force that stands for the chain's loads."""
    return dataclasses.replace(part, actuator=part.actuator.with_loads(HeldLoad(force[0], force[1:])))


def chain_residual(unknowns: Float[Array, "unknowns"], problem: ChainProblem) -> Float[Array, "unknowns"]:
    """Scaled imbalance of every segment [1]. Its root is the loaded chain's equilibrium."""
    forces = load_forces(problem, unknowns)
    rows = [
        jax.vmap(lambda z, part, load: residual(z, loaded(part, load)))(z, part, forces[np.asarray(members)])
        for z, part, members in zip(split(problem, unknowns), problem.parts, problem.members, strict=True)
    ]
    return jnp.concatenate([row.ravel() for row in rows])


def chain_jacobian(
    unknowns: Float[Array, "unknowns"], problem: ChainProblem
) -> tuple[Float[Array, "unknowns"], Float[Array, "unknowns unknowns"]]:
    """`chain_residual` and its derivative, at the cost of one evaluation of each segment and its slopes."""

    def forces_and_value(z: Array) -> tuple[Array, Array]:
        forces = load_forces(problem, z)
        return forces, forces

    slopes, forces = jax.jacfwd(forces_and_value, has_aux=True)(unknowns)

    def of_segment(z: Array, part: Problem, load: Array) -> tuple[tuple[Array, Array], Array]:
        def imbalance_and_value(z: Array, load: Array) -> tuple[Array, Array]:
            imbalance = residual(z, loaded(part, load))
            return imbalance, imbalance

        return jax.jacfwd(imbalance_and_value, argnums=(0, 1), has_aux=True)(z, load)

    values: list[Array] = []
    rows: list[Array] = []
    column = 0
    for z, part, members in zip(split(problem, unknowns), problem.parts, problem.members, strict=True):
        index, (count, size) = np.asarray(members), z.shape
        (block, by_load), value = jax.vmap(of_segment)(z, part, forces[index])
        row = jnp.einsum("gfh,ghn->gfn", by_load, slopes[index])
        columns = column + np.arange(count * size).reshape(count, size)
        row = row.at[np.arange(count)[:, None, None], np.arange(size)[:, None], columns[:, None, :]].add(
            block
        )
        values.append(value.ravel())
        rows.append(row.reshape(count * size, -1))
        column += z.size
    return jnp.concatenate(values), jnp.concatenate(rows)


def _is_stable(problem: ChainProblem, jacobian: Array) -> Array:
    """True if the symmetric part of the stiffness is positive definite: its Cholesky factor exists.

    Rows of the Jacobian are forces over `REFERENCE_MODULUS * area`, columns elongations over the length.
    Their product makes them derivatives of one energy, as far as the loads have one.
    """
    energies = [
        jnp.repeat(
            jax.vmap(lambda a: a.section.moments()[0] * a.length)(part.actuator), part.actuator.freedoms
        )
        for part in problem.parts
    ]
    energy = jnp.concatenate(energies)
    stiffness = (energy / jnp.mean(energy))[:, None] * jacobian
    return jnp.all(jnp.isfinite(jnp.linalg.cholesky(0.5 * (stiffness + stiffness.T))))


class _SearchState(eqx.Module):
    """State of the loop of `search`. An attempt is Newton's method at one share of the load.

    Attributes:
        unknowns: unknowns of the running attempt.
        last_good: unknowns of the last successful attempt.
        reached: share of the load that was solved [1].
        stride: addition to it by the running attempt [1].
        tries: Newton steps of the running attempt.
        steps: Newton steps of all attempts.
        begun: true once the start itself, an attempt of its own, has been solved.
        stable: true if the last solved equilibrium is stable.
    """

    unknowns: Array
    last_good: Array
    reached: Array
    stride: Array
    tries: Array
    steps: Array
    begun: Array
    stable: Array


def search(rest: ChainProblem, problem: ChainProblem, guess: Float[Array, "unknowns"]) -> ChainRoot:
    """Follow the equilibrium from one problem to another, without derivatives.

    Args:
        rest: problem that the guess solves, such as the chain without load.
        problem: problem to solve, of the same structure.
        guess: unknowns that solve `rest`.
    """

    def go_on(now: _SearchState) -> Array:
        return (now.reached < 1.0) & (now.stride >= LEAST_STRIDE) & (now.steps < MOST_STEPS_IN_ALL)

    def advance(now: _SearchState) -> _SearchState:
        share = jnp.where(now.begun, jnp.minimum(now.reached + now.stride, 1.0), 0.0)
        mix = lambda a, b: a + share * (b - a) if eqx.is_inexact_array(a) else a  # noqa: E731
        scaled = jax.tree.map(mix, rest, problem)
        excess, jacobian = chain_jacobian(now.unknowns, scaled)
        step = jnp.linalg.solve(jacobian, excess)
        size = jnp.max(jnp.abs(step))
        stable = _is_stable(scaled, jacobian)
        trial = now.unknowns - step * jnp.minimum(1.0, 1.0 / _step_ratio(scaled, step))
        converged = (size < CONVERGED_STEP) & (jnp.max(jnp.abs(excess)) < BALANCED)
        # an unstable equilibrium that follows a stable one is on another branch: take a smaller step
        off_branch = converged & now.begun & now.stable & ~stable & (now.stride > 4.0 * LEAST_STRIDE)
        good = converged & ~off_branch
        failed = off_branch | ~jnp.isfinite(size) | (now.tries >= MOST_STEPS)
        last_good = jnp.where(good, trial, now.last_good)
        longer = jnp.where(now.begun, 2.0 * now.stride, now.stride)
        return _SearchState(
            unknowns=jnp.where(failed, now.last_good, jnp.where(good, last_good, trial)),
            last_good=last_good,
            reached=jnp.where(good, share, now.reached),
            stride=jnp.where(good, longer, jnp.where(failed, 0.25 * now.stride, now.stride)),
            tries=jnp.where(good | failed, 0, now.tries + 1),
            steps=now.steps + 1,
            begun=now.begun | good,
            stable=jnp.where(good, stable, now.stable),
        )

    guess = jnp.where(jnp.all(jnp.isfinite(guess)), guess, jnp.zeros_like(guess))
    none, whole, no = jnp.asarray(0.0), jnp.asarray(1.0), jnp.asarray(0)
    first = _SearchState(guess, guess, none, whole, no, no, jnp.asarray(False), jnp.asarray(True))
    last = jax.lax.while_loop(go_on, advance, first)
    return ChainRoot(last.last_good, last.steps, last.reached >= 1.0, last.stable)


def _step_ratio(problem: ChainProblem, step: Array) -> Array:
    """Ratio of a Newton step to the maximum step."""
    turn = jnp.asarray(0.0)
    for part, z in zip(problem.parts, split(problem, step), strict=True):
        bends = jax.vmap(lambda part, z: configuration(part.actuator, z)[1])(part, z)
        turn = turn + jnp.sum(jnp.abs(bends))
    return jnp.maximum(turn / LONGEST_TURN, jnp.max(jnp.abs(step)) / LONGEST_STRAIN)


def rest_of(problem: ChainProblem) -> tuple[ChainProblem, Float[Array, "unknowns"]] | None:
    """The chain at rest, a start for `search`: without pressure, heat and loads, and straight unknowns.

    None where a spring's phase is not given, so that its state at rest is unknown.
    """
    none = lambda x: as_array(np.zeros(jnp.shape(x)))  # noqa: E731
    parts = []
    for part in problem.parts:
        drives = [drive for drive in part.activations if isinstance(drive, MartensiteFraction)]
        if len(drives) != len(part.activations):
            return None
        cold = tuple(MartensiteFraction(np.ones(jnp.shape(drive.value))) for drive in drives)
        parts.append(dataclasses.replace(part, pressure=none(part.pressure), activations=cold))
    sizes = [
        part.actuator.freedoms * len(members)
        for part, members in zip(problem.parts, problem.members, strict=True)
    ]
    rest = dataclasses.replace(problem, parts=tuple(parts), share=none(problem.share))
    return rest, as_array(np.zeros(sum(sizes)))


def chain_root(rest: ChainProblem, problem: ChainProblem, guess: Float[Array, "unknowns"]) -> ChainRoot:
    """`search`, with derivatives of the unknowns by the implicit function theorem."""
    problems, start = frozen((rest, problem)), jax.lax.stop_gradient(guess)

    def find(_: object, start: Array) -> tuple[Array, tuple]:
        root = search(*problems, start)  # type: ignore[call-arg]
        diagnostics = (root.steps, root.found, root.stable)
        return root.unknowns, tuple(x.astype(start.dtype) for x in diagnostics)  # integers get no tangent

    def tangent(linear: Callable, vector: Array) -> Array:
        return jnp.linalg.solve(jax.jacfwd(linear)(vector), vector)

    unknowns, diagnostics = jax.lax.custom_root(
        lambda z: chain_residual(z, problem), start, find, tangent, has_aux=True
    )
    steps, found, stable = jax.lax.stop_gradient(diagnostics)
    return ChainRoot(unknowns, steps.astype(int), found > 0.5, stable > 0.5)


def described(problem: ChainProblem, root: ChainRoot) -> list[Equilibrium]:
    """Every segment's row with its status, part by part; all are NaN where the chain found no equilibrium."""
    forces = load_forces(problem, root.unknowns)
    results = []
    rows = zip(problem.parts, split(problem, root.unknowns), problem.members, strict=True)
    for part, z, members in rows:
        one = lambda part, z, load: equilibrium_of(loaded(part, load), z, root.steps)  # noqa: E731
        row = jax.vmap(one)(part, z, forces[np.asarray(members)])
        lost = ~root.found & solved(row.status)
        row = eqx.tree_at(lambda r: r.status, row, jnp.where(lost, int(Status.no_equilibrium), row.status))
        blank = lambda x: jnp.where(root.found, x, jnp.nan) if eqx.is_inexact_array(x) else x  # noqa: E731
        results.append(jax.tree.map(blank, row))
    return results
