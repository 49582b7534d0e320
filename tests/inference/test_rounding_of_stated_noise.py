"""Readings that a logger rounded, whose noise somebody states as that of the instrument."""

import dataclasses

import numpy as np
import pytest

from fitting.data.recordings import Recording, read_campaign, write_recording
from fitting.inference.channels import block_noise, serial_correlation
from fitting.inference.noise import rounding_noise
from fitting.inference.readings import cautions, stated_noise
from pneusma_jax.errors import InputError

ROWS, SIGMA = 3000, 0.2
TREND = 20.0 * np.sin(np.linspace(0.0, 9.0, ROWS))


def lasting(correlation, seed=0):
    """First-order noise of size `SIGMA`."""
    kicks = np.random.default_rng(seed).standard_normal(ROWS)
    noise = [kicks[0]]
    for kick in kicks[1:]:
        noise.append(correlation * noise[-1] + np.sqrt(1.0 - correlation**2) * kick)
    return SIGMA * np.array(noise)


def rounded(step, correlation=0.0):
    values = TREND + lasting(correlation)
    return np.round(values / step) * step if step else values


def coupon(values, sigma=SIGMA):
    columns = {"time_s": np.arange(ROWS) * 0.1, "strain": np.linspace(0.0, 1.0, ROWS), "stress_kPa": values}
    return Recording("r", None, "elastomer", columns=columns, noise={"stress_kPa": sigma} if sigma else {})


@pytest.mark.parametrize("correlation", [0.0, 0.6])
@pytest.mark.parametrize("step", [0.0, 0.1, 0.5, 1.0])
def test_stated_noise_of_an_instrument_becomes_that_of_its_rounded_readings(step, correlation):
    values = rounded(step, correlation)
    errors = np.sqrt(np.mean((values - TREND) ** 2))
    assert stated_noise(coupon(values), "stress") == pytest.approx(1e3 * errors, rel=0.05)


@pytest.mark.parametrize("step", [0.0, 0.5, 1.0])
def test_stated_noise_of_rounded_readings_stays(step):
    values = rounded(step)
    stated = float(np.hypot(SIGMA, step / np.sqrt(12.0)))
    assert stated_noise(coupon(values, stated), "stress") == pytest.approx(1e3 * stated)


def test_nothing_is_stated_where_nobody_states_it():
    assert stated_noise(coupon(rounded(0.5), None), "stress") is None


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.8])
def test_rounding_hides_no_correlation(correlation):
    values = rounded(0.5, correlation)
    errors = values - TREND
    expected = np.mean(errors[1:] * errors[:-1]) / np.mean(errors**2)
    found = serial_correlation(values, np.hypot(SIGMA, rounding_noise(values)))
    assert found == pytest.approx(expected, abs=0.08)


def test_means_of_rounded_readings_scatter_as_their_noise_says():
    """Reduced chi-squares of nulls were 1.7 with the stated noise alone."""
    values, block = rounded(0.5, 0.6), 3
    total = stated_noise(coupon(values), "stress") / 1e3
    assert np.mean((values - TREND) ** 2) / total**2 == pytest.approx(1.0, abs=0.1)
    each = block_noise(total, serial_correlation(values, total), block)[0]
    means = (values - TREND).reshape(-1, block).mean(axis=1)
    assert np.mean(means**2) / each**2 == pytest.approx(1.0, abs=0.15)


def test_a_caution_says_that_rounding_far_above_the_noise_counts():
    recording = coupon(rounded(2.0))
    (said,) = (text for text in cautions([recording]) if "far below the" in text)
    counted = stated_noise(recording, "stress") / 1e3
    assert said.endswith(f"Rounding is added to it, so that the readings count with {counted:.3g} kPa")


def test_a_file_may_say_that_its_noise_includes_rounding():
    """Rounding had been added below an apparent step of the readings, and nobody could deny it."""
    added = coupon(rounded(2.0))
    (said,) = (text for text in cautions([added]) if "far below the" in text)
    assert "noise_includes_rounding = true" in said
    denied = dataclasses.replace(added, noise_includes_rounding=True)
    assert stated_noise(denied, "stress") == pytest.approx(1e3 * SIGMA)
    assert stated_noise(added, "stress") > 2.0e3 * SIGMA
    (said,) = (text for text in cautions([denied]) if "far below the" in text)
    assert said.endswith("so nothing is added")


@pytest.mark.parametrize(("campaign", "sidecar", "held"), [("true", "", True), ("true", "false", False), ("", "true", True)])
def test_a_campaign_says_so_of_all_and_a_sidecar_of_its_own(tmp_path, campaign, sidecar, held):
    key = "noise_includes_rounding = "
    (tmp_path / "campaign.toml").write_text(f"{key}{campaign}\n" if campaign else "")
    (tmp_path / "pull.toml").write_text('kind = "elastomer"\n' + (f"{key}{sidecar}\n" if sidecar else ""))
    (tmp_path / "pull.csv").write_text("strain,stress_kPa\n" + "".join(f"{x / 9},{9 * x}\n" for x in range(10)))
    assert read_campaign(tmp_path).recordings[0].noise_includes_rounding is held
    (tmp_path / "pull.toml").write_text(f'kind = "elastomer"\n{key}"yes"\n')
    (tmp_path / "campaign.toml").write_text(f"[noise]\n{key}true\n")
    with pytest.raises(InputError, match="move its line above all tables"):
        read_campaign(tmp_path)
    (tmp_path / "campaign.toml").unlink()
    with pytest.raises(InputError, match=r"must be true \(nothing is added to \[noise\]\) or false"):
        read_campaign(tmp_path)


def test_a_recording_that_is_written_again_still_says_so(tmp_path):
    written = dataclasses.replace(coupon(rounded(2.0)), noise_includes_rounding=True)
    write_recording(written, tmp_path)
    assert read_campaign(tmp_path).recordings[0].noise_includes_rounding
