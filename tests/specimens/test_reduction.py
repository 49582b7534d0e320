"""Long recordings with fewer rows: nothing moves off its curve, loops stay loops, and it is said."""

import numpy as np
import pytest

from fitting.calibrate.assumed import notices_of
from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import channel_weight
from fitting.inference.parameters import Parameters
from fitting.specimens import WIRE
from fitting.specimens.reduction import reduced, reduction_notes

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
    (text,) = reduction_notes([recording])
    assert f"{len(short)} of {cycles * rows} rows are used" in text and "as they were read" in text
    assert ("cycles, as they" in text) == ("do not see the cycles left out" in text) == (cycles > 64)


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
    assert (
        short.block == 26 and short.reduction.rows is None and "each the mean of 26" in short.reduction.text
    )
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
    assert reduced(recording, 1024) is recording and reduction_notes([recording]) == []
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
    told = " ".join(notices_of([long, short], Parameters()))
    assert (
        "of 9600 rows are used" in told
        and "short: strain repeats earlier readings in 240 of 320" in told
    )
    assert "of 320 rows are used" not in told
    assert "of 320 rows are used" in " ".join(notices_of([short], Parameters(), most=128))


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
    assert short.block == 1 and 318 <= len(short) <= 321 and reduction_notes([short]) == []
    assert np.median(np.diff(short.reduction.rows)) == 3.0


def holds_and_ramps(rows, jumps, ramp, low, high):
    """A driver that rests for long and jumps between two values within a few rows."""
    hold = (rows - jumps * ramp) // (jumps + 1)
    course, now, other = [], low, high
    for _ in range(jumps):
        course += [now] * hold + list(np.linspace(now, other, ramp))
        now, other = other, now
    return np.array(course + [now] * (rows - len(course)))


def rubber(strain, stiffness=120.0):
    stretch = 1.0 + strain
    return stiffness * (stretch - stretch**-2)


def coupon(strain, noise=0.3, seed=1):
    stress = rubber(strain) + noise * np.random.default_rng(seed).standard_normal(len(strain))
    columns = {"time_s": 0.1 * np.arange(len(strain)), "strain": strain, "stress_kPa": stress}
    return Recording("coupon", None, "elastomer", geometry={"material": "fit"}, columns=columns)


@pytest.mark.parametrize(
    ("rows", "jumps", "ramp"), [(20_000, 16, 20), (26_000, 30, 9), (5_000, 2, 5), (9_000, 1, 3)]
)
def test_no_jump_between_long_rests_is_averaged(rows, jumps, ramp):
    short = reduced(coupon(holds_and_ramps(rows, jumps, ramp, 0.0, 0.8)), 1024)
    strain = short.columns["strain"]
    assert short.block == 1 and np.max(np.abs(short.columns["stress_kPa"] - rubber(strain))) < 5.0 * 0.3
    between = (strain > 0.05) & (strain < 0.75)
    assert between.sum() >= 0.5 * jumps * (ramp - 2)


def test_no_jump_of_temperature_is_averaged_so_that_each_row_lies_on_its_branch():
    temperature = holds_and_ramps(24_000, 20, 24, 30.0, 200.0)
    heating = np.concatenate([[True], np.diff(temperature) > 0.0])
    strain = law(temperature, heating) + NOISE * np.random.default_rng(2).standard_normal(len(temperature))
    columns = {"time_s": 1.0 * np.arange(24_000), "temperature_degC": temperature, "strain": strain}
    columns["stress_MPa"] = np.full(24_000, 300.0)
    short = reduced(Recording("jumps", None, "wire", columns=columns), 1024)
    seen = short.columns["temperature_degC"]
    off = [np.abs(short.columns["strain"] - law(seen, np.full(len(seen), way))) for way in (True, False)]
    assert np.max(np.minimum(*off)) < 5.0 * NOISE and "as they were read" in short.reduction.text


@pytest.mark.parametrize("length", [3, 12, 40])
def test_one_short_pulse_in_a_slow_test_is_not_averaged(length):
    strain = np.linspace(0.0, 0.5, 12_000)
    strain[7_003 : 7_003 + length] += 0.2
    assert reduced(coupon(strain), 1024).block == 1


@pytest.mark.parametrize("pulls", [1, 3])
def test_means_stop_at_turns_and_lie_on_the_curve(pulls):
    """Loading and unloading on different curves, so that a mean over a turn would lie on neither."""
    phase = (np.arange(30_000) / 30_000 * pulls) % 1.0
    strain, back = 0.6 * (1.0 - np.abs(2.0 * phase - 1.0)), phase > 0.5
    recording = coupon(strain)
    lower = np.where(back, -0.4 * rubber(strain) * (0.6 - strain) / 0.6, 0.0)
    recording.columns["stress_kPa"] = recording.columns["stress_kPa"] + lower
    short = reduced(recording, 1024)
    assert short.block == 30 and len(short) >= 1000 - 2 * pulls
    seen, time = short.columns["strain"], short.columns["time_s"]
    way = ((time / 3000.0 * pulls) % 1.0) > 0.5
    off = (
        short.columns["stress_kPa"]
        - rubber(seen)
        + np.where(way, 0.4 * rubber(seen) * (0.6 - seen) / 0.6, 0.0)
    )
    assert np.max(np.abs(off)) < 4.5 * 0.3 / np.sqrt(30.0)
    assert ("left over" in short.reduction.text) == (short.block * len(short) < 30_000)


