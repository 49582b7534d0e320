"""A drive that turned between two rows is no missing physics: the base model passes through the turning point."""

import dataclasses
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.steps import Explanation, Named
from fitting.diagnose.verdict.turns import TriedTurns
from fitting.specimens.unsampled_turns import with_unsampled_turns

SIZES = {
    "wire_diameter_mm": 0.2,
    "mandrel_diameter_mm": 0.8,
    "initial_pitch_mm": 0.27,
    "active_coils": 52.0,
    "free_length_mm": 14.0,
}
EVERY = 13


def slow_campaign():
    """A cold spring is pulled, let go in part and pulled again; of 500 rows the file has every 13th."""
    lengths = (1e-3 * SIZES[key] for key in ("wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm"))
    spring = pj.Spring(pj.SpringGeometry(*lengths, 52.0, 14e-3), pj.load_alloy("krl35"), 14e-3)
    time, rng, recordings = np.linspace(0.0, 60.0, 501), np.random.default_rng(4), []
    for number, largest in enumerate([60.0, 48.0]):
        elongation = np.interp(time, [0.0, 26.1, 60.0], [0.0, largest, 2.0])
        rows = pj.simulate_spring(spring, jnp.asarray(1e-3 * elongation), pj.MartensiteFraction(1.0)).rows
        columns = {
            "time_s": time, "elongation_mm": elongation, "temperature_degC": np.full(501, 15.0),
            "force_N": rows.force + 2e-3 * rng.standard_normal(501),
            "resistance_ohm": rows.resistance + 5e-4 * rng.standard_normal(501),
        }  # fmt: skip
        columns = {name: np.asarray(column)[::EVERY] for name, column in columns.items()}
        noise = {"force_N": 2e-3, "resistance_ohm": 5e-4}
        geometry = {"alloy": "krl35", **SIZES}
        recordings.append(
            Recording(
                f"r{number}", None, "spring", specimen="S", noise=noise, geometry=geometry, columns=columns
            )
        )
    return Campaign("slow", recordings, Path("slow"))


def explained(program):
    """The base model, which nobody searched for effects beside."""
    base = Refitter(program).fit(())
    return Explanation(program, base, Named(base), [], 1.0, False)


@pytest.mark.slow
def test_the_base_model_passes_through_a_turn_between_rows_that_the_readings_show():
    campaign = slow_campaign()
    turned = [with_unsampled_turns(recording) for recording in campaign.recordings]
    programs = [
        Program.of(dataclasses.replace(campaign, recordings=r), "spring")
        for r in (campaign.recordings, turned)
    ]
    assert [len(r) for r in programs[1].recordings] == [len(r) + 1 for r in programs[0].recordings]
    plain, beside = (explained(program) for program in programs)
    assert plain.base.objective - beside.base.objective > 10.0
    assert TriedTurns.beside(programs[1], plain).help_base
    assert not TriedTurns.beside(programs[0], beside).help_base
