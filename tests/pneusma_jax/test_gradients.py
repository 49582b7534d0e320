"""Implicit gradients against central differences, and finite gradients at the singular points."""

import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj

GEOMETRY = ("outer_diameter", "wall_thickness", "length", "wire_diameter", "mandrel_diameter", "initial_pitch",
            "active_coils", "free_length", "attached_length", "prestrain")  # fmt: skip


def curvature(numbers, alloy, silicone, design, driven):
    """Curvature as a function of a dictionary of inputs and every number of alloy and silicone."""
    geometry = pj.Geometry(**{key: numbers[key] for key in GEOMETRY})
    body = pj.round_actuator(pj.layout(design), geometry, alloy, silicone)
    drive = {"xi0": pj.MartensiteFraction, "resistance": pj.Resistance}[driven]
    active = drive(numbers["activation"])
    phases = (active,) if design == "pneusma1" else (pj.MartensiteFraction(numbers["xi0_1"]), active)
    if not body.springs:
        phases = ()
    states = pj.fresh_states(body, geometry)
    return pj.solve(body, numbers["pressure"], phases, states, throw=False).curvature


def start(pressure=25e3, activation=0.55, xi0_1=0.9):
    base = pj.design_geometry("pneusma2", prestrain=0.17)  # the default sits on the kink of the residual strain
    numbers = {key: jnp.asarray(getattr(base, key)) for key in GEOMETRY}
    given = dict(pressure=pressure, activation=activation, xi0_1=xi0_1)
    return numbers | {key: jnp.asarray(value) for key, value in given.items()}


@functools.cache
def slopes_of(design, driven):
    """Curvature and its gradient by every number, one program for all places."""
    f = lambda numbers, alloy, silicone: curvature(numbers, alloy, silicone, design, driven)  # noqa: E731
    return jax.jit(jax.value_and_grad(f, argnums=(0, 1, 2)))


@pytest.mark.parametrize(
    ("design", "driven", "activation"),
    [
        ("pneusma2", "xi0", 0.55),
        pytest.param("pneusma1", "xi0", 0.55, marks=pytest.mark.slow),
        pytest.param("pneusma2", "resistance", 3.45, marks=pytest.mark.slow),
        pytest.param("pneuflex_s", "xi0", 1.0, marks=pytest.mark.slow),
    ],
)
def test_gradient_equals_central_difference(design, driven, activation):
    everything = (start(activation=activation), pj.load_alloy("krl35"), pj.load_silicone())
    numbers, fixed = eqx.partition(everything, eqx.is_inexact_array)
    leaves, tree = jax.tree.flatten(numbers)
    leaves = [np.asarray(leaf) for leaf in leaves]
    flat = np.concatenate([leaf.ravel() for leaf in leaves])
    program = slopes_of(design, driven)

    def f(vector):
        parts = np.split(vector, np.cumsum([leaf.size for leaf in leaves])[:-1])
        shaped = [part.reshape(leaf.shape) for part, leaf in zip(parts, leaves, strict=True)]
        return float(program(*eqx.combine(jax.tree.unflatten(tree, shaped), fixed))[0])

    exact = np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(program(*everything)[1])])
    assert np.all(np.isfinite(exact))
    scale = np.where(flat == 0.0, 1.0, np.abs(flat))
    # fourth-order central difference: the equilibrium is solved to rounding, so a wide step is the accurate one
    steps = 2e-4 * np.diag(scale)
    far, near = (np.array([f(flat + wide * step) - f(flat - wide * step) for step in steps]) for wide in (2, 1))
    numeric = (8.0 * near - far) / 12.0 / (2e-4 * scale)
    error = np.abs(exact - numeric) * scale
    size = np.maximum(np.abs(exact) * scale, 1e-3)
    assert np.max(error / size) < 1e-6, (np.argmax(error / size), exact, numeric)
    assert np.sum(np.abs(exact) > 0) > (10 if design.startswith("pneusma") else 5)


