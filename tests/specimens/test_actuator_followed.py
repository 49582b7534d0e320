"""Fractions of an actuator from its resistances: without effects, and with leads while parameters change."""

import equinox as eqx
import jax
import numpy as np
import pytest

from fitting.data.recordings import Campaign, Recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.specimens import actuator_phase, stack
from fitting.specimens.actuator_followed import settled
from fitting.specimens.actuator_phase import UNSETTLED
from fitting.specimens.actuator_rows import body_of
from fitting.specimens.registry import drivers_of
from fitting.specimens.rows import numbers, with_extra
from fitting.specimens.saved_models import AugmentedModel, add_effect
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.effects.electrical import SeriesResistance
from pneusma_jax.numerics.safe import as_arrays

LEADS = 0.12
NOISE = 1.5e-4
"""Noise of a resistance [ohm]."""
ERROR = 4e-5
"""Standard error of the leads in a campaign of four recordings [ohm]."""
NAME = "series_resistance_ohms"
FRACTION = np.r_[0.976, 0.976, 0.974, 0.967, 0.55, 0.28, 0.2, 0.176, 0.16, 0.163, 0.16, 0.161, 0.157, 0.168, 0.6, 0.91,
                 0.955, 0.966, np.full(12, 0.972)]  # fmt: skip
"""Martensite fraction of a spring that is heated through within two rows, and cools again [1]."""
OHMS = [3.7316, 3.7316, 3.7313, 3.7283, 3.4141, 3.3714, 3.3682, 3.3676, 3.3672, 3.3673, 3.3672, 3.3673, 3.3672, 3.3674,
        3.4371, 3.6941, 3.7526, 3.7671, 3.7717, 3.7732, 3.7741, 3.7743, 3.7746, 3.7747, 3.7747, 3.7746, 3.7747, 3.7745,
        3.7745, 3.7744]  # fmt: skip
"""Resistances of such a spring behind leads, in a simulated actuator under pressure [ohm]."""


@pytest.fixture(scope="module")
def heated():
    """A model with leads, its numbers, and a recording with a spring that is heated through."""
    columns = {
        "time_s": 3.0 * np.arange(len(OHMS)),
        "pressure_kPa": np.full(len(OHMS), 30.0),
        "resistance_2_ohm": np.array(OHMS),
        "current_2_A": np.where((np.arange(len(OHMS)) > 3) & (np.arange(len(OHMS)) < 14), 0.195, 0.0),
        "curvature_1pm": np.full(len(OHMS), 20.0),
    }
    recording = Recording(
        "heated", None, "actuator", specimen="A", columns=columns,
        geometry=nominal_geometry("actuator", {"design": "pneusma2"}),
        noise={"resistance_2_ohm": NOISE, "curvature_1pm": 0.25}, tolerance={"wall_thickness_mm": 0.03},
    )  # fmt: skip
    campaign = Campaign("heated", [recording], None)
    model = AugmentedModel(added=(add_effect(SeriesResistance(ohms=LEADS), "measured"),))
    augmented = Augmented("actuator", model, "heated")
    values = augmented.parameters_for(augmented.described(campaign)).valuesdict()
    return augmented, values, augmented.rows_for(campaign)


_resistivity = eqx.filter_jit(lambda alloy, xi0, gamma: alloy.resistivity(xi0, gamma))


def _simple(recordings):
    """Drivers of springs whose strain rises with the fraction: a stand-in for an actuator, in closed form."""
    rows = recordings[0]
    spring, found = body_of(numbers({}, rows), rows).springs[1], {}
    for n, xi0 in zip(rows.extra["layout"].spring_numbers, map(np.asarray, rows.extra["xi0"]), strict=True):
        gamma = 0.02 + 0.08 * xi0
        ohms = np.asarray(_resistivity(spring.alloy, xi0, gamma)) * spring.geometry.wire_length
        found |= {f"xi0_{n}": xi0[None], f"gamma_{n}": gamma[None], f"ohms_{n}": np.asarray(ohms)[None]}
    return found


@pytest.fixture
def through(heated):
    """Rows whose resistances are those of `FRACTION` by `_simple`, without noise."""
    rows = heated[2][0]
    ohms = _simple([_with_fraction(rows, FRACTION)])["ohms_2"][0]
    return [eqx.tree_at(lambda r: r.inputs["resistance_2"], rows, ohms)]


def _with_fraction(rows, fraction):
    return with_extra(rows, xi0=(rows.extra["xi0"][0], fraction))


