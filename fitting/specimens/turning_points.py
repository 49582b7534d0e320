"""Rows that renewed a spring's memory, from the rule of the residual strain and the measured force.

At a turning point the constants' last per cent and noise decide if a wire still loads and renews its memory.
The force of all later rows depends on it. A test has several such points, each with its own error, so they
are decided one by one.

The state after a row is known from the row that renewed the memory last. So dynamic programming (Viterbi)
over that row finds the best history of renewals at a given trajectory of the martensite fraction. It is exact
as far as `WIDTH` histories at a time suffice.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from pneusma_jax.nitinol import Alloy, SpringState
from pneusma_jax.nitinol.residual_strain import hottest, residual_strain

WIDTH = 16
"""Number of histories that are followed at a time."""
TIE = 1e-3
"""Chi-square penalty of a row that deviates from the rule by the allowed maximum. Among histories that
explain as much, the rule's wins."""


class Memories(eqx.Module):
    """State of a spring's memory at the beginning of every row, shape (rows,) each, or (histories, rows).

    Attributes:
        prestrain: shear strain that set the residual strain [1].
        xi_min: smallest martensite fraction since then [1].
        origin: row of that strain; -1 for none.
        hottest: row of that fraction; -1 for none.
    """

    prestrain: Float[Array, " rows"]
    xi_min: Float[Array, " rows"]
    origin: Int[Array, " rows"]
    hottest: Int[Array, " rows"]


class Course(eqx.Module):
    """What is known of a wire in every row of a test, shape (rows,) each, or of one row.

    Attributes:
        gamma: shear strain [1].
        xi0: martensite fraction [1].
        slack: indistinguishable difference of fractions [1].
        stress: measured stress [Pa].
        weight: its inverse standard deviation [1/Pa], zero where it was not measured.
    """

    gamma: Float[Array, " rows"]
    xi0: Float[Array, " rows"]
    slack: Float[Array, " rows"]
    stress: Float[Array, " rows"]
    weight: Float[Array, " rows"]


def likeliest(
    alloy: Alloy, prestrain: Array, course: Course, margin: Float[Array, ""], count: int
) -> Memories:
    """Histories of renewals that explain the measured stress best, best first.

    Args:
        alloy: constants of the alloy.
        prestrain: shear strain of the spring before the test [1].
        course: what is known of every row.
        margin: maximum deviation of a renewal from the rule, as part of the residual strain.
        count: number of histories to return, at most `WIDTH`; where there are fewer, some are repeated.
    """
    never = jnp.full(WIDTH, -1)
    first = Memories(jnp.full(WIDTH, prestrain), jnp.ones(WIDTH), never, never)
    cost = jnp.full(WIDTH, jnp.inf).at[0].set(0.0)

    def row(carry: tuple[Memories, Array], now: tuple) -> tuple[tuple[Memories, Array], tuple]:
        return _extended_histories(alloy, margin, *carry, *now)

    rows = (course, jnp.arange(course.gamma.size))
    (_, cost), (memories, *choices) = jax.lax.scan(row, (first, cost), rows)
    best = jnp.argsort(cost)[:count]
    best = jnp.where(jnp.isfinite(cost[best]), best, best[0])
    return jax.vmap(lambda slot: _history_of_slot(memories, slot, *choices))(best)


def _extended_histories(
    alloy: Alloy, margin: Array, known: Memories, cost: Array, now: Course, number: Array
) -> tuple[tuple[Memories, Array], tuple]:
    """All histories after a row, their earlier states, and the slot and parent of a renewal, if any."""
    gamma, xi0 = now.gamma, now.xi0
    state = SpringState(known.prestrain, known.xi_min)
    heated = hottest(state, xi0)
    residual = alloy.residual_strain(state, xi0)
    modulus, detwinning = alloy.modulus(xi0), alloy.detwinning_stress(gamma, xi0)
    cost = cost + (now.weight * (alloy.shear_stress(gamma, xi0, residual) - now.stress)) ** 2
    deeper = residual_strain(alloy.residual_strain_limit(gamma), xi0, alloy.gR_decay) > residual
    beyond = (detwinning - modulus * residual) / jnp.maximum(modulus * residual, 1e-12)  # positive: renewed
    against = TIE * (beyond / jnp.maximum(margin, 1e-12)) ** 2
    due = deeper & (beyond > 0.0)
    stays = jnp.where(deeper & (beyond > margin), jnp.inf, cost + jnp.where(due, against, 0.0))
    renews = jnp.where(deeper & (beyond > -margin), cost + jnp.where(due, 0.0, against), jnp.inf)
    parent, slot = jnp.argmin(renews), jnp.argmax(stays)
    renewed = renews[parent] < stays[slot]
    place = renewed & (jnp.arange(WIDTH) == slot)
    alike = (heated != known.xi_min) | (xi0 < known.xi_min + now.slack)
    after = Memories(
        jnp.where(place, gamma, known.prestrain),
        jnp.where(place, xi0, heated),
        jnp.where(place, number, known.origin),
        jnp.where(place | alike, number, known.hottest),
    )
    return (after, jnp.where(place, renews[parent], stays)), (known, slot, parent, renewed)


def _history_of_slot(
    memories: Memories, last: Array, slot: Array, parent: Array, renewed: Bool[Array, " rows"]
) -> Memories:
    """The history that ends in a slot, from memories of shape (rows, histories)."""

    def back(at: Array, choice: tuple) -> tuple[Array, Array]:
        slot, parent, renewed = choice
        before = jnp.where(renewed & (at == slot), parent, at)
        return before, before

    slots = jax.lax.scan(back, last, (slot, parent, renewed), reverse=True)[1]
    take: Callable[[Array], Array] = lambda x: jnp.take_along_axis(x, slots[:, None], axis=1)[:, 0]  # noqa: E731
    return jax.tree.map(take, memories)
