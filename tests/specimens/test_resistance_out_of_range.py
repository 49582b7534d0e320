"""A wire whose resistance no fraction explains, as with leads: how fast its fraction may change all the same."""

from types import SimpleNamespace

import jax
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.data.recordings import read_campaign
from fitting.specimens import SPRING, spring
from fitting.specimens.rows import stack

OHMS, LEADS, ROWS = 2e-4, 0.1, 240
TIME = 0.5 * np.arange(ROWS)
HEATED = np.clip(1.0 - 0.95 * (TIME - 20.0) / 60.0, 0.05, 1.0)
"""Fraction of a wire that is held at its length and heated from 20 s on."""

SIDECAR = f"""
kind = "spring"
specimen = "S"
real = false
[noise]
force_N = 0.004
resistance_ohm = {OHMS}
[geometry]
alloy = "krl35"
active_coils = 52.0
free_length_mm = 14.0
prestrain = 0.0
"""


def prepared(folder, leads, fraction, seed=1):
    """Process noise and readings beyond range of a held spring, for a base model without leads."""
    pull = np.minimum(TIME, 15.0) * 1e-3
    spring = pj.Spring(pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3), pj.load_alloy("krl35"), 14e-3)
    found = pj.simulate_spring(spring, pull, pj.MartensiteFraction(np.broadcast_to(fraction, ROWS)), time=TIME)
    noise = np.random.default_rng(seed).standard_normal((2, ROWS))
    force = np.asarray(found.seen["force"]) + 4e-3 * noise[0]
    ohms = np.asarray(found.seen["resistance"]) + leads + OHMS * noise[1]
    table = np.stack([TIME, 1e3 * pull, force, ohms], axis=1)
    folder = folder / f"leads_{leads}"
    folder.mkdir(exist_ok=True)
    header = "time_s,elongation_mm,force_N,resistance_ohm"
    np.savetxt(folder / "held.csv", table, delimiter=",", header=header, comments="", fmt="%.9g")
    (folder / "held.toml").write_text(SIDECAR)
    campaign = read_campaign(folder)
    latent = SPRING.latent
    stacked = stack(latent.rows_for(campaign), coarse=True)
    sigma = np.full(stacked.mask.shape[1], np.inf)
    sigma[:ROWS] = OHMS
    channel = SimpleNamespace(quantity="resistance", sigma=sigma, correlation=0.0)
    values = {name: entry.value for name, entry in SPRING.parameters_for(campaign).items()}
    found = latent.prepared(values, stacked, [[channel]] + [[] for _ in range(len(stacked.mask) - 1)])
    return np.asarray(found.extra["process_noise"])[0, :ROWS]


def allowed(walk, first, last):
    """Change of the fraction that a walk allows between two rows, one standard deviation."""
    return float(np.sqrt(np.sum(0.5 * walk[first + 1 : last + 1])))


def test_a_fraction_may_change_where_leads_lift_its_resistance_out_of_range(tmp_path):
    """The resistance of a heated wire tells how the fraction changes, though not where it is."""
    first, last = 40, 46  # it falls to 0.95, while the resistance is higher than that of a cold wire
    change = HEATED[first] - HEATED[last]
    least = [allowed(prepared(tmp_path, leads, HEATED), first, last) for leads in (0.0, LEADS)]
    assert min(least) > 0.5 * change / np.sqrt(last - first), least


def test_a_wire_at_rest_does_not_move_for_its_leads(tmp_path):
    """Its strained wire's resistance is out of range by the same all the time."""
    still, lifted = prepared(tmp_path, 0.0, 1.0), prepared(tmp_path, LEADS, 1.0)
    assert allowed(lifted, 0, ROWS - 1) < 1e-3 and allowed(still, 0, ROWS - 1) < 1e-3


@pytest.mark.parametrize("seed", range(3))
def test_noise_of_a_resistance_in_range_frees_nothing(seed, monkeypatch, tmp_path):
    whole = prepared(tmp_path, 0.0, HEATED, seed)
    monkeypatch.setattr(spring, "changes_beyond_range", lambda values, rows, precision: jax.numpy.zeros(precision.shape))
    np.testing.assert_array_equal(whole, prepared(tmp_path, 0.0, HEATED, seed))