def test_a_spring_that_is_heated_through_within_two_rows_gets_its_fractions_back(through):
    """They had run through a cycle of seven rounds, because the walk passed for noise."""
    (found,) = settled(through, _simple)
    np.testing.assert_allclose(found.extra["xi0"][1], FRACTION, atol=2e-3)
    assert not found.extra[UNSETTLED]


def test_they_are_found_without_effects_too(through, without_effects):
    """A recording with rows 3 s apart ended at 0.83 where 0.16 was true."""
    (found,) = actuator_phase.decided({}, through)
    np.testing.assert_allclose(found.extra["xi0"][1], FRACTION, atol=2e-3)


def test_rounds_do_not_go_to_and_fro_where_single_rows_have_a_steeper_slope_than_all(heated):
    """As a wire has that remembers. Steps then overshoot, here by a factor of 2.3."""
    rows = heated[2][0]

    def steeper(recordings):
        found, xi0 = _simple(recordings), recordings[0].extra["xi0"][1]
        return found | {"ohms_2": found["ohms_2"] + 1.2 * (xi0 - xi0.mean())}

    fraction = np.linspace(0.97, 0.95, len(FRACTION))
    ohms = steeper([_with_fraction(rows, fraction)])["ohms_2"][0]
    (found,) = settled([eqx.tree_at(lambda r: r.inputs["resistance_2"], rows, ohms)], steeper)
    assert not found.extra[UNSETTLED]
    np.testing.assert_allclose(found.extra["xi0"][1], fraction, atol=1e-3)


@pytest.fixture
def rounds(monkeypatch):
    """Four rounds, of which the last goes astray. Three are too few from a cold start."""
    smoothed, found = actuator_phase._smoothed, []

    def astray(*arguments):
        found.append(smoothed(*arguments))
        return _with_fraction(found[-1], np.full(len(FRACTION), 0.9)) if len(found) == 4 else found[-1]

    monkeypatch.setattr(actuator_phase, "ROUNDS", 4)
    monkeypatch.setattr(actuator_phase, "_smoothed", astray)
    return found


def test_rounds_that_end_nowhere_keep_the_fractions_that_miss_least_and_say_so(through, rounds):
    (found,) = settled(through, _simple)
    assert found.extra[UNSETTLED]
    np.testing.assert_array_equal(found.extra["xi0"][1], rounds[2].extra["xi0"][1])


def test_a_row_without_an_equilibrium_follows_its_neighbours(through):
    def lost(recordings):
        found = _simple(recordings)
        return {name: np.where(np.arange(len(FRACTION)) == 20, np.nan, x) for name, x in found.items()}

    (found,) = settled(through, lost)
    np.testing.assert_allclose(found.extra["xi0"][1], FRACTION, atol=2e-3)
    assert not found.extra[UNSETTLED] and found.extra["gain"][1][20] == 0.0


@pytest.fixture
def without_effects(monkeypatch):
    """`actuator_phase` whose rows are solved by `_simple`; a list of the fractions at which they were."""
    solved = []

    def solve(values, stacked):
        solved.append(np.stack(stacked.extra["xi0"]))
        found = _simple([jax.tree.map(lambda x: np.asarray(x)[0, ...], stacked)])
        columns = {name: np.stack([found[f"{name}_{n}"] for n in (1, 2)], axis=1) for name in ("gamma", "xi0", "ohms")}
        return dict.fromkeys(actuator_phase.OUTPUTS, columns["xi0"][:, 1]) | columns

    monkeypatch.setattr(actuator_phase, "_rows", solve)
    return solved


def test_no_row_is_solved_twice_at_the_same_fractions(through, without_effects):
    """Gains took another solution, and another for each spring, at the fractions of the last round."""
    actuator_phase.decided({}, through)
    assert len(without_effects) > 2 and len(np.unique(without_effects, axis=0)) == len(without_effects)


def test_rounds_without_effects_say_too_that_they_end_nowhere(through, without_effects, rounds):
    """They took the last round without a word."""
    (found,) = actuator_phase.decided({}, through)
    assert found.extra[UNSETTLED]
    np.testing.assert_array_equal(found.extra["xi0"][1], rounds[2].extra["xi0"][1])


