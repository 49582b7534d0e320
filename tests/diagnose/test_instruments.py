"""The noise of an instrument from all of its recordings: its size, its growth with the signal, its memory."""

from dataclasses import replace

import numpy as np
import pytest

from fitting.diagnose.evaluate.instruments import Series, each_of_its_size, instrument_of

TIME = np.arange(150)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


def signals():
    """Small and large ones: a recording by itself cannot tell small errors from lasting ones."""
    return [size * (1.0 - np.cos(TIME / 40.0)) for size in (0.3, 1.0, 3.0, 6.0)]


def noise(rng, correlation):
    kicks = rng.normal(size=len(TIME))
    for n in range(1, len(TIME)):
        kicks[n] = correlation * kicks[n - 1] + np.sqrt(1.0 - correlation**2) * kicks[n]
    return kicks


def told(errors, stated=0.2, inputs=0.0):
    found = [
        Series(e, s, np.full(len(s), inputs), stated, 1) for e, s in zip(errors, signals(), strict=True)
    ]
    return instrument_of(found)


def test_white_noise_of_the_stated_size_is_believed(rng):
    found = told([0.2 * noise(rng, 0.0) for _ in signals()])
    assert found.scale == 1.0 and found.growth == 0.0 and found.correlation == 0.0


def test_noise_that_grows_with_the_signal_is_not_taken_for_noise_that_lasts(rng):
    level = np.sqrt(np.mean(np.concatenate(signals()) ** 2))
    found = told([0.2 * (0.05 + 0.95 * s / level) * noise(rng, 0.0) for s in signals()])
    assert found.growth > 0.9 and found.correlation == 0.0
    small, large = (found.sigma(0.2, s, 1)[0].mean() for s in (signals()[0], signals()[-1]))
    assert large > 5.0 * small


def test_noise_that_lasts_is_not_taken_for_noise_that_grows(rng):
    found = told([0.2 * noise(rng, 0.7) for _ in signals()])
    assert found.correlation == pytest.approx(0.7, abs=0.12) and found.growth < 0.2


def test_slow_misfit_and_corners_are_no_noise(rng):
    """What missing physics leaves: a course ten times as large as the noise, with a corner."""
    course = 2.0 * np.sin(TIME / 25.0) + np.abs(TIME - 75.0) / 30.0
    found = told([course + 0.2 * noise(rng, 0.0) for _ in signals()])
    assert found.scale == 1.0 and found.correlation < 0.15


def test_unstated_noise_is_found_and_a_statement_is_believed(rng):
    assert told([0.2 * noise(rng, 0.0) for _ in signals()], None).scale == pytest.approx(0.2, rel=0.1)
    assert told([0.2 * noise(rng, 0.0) for _ in signals()], 0.1).scale == 1.0


def test_of_few_rows_unstated_noise_is_taken_for_lasting_where_that_is_likelier():
    """Errors that last, taken for white ones, are much too small; what is left of them passes for physics."""
    rows = np.ones(60), np.zeros(60)

    def found(correlation, seed):
        rng = np.random.default_rng(seed)
        errors = [0.2 * noise(rng, correlation)[:60] for _ in range(2)]
        return instrument_of([Series(e, *rows, None, 1) for e in errors])

    assert all(found(0.0, seed).correlation == 0.0 for seed in range(8))
    assert sum(found(0.8, seed).correlation > 0.4 for seed in range(8)) >= 7


def test_noise_of_inputs_is_not_counted_twice(rng):
    errors = [np.hypot(0.2, 0.2) * noise(rng, 0.0) for _ in signals()]
    assert told(errors, None, inputs=0.2**2).scale == pytest.approx(0.2, rel=0.2)


def test_means_over_blocks_have_the_noise_of_means(rng):
    found = told([0.2 * noise(rng, 0.0) for _ in signals()])
    sigma, correlation = found.sigma(0.2, signals()[0], 4)
    np.testing.assert_allclose(sigma, 0.1)
    assert correlation == 0.0


