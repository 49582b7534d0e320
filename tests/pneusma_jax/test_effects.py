"""Effects: absent at their neutral values, a finite signature there, and the change they announce.

One compiled program holds every effect that can apply, and its Jacobian over all their parameters.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.effects import CATALOGUE, find_effect

ROWS = 24
TIME = jnp.linspace(0.0, 80.0, ROWS)


def actuator_outputs(effects):
    heat = 1.0 - 0.7 * jnp.sin(jnp.pi * TIME / 80.0) ** 2
    drive = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(heat))
    pressure = 20e3 + 10e3 * jnp.sin(TIME / 5.0)
    body = pj.make_actuator("pneusma2")
    history = pj.simulate_history(body, pressure, drive, time=TIME, effects=effects)
    ohms = history.rows.springs[1].resistance
    return jnp.concatenate([history.seen["curvature"], 100.0 * ohms])


def spring_outputs(effects):
    dimensions = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    spring = pj.Spring(dimensions, pj.load_alloy("krl35"), 14e-3)
    pull = 40e-3 * (1.0 - jnp.abs(TIME / 40.0 - 1.0))
    history = pj.simulate_spring(spring, pull, pj.MartensiteFraction(0.7), time=TIME, effects=effects)
    return jnp.concatenate([history.seen["force"], history.seen["resistance"]])


def switches(kind):
    """Names, neutral and typical values of every parameter that makes an effect of a kind absent."""
    return [
        (slug, name, spec)
        for slug, effect in CATALOGUE.items()
        if kind in effect.kinds
        for name, spec in effect.specs.items()
        if not spec.shape
    ]


def built(kind, values):
    """Every effect of a kind, its switches set to `values`."""
    table = dict(zip([(slug, name) for slug, name, _ in switches(kind)], values, strict=True))
    effects = []
    for slug, effect in CATALOGUE.items():
        if kind in effect.kinds:
            shown = effect()
            own = {name: table[slug, name] for name in effect.specs if (slug, name) in table}
            if slug == "prestrain_error" and kind == "S":
                shown = effect(number=1)
            for name, value in own.items():
                shape = jnp.shape(getattr(shown, name))
                shown = eqx.tree_at(lambda e, n=name: getattr(e, n), shown, jnp.broadcast_to(value, shape))
            effects.append(shown)
    return tuple(effects)


SCANNED = {"tip_contact", "pressure_lag"}  # no slope where absent: a threshold, a lag without rows to fill it


@pytest.mark.parametrize(("kind", "outputs"), [pytest.param("A", actuator_outputs, marks=pytest.mark.slow), ("S", spring_outputs)])
def test_neutral_is_absent_and_its_signature_is_finite(kind, outputs):
    rows = switches(kind)
    neutral = jnp.asarray([spec.neutral for _, _, spec in rows])
    run = jax.jit(lambda v: outputs(built(kind, v)))
    bare, with_all = np.asarray(outputs(())), np.asarray(run(neutral))
    np.testing.assert_allclose(with_all, bare, rtol=1e-11, atol=1e-11)
    signature = np.asarray(jax.jit(jax.jacfwd(lambda v: outputs(built(kind, v))))(neutral))
    assert np.all(np.isfinite(signature))
    for (slug, name, spec), column in zip(rows, signature.T, strict=True):
        size = np.max(np.abs(column)) * abs(spec.typical - spec.neutral)
        print(f"{kind} {slug}.{name}: {size:.3g} at the typical value, to first order")
        assert size > 1e-9 or slug in SCANNED, (slug, name)


@pytest.mark.slow
@pytest.mark.parametrize("slug", ["opposing_spring_heating", "wrap_friction"])
def test_a_present_effect_changes_what_its_signature_says(slug):
    effect = find_effect(slug)
    name, spec = next((n, s) for n, s in effect.specs.items() if not s.shape)
    small = spec.neutral + 0.02 * (spec.typical - spec.neutral)
    change = lambda value: actuator_outputs((eqx.tree_at(lambda e: getattr(e, name), effect(), jnp.asarray(value)),))  # noqa: E731
    _, slope = jax.jvp(change, (spec.neutral,), (1.0,))
    moved = change(small) - change(spec.neutral)
    rising = slice(0, 12)  # once the heat falls, the memory's running minimum ties where the effect is absent
    moved, slope = moved[rising], slope[rising]
    np.testing.assert_allclose(moved, slope * (small - spec.neutral), atol=0.05 * np.max(np.abs(moved)))


@pytest.mark.slow
def test_contact_stops_the_bend():
    hot = (pj.MartensiteFraction(jnp.ones(8)), pj.MartensiteFraction(jnp.linspace(1.0, 0.2, 8)))
    body, pressure = pj.make_actuator("pneusma2"), jnp.full(8, 25e3)
    free = pj.simulate_history(body, pressure, hot).rows.bend_angle
    limit = 0.6 * float(free[-1])
    stop = find_effect("tip_contact")(stiffness=10.0, angle=limit)
    held = pj.simulate_history(body, pressure, hot, effects=(stop,)).rows.bend_angle
    below = np.asarray(free) < limit
    np.testing.assert_allclose(held[below], free[below], rtol=1e-9, atol=1e-12)
    assert limit < float(held[-1]) < 1.01 * limit


@pytest.mark.slow
def test_relaxation_drifts_in_a_hold_and_forgets():
    t = jnp.concatenate([jnp.linspace(0.0, 1.0, 6), jnp.linspace(2.0, 200.0, 20)])
    pressure = jnp.where(t < 1.0, 5e3 + 25e3 * t, 30e3)
    body = pj.make_actuator("pneuflex_s")
    slow = pj.simulate_history(body, pressure, time=t).rows.curvature
    term = find_effect("viscoelastic_relaxation")(g=jnp.asarray([0.3]), tau=jnp.asarray([10.0]))
    kappa = pj.simulate_history(body, pressure, time=t, effects=(term,)).rows.curvature
    assert float(kappa[5]) < 0.95 * float(slow[5])
    assert np.all(np.diff(kappa[6:]) > 0.0)
    np.testing.assert_allclose(kappa[-1], slow[-1], rtol=1e-4)


def test_a_typo_is_answered_with_the_nearest_name():
    with pytest.raises(pj.InputError, match="did you mean 'tip_contact'"):
        find_effect("tip_contakt")
