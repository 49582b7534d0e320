"""Rounded, repeated, interpolated and clipped readings: their step, their noise, and which of them count."""

import numpy as np
import pytest

from fitting.data.recordings import Recording, read_recording
from fitting.inference.between_readings import readings_at, readings_between
from fitting.inference.channels import correlation_by_lags, serial_correlation
from fitting.inference.noise import common_step, least_step, robust_noise, rounding_noise
from fitting.inference.readings import cautions, measurements, noise_found, readings_of

RAMP = np.linspace(0.0, 1.0, 300)
SHAPES = {
    "ramp": 100.0 * RAMP,
    "sine": 50.0 * np.sin(4.0 * np.pi * RAMP),
    "rubber": 800.0 * (RAMP - 1.2 * RAMP**2 + 1.1 * RAMP**3),
    "triangles": 100.0 * np.abs((6.0 * RAMP) % 2.0 - 1.0),
    "transformation": 60.0 / (1.0 + np.exp((RAMP - 0.5) / 0.08)) + 20.0 * RAMP,
    "hysteresis": 60.0 / (1.0 + np.exp((0.5 - np.abs(RAMP - 0.5) - 0.25 - 0.05 * np.sign(RAMP - 0.5)) / 0.03))
    + 30.0 * RAMP,
    "staircase": 10.0 * np.floor(8.0 * RAMP),
}


@pytest.mark.parametrize("step", [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0])
@pytest.mark.parametrize("shape", SHAPES)
def test_noise_of_rounded_readings_is_right_to_a_fifth(shape, step):
    rng, found = np.random.default_rng(3), []
    for n in range(10):
        time = RAMP if n % 2 else np.sort(rng.uniform(0.0, 1.0, len(RAMP)))
        exact = np.interp(time, RAMP, SHAPES[shape])
        values = exact + rng.standard_normal(len(RAMP))
        values = step * np.round(values / step) if step else values
        error = np.sqrt(np.mean((values - exact) ** 2))  # less than rounding on the treads of a staircase
        found.append(robust_noise(time, values) / max(error, step / np.sqrt(12.0)))
    assert np.median(found) == pytest.approx(1.0, rel=0.2)


@pytest.mark.parametrize("shape", ["ramp", "rubber", "sine", "hardening"])
def test_a_curve_of_21_digitised_points_is_not_taken_for_noise(shape):
    strain, rng = np.linspace(0.0, 1.0, 21), np.random.default_rng(0)
    exact = 300.0 * (np.exp(1.5 * strain) - 1.0) if shape == "hardening" else np.interp(strain, RAMP, SHAPES[shape])
    found = [robust_noise(strain, exact + 2.0 * rng.standard_normal(21)) for _ in range(40)]
    assert np.median(found) == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize("factor", [1.0, 1e-3, 6894.757293168, 1.0 / (25.0 * 3.1)])
@pytest.mark.parametrize("rows", [80, 300, 2000])
def test_the_step_of_a_staircase_is_found_in_any_unit(factor, rows):
    course = np.interp(np.linspace(0.0, 3.0, rows), [0.0, 1.0, 2.0, 3.0], [0.0, 200.0, 20.0, 210.0])
    values = factor * 4.0 * np.round(course**1.1 / 4.0)
    assert least_step(values) == pytest.approx(factor * 4.0, rel=1e-6)
    printed = np.array([float(f"{v:.7g}") for v in values])
    assert rounding_noise(printed) == pytest.approx(factor * 4.0 / np.sqrt(12.0), rel=1e-3)
    assert robust_noise(np.arange(rows), printed) == pytest.approx(factor * 4.0 / np.sqrt(12.0), rel=0.25)


