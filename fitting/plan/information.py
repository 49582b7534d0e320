"""Expected information of a test about an alloy: Fisher information from the model's own sensitivities.

A test yields force and resistance at known elongations. The phase is unknown. The controller holds it as well
as it can. Every few readings it deviates by an unknown amount, which resistance and force must determine
together with the constants. These deviations are Gaussian unknowns and are integrated out (a Schur
complement). A test whose resistance does not determine the phase therefore gets its low true worth.
"""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

import pneusma_jax as pj
from pneusma_jax.numerics.rows import lots
from pneusma_jax.program_cache import stored_jit

from .candidates import COLD, HEATED, HOT, LATENT_ROWS, Courses

TOGETHER = 16  # Number of tests that are computed side by side; a last lot is filled up


def held_phase(alloy: pj.Alloy, gamma: Array, share: Array) -> Array:
    """Martensite fraction of a wire whose resistance a slow, ideal controller holds, shape (rows,).

    A set-point above the resistance of the cold wire turns the heater off. One below that of the hot wire
    turns it on fully (Section 2.4.5: at high strain the set-point is lost).

    Args:
        alloy: alloy of the wire.
        gamma: shear strain, shape (rows,).
        share: position of the set-point between the hot (0) and the cold resistance (1) at rest.
    """
    zero = jnp.asarray(0.0)
    rest = alloy.rho_a(zero) + share * (alloy.rho_m(zero) - alloy.rho_a(zero))
    cold, hot = alloy.rho_m(gamma), alloy.rho_a(gamma)
    reading = alloy.martensite_fraction(jnp.broadcast_to(rest, gamma.shape), gamma).xi0
    return jnp.where(rest >= cold, 1.0, jnp.where(rest <= hot, 0.0, reading))


def phase_course(alloy: pj.Alloy, gamma: Array, test: Courses) -> Array:
    """Martensite fraction over one test, shape (rows,)."""
    at_setpoint = held_phase(alloy, gamma, test.share)
    fixed = jnp.where(test.hold == COLD, 1.0, 0.0)
    course = jnp.where((test.hold == COLD) | (test.hold == HOT), fixed, at_setpoint)
    return jnp.where(test.hold == HEATED, 1.0 - test.warmth, course)


class Accuracy(eqx.Module):
    """Errors of a test.

    Attributes:
        noise: standard deviations of force [N] and of resistance [ohm], shape (2,).
        misfit: standard deviation of the law's own error [1], equal in every repeat. It is a share of the
            force, and of the contrast in resistance between both phases at rest.
        repeats: number of averaged repeats of each test.
    """

    noise: Float[Array, "2"]
    misfit: Float[Array, ""]
    repeats: Float[Array, ""]


def information(
    constants: Mapping[str, Float[Array, "draws"]],
    names: tuple[str, ...],
    scale: Float[Array, "unknowns"],
    geometry: pj.SpringGeometry,
    tests: Courses,
    accuracy: Accuracy,
) -> Float[np.ndarray, "draws tests unknowns unknowns"]:
    """Fisher information of each test at each alloy about unknown constants, in units of their scales.

    Args:
        constants: constants of the alloys by name, SI, shape (draws,).
        names: names of the unknown constants.
        scale: prior standard deviation of each, SI, shape (unknowns,).
        geometry: geometry of the spring.
        tests: tests as arrays, any number; one program serves all numbers of tests.
        accuracy: errors of the tests.
    """
    found = [_of_lot(constants, names, scale, geometry, lot, accuracy) for lot in lots(tests, TOGETHER)]
    return np.concatenate(found, axis=1)[:, : len(tests.mask)]


@stored_jit()
def _of_lot(
    constants: Mapping[str, Array],
    names: tuple[str, ...],
    scale: Array,
    geometry: pj.SpringGeometry,
    tests: Courses,
    accuracy: Accuracy,
) -> Array:
    """`information` of `TOGETHER` tests."""
    many = jnp.sqrt(accuracy.repeats)
    tests = eqx.tree_at(lambda t: t.phase_sd, tests, tests.phase_sd / many)
    noise, misfit = accuracy.noise / many, accuracy.misfit

    def each(alloy: dict[str, Array]) -> Array:
        one = lambda test: _information(alloy, names, scale, geometry, test, noise, misfit)  # noqa: E731
        return jax.vmap(one)(tests)

    return jax.lax.map(each, dict(constants))


def _information(
    constants: dict[str, Array],
    names: tuple[str, ...],
    scale: Array,
    geometry: pj.SpringGeometry,
    test: Courses,
    noise: Array,
    misfit: Array,
) -> Array:
    """Fisher information of one test at one alloy, shape (unknowns, unknowns)."""
    elongation = geometry.free_length * test.strain
    nominal = pj.Spring(geometry, pj.Alloy(**constants), geometry.free_length)
    course = phase_course(nominal.alloy, nominal.shear_strain(elongation), test)
    rows = elongation.shape[0]
    zero = jnp.asarray(0.0)
    contrast = (nominal.alloy.rho_m(zero) - nominal.alloy.rho_a(zero)) * geometry.wire_length
    force = pj.simulate_spring(nominal, elongation, pj.MartensiteFraction(course)).rows.force
    sigma = jnp.hypot(noise[0], misfit * force), jnp.hypot(noise[1], misfit * contrast)

    def outputs(shift: Array, deviation: Array) -> Array:
        perturbed = {name: constants[name] + scale[k] * shift[k] for k, name in enumerate(names)}
        spring = pj.Spring(geometry, pj.Alloy(**{**constants, **perturbed}), geometry.free_length)
        xi0 = course + jnp.repeat(deviation, LATENT_ROWS)[:rows]
        found = pj.simulate_spring(spring, elongation, pj.MartensiteFraction(xi0)).rows
        return jnp.concatenate([test.mask * found.force / sigma[0], test.mask * found.resistance / sigma[1]])

    at = jnp.zeros(len(names)), jnp.zeros(rows // LATENT_ROWS)
    by_constants, by_phase = jax.jacfwd(outputs, argnums=(0, 1))(*at)
    precision = by_phase.T @ by_phase + jnp.eye(by_phase.shape[1]) / test.phase_sd**2
    mixed = by_phase.T @ by_constants
    fisher = by_constants.T @ by_constants - mixed.T @ jnp.linalg.solve(precision, mixed)
    return 0.5 * (fisher + fisher.T)