@pytest.mark.parametrize(
    "where",
    [
        dict(pressure=0.0, activation=1.0, xi0_1=1.0),
        dict(activation=0.0),
        dict(activation=1.0, xi0_1=1.0),
        dict(activation=0.5, xi0_1=0.5),
        dict(pressure=0.0, activation=0.0, xi0_1=0.0),
    ],
)
def test_gradient_is_finite_at_singular_points(where):
    _, gradients = slopes_of("pneusma2", "xi0")(start(**where), pj.load_alloy("krl35"), pj.load_silicone())
    assert all(bool(jnp.all(jnp.isfinite(leaf))) for leaf in jax.tree.leaves(gradients))


def test_laws_are_finite_at_their_singular_points():
    alloy, law = pj.load_alloy("krl35"), pj.load_silicone()
    by_both = (alloy.resistivity, lambda x, g: alloy.shear_stress(g, x, 0.01))
    laws = [jax.jit(jax.value_and_grad(f, argnums=(0, 1))) for f in by_both]
    for xi0 in (0.0, 0.5, 1.0):
        for gamma in (0.0, -0.02, 1e-9, 0.195, 0.24):
            for f in laws:
                value, slopes = f(xi0, gamma)
                assert np.isfinite([value, *slopes]).all()
    fraction = jax.jit(jax.grad(lambda r, g: alloy.martensite_fraction(r, g).xi0, argnums=(0, 1)))
    for rho in (10.0, float(alloy.rho_a(0.01)), 18.0, float(alloy.rho_m(0.01)), 30.0):
        slopes = fraction(rho, 0.01)
        assert np.isfinite(slopes).all()
    slope = jax.jit(jax.grad(law))
    for strain in (-0.9, -0.54, -0.02, 0.0, 0.02, 1.5, 3.0):
        assert np.isfinite(slope(strain))


@pytest.mark.slow
def test_second_derivatives_of_a_planar_actuator():
    body = pj.make_actuator("pneusma2")
    cold = pj.MartensiteFraction(1.0)
    f = lambda p: pj.solve(body, p, (cold, pj.MartensiteFraction(0.6))).curvature * 1e3  # noqa: E731
    h = 50.0
    numeric = (jax.grad(f)(20e3 + h) - jax.grad(f)(20e3 - h)) / (2 * h)
    np.testing.assert_allclose(jax.grad(jax.grad(f))(20e3), numeric, rtol=1e-5)


@pytest.mark.slow
def test_gradients_of_rows_together_are_those_of_rows_alone():
    """Rows take the slope that their root-find left; one row alone computes it at its equilibrium."""
    body, rng = pj.make_actuator("pneusma2"), np.random.default_rng(3)
    pressure, xi0 = rng.uniform(1e3, 50e3, 300), rng.uniform(0.02, 0.98, (2, 300))

    def bend(pressure, xi0, thicker, of):
        actuator = eqx.tree_at(lambda a: a.springs[0].geometry.wire_diameter, body, replace_fn=lambda d: d * thicker)
        return of(actuator, pressure, tuple(pj.MartensiteFraction(x) for x in xi0)).bend_angle

    together = jax.jit(jax.grad(lambda *given: jnp.sum(bend(*given, pj.solve_batch)), argnums=(0, 1, 2)))
    alone = jax.jit(jax.grad(lambda *given: bend(*given, pj.solve), argnums=(0, 1, 2)))
    by_pressure, by_xi0, by_thickness = together(pressure, xi0, 1.0)
    own = jax.vmap(alone, (0, 1, None))(pressure, xi0, 1.0)
    for found, one in zip((by_pressure, by_xi0.T, by_thickness), (*own[:2], own[2].sum()), strict=True):
        np.testing.assert_allclose(found, one, rtol=1e-6, atol=1e-9 * float(np.max(np.abs(one))))