def test_numbers_of_three_digits_have_larger_steps_where_they_are_larger():
    values = np.array([float(f"{v:.3g}") for v in 10.0 * np.exp(3.0 * RAMP)])
    assert least_step(values)[0] == pytest.approx(0.1) and least_step(values)[-1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "values",
    [
        RAMP,
        np.interp(RAMP, [0.0, 0.3, 0.7, 1.0], [0.0, 1.0, 1.0, 0.0]),
        np.exp(RAMP),
        np.cumsum(np.repeat([1.0, 3.0], 150)),
        np.interp(np.arange(150.0), [3, 6, 46, 49, 89, 92, 132, 141], [0.0, 0.3, 0.3, 0.6, 0.6, 0.9, 0.9, 0.0]),
        np.random.default_rng(0).standard_normal(300),
    ],
    ids=["straight", "held", "curved", "two rates", "fast ramps and holds", "noise"],
)
def test_courses_that_are_not_rounded_have_no_step(values):
    assert not least_step(values).any() and rounding_noise(values) == 0.0


def test_readings_that_move_only_beyond_a_dead_band_are_uncertain_by_it():
    exact = 100.0 * np.sin(7.0 * RAMP)
    rng, seen, last = np.random.default_rng(0), [], 0.0
    for value in exact + 0.3 * rng.standard_normal(len(RAMP)):
        last = value if abs(value - last) > 3.0 else last
        seen.append(last)
    error = np.std(np.array(seen) - exact)
    assert robust_noise(RAMP, np.array(seen)) == pytest.approx(error, rel=0.2)


def test_few_values_have_a_common_step_of_which_none_is_the_next():
    assert common_step(np.array([0.0, 0.6, 1.5, 2.1, 3.6, 5.7])) == pytest.approx(0.3)


@pytest.mark.parametrize("share", [0.5, 3.0])
def test_a_staircase_is_no_noise_that_lasts(share):
    """Its second differences are mostly none at all."""
    values = np.round(SHAPES["rubber"] / (share * 10.0)) * share * 10.0
    assert serial_correlation(values, float(share * 10.0 / np.sqrt(12.0))) < 0.3
    assert correlation_by_lags(values) < 0.3


def coupon(strain, stress, noise=None, time=None):
    time = np.arange(len(strain)) * 1.0 if time is None else time
    columns = {"time_s": time, "strain": strain, "stress_kPa": stress}
    return Recording("r", None, "elastomer", columns=columns, noise=noise or {})


def pulls(rows=150):
    strain = np.interp(np.linspace(0.0, 1.0, rows), [0.0, 0.27, 0.5, 0.73, 1.0], [0.0, 0.9, 0.0, 0.9, 0.0])
    stress = 120.0 * (1.0 + strain - (1.0 + strain) ** -2)
    return strain, stress, stress + 0.3 * np.random.default_rng(1).standard_normal(rows)


UNEVEN = {
    "pairs of a traced curve": np.sort(np.concatenate([np.linspace(0.0, 1.4, 15), np.linspace(0.0, 1.4, 15) + 0.003])),
    "closer where the curve bends": 1.4 * np.linspace(0.0, 1.0, 40) ** 3,
    "points picked by hand": np.sort(np.random.default_rng(4).uniform(0.0, 1.4, 40)),
    "up and down": np.concatenate([1.4 * np.linspace(0.0, 1.0, 30) ** 2, 1.4 * np.linspace(0.98, 0.0, 30) ** 2]),
    "even": np.linspace(0.0, 1.4, 40),
}  # fmt: skip


@pytest.mark.parametrize("name", UNEVEN)
def test_noise_of_a_table_without_clock_is_that_of_its_curve_however_its_points_lie(name):
    strain, found = UNEVEN[name], []
    stress = 800.0 * (1.0 + strain - (1.0 + strain) ** -2) + 300.0 * strain**3
    for seed in range(10):
        read = stress + 2.0 * np.random.default_rng(seed).standard_normal(len(strain))
        recording = Recording("r", None, "elastomer", columns={"strain": strain, "stress_kPa": read}, noise={})
        found.append(1e-3 * noise_found(recording, "stress"))
    assert np.median(found) == pytest.approx(2.0, rel=0.3)