def test_a_step_settles_only_as_a_whole(through, monkeypatch):
    """Half of a step that went to and fro by 1.5e-3 passed for settled."""
    rows, start, moves = through[0], np.full(len(FRACTION), 0.9), []

    def to_and_fro(found, _):
        moves.append(1.5e-3 * (-1.0) ** len(moves))
        return _with_fraction(found.rows, np.asarray(found.rows.extra["xi0"][1]) + moves[-1])

    monkeypatch.setattr(actuator_phase, "_smoothed", to_and_fro)
    (found,) = settled([_with_fraction(rows, start)], _simple)
    assert found.extra[UNSETTLED] and len(moves) == actuator_phase.ROUNDS


@pytest.mark.parametrize("ratio", [0.02, 0.05, 0.2, 1.0, 3.0, 7.0, 10.0, 20.0, 50.0])
def test_readings_average_however_far_their_noise_is_from_the_stated_one(through, ratio):
    """Of a fraction of 0.5. Beyond a factor of 5 the walk followed every reading."""
    rows = _many(through[0], 200)
    law = _simple([rows])["ohms_2"][0]
    noise, slope = 1.5e-3, _slope(rows)
    read = law + noise * np.random.default_rng(0).standard_normal(200)
    rows = _with_noise(eqx.tree_at(lambda r: r.inputs["resistance_2"], rows, read), noise / ratio)
    (found,) = settled([rows], _simple)
    assert np.sqrt(np.mean((found.extra["xi0"][1] - 0.5) ** 2)) < 0.3 * noise / slope
    assert (actuator_phase.understated(found).get(2, 1.0) > actuator_phase.MISSTATED) == (ratio > 5.0)


def _many(rows, count):
    """A recording of so many rows, 1 s apart, at a fraction of 0.5."""
    first = jax.tree.map(lambda x: np.full(count, x[0]) if np.ndim(x) == 1 and len(x) == len(FRACTION) else x, rows)
    return _with_fraction(eqx.tree_at(lambda r: r.time, first, np.arange(float(count))), np.full(count, 0.5))


def _slope(rows):
    """Slope of `_simple`'s resistance over the fraction at 0.5 [ohm]."""
    high, low = (_simple([_with_fraction(rows, np.full(200, x))])["ohms_2"][0, 0] for x in (0.51, 0.49))
    return abs(high - low) / 0.02


def _with_noise(rows, noise):
    return with_extra(rows, noise_resistance_2=np.asarray(noise))


def test_a_stated_noise_of_next_to_nothing_has_a_floor(through):
    """A gain had the stated noise where all else had the floor of the reading's resolution."""
    least = actuator_phase.LEAST_NOISE * float(np.median(through[0].inputs["resistance_2"]))
    gains = [settled([_with_noise(through[0], noise)], _simple)[0].extra["gain"][1] for noise in (1e-12, least)]
    np.testing.assert_array_equal(*gains)
    assert np.any(gains[0] != 0.0)


def test_scatter_is_that_of_quiet_rows_only():
    rows = 200
    noise = 0.01 * np.random.default_rng(1).standard_normal(rows)
    time = np.sort(np.random.default_rng(2).uniform(0.0, 200.0, rows))
    still = actuator_phase.scatter(time, noise)
    assert still == pytest.approx(0.01, rel=0.3)
    assert actuator_phase.scatter(time, noise + 3.0 * time) == pytest.approx(still)
    heated = noise + np.where(np.arange(rows) % 20 < 6, 10.0 * np.sin(np.arange(rows)), 0.0)
    assert actuator_phase.scatter(time, heated) == pytest.approx(still, rel=0.8)
    assert actuator_phase.scatter(time[:2], noise[:2]) == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("errors", [-3.0, 1.0])
def test_a_hot_spring_follows_leads_without_a_jump(heated, errors):
    """Near full heat rows had jumped to the cold spring's configuration, at a hundredth of an error."""
    augmented, values, rows = heated
    moved = {**values, NAME: values[NAME] + errors * ERROR}
    decided = augmented.decided(values, rows)
    assert np.max(np.abs(_drivers(augmented, values, decided)["ohms_2"] - OHMS)) < NOISE
    curvature = lambda at, rows: _drivers(augmented, at, rows)["curvature"]  # noqa: E731
    change = curvature(moved, augmented.decided(moved, decided)) - curvature(values, decided)
    followed = curvature(moved, decided) - curvature(values, decided)
    assert 0.03 < np.max(np.abs(change)) < 2.0  # a noise of the curvature is 0.25 1/m
    np.testing.assert_allclose(followed, change, atol=0.1 * np.max(np.abs(change)))


def _drivers(augmented, values, rows):
    found = jax.device_get(drivers_of(augmented)(as_arrays(values), stack(rows)))
    return {name: x[0][: len(OHMS)] for name, x in found.items()}
