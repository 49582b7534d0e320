"""One compiled program per kind of recording: every effect of the kind at once, parameters and protocol traced.

All tests of effects call these, so each is compiled once: `run(kind, {"tip_contact.stiffness": 0.01})` simulates
with everything else at its neutral value.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from pneusma_jax.effects import CATALOGUE, specs_of

ROWS = 48
TIME = np.linspace(0.0, 94.0, ROWS)  # 2 s a row
UP_AND_DOWN = np.interp(TIME, [0.0, 30.0, 60.0, 94.0], [0.0, 1.0, 0.0, 1.0])
AREA, GAUGE = 20e-6, 30e-3


def names(kind):
    """Slug, parameter and spec of everything that acts in a kind of recording."""
    return [
        (slug, name, spec)
        for slug, effect in CATALOGUE.items()
        if kind in effect.kinds
        for name, spec in specs_of(effect, kind).items()
    ]


def built(kind, values):
    """Every effect of a kind with `values` in the order of `names`."""
    table = {}
    for (slug, name, _), value in zip(names(kind), values, strict=True):
        table.setdefault(slug, {})[name] = value
    return tuple(CATALOGUE[slug](**parameters) for slug, parameters in table.items())


@functools.cache
def specimen(kind):
    """What is tested; made outside of any trace."""
    if kind == "S":
        dimensions = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
        return pj.Spring(dimensions, pj.load_alloy("krl35"), 14e-3)
    if kind == "A":
        return pj.make_actuator("pneusma2")
    if kind == "W":
        return pj.load_wire()
    return pj.load_silicone() if kind == "E" else pj.make_tube(pj.Geometry(), pj.load_silicone())


def coupon(effects, strain, time):
    history = pj.simulate_coupon(specimen("E"), strain, time=time, effects=effects, area=AREA, gauge_length=GAUGE)
    return history.seen | {"true_strain": history.rows.strain}


def stand(effects, elongation, xi0, time):
    history = pj.simulate_spring(specimen("S"), elongation, pj.MartensiteFraction(xi0), time=time, effects=effects)
    rows = history.rows
    return history.seen | {"true_stress": rows.stress, "true_gamma": rows.gamma, "true_gamma_R": rows.gamma_R}


def wire(effects, stress, temperature, time):
    history = pj.simulate_wire(specimen("W"), stress=stress, temperature=temperature, time=time, effects=effects)
    return history.seen | {"true_xi0": history.rows.xi0}


def tube(effects, pressure, time):
    history = pj.simulate_tube(specimen("T"), pressure, time=time, effects=effects)
    return history.seen | {"true_bend": history.rows.bend_angle}


def actuator(effects, pressure, xi0, current, gravity, time):
    drive = (pj.MartensiteFraction(1.0), pj.MartensiteFraction(xi0))
    history = pj.simulate_history(
        specimen("A"), pressure, drive, time=time, effects=effects, currents=(None, current), gravity=gravity
    )
    rows = history.rows
    return history.seen | {"true_ohms": rows.springs[1].resistance, "true_xi0_1": rows.springs[0].xi0}


LATE = 1.0 - 0.6 * np.sin(np.pi * np.maximum(TIME - 46.0, 0.0) / 48.0) ** 2
HEAT = 1.0 - 0.7 * np.sin(np.pi * TIME / 94.0) ** 2
SIMULATIONS = {"A": actuator, "S": stand, "W": wire, "E": coupon, "T": tube}
PROTOCOLS = {
    "A": dict(
        pressure=20e3 + 10e3 * np.sin(TIME / 5.0),
        xi0=HEAT,
        current=np.sqrt(1.0 - HEAT),
        gravity=pj.gravity_vector("horizontal"),
        time=TIME,
    ),
    "S": dict(elongation=42e-3 * UP_AND_DOWN - 2e-3, xi0=LATE, time=TIME),
    "W": dict(stress=100e6 * np.sin(TIME / 6.0), temperature=35.0 + 30.0 * np.cos(TIME / 15.0), time=TIME),
    "E": dict(strain=0.8 * UP_AND_DOWN, time=TIME),
    "T": dict(pressure=40e3 * UP_AND_DOWN, time=TIME),
}


@functools.cache
def program(kind):
    """Outputs, and their Jacobian over every parameter, of values and a protocol."""

    def outputs(values, protocol):
        seen = SIMULATIONS[kind](built(kind, values), **protocol)
        return seen, seen

    specimen(kind)
    return jax.jit(jax.jacfwd(outputs, has_aux=True))


def run(kind, present=None, **protocol):
    """Outputs with some parameters, named `slug.parameter`, and the rest neutral; and the Jacobian."""
    present = dict(present or {})
    values = [present.pop(f"{slug}.{name}", spec.neutral) for slug, name, spec in names(kind)]
    assert not present, present
    drive = {name: jnp.asarray(value, dtype=float) for name, value in (PROTOCOLS[kind] | protocol).items()}
    slopes, seen = program(kind)(jnp.asarray(values, dtype=float), drive)
    return {name: np.asarray(value) for name, value in seen.items()}, slopes


def seen(kind, present=None, **protocol):
    """Outputs alone."""
    return run(kind, present, **protocol)[0]


@functools.cache
def _bare(kind):
    specimen(kind)
    return jax.jit(lambda protocol: SIMULATIONS[kind]((), **protocol))


def without(kind, **protocol):
    """Outputs of the base model, in which no effect is compiled."""
    drive = {name: jnp.asarray(value, dtype=float) for name, value in (PROTOCOLS[kind] | protocol).items()}
    return {name: np.asarray(value) for name, value in _bare(kind)(drive).items()}
