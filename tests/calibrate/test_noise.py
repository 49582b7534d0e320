import numpy as np
import pytest

from fitting.data.recordings import Recording
from fitting.inference.channels import channel_weight, correlation_by_lags
from fitting.inference.noise import robust_noise
from fitting.inference.serial_correlation import autocorrelation, correlation_time, inflation_of, lag_one


def first_order(count, memory, seed):
    random = np.random.default_rng(seed)
    white = random.standard_normal(count)
    series = np.empty(count)
    series[0] = white[0] / np.sqrt(1.0 - memory**2)
    for k in range(1, count):
        series[k] = memory * series[k - 1] + white[k]
    return series


def test_noise_of_an_unevenly_sampled_smooth_curve_is_found():
    random = np.random.default_rng(1)
    x = np.sort(random.uniform(0.0, 3.0, 2000))
    y = np.sinh(x) + 0.02 * random.standard_normal(2000)
    assert robust_noise(x, y) == pytest.approx(0.02, rel=0.08)


def test_jumps_and_turning_points_do_not_count_as_noise():
    random = np.random.default_rng(2)
    x = np.concatenate([np.linspace(0, 1, 300), np.linspace(1, 0, 300)])
    y = x**2 + 0.01 * random.standard_normal(600)
    y[100:] += 5.0
    assert robust_noise(x, y) == pytest.approx(0.01, rel=0.15)


def test_a_curve_that_never_moves_has_no_noise_estimate():
    assert robust_noise(np.zeros(10), np.arange(10.0)) == 0.0


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_correlation_time_of_a_first_order_process(memory):
    series = [first_order(4000, memory, seed) for seed in range(20)]
    assert correlation_time(series) == pytest.approx((1.0 + memory) / (1.0 - memory), rel=0.15, abs=0.12)
    assert lag_one(series) == pytest.approx(memory, abs=0.03)


def test_autocorrelation_agrees_with_the_sums_written_out():
    series = [first_order(50, 0.5, 1), first_order(31, 0.5, 2)]
    power = sum(np.sum(s**2) for s in series)
    by_hand = [sum(np.sum(s[lag:] * s[: len(s) - lag]) for s in series) / power for lag in range(25)]
    np.testing.assert_allclose(autocorrelation(series), by_hand, atol=1e-12)


def test_a_smooth_misfit_counts_as_few_independent_samples():
    wave = np.cos(np.linspace(0, 4 * np.pi, 400))
    assert 400 / correlation_time([wave]) < 40


def test_residuals_that_vanish_are_one_sample_each():
    assert correlation_time([np.zeros(20)]) == 1.0


@pytest.mark.parametrize("memory", [0.0, 0.6, 0.9])
def test_standard_errors_grow_with_noise_that_lasts_below_any_misfit(memory):
    """Of stated size, so that chi-square says nothing; and none where the noise is white."""
    series = [first_order(1000, memory, seed) * np.sqrt(1.0 - memory**2) for seed in range(8)]
    reduced = float(np.mean(np.concatenate(series) ** 2))
    assert reduced == pytest.approx(1.0, abs=0.15)
    wanted = np.sqrt((1.0 + memory) / (1.0 - memory))
    assert inflation_of(reduced, series) == pytest.approx(wanted, rel=0.15)
    larger = [s / wanted for s in series]  # noise that was taken as larger because it lasts is not counted twice
    assert inflation_of(reduced / wanted**2, larger) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("memory", [0.0, 0.7])
def test_noise_that_is_stated_too_large_is_no_noise_that_lasts(memory):
    noise = first_order(600, memory, 3) * np.sqrt(1.0 - memory**2)
    time = np.linspace(0.0, 60.0, 600)
    values = 20.0 * np.sin(time / 20.0) + noise
    assert correlation_by_lags(values) == pytest.approx(memory, abs=0.15)

    def weight(stated):
        columns = {"time_s": time, "force_N": values}
        recording = Recording("r", None, "spring", columns=columns, noise={"force_N": stated})
        return channel_weight(recording, "force", {"time": time, "force": values}, 1)[0]

    lasting = np.sqrt((1.0 + memory) / (1.0 - memory))
    assert 1.0 / weight(1.0) == pytest.approx(lasting, rel=0.2)
    assert 1.0 / weight(3.0) < 3.0 * lasting * 1.25  # nine times as much before
