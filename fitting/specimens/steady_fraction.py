"""Steady course of a spring's martensite fraction, which decides what the metal remembers.

A spring remembers the row that renewed its memory and the hottest row since. Where rows are almost alike, the
noise of single readings would choose among them. The hottest of a hundred noisy rows is the one whose noise
was lowest, and the force of all later rows would feel it. So these decisions are made along a steady course.
The fraction that is remembered is still that of the latent trajectory in the chosen row.

What changes steadily is the temperature. The fraction is its logistic function, with the temperature in
widths of the transformation about its middle. So a wire that is all martensite rests there, whatever the
noise. Where both phases conduct alike, the force of a wire that loads tells the fraction.
"""

from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jax.scipy.special import logit
from jaxtyping import Array, Float

from fitting.inference.latent_trajectory.steady import steady_course
from pneusma_jax.nitinol.stress import on_detwinning_branch
from pneusma_jax.program_cache import cached_program

from .rows import Rows, numbers
from .spring_law import Law
from .spring_rows import spring_of
from .spring_trajectory import fraction_read

SPREAD = 5.0
"""Standard deviation of the first temperature about the transformation's middle, in its widths."""
BEGIN = 1e-3
"""Minimum distance of the fraction from 0 and 1 at which the search begins [1]."""
ROUNDS = 4
"""Number of linearisations of the resistance, and then of resistance and force."""
LONGEST = 2.0
"""Maximum difference of a reading from the temperature that it is linearised about, in widths."""
BEYOND = 5.0
"""Standard deviations by which a resistance is beyond every fraction's, for more than noise; see
`changes_beyond_range`. Of white noise one reading in two million is as far."""
TOLD = 1e-9
"""Minimum slope of the resistance over the fraction that a reading tells something by, relative to the wire's
resistance."""


class _Seen(NamedTuple):
    """What one output says about the course at its present guess; arrays of shape (rows,).

    Attributes:
        missed: measured less predicted value.
        slope: derivative of the prediction by the temperature.
        precision: inverse variance of the measured value; zero where it says nothing.
    """

    missed: Array
    slope: Array
    precision: Array


def _of_tests(
    values: Mapping[str, Array], stacked: Rows, precision: Mapping[str, Float[Array, "recordings rows"]]
) -> Float[Array, "recordings rows"]:
    """Courses of a stack.

    Args:
        values: base constants by name, SI.
        stacked: stack of recordings of kind spring, without decisions.
        precision: inverse variance of every measured value by output, zero where there is none.
    """

    def one(rows: Rows, precision: Mapping[str, Array]) -> Array:
        parameters = numbers(values, rows)
        law = Law.of(spring_of(parameters), parameters["prestrain"], rows.inputs["elongation"], None)

        def closer(cold: Array, by_force: bool) -> Array:
            seen = [_resistance(law, cold, rows, precision["resistance"])]
            if by_force:
                seen.append(_force(law, cold, rows, precision["force"]))
            information = sum(one.precision * one.slope**2 for one in seen)
            pull = sum(one.precision * one.slope * one.missed for one in seen)
            step = pull / jnp.where(information > 0.0, information, 1.0)
            read = cold + jnp.clip(step, -LONGEST, LONGEST)
            return steady_course(rows.time, read, information, SPREAD)

        begin = logit(jnp.clip(fraction_read(law.spring, rows), BEGIN, 1.0 - BEGIN))
        cold = jax.lax.fori_loop(0, ROUNDS, lambda _, cold: closer(cold, False), begin)
        return jax.nn.sigmoid(jax.lax.fori_loop(0, ROUNDS, lambda _, cold: closer(cold, True), cold))

    return jax.vmap(one)(stacked, precision)


def _resistance(law: Law, cold: Array, rows: Rows, precision: Array) -> _Seen:
    """What the resistance says; nothing where both phases conduct alike."""
    wire = law.spring.geometry.wire_length
    of = lambda cold: law.strained.resistivity(jax.nn.sigmoid(cold)) * wire  # noqa: E731
    ohms, slope = jax.jvp(of, (cold,), (jnp.ones_like(cold),))
    told = jnp.abs(slope) > TOLD * jnp.abs(ohms)
    return _Seen(rows.measured["resistance"] - ohms, slope, jnp.where(told, precision, 0.0))


