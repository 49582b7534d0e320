"""Effects that may be off: on they act as they would without a switch, off nothing of them is left."""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_programs import TIME, UP_AND_DOWN, coupon, specimen, stand

from pneusma_jax.effects import CATALOGUE, specs_of
from pneusma_jax.pipeline import Switched

SLUGS = {
    "E": ("mullins_softening", "viscoelastic_relaxation", "load_train_compliance", "channel_lag"),
    "S": ("cyclic_shakedown", "coil_contact", "force_calibration", "load_train_compliance"),
}


def typical(kind, slug, size=1.0):
    """An effect as large as it usually is, times a size."""
    specs = specs_of(CATALOGUE[slug], kind).items()
    values = {n: s.typical if s.shape else s.neutral + size * (s.typical - s.neutral) for n, s in specs}
    return CATALOGUE[slug](**values)


def outputs(kind, effects):
    if kind == "E":
        return coupon(effects, 0.8 * UP_AND_DOWN, TIME)
    return stand(effects, 0.03 * UP_AND_DOWN, 0.6 + 0.4 * UP_AND_DOWN, TIME)


def along(function, at, step):
    """Outputs and their derivatives along a step, in one program."""
    return jax.jit(lambda at, step: jax.jvp(function, (at,), (step,)))(at, step)


@functools.cache
def switched(kind):
    """Outputs with every effect behind a switch, and their derivatives along the sizes: one program of a kind."""
    specimen(kind)  # made outside of any trace

    def found(sizes, on):
        return outputs(kind, tuple(Switched(typical(kind, slug, s), o) for slug, s, o in zip(SLUGS[kind], sizes, on, strict=True)))

    return jax.jit(lambda sizes, on: jax.jvp(lambda s: found(s, on), (sizes,), (sizes,)))


@functools.cache
def without(kind):
    return outputs(kind, ())


@pytest.mark.parametrize(("kind", "slug"), [(kind, slug) for kind, slugs in SLUGS.items() for slug in slugs])
def test_a_switch_leaves_its_effect_or_nothing(kind, slug):
    only, off = jnp.asarray([float(other == slug) for other in SLUGS[kind]]), jnp.zeros(len(SLUGS[kind]), bool)
    acting, tangent = switched(kind)(only, only > 0.0)
    plain, expected = along(lambda size: outputs(kind, (typical(kind, slug, size),)), jnp.ones(()), jnp.ones(()))
    idle, none = switched(kind)(only, off)
    base, shown = without(kind), ("force",) if kind == "S" else ("stress", "force")
    for name in [name for name in shown if name in plain]:
        np.testing.assert_allclose(acting[name], plain[name], rtol=1e-11, atol=1e-14)
        np.testing.assert_allclose(tangent[name], expected[name], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(idle[name], base[name], rtol=1e-11, atol=1e-14)
        assert not np.any(none[name])
        assert np.max(np.abs(plain[name] - base[name])) > 1e-4 * np.max(np.abs(base[name]))


def test_what_is_off_leaves_what_always_acts():
    specimen("E")
    always = typical("E", "viscoelastic_relaxation")
    off = Switched(typical("E", "mullins_softening", 0.0), jnp.asarray(False))
    beside, alone = (outputs("E", effects)["stress"] for effects in ((off, always), (always,)))
    np.testing.assert_allclose(beside, alone, rtol=1e-12)
    assert np.max(np.abs(alone - outputs("E", ())["stress"])) > 1e-3 * np.max(alone)
