"""The catalogue: complete, absent at neutral values, visible where it says so, and open to one more file."""

import re
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from effect_programs import built, names, program, run, without
from scipy.integrate import solve_ivp

import pneusma_jax as pj
from pneusma_jax.effects import CATALOGUE, Effect, find_effect, register, specs_of
from pneusma_jax.pipeline import Known, changes_states

SLOW = [pytest.param("A", marks=pytest.mark.slow), pytest.param("T", marks=pytest.mark.slow)]
KINDS = ["E", "S", pytest.param("W", marks=pytest.mark.slow), *SLOW]
COMPONENTS = {
    "spring", "elastomer", "geometry", "pressure", "contact", "friction", "environment", "sensor",
}  # fmt: skip
# without a slope where absent, or only under a drive that these protocols do not have
HIDDEN = {
    ("A", "tip_contact.stiffness"): "a threshold that is not reached",
    ("T", "wall_eccentricity.shift"): "even in its sign: a straight tube bends and lengthens by its square",
    ("W", "series_resistance.ohms"): "the phase comes from temperature, not from resistance",
    ("W", "resistance_temperature_coefficient.alpha_m"): "as above",
    ("W", "resistance_temperature_coefficient.alpha_a"): "as above",
}


def test_every_effect_of_the_published_list_is_there(shared):
    text = (shared / "EFFECTS.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| ([A-Z, al]+) \|", text, re.MULTILINE))
    assert set(CATALOGUE) == set(rows)
    for slug, kinds in rows.items():
        wanted = "ASWET" if kinds == "all" else kinds.replace(", ", "")
        assert set(CATALOGUE[slug].kinds) == set(wanted), slug


@pytest.mark.parametrize("slug", CATALOGUE)
def test_an_effect_says_what_it_is_in_plain_numbers(slug):
    effect = CATALOGUE[slug]
    assert effect.component in COMPONENTS and effect.sentence.endswith(".") and effect.literature
    usual = effect()
    assert any(not spec.shape for spec in effect.specs.values())
    for name, spec in effect.specs.items():
        assert spec.low <= min(spec.neutral, spec.typical) <= max(spec.neutral, spec.typical) <= spec.high, name
        assert np.shape(getattr(usual, name)) == () and float(getattr(usual, name)) == spec.neutral, name
        assert spec.shape or spec.typical != spec.neutral, name
        assert set(spec.kinds) <= set(effect.kinds), name
    for kind in effect.kinds:
        assert specs_of(effect, kind), kind


@pytest.mark.parametrize("kind", KINDS)
def test_neutral_is_absent_and_its_signature_is_finite(kind):
    bare, (with_all, slopes) = without(kind), run(kind)
    for channel, values in bare.items():
        scale = max(np.max(np.abs(values)), 1e-2)
        np.testing.assert_allclose(with_all[channel], values, rtol=1e-11, atol=1e-12 * scale, err_msg=channel)
    for k, (slug, name, spec) in enumerate(names(kind)):
        moved = {channel: np.asarray(slope)[..., k] for channel, slope in slopes.items()}
        assert all(np.all(np.isfinite(values)) for values in moved.values()), (slug, name)
        # no instrument shows a tube's bend
        shown = {channel: x for channel, x in moved.items() if channel != "true_bend"}
        shares = [np.max(np.abs(x)) / max(np.max(np.abs(bare[c])), 1e-3) for c, x in shown.items()]
        size = max(shares) * abs(spec.typical - spec.neutral)
        if spec.shape:
            assert max(shares) < 1e-9, f"{slug}.{name} is no shape: it acts while the effect is absent"
        else:
            assert (size > 1e-9) != ((kind, f"{slug}.{name}") in HIDDEN), (slug, name, size)


