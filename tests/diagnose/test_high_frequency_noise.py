"""The noise of a resistance that nobody states, told by itself: beside ramps, ripple and switches, as rows see it."""

import dataclasses

import numpy as np
import pytest

from fitting.data.recordings import Recording, Reduction
from fitting.diagnose.evaluate.high_frequency_noise import high_frequency_noise, high_frequency_readings
from fitting.specimens.rows import Rows

NAME = "resistance_2"


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def recordings(pieces, block=1, stated=None):
    """Recordings and their rows, means over blocks."""
    found, rows = [], []
    for values in pieces:
        held = values[: len(values) // block * block].reshape(-1, block)
        mean = held.mean(axis=1)
        noise = {} if stated is None else {f"{NAME}_ohm": stated}
        time = np.arange(float(len(values)))
        read = Recording("run", None, "actuator", columns={"time_s": time, f"{NAME}_ohm": values}, noise=noise)
        short = dataclasses.replace(read, reduction=Reduction(read, None, block, ""))
        found.append(read if block == 1 else short)
        there, clock = np.isfinite(mean), np.arange(float(len(mean)))
        rows.append(Rows(there, clock, {}, {NAME: mean}, {NAME: 1.0 * there}, {}, {}, 1))
    return found, rows


def sigmas(pieces, **how):
    return [told[NAME] for told in high_frequency_readings(*recordings(pieces, **how))]


@pytest.mark.parametrize("count", [30, 166, 800])
def test_beside_ramps_ripple_and_a_heater_that_is_switched_off(rng, count):
    time = np.arange(count)
    course = 0.01 * np.sin(time / 3.0) + 0.4 / (1.0 + np.exp((time - 0.7 * count) / 2.0))
    found = np.mean([sigmas([course + 3e-4 * rng.normal(size=count)]) for _ in range(20)])
    assert found == pytest.approx(3e-4, rel=0.35 if count < 100 else 0.1)


@pytest.mark.parametrize("counts", [(60,), (40,) * 8, (166,) * 6, (50, 3000)])
def test_white_noise_is_told_without_bias(rng, counts):
    drawn = [high_frequency_noise([rng.normal(size=n) for n in counts]) for _ in range(100)]
    assert np.mean(drawn) == pytest.approx(1.0, abs=0.06)


def test_a_loud_recording_does_not_hide_what_quiet_ones_show(rng):
    pieces = [size * rng.normal(size=200) for size in (1.0, 1.0, 1.0, 30.0)]
    assert np.allclose(sigmas(pieces), 1.0, rtol=0.25)


def test_rows_that_are_means_have_the_noise_of_means(rng):
    assert np.mean(sigmas([rng.normal(size=1600) for _ in range(4)], block=16)) == pytest.approx(0.25, rel=0.2)


def test_errors_that_last_over_a_block_do_not_average_out(rng):
    """A meter that shows the mean of its last eight readings, in rows of as many."""
    slow = [np.convolve(rng.normal(size=3200), np.ones(8) / 8.0, "valid") for _ in range(4)]
    truth = np.std([s[: len(s) // 8 * 8].reshape(-1, 8).mean(axis=1) for s in slow])
    assert np.mean(sigmas(slow, block=8)) > 0.5 * truth


def test_a_display_of_few_digits_is_not_better_than_its_step(rng):
    """Nor do means of a slow course, whose samples share the error of rounding."""
    time = np.arange(800)
    slow = np.round(2.0 + 0.05 * np.sin(time / 150.0), 2)
    assert sigmas([slow], block=4)[0] == pytest.approx(0.01 / np.sqrt(12.0))


def test_a_ramp_without_repeated_values_has_no_step(rng):
    ramp = np.linspace(3.6, 3.2, 40) + 1e-5 * rng.normal(size=40)
    assert sigmas([ramp])[0] < 3e-5


def test_samples_that_a_logger_leaves_out_do_not_matter(rng):
    values = rng.normal(size=600)
    values[1::2] = np.nan
    assert sigmas([values])[0] == pytest.approx(1.0, rel=0.25)


def test_a_statement_is_believed(rng):
    assert high_frequency_readings(*recordings([rng.normal(size=100)], stated=0.1)) == [{}]


def test_few_samples_tell_something_all_the_same(rng):
    assert high_frequency_noise([np.arange(8.0)]) is None
    assert 0.2 < sigmas([rng.normal(size=9)])[0] < 5.0
