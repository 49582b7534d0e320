"""Heating and cooling under a steady load: where the transformation lies, and a first heating that is no cycle."""

from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import Campaign, Recording
from fitting.specimens import wire
from fitting.specimens.thermal_runs import first_heating, half_way, runs_of


def cycles(count, low=25.0, high=160.0, rows=60, start="cold"):
    """Temperature through heating and cooling in turn."""
    corners = [low, high] * count + [low]
    corners = corners if start == "cold" else corners[1:]
    places = np.arange(len(corners)) * rows
    return np.interp(np.arange(places[-1] + 1), places, corners)


def strain_of(temperature, heating, cooling, width=3.0, first=None, grows=0.0):
    """Strain of a wire under a weight, half of it on heating at one temperature and on cooling at another.

    `first` scales the first heating; every further cycle adds `grows` times as much as the one before.
    """
    runs = runs_of(temperature)
    strain, cycle = np.zeros(len(temperature)), 0
    for k, run in enumerate(runs):
        T = temperature[run.rows]
        middle = heating if run.heating else cooling
        size = 0.04 + 0.02 * sum(grows**n for n in range(1, cycle + 1)) if grows else 0.04
        strain[run.rows] = 0.002 + size / (1.0 + np.exp((T - middle) / width))
        if k == 0 and first is not None:
            strain[run.rows] = 0.002 + first * (strain[run.rows] - 0.002)
        cycle += not run.heating
    return strain


def recording(temperature, strain, stress=300.0, noise=5e-5, geometry=None, seed=1):
    rng, rows = np.random.default_rng(seed), len(temperature)
    columns = {
        "time_s": np.arange(rows) * 1.0,
        "strain": strain + noise * rng.standard_normal(rows),
        "stress_MPa": np.broadcast_to(stress, (rows,)) * 1.0,
        "temperature_degC": temperature + 0.02 * rng.standard_normal(rows),
    }
    stated = {"alloy": "fit"} | (geometry or {})
    return Recording("W", None, "wire", specimen="W", geometry=stated, columns=columns)


def campaign(*recordings):
    return Campaign("W", list(recordings), Path("W"))


@pytest.mark.parametrize("start", ["cold", "hot"])
def test_runs_are_told_in_noise(start):
    T = cycles(3, start=start) + 0.5 * np.random.default_rng(0).standard_normal(len(cycles(3, start=start)))
    found = runs_of(T)
    assert len(found) == (6 if start == "cold" else 5)
    assert [run.heating for run in found] == ([True, False] * 3)[0 if start == "cold" else 1 :]
    assert found[0].first == 0 and found[-1].last == len(T) - 1


def test_a_temperature_that_stands_still_has_no_runs():
    assert runs_of(np.full(20, 22.0)) == [] and runs_of(np.zeros(0)) == []


@pytest.mark.parametrize(("heating", "cooling"), [(121.0, 109.0), (71.0, 50.0), (60.0, 60.0)])
def test_the_middle_of_a_transformation_is_read_from_the_recordings(heating, cooling):
    T = cycles(3)
    one = recording(T, strain_of(T, heating, cooling))
    assert wire.bracket(campaign(one)) == pytest.approx((cooling, heating), abs=0.5)


def test_nothing_is_told_where_the_load_changes_or_the_transformation_is_not_passed():
    T = cycles(3)
    assert half_way(recording(T, strain_of(T, 121.0, 109.0), np.linspace(100.0, 300.0, len(T))), "stress", "strain") == ()
    still = np.full(len(T), 22.0)
    assert wire.bracket(campaign(recording(still, np.interp(T, [25, 160], [0.0, 0.05]), T))) is None


@pytest.mark.parametrize("first", [0.0, 0.4, 1.5])
def test_a_first_heating_unlike_the_later_ones_is_set_apart(first):
    T = cycles(4)
    one = recording(T, strain_of(T, 121.0, 109.0, first=first))
    begun = wire.set_apart(one)
    assert abs(begun.rows - 61) <= 2 and "not fitted" in begun.text("W")
    (rows,) = wire.WIRE.rows_for(campaign(one))
    counted = rows.weight["strain"] > 0.0
    assert not counted[: begun.rows].any() and counted[begun.rows :].all()
    assert wire.bracket(campaign(one)) == pytest.approx((109.0, 121.0), abs=0.5)


@pytest.mark.parametrize("grows", [0.7, 0.3])
def test_what_fades_over_cycles_is_no_first_heating(grows):
    T = cycles(5)
    assert wire.set_apart(recording(T, strain_of(T, 121.0, 109.0, grows=grows))) is None


def test_cycles_that_are_alike_a_pair_of_them_and_a_stated_state_are_left_alone():
    T = cycles(3)
    assert wire.set_apart(recording(T, strain_of(T, 121.0, 109.0))) is None
    assert wire.set_apart(recording(T, strain_of(T, 121.0, 109.0, first=0.0), geometry={"prestrain": 0.0})) is None
    two = cycles(2)  # one later heating: what is gone and what fades are not told apart
    assert first_heating(recording(two, strain_of(two, 121.0, 109.0, first=0.0)), "stress", "strain") is None


def test_a_steady_load_leaves_the_residual_strain_alone_and_says_where_the_middle_lies():
    T = cycles(3)
    steady = recording(T, strain_of(T, 121.0, 109.0))
    found = wire.WIRE.parameters_for(campaign(steady))
    assert not set(wire.RESIDUAL) & set(found) and set(wire.unseen(campaign(steady))) == set(wire.RESIDUAL)
    assert found["T_mid"].value == pytest.approx(115.0, abs=0.5) == found["T_mid"].prior.mean
    assert found["T_mid"].prior.sd == 25.0
    strain = np.r_[np.linspace(0.0, 0.05, 100), np.linspace(0.05, 0.0, 100)]
    pull = recording(np.full(200, 22.0), strain, 9e3 * strain)
    both = wire.WIRE.parameters_for(campaign(steady, pull))
    assert set(wire.RESIDUAL) <= set(both) and not wire.unseen(campaign(steady, pull))
    alone = wire.WIRE.parameters_for(campaign(pull))
    assert alone["T_mid"].value == 45.0  # nothing was heated


def test_a_known_alloy_keeps_what_is_known_of_it():
    T = cycles(3)
    known = recording(T, strain_of(T, 121.0, 109.0), geometry={"alloy": "niti_wire"})
    assert "T_mid" not in wire.WIRE.parameters_for(campaign(known)) and not wire.unseen(campaign(known))