@pytest.mark.parametrize("kind", KINDS)
def test_all_at_once_stay_finite_when_present_and_shapes_then_count(kind):
    half = {f"{s}.{n}": x.neutral + 0.3 * (x.typical - x.neutral) for s, n, x in names(kind)}
    seen, slopes = run(kind, half)
    for channel, values in seen.items():
        assert np.all(np.isfinite(values)) and np.all(np.isfinite(np.asarray(slopes[channel]))), channel
    for k, (slug, name, _) in enumerate(names(kind)):
        acts = max(float(np.max(np.abs(np.asarray(slope)[..., k]))) for slope in slopes.values())
        unseen = slug == "tip_contact" or (kind, f"{slug}.{name}") in HIDDEN and slug != "wall_eccentricity"
        # on an actuator the springs never come near zero strain
        unseen = unseen or (kind, name) == ("A", "closed")
        assert acts > 0.0 or unseen, (slug, name)
    assert program(kind) is program(kind) and len(built(kind, [0.1] * len(names(kind)))) > 5


@pytest.mark.parametrize("kind", ["E", "S", "W"])
def test_a_repeated_row_without_duration_changes_nothing(kind):
    from effect_programs import PROTOCOLS, ROWS

    cut = ROWS - 12
    padded = {k: np.concatenate([v[:cut], np.full(12, v[cut - 1])]) for k, v in PROTOCOLS[kind].items()}
    half = {f"{s}.{n}": x.neutral + 0.3 * (x.typical - x.neutral) for s, n, x in names(kind)}
    seen, _ = run(kind, half, **padded)
    for channel, values in seen.items():
        scale = np.max(np.abs(values))
        # effects that look one row back settle in the first repeated row
        np.testing.assert_allclose(values[cut + 1 :], values[-1], atol=2e-3 * scale, err_msg=channel)


def test_a_typo_is_answered_with_the_nearest_name():
    with pytest.raises(pj.InputError, match="did you mean 'tip_contact'"):
        find_effect("tip_contakt")


def test_an_incomplete_or_doubled_effect_is_refused():
    class Nameless(Effect):
        slug, component, kinds = "nameless", "sensor", "S"

    class Second(CATALOGUE["gravity"]):
        pass

    with pytest.raises(ValueError, match="must state its `sentence`"):
        register(Nameless)
    with pytest.raises(ValueError, match="is taken by Weight"):
        register(Second)
    assert "nameless" not in CATALOGUE and CATALOGUE["gravity"].__name__ == "Weight"


@pytest.mark.parametrize("slug", CATALOGUE)
def test_words_of_a_kind_are_for_kinds_that_show_the_effect(slug):
    effect = CATALOGUE[slug]
    assert set(effect.sentences) <= set(effect.kinds)
    for kind in effect.kinds:
        assert effect.sentence_for(kind).endswith(".")
        words = " ".join([effect.sentence_for(kind), *(spec.text for spec in specs_of(effect, kind).values())])
        if kind != "A":
            assert not re.search(r"\b(bend|bending|moment|camera|straightening)\b", words), (kind, words)


def test_a_tube_rubs_as_it_lengthens():
    effect = CATALOGUE["wrap_friction"]
    assert "bending" in effect.sentence_for("A") and "lengthens" in effect.sentence_for("T")
    assert "lengthening" in specs_of(effect, "T")["slip"].text and "bend" in specs_of(effect, "A")["slip"].text


