"""Long recordings with fewer rows: nothing moves off its curve, loops stay loops, and it is said."""

import numpy as np
import pytest

from fitting.calibrate.assumed import notices_of
from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import channel_weight
from fitting.specimens import WIRE
from fitting.specimens.reduction import reduced, said

NOISE = 5e-5


def law(temperature, heating):
    return 0.004 + 0.036 / (1.0 + np.exp((temperature - 115.0 - np.where(heating, 6.0, -6.0)) / 4.0))


def wire(cycles, rows, noise=NOISE):
    """Thermal cycles of a wire with a hysteresis of 12 K."""
    phase = (np.arange(cycles * rows) % rows) / (rows - 1)
    temperature = np.interp(phase, [0.0, 0.5, 1.0], [30.0, 200.0, 30.0])
    strain = law(temperature, phase < 0.5) + noise * np.random.default_rng(0).standard_normal(len(phase))
    columns = {"time_s": np.arange(len(phase)) * 1.0, "temperature_degC": np.round(temperature, 1)}
    columns |= {"strain": strain, "stress_MPa": np.full(len(phase), 300.0)}
    return Recording("cycles", None, "wire", geometry={"alloy": "niti_wire"}, columns=columns)


@pytest.mark.parametrize(("cycles", "rows"), [(60, 160), (8, 300), (160, 160), (600, 44)])
def test_fast_cycles_keep_rows_and_their_loops(cycles, rows):
    recording = wire(cycles, rows)
    short = reduced(recording, 1024)
    assert 700 < len(short) <= 1024 and short.block == 1
    kept = short.reduction.rows
    assert np.array_equal(short.columns["strain"], recording.columns["strain"][kept])
    temperature = short.columns["temperature_degC"]
    heating = kept % rows < rows / 2
    assert np.std(short.columns["strain"] - law(temperature, heating)) < 1e-3 * 0.4  # temperature has 0.1 K
    for side in (heating, ~heating):
        in_middle = side & (np.abs(temperature - 115.0) < 12.0)
        assert in_middle.sum() > 0.08 * len(short)  # 0.06 to 0.07 of all rows are there
    assert temperature.max() > 195.0 and temperature.min() < 35.0
    (text,) = said([recording])
    assert f"reduced from {cycles * rows} rows to {len(short)}" in text and "nothing is averaged" in text
    assert ("cycles, kept" in text) == (cycles > 64)


def test_of_very_many_cycles_whole_ones_are_kept():
    short = reduced(wire(600, 44), 1024)
    cycle = np.unique(short.reduction.rows // 44)
    assert cycle[0] <= 1 and cycle[-1] >= 598 and len(cycle) < 200
    steps = np.diff(short.reduction.rows)
    assert np.mean(steps <= 4) > 0.8


@pytest.mark.parametrize("noise", [NOISE, 5e-4])
def test_slow_courses_are_averaged_and_the_noise_is_that_of_means(noise):
    recording = wire(1, 26_000, noise)
    short = reduced(recording, 1024)
    assert short.block == 26 and short.reduction.rows is None and "each the mean of 26" in short.reduction.text
    columns = {"time": short.si("time"), "strain": short.si("strain")}
    heating = np.arange(len(short)) < len(short) / 2
    off = short.columns["strain"] - law(short.columns["temperature_degC"], heating)
    sigma = 1.0 / channel_weight(short, "strain", columns, short.block)[0]
    assert sigma == pytest.approx(noise / np.sqrt(26.0), rel=0.1)
    assert np.std(off[(np.arange(len(off)) % 500 > 5)]) == pytest.approx(sigma, rel=0.25)


@pytest.mark.parametrize("most", [128, 512, 1024])
def test_noise_is_that_of_all_readings_whatever_is_kept(most):
    recording = wire(20, 160)
    short = reduced(recording, most)
    columns = {"time": short.si("time"), "strain": short.si("strain")}
    assert 1.0 / channel_weight(short, "strain", columns, short.block)[0] == pytest.approx(NOISE, rel=0.1)


def test_short_recordings_are_left_alone_and_a_reduction_starts_from_what_was_read():
    recording = wire(4, 160)
    assert reduced(recording, 1024) is recording and said([recording]) == []
    twice = reduced(reduced(recording, 512), 128)
    assert twice.whole is recording and len(twice) <= 128


def test_rows_with_missing_drivers_or_copies_are_not_kept():
    recording = wire(8, 300)
    gone = np.random.default_rng(1).random(2400) < 0.3
    columns = dict(recording.columns)
    columns["strain"] = np.where(gone, np.nan, columns["strain"])
    short = reduced(Recording("gaps", None, "wire", columns=columns), 1024)
    assert np.isfinite(short.columns["strain"]).mean() > 0.97


def test_the_report_says_what_was_done_to_which_recording():
    long, short = wire(60, 160), wire(2, 160)
    short.name = "short"
    short.columns["strain"] = np.repeat(short.columns["strain"][::4], 4)
    told = " ".join(notices_of([long, short]))
    assert "cycles: reduced from 9600 rows" in told and "short: strain repeats earlier readings in 240 of 320" in told
    assert "short: reduced" not in told
    assert "reduced from 320 rows" in " ".join(notices_of([short], most=128))


def test_a_fit_gets_rows_with_their_own_noise():
    (rows,) = WIRE.rows_for(Campaign("c", [wire(60, 160)], None))
    assert len(rows.mask) <= 1024
    weight = np.asarray(rows.extra["clean"]["strain"])
    assert 1.0 / weight[0] == pytest.approx(NOISE, rel=0.15)


@pytest.mark.parametrize("way", ["held", "interpolated"])
def test_rows_between_readings_are_left_out_whole_so_that_errors_of_neighbours_stay_neighbours(way):
    read = wire(2, 160)
    fine = np.linspace(0.0, 319.0, 1 + 319 * 3)
    columns = {}
    for name, values in read.columns.items():
        at = np.floor(fine + 1e-9).astype(int) if way == "held" and name != "time_s" else None
        new = values[at] if at is not None else np.interp(fine, np.arange(320.0), values)
        columns[name] = np.array([float(f"{v:.7g}") for v in new])
    short = reduced(Recording("fine", None, "wire", columns=columns), 1024)
    assert short.block == 1 and 318 <= len(short) <= 321 and said([short]) == []
    assert np.median(np.diff(short.reduction.rows)) == 3.0
