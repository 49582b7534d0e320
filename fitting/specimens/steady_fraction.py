"""Steady course of a spring's martensite fraction, which decides what the metal remembers.

A spring remembers the row that renewed its memory and the hottest row since. Where rows are almost alike, the
noise of single readings would choose among them. The hottest of a hundred noisy rows is the one whose noise
was lowest, and the force of all later rows would feel it. So these decisions are made along a steady course.
The fraction that is remembered is still that of the latent trajectory in the chosen row.
"""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.inference.latent_trajectory.steady import steady_course
from pneusma_jax.program_cache import cached_program

from .rows import Rows, numbers
from .spring_rows import spring_of
from .spring_trajectory import fraction_read

DECIDED_BY = "decided_by"
"""Entry of rows with the steady course, shape (rows,)."""
ROUNDS = 4
"""Number of linearisations of the resistance."""
LONGEST = 0.3
"""Maximum difference of a reading from the course that it is linearised about [1]."""
TOLD = 1e-9
"""Minimum slope of the resistance over the fraction that a reading tells something by, relative to the wire's
resistance."""


def _of_tests(
    values: Mapping[str, Array], stacked: Rows, precision: Float[Array, "recordings rows"]
) -> Float[Array, "recordings rows"]:
    """Courses of a stack.

    Args:
        values: base constants by name, SI.
        stacked: stack of recordings of kind spring, without decisions.
        precision: inverse variance of every measured resistance [1/ohm2], zero where there is none.
    """

    def one(rows: Rows, precision: Array) -> Array:
        spring = spring_of(numbers(values, rows))
        gamma, wire = spring.shear_strain(rows.inputs["elongation"]), spring.geometry.wire_length
        law = lambda course: spring.alloy.resistivity(course, gamma) * wire  # noqa: E731

        def closer(_: int, course: Array) -> Array:
            ohms, slope = jax.jvp(law, (course,), (jnp.ones_like(course),))
            told = jnp.abs(slope) > TOLD * jnp.abs(ohms)
            missed = (rows.measured["resistance"] - ohms) / jnp.where(told, slope, 1.0)
            read = course + jnp.clip(missed, -LONGEST, LONGEST)
            return steady_course(rows.time, read, jnp.where(told, precision * slope**2, 0.0))

        return jax.lax.fori_loop(0, ROUNDS, closer, fraction_read(spring, rows))

    return jax.vmap(one)(stacked, precision)


steady_fractions = cached_program(_of_tests, "steady fractions that resistances imply")