def test_too_few_rows_tell_nothing():
    assert instrument_of([Series(np.zeros(20), np.ones(20), np.zeros(20), None, 1)]) is None


def test_samples_tell_what_their_means_do_not(rng):
    """Errors that last two samples, seen through means over two of them beside a slow misfit."""
    samples, rows = [], []
    for signal in signals():
        values = signal + 0.2 * noise(rng, 0.5)
        means, wide = values.reshape(-1, 2).mean(axis=1), signal.reshape(-1, 2).mean(axis=1)
        samples.append(values)
        rows.append(Series(means - wide, wide, np.zeros(75), 0.2, 2))
    fine = [row.finer(values, 75) for row, values in zip(rows, samples, strict=True)]
    assert instrument_of(rows).correlation == 0.0
    both = instrument_of(rows + fine)
    assert both.correlation == pytest.approx(0.5, abs=0.1)
    sigma, _ = both.sigma(0.2, signals()[0], 2)
    np.testing.assert_allclose(sigma, 0.2 * np.sqrt(0.75), rtol=0.05)


def test_samples_beside_a_row_that_does_not_count_do_not_count():
    row = Series(np.array([0.0, np.nan, 0.0, 0.0]), np.arange(4.0), np.ones(4), 0.2, 3)
    fine = row.finer(np.arange(11.0) / 3.0, 4)
    assert len(fine.errors) == 11 and fine.block == 1
    assert np.isnan(fine.errors[2:7]).all() and np.isfinite(fine.errors[7:]).all()
    np.testing.assert_allclose(fine.inputs, 3.0)


def test_the_misfit_of_rows_that_were_chosen_far_apart_is_no_noise():
    """Of many cycles every 25th reading was kept: what the model misses of a cycle bends from row to row."""
    readings = 25 * np.arange(400)
    missed = np.sin(2.0 * np.pi * readings / 260.0)
    errors = missed + 1e-3 * np.random.default_rng(1).normal(size=400)
    apart = Series(errors, np.ones(400), np.zeros(400), None, 1)
    assert instrument_of([apart]).scale > 0.1
    assert instrument_of([replace(apart, readings=readings)]) is None  # its first estimate stays


def test_neighbours_among_chosen_rows_tell_the_noise():
    """Runs of ten neighbouring readings between gaps, as where readings change fast."""
    readings = np.concatenate([100 * k + np.arange(10) for k in range(40)])
    slow = np.sin(2.0 * np.pi * readings / 2000.0)
    errors = slow + 0.02 * np.random.default_rng(1).normal(size=400)
    found = instrument_of([Series(errors, np.ones(400), np.zeros(400), None, 1, readings=readings)])
    assert found.scale == pytest.approx(0.02, rel=0.1)


def in_recordings(rng, sizes, inputs=0.0, correlation=0.0):
    """Series of errors of these sizes, with errors of inputs beside them."""
    return [
        Series(np.hypot(size, np.sqrt(inputs)) * noise(rng, correlation), np.ones(150), np.full(150, inputs), None, 1)
        for size in sizes
    ]


@pytest.mark.parametrize(("inputs", "correlation"), [(0.0, 0.0), (0.1**2, 0.0), (0.0, 0.8)])
def test_a_noisy_recording_has_a_noise_of_its_own(rng, inputs, correlation):
    series = in_recordings(rng, [1.0, 0.2, 0.2, 0.2], inputs, correlation)
    each = each_of_its_size(series, instrument_of(series))
    found = instrument_of(each)
    assert found.correlation == pytest.approx(correlation, abs=0.15)
    assert [found.scale * one.relative for one in each] == pytest.approx([1.0, 0.2, 0.2, 0.2], rel=0.3)


def test_recordings_of_one_noise_keep_it(rng):
    """Also beside large errors of inputs, which tell nothing of the instrument's own."""
    for inputs in (0.0, 1.0):
        series = in_recordings(rng, [0.2] * 4, inputs)
        assert each_of_its_size(series, instrument_of(series)) is None