def test_a_volume_before_the_restriction_is_a_second_lag():
    """The chamber of two lags in a row answers a ramp that ends, as a solver of the two equations says."""
    time, taus = np.linspace(0.0, 4.0, 41), (0.6, 0.3)
    pressure = np.minimum(20e3 * time, 20e3)
    lag = find_effect("pressure_lag")(tau=0.6, laminar=1e9, line=0.5)
    chamber, memory = [], lag.begin(Known({"pressure": jnp.zeros(())}))
    step = jax.jit(lambda at, memory: (lag.pressure(at["recorded_pressure"], at, memory), lag.remember(memory, at)))
    for value, interval in zip(pressure, np.diff(time, prepend=0.0), strict=True):
        now, memory = step({"recorded_pressure": value, "interval": interval}, memory)
        chamber.append(float(now))

    def follow(t, p):
        return [(min(20e3 * t, 20e3) - p[0]) / taus[1], (p[0] - p[1]) / taus[0]]

    exact = solve_ivp(follow, (0.0, 4.0), [0.0, 0.0], t_eval=time, max_step=0.05).y[1]
    np.testing.assert_allclose(chamber, exact, atol=20.0)  # of 20 kPa; one lag of 0.9 s is off by 1.5 kPa
    one = 20e3 * (time - 0.9 * (1.0 - np.exp(-time / 0.9)))
    assert np.abs(one - exact)[time <= 1.0].max() > 1e3


def test_the_slips_of_a_wrapping_may_differ_a_hundredfold():
    """Friction builds up with the logarithm of the way then, within a tenth of its limit."""
    widest = specs_of(CATALOGUE["wrap_friction"], "T")["spread"].high
    friction = find_effect("wrap_friction")(slip=0.1, spread=widest, begun=1.0)
    assert np.exp(2.0 * widest) > 50.0
    ways = np.geomspace(2e-3, 2.0, 40)
    first = friction.begin(Known({}))
    built = [float(np.mean(np.asarray(friction._states(jnp.asarray(way), first)))) for way in ways]
    slips = 0.1 * np.exp(widest * np.linspace(-1.0, 1.0, 2001))
    smooth = [float(np.mean(np.minimum(way / slips, 1.0))) for way in ways]
    np.testing.assert_allclose(built, smooth, atol=0.1)


def test_a_loop_of_temperature_may_lie_about_the_base_curve():
    """A table's temperature may be that of cooling, of heating, or the middle of both; a loop is 12 K wide."""
    wire = SimpleNamespace(T_mid=50.0, martensite_fraction_at=lambda T: jnp.where(T < 50.0, 1.0, 0.0))
    temperatures = np.concatenate([np.arange(79.0, 21.0, -2.0), np.arange(21.0, 80.0, 2.0)])
    crossings = {}
    for between in (0.0, 0.5, 1.0):
        loop, crossed = find_effect("transformation_hysteresis")(gap_T=12.0, width_T=1.0, between=between), []
        last, before = loop.begin(Known({"temperature": jnp.asarray(79.0), "wire": wire}))[1], None
        step = jax.jit(lambda T, last, loop=loop: (
            loop.temperature(T, Known({"wire": wire, "number": 1}), {1: last}), loop._cooling(T, last)
        ))  # fmt: skip
        for T in temperatures:
            seen, cooling = map(float, step(T, last))  # the first is what the base curve is read at
            if before is not None and (seen - 50.0) * (before - 50.0) <= 0.0 and seen != before:
                crossed.append(T)
            last, before = (1.0, *last[1:3], T, cooling), seen
        crossings[between] = min(crossed), max(crossed)
    for between, (cooled, heated) in crossings.items():
        assert cooled == pytest.approx(50.0 - 12.0 * between, abs=2.0)
        assert heated == pytest.approx(62.0 - 12.0 * between, abs=2.0)


def test_an_instrument_that_a_specimen_lacks_reads_nothing():
    """A model of a spring has a load cell, one of an actuator a camera; either may be asked for the other."""
    for slug, there in (("force_calibration", {"curvature": 1.0}), ("camera_calibration", {"force": 1.0})):
        assert find_effect(slug)().outputs(dict(there), Known({"time": 0.0}), None) == there
    assert not changes_states(find_effect("camera_calibration")()) and changes_states(find_effect("gravity")())
    stand = {slug for slug, effect in CATALOGUE.items() if not changes_states(effect())}
    assert stand == {"camera_calibration", "channel_lag", "force_calibration", "load_train_compliance"}