def test_rows_that_a_logger_wrote_again_count_once():
    strain, _, stress = pulls()
    recording = coupon(np.repeat(strain, 3), np.repeat(stress, 3))
    told = readings_of(recording, "stress")
    assert told.counted.sum() == 150 and told.repeated == 300
    assert noise_found(recording, "stress") == pytest.approx(noise_found(coupon(strain, stress), "stress"), rel=0.01)
    assert "repeats earlier readings in 300 of 450 rows" in cautions([recording])[0]


def test_a_slow_channel_counts_where_it_was_read():
    strain, exact, stress = pulls(600)
    recording = coupon(strain, stress[3 * (np.arange(600) // 3)])
    assert readings_of(recording, "stress").counted.sum() == pytest.approx(200, abs=2)
    left = measurements(recording, "stress") - 1e3 * exact
    assert np.nanstd(left) == pytest.approx(300.0, rel=0.2)
    assert noise_found(recording, "stress") == pytest.approx(300.0, rel=0.2)


def rounded(rows, step, seed):
    """Strain, exact stress, and stress with noise of 0.3 kPa as an instrument with steps reads it."""
    strain, exact, _ = pulls(rows)
    stress = exact + 0.3 * np.random.default_rng(seed).standard_normal(rows)
    return strain, exact, step * np.round(stress / step) if step else stress


def seven_digits(values):
    return np.array([float(f"{v:.7g}") for v in values])


@pytest.mark.parametrize("step", [0.0, 0.15, 0.3, 0.6, 0.9, 1.5])
@pytest.mark.parametrize(
    "finer", [1.1, 2.0, 2.3, 4.7, *(pytest.param(x, marks=pytest.mark.slow) for x in (1.4, 1.7, 2.15, 3.0, 10.0))]
)
def test_straight_lines_between_readings_add_none(finer, step):
    """Noise is right to a fifth for steps from 0 to 5 standard deviations, and each reading counts once."""
    found, rows = [], 150
    for seed in range(4):
        strain, exact, stress = rounded(rows, step, seed)
        fine = np.linspace(0.0, rows - 1.0, 1 + round((rows - 1) * finer))
        columns = [seven_digits(np.interp(fine, np.arange(rows), x)) for x in (strain, stress)]
        recording = coupon(*columns, time=fine)
        told = readings_of(recording, "stress")
        assert told.counted.sum() == pytest.approx(rows, abs=1) and told.interpolated == len(fine) - told.counted.sum()
        assert np.array_equal(readings_of(recording, "strain").counted, told.counted)
        found.append(1e-3 * noise_found(recording, "stress") / np.sqrt(np.mean((stress - exact) ** 2)))
        assert "is interpolated between readings" in cautions([recording])[0]
    assert np.median(found) == pytest.approx(1.0, rel=0.2)


@pytest.mark.parametrize("finer", [1.4, 2.3, 3.757, 8.0])
def test_a_column_with_blunt_corners_is_read_where_another_column_was(finer):
    """Noise that is far below the digits for most of the time leaves too few corners for a grid of its own."""
    rows, rng = 150, np.random.default_rng(2)
    fine = np.linspace(0.0, rows - 1.0, 1 + round((rows - 1) * finer))
    noise = np.where(np.arange(rows) % 3 == 0, 5e-4, 3e-7) * rng.standard_normal(rows)
    resistance = 3.2 + 0.4 / (1.0 + np.exp((np.arange(rows) - 60.0) / 9.0)) + noise
    place = np.arange(float(len(fine)))
    grid = readings_between(place, seven_digits(np.interp(fine, np.arange(rows), rng.standard_normal(rows))))
    found = readings_at(grid, place, seven_digits(np.interp(fine, np.arange(rows), resistance)))
    assert np.array_equal(found.at, grid.at) and np.nanmax(np.abs(found.values - resistance)) < 1e-4
    elsewhere = seven_digits(np.interp(fine, np.arange(rows) + 0.37, resistance))
    assert readings_at(grid, place, elsewhere) is None
    assert readings_at(grid, place, 3.2 + 1e-3 * place) is None  # a straight line shows no readings


def test_lines_by_an_uneven_clock_are_seen():
    strain, _, stress = pulls()
    fine = np.sort(np.random.default_rng(5).uniform(0.0, 149.0, 500))
    columns = [seven_digits(np.interp(fine, np.arange(150.0), x)) for x in (strain, stress)]
    recording = coupon(*columns, time=fine)
    assert readings_of(recording, "stress").counted.sum() > 140
    assert noise_found(recording, "stress") == pytest.approx(300.0, rel=0.2)


@pytest.mark.parametrize(
    "stress",
    [
        3.0 * np.abs((np.arange(600.0) + 3.0) % 60.0 - 30.0),
        np.interp(np.arange(600.0) % 60.0, [0.0, 10.0, 30.0, 40.0, 60.0], [0.0, 5.0, 6.1, 2.3, 0.0]),
        np.round(200.0 * RAMP, 0),
        np.round(100.0 * np.sin(9.0 * RAMP), 1),
        np.random.default_rng(0).standard_normal(600),
        np.round(np.random.default_rng(1).standard_normal(600), 1),
        np.concatenate([np.zeros(60), np.round(np.cumsum(np.random.default_rng(2).uniform(0.0, 1.0, 300))), np.full(60, 151.0)]),
        np.concatenate([np.arange(100.0), 99.0 + 0.1 * np.random.default_rng(2).standard_normal(100), np.arange(99.0, 0.0, -1.0)]),
    ],
    ids=["triangles", "bilinear loops", "staircase", "rounded sine", "noise", "rounded noise", "held ends", "straight ends"],
)
def test_straight_pieces_of_a_law_are_no_lines_between_readings(stress):
    assert readings_between(np.arange(float(len(stress))), stress) is None


@pytest.mark.parametrize("step", [0.0, 0.15, 0.3, 0.6, 0.9, 1.5])
@pytest.mark.parametrize("slower", [1.4, 2.3, *(pytest.param(x, marks=pytest.mark.slow) for x in (2.0, 3.0))])
def test_a_channel_that_is_slower_than_the_clock_is_seen_in_any_steps(slower, step):
    found = []
    for seed in range(4):
        strain, exact, _ = pulls(600)
        _, _, stress = rounded(600, step, seed)
        kept = np.unique(np.ceil(np.arange(0.0, 600.0, slower)).astype(int))
        kept = kept[kept < 600]
        held = kept[np.searchsorted(kept, np.arange(600), side="right") - 1]
        recording = coupon(strain, stress[held])
        if step <= 0.3:
            assert readings_of(recording, "stress").counted.sum() == pytest.approx(len(kept), rel=0.12)
        error = np.sqrt(np.mean((stress[held] - exact)[readings_of(recording, "stress").counted] ** 2))
        found.append(1e-3 * noise_found(recording, "stress") / error)
    assert np.median(found) == pytest.approx(1.0, rel=0.2)


@pytest.mark.parametrize("recording", [coupon(*pulls()[::2]), coupon(pulls()[0], np.round(pulls()[2]))], ids=["exact", "round"])
def test_ordinary_rows_all_count(recording):
    assert readings_of(recording, "stress").counted.all() and cautions([recording]) == []


@pytest.mark.parametrize(("step", "level"), [(0.1, 150.0), (0.1, 178.0), (4.0, 152.0)])
def test_a_channel_at_full_scale_says_so_and_does_not_count_there(step, level):
    strain, exact, stress = pulls()
    recording = coupon(strain, np.minimum(step * np.round(stress / step), level))
    told = readings_of(recording, "stress")
    assert told.level == pytest.approx(1e3 * level)
    assert not told.counted[exact > level].any() and told.counted[exact < level - 8.0 - 3.0 * step].all()
    assert f"stops at {level:g}, its extreme value" in cautions([recording])[0]
    noise = np.hypot(0.3, step / np.sqrt(12.0))
    assert noise_found(recording, "stress") == pytest.approx(1e3 * noise, rel=0.25)


def held(time):
    return np.interp(time, [0.0, 20.0, 130.0, 149.0], [0.0, 0.8, 0.8, 0.0])


@pytest.mark.parametrize("digits", [3, 4, 5])
@pytest.mark.parametrize("width", [2.0, 4.0, 9.0])
@pytest.mark.parametrize("shape", ["sigmoid", "exponential", "gaussian"])
def test_a_course_without_noise_that_levels_off_is_not_at_full_scale(shape, width, digits):
    """Printed digits make an exact plateau of every smooth end."""
    rows = np.arange(240.0)
    rise = {
        "sigmoid": 1.0 / (1.0 + np.exp(-(rows - 80.0) / width)),
        "exponential": 1.0 - np.exp(-rows / (2.0 * width)),
        "gaussian": 1.0 - np.exp(-0.5 * (rows / (4.0 * width)) ** 2),
    }[shape]
    for values in (rise, 1.0 - rise, rise[::-1]):
        told = readings_of(coupon(np.linspace(0.0, 1.0, 240), 50.0 * np.round(values, digits)), "stress")
        assert told.saturated == 0 and told.counted.sum() > 200


@pytest.mark.parametrize("at", [0.5, 0.8, 0.9])
@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("shape", ["ramp", "sine", "parabola", "bend"])
def test_a_course_that_is_cut_off_is_at_full_scale(shape, noise, at):
    part = np.linspace(0.0, 1.0, 400)
    values = {"ramp": part, "sine": np.sin(np.pi * part), "parabola": 4.0 * part * (1.0 - part), "bend": part**0.6}[shape]
    values = values + noise * np.random.default_rng(3).standard_normal(400)
    told = readings_of(coupon(2.0 * part, 50.0 * np.minimum(values, at)), "stress")
    assert told.level == pytest.approx(5e4 * at)


@pytest.mark.parametrize(
    ("driver", "values"),
    [
        (held(np.arange(150.0)), np.round(100.0 * held(np.arange(150.0)))),
        (np.linspace(0.0, 9.0, 150), np.round(40.0 * np.tanh(np.linspace(-3.0, 6.0, 150)))),
        (np.linspace(0.0, 9.0, 150), np.round(20.0 * np.sin(np.linspace(0.0, 9.0, 150)))),
        (np.linspace(0.0, 1.0, 150), np.round(100.0 * np.maximum(np.linspace(-0.2, 0.8, 150), 0.0), 1)),
    ],
    ids=["hold", "plateau", "sine", "slack"],
)
def test_what_stands_still_by_itself_is_not_at_full_scale(driver, values):
    assert readings_of(coupon(driver, values), "stress").saturated == 0


def test_a_stated_noise_far_below_the_step_stays_and_is_said():
    strain, _, stress = pulls()
    recording = coupon(strain, 4.0 * np.round(stress / 4.0), noise={"stress_kPa": 0.05})
    (text,) = cautions([recording])
    assert "stated noise of 0.05 kPa" in text and "steps of 4 kPa" in text and "1.15 kPa" in text
    assert recording.noise_si("stress") == pytest.approx(50.0)
    assert cautions([coupon(strain, 4.0 * np.round(stress / 4.0), noise={"stress_kPa": 1.2})]) == []


def test_a_slow_channel_is_told_where_its_inputs_stand_still_most_of_the_time(tmp_path):
    """A short ramp and a long hold: whole rows come twice in the hold only, the slow channel's all the way."""
    rng = np.random.default_rng(4)
    strain = np.concatenate([np.linspace(0.0, 0.7, 10), np.full(110, 0.7)])
    stress = 150.0 * strain + 0.1 * rng.standard_normal(len(strain))
    stress = stress[2 * (np.arange(len(strain)) // 2)]
    rows = [f"{2.0 * k:.6g},{e:.7g},{s:.7g}" for k, (e, s) in enumerate(zip(strain, stress, strict=True))]
    (tmp_path / "pull.csv").write_text("\n".join(["time_s,strain,stress_kPa", *rows]) + "\n")
    (tmp_path / "pull.toml").write_text('kind = "elastomer"\nspecimen = "E"\nreal = false\n')
    told = readings_of(read_recording(tmp_path / "pull.csv"), "stress")
    assert told.repeated == 60
    np.testing.assert_array_equal(np.flatnonzero(told.counted), np.arange(0, 120, 2))
