"""The band of new measurements holds what it says, and never less than the model's own band."""

from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.stats import norm

from fitting.characterise import characterise
from fitting.data.recordings import read_campaign
from fitting.report.posterior import figures
from fitting.sample.bands import measurement_band
from fitting.sample.models import model_problem
from fitting.specimens.correlated_noise import correlated, spread_of

LEVELS = (0.05, 0.95)
RANDOM = np.random.default_rng(3)
SKEWED = RANDOM.exponential(size=(400, 7)) ** 1.5
TWO_PLACES = np.repeat(np.where(np.arange(400) < 376, 0.0, 10.0)[:, None], 3, axis=1)


@pytest.mark.parametrize("sigma", [0.0, 1e-3, 0.5, 20.0])
@pytest.mark.parametrize("predicted", [SKEWED, -SKEWED, TWO_PLACES], ids=["right", "left", "two places"])
def test_the_band_of_measurements_is_never_within_that_of_the_model(predicted, sigma):
    """A band of a normal about the median ended inside a skewed model's band."""
    low, high = measurement_band(predicted, np.full(predicted.shape[1], sigma), LEVELS)
    model = np.quantile(predicted, LEVELS, axis=0)
    assert np.all(low <= model[0]) and np.all(high >= model[1])


def test_the_band_holds_90_percent_of_measurements_about_the_same_draws():
    low, high = measurement_band(SKEWED, np.full(7, 0.5), LEVELS)
    noise = 0.5 * RANDOM.standard_normal((4000, *SKEWED.shape))
    measured = (SKEWED + noise).reshape(-1, 7)
    np.testing.assert_allclose(np.mean(measured < low, axis=0), 0.05, atol=2e-3)
    np.testing.assert_allclose(np.mean(measured > high, axis=0), 0.05, atol=2e-3)


def test_it_is_that_of_the_noise_where_all_draws_agree():
    low, high = measurement_band(np.full((50, 2), 3.0), np.array([2.0, np.nan]), LEVELS)
    np.testing.assert_allclose([low[0], high[0]], norm(3.0, 2.0).ppf(LEVELS), rtol=1e-9)
    assert np.isnan(low[1]) and np.isnan(high[1])  # nothing is measured there


def test_the_figure_draws_both_bands_from_the_same_draws():
    x = np.arange(7.0)
    curve = SimpleNamespace(
        x=x, measured=np.median(SKEWED, axis=0), sigma=np.full(7, 0.05), recording="a", role="fit",
        x_column="pressure_kPa", y_column="length_mm",
    )  # fmt: skip
    above, below = Figure().subplots(2, 1)
    figures._bands(above, below, curve, SKEWED)
    for axes in (above, below):
        measured, model = (band.get_paths()[0].get_extents() for band in axes.collections[:2])
        assert measured.y0 <= model.y0 and measured.y1 >= model.y1


@pytest.fixture(scope="module")
def tubes():
    """The rows of two shipped tubes."""
    campaign = read_campaign(Path(str(resources.files("calibration_data"))) / "examples" / "tube")
    return characterise(campaign, starts=1, profile=0)


def problem_of(fit, rows):
    return model_problem(fit.title, fit.fit.recordings, rows, fit.fitted)


def test_the_noise_of_a_new_measurement_has_the_zero_of_its_instrument(tubes):
    """The band had white noise only, where the fit had found a zero that drifts by several times that."""
    offset, drift, scale = 3.0, 2.0, 1.5
    rows = [correlated(one, {"length": (drift, offset, scale)}) for one in tubes.fit.rows]
    white, zeros = (problem_of(tubes, some).curves for some in (tubes.fit.rows, rows))
    for one, other, own in zip(white, zeros, rows, strict=True):
        there = np.isfinite(one.sigma)
        np.testing.assert_allclose(other.sigma[there], one.sigma[there] * spread_of(own, "length")[there])
        grown = spread_of(own, "length")[there] / scale
        assert grown[0] > 0.9 * np.hypot(1.0, offset / scale) and grown[-1] > 1.1 * grown[0]  # it drifts from the start


def test_the_spread_is_the_diagonal_of_the_covariance_that_a_fit_takes(tubes):
    rows = correlated(tubes.fit.rows[0], {"length": (2.0, 3.0, 1.5)})
    noise = rows.extra["correlated"]["length"]
    count = len(rows.mask)
    root = np.asarray(noise(np.eye(count)))
    held = np.asarray(rows.weight["length"]) > 0.0
    covariance = np.linalg.inv((root.T @ root)[np.ix_(held, held)])
    np.testing.assert_allclose(spread_of(rows, "length")[held], np.sqrt(np.diag(covariance)), rtol=1e-6)


def test_white_noise_stays_as_stated(tubes):
    assert np.all(spread_of(tubes.fit.rows[0], "length") == 1.0)
