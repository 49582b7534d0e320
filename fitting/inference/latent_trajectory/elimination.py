"""Exact steps of a latent trajectory whose rows remember earlier ones: rows are eliminated, the latest first.

The readings of a row depend on the row itself and on the one that it remembers. Neighbours remember the same
one, unless one of them is remembered from then on. So an eliminated row leaves a coupling of two numbers
only: the row before, and what this remembers. Two passes over the rows solve the whole system.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


class Elimination(eqx.Module):
    """A symmetric positive system of a trajectory, eliminated row by row.

    Attributes:
        pivot: of every row, shape (rows,).
        by_before, by_remembered: coupling of every row to the one before, and to the row that this one
            remembers, shape (rows,).
        renews: true where a row is remembered from then on, shape (rows,).
    """

    pivot: Float[Array, " rows"]
    by_before: Float[Array, " rows"]
    by_remembered: Float[Array, " rows"]
    renews: Bool[Array, " rows"]

    @classmethod
    def of(
        cls,
        own: Float[Array, "channels rows"],
        remembered: Float[Array, "channels rows"],
        renews: Bool[Array, " rows"],
        information: Float[Array, "channels rows"],
        correlated: Float[Array, "channels rows"],
        walk: Float[Array, " rows"],
        held: Float[Array, " rows"] | float,
    ) -> "Elimination":
        """The system of measured channels, of a random walk and of a hold on every row.

        Args:
            own, remembered: derivatives of the channels by their row, and by the row that this remembers. The
                latter is zero where `renews` is true.
            renews: true where a row is remembered from then on, the first one included.
            information: inverse covariance of the channels' errors: its diagonal.
            correlated: its entry for every row and the one before; zero for the first.
            walk: inverse variance of the increment from the row before; zero for the first.
            held: weight of every row's square.

        A walk may be stiffer than the readings by any factor. Its share of a pivot is never subtracted again,
        so the readings' share keeps all its digits.
        """
        earlier = lambda each: jnp.concatenate([each[:, :1], each[:, :-1]], axis=1)  # noqa: E731
        own_before, remembered_before = earlier(own), earlier(remembered)
        each = lambda weight, one, other: jnp.sum(weight * one * other, axis=0)  # noqa: E731
        rows = (
            each(information, own, own) + held,
            each(correlated, own, own_before),
            each(information, own, remembered) + each(correlated, own, remembered_before),
            walk,
            each(correlated, remembered, own_before),
            each(information, remembered, remembered)
            + 2.0 * each(correlated, remembered, remembered_before),
            renews,
        )

        def eliminate(later: tuple, row: tuple) -> tuple:
            """Couplings of the row before and of what it remembers, once a row is eliminated."""
            here, both, there = later
            here_row, beside, by_remembered, walk, across, beyond, renewed = row
            rest = here_row + here + jnp.where(renewed, 2.0 * both + there, 0.0)
            pivot, by_before = rest + walk, beside - walk
            by_remembered = by_remembered + jnp.where(renewed, 0.0, both)
            left = (
                (walk * (rest + 2.0 * beside) - beside**2) / pivot,  # walk - by_before**2 / pivot
                across - by_before * by_remembered / pivot,
                beyond + jnp.where(renewed, 0.0, there) - by_remembered**2 / pivot,
            )
            return left, (pivot, by_before, by_remembered)

        nothing = 0.0 * walk[0]
        _, found = jax.lax.scan(eliminate, (nothing, nothing, nothing), rows, reverse=True)
        return cls(*found, renews)

    def solve(self, right: Float[Array, " rows"]) -> Float[Array, " rows"]:
        """Solution for a right-hand side."""

        def back(later: tuple, row: tuple) -> tuple:
            here, there = later
            pivot, by_before, by_remembered, renewed, value = row
            rest = value + here + jnp.where(renewed, there, 0.0)
            there = jnp.where(renewed, 0.0, there) - by_remembered * rest / pivot
            return (-by_before * rest / pivot, there), rest / pivot

        def forth(earlier: tuple, row: tuple) -> tuple:
            before, remembered = earlier
            pivot, by_before, by_remembered, renewed, rest = row
            value = rest - (by_before * before + by_remembered * remembered) / pivot
            return (value, jnp.where(renewed, value, remembered)), value

        factor, nothing = (self.pivot, self.by_before, self.by_remembered, self.renews), 0.0 * right[0]
        _, rest = jax.lax.scan(back, (nothing, nothing), (*factor, right), reverse=True)
        return jax.lax.scan(forth, (nothing, nothing), (*factor, rest))[1]