def test_what_the_sentence_says_of_means_is_true_of_every_block():
    recording = wire(1, 26_000)
    short = reduced(recording, 1024)
    assert "Within none of them a channel moves by more than 5 % of its range" in short.reduction.text
    temperature = recording.columns["temperature_degC"]
    moved = [np.ptp(temperature[k : k + 26]) for k in range(0, 25_974)]
    assert max(moved) < 0.05 * np.ptp(temperature) + 0.1


def test_cycles_of_a_few_rows_are_not_taken_for_noise():
    recording = coupon(np.linspace(0.0, 0.5, 12_000))
    cycles = 0.25 * (1.0 + np.sin(np.arange(12_000) * 2.0 * np.pi / 4.7))
    assert reduced(coupon(cycles), 1024).block == 1
    assert reduced(recording, 1024).block == 12


def heated(rows, pressure, stated, seed=3):
    """An actuator under about constant pressure, whose second spring is heated once."""
    rng, time = np.random.default_rng(seed), 0.5 * np.arange(rows)
    heat = 1.0 / (1.0 + np.exp(-(time - 0.3 * time[-1]) / 4.0))
    columns = {"time_s": time, "pressure_kPa": pressure + 0.05 * rng.standard_normal(rows)}
    columns["resistance_2_ohm"] = 3.66 - 0.4 * heat + 1.5e-4 * rng.standard_normal(rows)
    columns["curvature_1pm"] = 50.0 * heat + 0.25 * rng.standard_normal(rows)
    noise = {"pressure_kPa": 0.05, "curvature_1pm": 0.25} if stated else {}
    return Recording("heated", None, "actuator", noise=noise, columns=columns)


@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("rows", [150, 400, 2000])
def test_noise_of_a_constant_drive_makes_no_cycles(rows, stated):
    short = reduced(heated(rows, 15.0, stated), 128)
    assert short.block == 1 and 124 <= len(short) <= 128 and "cycles" not in short.reduction.text
    assert np.max(np.diff(short.reduction.rows)) <= 3 * rows / 128


@pytest.mark.parametrize("stated", [True, False])
def test_cycles_of_a_noisy_drive_are_found_whatever_its_noise(stated):
    phase = (np.arange(400) / 100.0) % 1.0
    short = reduced(heated(400, 15.0 + 2.0 * (1.0 - np.abs(2.0 * phase - 1.0)), stated), 128)
    pressure = short.columns["pressure_kPa"]
    for turn in (50, 150, 250, 350):
        assert pressure[np.abs(short.reduction.rows - turn) <= 4].max() > 16.85
    assert 124 <= len(short) <= 128


@pytest.mark.parametrize("most", [64, 100, 128, 129])
def test_as_many_rows_are_kept_as_may_be_also_where_rows_lie_far_apart(most):
    strain = holds_and_ramps(160, 3, 3, 0.0, 0.8)
    short = reduced(coupon(strain), most)
    assert most - 3 <= len(short) <= most and len(np.unique(short.reduction.rows)) == len(short)


@pytest.mark.parametrize("levels", [(0.0, 0.5), (0.0, 0.25, 0.5, 0.25)])
def test_an_exact_switched_current_keeps_its_switches(levels):
    rows, stay = 2000, 125
    recording = heated(rows, 15.0, True)
    course = np.array(levels)[(np.arange(rows) // stay) % len(levels)]
    recording.columns["current_2_A"] = course
    recording.columns["curvature_1pm"] = 2.0 * course + recording.columns["curvature_1pm"]
    kept = reduced(recording, 128).reduction.rows
    turns = np.arange(stay, rows, stay)
    if len(levels) > 2:
        turns = turns[1::2]  # up and down, not between
    assert np.mean([np.min(np.abs(kept - turn)) <= 2 for turn in turns]) > 0.9


def test_flicker_of_a_readout_makes_no_cycles():
    recording = heated(600, 15.05, False)
    flicker = 15.05 + 0.005 * np.random.default_rng(5).standard_normal(600)
    recording.columns["pressure_kPa"] = np.round(10.0 * flicker) / 10.0
    short = reduced(recording, 128)
    assert len(short) >= 124 and "cycles" not in short.reduction.text


@pytest.mark.parametrize(("cycles", "rows"), [(17, 8), (40, 5), (12, 12)])
def test_short_cycles_are_kept_until_the_limit_is_reached(cycles, rows):
    phase = (np.arange(cycles * rows) % rows) / rows
    recording = heated(cycles * rows, 15.0 + 5.0 * (1.0 - np.abs(2.0 * phase - 1.0)), True)
    assert 0.8 * 128 <= len(reduced(recording, 128)) <= 128
