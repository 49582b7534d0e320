"""Noise that nobody states: a diagnosis and a characterisation of one model judge it alike."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.general.fit import GeneralFit
from fitting.calibrate.general.noise import with_noise_of_residuals
from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.inputs import input_noise
from fitting.inference.readings import noise_found, noise_of
from fitting.report.general import text
from fitting.specimens import TUBE, stack
from fitting.specimens.rows import CLEAN

EXAMPLE = Path(__file__).parents[2] / "calibration_data" / "examples" / "tube"


def silent(*kept):
    """The example's inflations, which state the noise of some columns only."""
    campaign = read_campaign(EXAMPLE)
    recordings = [replace(r, noise={n: s for n, s in r.noise.items() if n in kept}) for r in campaign.recordings]
    return replace(campaign, recordings=recordings)


def test_noise_of_a_pressure_counts_for_a_tube_though_nobody_states_it():
    """Nulls had a reduced chi-square of 5 in `characterise`, and were consistent in a diagnosis."""
    campaign = silent()
    rows = TUBE.rows_for(campaign)
    for recording, one in zip(campaign.recordings, rows, strict=True):
        sigma = 1.0 / np.asarray(one.weight["length"])
        assert sigma.min() > noise_found(recording, "length") and sigma.max() > 1.12 * noise_found(recording, "length")
    found = input_noise(list(campaign.recordings), stack(rows))["pressure"]  # as a diagnosis counts it
    assert found[: len(rows)] == pytest.approx([noise_of(r, "pressure") for r in campaign.recordings])


@pytest.mark.parametrize("correlation", [0.0, 0.7])
def test_residuals_tell_noise_that_readings_do_not(correlation):
    """Errors that last over rows are told by what a model leaves, and slow misfit is not taken for them."""
    campaign, rng = silent(), np.random.default_rng(3)
    rows, predicted = TUBE.rows_for(campaign), []
    for one in rows:
        error = rng.standard_normal(len(one.time))
        for k in range(1, len(error)):
            error[k] = correlation * error[k - 1] + np.sqrt(1.0 - correlation**2) * error[k]
        slow = 5e-3 * np.sin(np.linspace(0.0, 4.0, len(error)))
        predicted.append({"length": one.measured["length"] - 1e-3 * error - slow})
    told = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    sizes = [float(np.median(1.0 / one.weight["length"])) for one in told]
    assert min(sizes) == pytest.approx(1e-3, rel=0.3)


@pytest.mark.parametrize("noisy", ["inflation_1", "inflation_4"])
def test_one_noisy_recording_widens_no_other(noisy):
    """All error bars were doubled by a recording of five times the noise, and hid misfit in the others."""
    campaign, rng = silent(), np.random.default_rng(4)
    rows, predicted = TUBE.rows_for(campaign), []
    for recording, one in zip(campaign.recordings, rows, strict=True):
        size = 5e-3 if recording.name == noisy else 1e-3
        predicted.append({"length": one.measured["length"] - size * rng.standard_normal(len(one.time))})
    told = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    sizes = {r.name: float(np.median(1.0 / one.weight["length"])) for r, one in zip(campaign.recordings, told, strict=True)}
    assert sizes.pop(noisy) == pytest.approx(5e-3, rel=0.3)
    assert list(sizes.values()) == pytest.approx([1e-3] * len(sizes), rel=0.3)


def test_what_residuals_tell_beyond_noise_of_inputs_is_the_outputs_own():
    """It is alike in all rows. It had counted as noise of the pressure, and a fit beside zeros was drawn away by it."""
    campaign, rng = silent(), np.random.default_rng(5)
    rows, predicted = TUBE.rows_for(campaign), []
    by_inputs = [1.0 / one.weight["length"] ** 2 - 1.0 / one.extra[CLEAN]["length"] ** 2 for one in rows]
    for one, variance in zip(rows, by_inputs, strict=True):
        error = np.sqrt(5e-4**2 + variance) * rng.standard_normal(len(one.time))
        predicted.append({"length": one.measured["length"] - error})
    told = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    for one, variance in zip(told, by_inputs, strict=True):
        own = 1.0 / one.extra[CLEAN]["length"]
        assert np.ptp(own) == pytest.approx(0.0, abs=1e-12) and own[0] == pytest.approx(5e-4, rel=0.4)
        np.testing.assert_allclose(1.0 / one.weight["length"] ** 2, own**2 + variance, rtol=1e-9)


@pytest.mark.parametrize("noisy", [1.0, 5.0])
def test_a_recording_that_tells_no_noise_has_that_of_the_others(noisy):
    """Also where errors are correlated and the noise of inputs differs. It had had none where the others differ."""
    campaign, rng = silent(), np.random.default_rng(6)
    rows, predicted = TUBE.rows_for(campaign), []
    for k, one in enumerate(rows):
        error = rng.standard_normal(len(one.time))
        for i in range(1, len(error)):
            error[i] = 0.7 * error[i - 1] + np.sqrt(0.51) * error[i]
        predicted.append({"length": one.measured["length"] - 1e-3 * (noisy if k == 1 else 1.0) * error})
    predicted[0]["length"] = np.where(np.arange(len(rows[0].time)) < 8, predicted[0]["length"], np.nan)
    told = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    own = [1.0 / float(np.max(one.extra[CLEAN]["length"])) for one in told]
    others = [size for k, size in enumerate(own) if k and campaign.recordings[k].role == "fit"]
    assert (np.ptp(others) > 0.0) == (noisy > 1.0)
    assert own[0] == pytest.approx(np.exp(np.mean(np.log(others)))) and own[0] > 5e-4


def test_a_recording_for_validation_changes_no_noise_of_a_fit():
    campaign, rng = silent(), np.random.default_rng(4)
    rows = TUBE.rows_for(campaign)
    predicted = [{"length": one.measured["length"] - 1e-3 * rng.standard_normal(len(one.time))} for one in rows]
    (unseen,) = [k for k, r in enumerate(campaign.recordings) if r.role == "validation"]
    before = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    predicted[unseen] = {"length": rows[unseen].measured["length"] + 5.0 * (predicted[unseen]["length"] - rows[unseen].measured["length"])}
    after = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    same = [np.array_equal(a.weight["length"], b.weight["length"]) for a, b in zip(before, after, strict=True)]
    assert same == [k != unseen for k in range(len(rows))]


def test_a_stated_noise_is_not_told_anew():
    campaign = silent("length_mm")
    rows = TUBE.rows_for(campaign)
    predicted = [{"length": one.measured["length"] + 1e-2} for one in rows]
    told = with_noise_of_residuals(campaign.recordings, rows, lambda: predicted)
    assert all(one is other for one, other in zip(told, rows, strict=True))


@pytest.mark.parametrize("again", [True, False])
def test_a_report_says_for_which_noise_its_chi_squares_are(again, monkeypatch):
    """Nine starts had 1874.5 beside a reduced chi-square of 0.313, which was for another noise."""
    monkeypatch.setattr(text, "_priors", lambda _: "")
    monkeypatch.setattr(text, "_specimens", lambda _: [])
    monkeypatch.setattr(text, "how_errors_grew", lambda *_: "were not multiplied")
    ended = SimpleNamespace(status=SimpleNamespace(value="The fit converged."))
    fit = GeneralFit((), (), None, ended, (1874.5,), 0.313, 1.0, 1.0, noise_of_residuals=again)
    said = " ".join(text.how_it_was_fitted(SimpleNamespace(fit=fit, lasting=None)))
    assert ("fitted again with the noise that residuals tell" in said) is again