def _force(law: Law, cold: Array, rows: Rows, precision: Array) -> _Seen:
    """What the force says while the wire loads, where it depends on no memory.

    A law that misses the force by more than its noise counts the less.
    """
    alloy, strained = law.spring.alloy, law.strained

    def of(cold: Array) -> tuple[Array, Array]:
        xi0 = jax.nn.sigmoid(cold)
        modulus, detwinning = alloy.modulus(xi0), strained.detwinning_stress(alloy, xi0)
        states, _ = law.by_rule(strained.gamma, xi0)
        loading = on_detwinning_branch(modulus, detwinning, alloy.residual_strain(states, xi0))
        return law.spring.geometry.force(modulus * strained.gamma - detwinning), loading

    newtons, slope, loading = jax.jvp(of, (cold,), (jnp.ones_like(cold),), has_aux=True)
    missed, counted = rows.measured["force"] - newtons, jnp.where(loading, precision, 0.0)
    square = jnp.sum(counted * missed**2) / jnp.maximum(jnp.sum(counted > 0.0), 1)
    return _Seen(missed, slope, counted / jnp.maximum(square, 1.0))


steady_fractions = cached_program(_of_tests, "steady fractions that resistances imply")


def _beyond(
    values: Mapping[str, Array], stacked: Rows, precision: Float[Array, "recordings rows"]
) -> Float[Array, "recordings rows"]:
    """Changes of the fraction from row to row [1] by which resistances change beyond those of every fraction.

    They are zero in recordings whose resistances a wire of this alloy can have, within noise. Leads add a
    resistance, for example. A fraction at its limit says nothing then of how it changes, but the resistance
    still does. A steady course of what exceeds the range counts by the slope of a cold wire's resistance, and
    of what falls short of it by the contrast of the phases.

    Args:
        values: base constants by name, SI.
        stacked: stack of recordings of kind spring, without decisions.
        precision: inverse variance of every measured resistance, zero where there is none.
    """

    def one(rows: Rows, precision: Array) -> Array:
        parameters = numbers(values, rows)
        law = Law.of(spring_of(parameters), parameters["prestrain"], rows.inputs["elongation"], None)
        wire, whole = law.spring.geometry.wire_length, jnp.ones_like(precision)
        of = lambda xi0: law.strained.resistivity(xi0) * wire  # noqa: E731
        cold, slope = jax.jvp(of, (whole,), (whole,))
        hot = of(0.0 * whole)
        contrast, measured = cold - hot, rows.measured["resistance"]
        told = (jnp.abs(contrast) > TOLD * cold) & (contrast * slope > 0.0) & (precision > 0.0)
        contrast, slope = jnp.where(told, contrast, 1.0), jnp.where(told, slope, 1.0)
        over, under = (measured - cold) / slope, (measured - hot) / contrast
        out = told & ((over > 0.0) | (under < 0.0))
        ohms = jnp.where(out, jnp.where(over > 0.0, measured - cold, measured - hot), 0.0)
        out &= jnp.abs(ohms) * jnp.sqrt(jnp.where(told, precision, 0.0)) > BEYOND
        read = steady_course(rows.time, jnp.where(out, ohms, 0.0), jnp.where(told, precision, 0.0), 1.0)
        change = jnp.diff(read, prepend=read[:1]) / jnp.where(over > 0.0, slope, contrast)
        return jnp.where(jnp.any(out), change, 0.0)  # rows without a reading lie on the course, too

    return jax.vmap(one)(stacked, precision)


changes_beyond_range = cached_program(_beyond, "changes of resistances beyond the range of a wire's")


def steady_near(
    time: Float[Array, " rows"], course: Float[Array, " rows"], information: Float[Array, " rows"]
) -> Float[Array, " rows"]:
    """Steady course near another one, such as that which a model with effects finds.

    Args:
        time: time [s].
        course: martensite fraction.
        information: inverse variance of the fraction of every row by what was measured in it.
    """
    within = jnp.clip(course, BEGIN, 1.0 - BEGIN)
    slope = within * (1.0 - within)
    return jax.nn.sigmoid(steady_course(time, logit(within), information * slope**2, SPREAD))


steady_along = cached_program(jax.vmap(steady_near), "steady fractions along courses")
