"""Columns: two of one name, and clocks of their own."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, make_options
from pneusma_jax.errors import InputError

STRAIN = np.linspace(0.0, 0.5, 20)
STRESS = 80.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)
TIME = 3.0 * np.arange(20)
SIZES = {"dimensions": ["gauge_length_mm=20", "area_mm2=10"]}
LOAD = 0.01 * STRESS


def table(heads, *columns, sep=","):
    rows = (sep.join(x if isinstance(x, str) else f"{x:.5f}" for x in row) for row in zip(*columns, strict=True))
    return sep.join(heads) + "\n" + "\n".join(rows) + "\n"


# Two columns of one name.

TWINS = {
    "stress": (["Strain (%)", "Stress (kPa)", "Stress (kPa)"], [100 * STRAIN, STRESS, STRESS + 3 * STRAIN], {}, "strain=2", ""),
    "strain": (["Strain (%)", "Stress (kPa)", "Strain (%)"], [100 * STRAIN, STRESS, 90 * STRAIN], {}, "strain=3", "strain"),
    "capitals": (["strain (%)", "Stress (kPa)", "STRAIN (%)"], [100 * STRAIN, STRESS, 90 * STRAIN], {}, "strain=3", "strain"),
    "extension": (
        ["Extension (mm)", "Load (N)", "Extension (mm)"], [20 * STRAIN, LOAD, 18 * STRAIN], SIZES, "elongation=3", "strain",
    ),
    "temperature": (
        ["Temperature (C)", "Temperature (C)", "Strain (-)", "Stress (MPa)"],
        [20 + TIME, 21 + TIME, 0.1 * STRAIN, 200 + 0 * TIME], {}, "temperature=2", "temperature_degC",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name in TWINS if name != "stress"])
def test_the_second_of_two_columns_of_one_name_is_said(put, name):
    heads, columns, options, other, changed = TWINS[name]
    path = put("a.csv", table(heads, *columns))
    recording = import_file(path, make_options(**options))
    (said,) = [note for note in checks(recording) if "is named as column" in note]
    assert f"--map {other} takes the other" in said and "differs from it by up to" in said
    mapped = import_file(path, make_options(**options, columns=[other]))
    assert not np.allclose(mapped.columns[changed], recording.columns[changed])
    assert any("is named as column" in note for note in mapped.notices)  # now the first is left


def test_a_column_that_repeats_another_needs_no_look(put):
    recording = import_file(put("a.csv", table(["Strain (%)", "Strain (%)", "Stress (kPa)"], 100 * STRAIN, 100 * STRAIN, STRESS)))
    assert any("and repeats it: left aside" in note for note in recording.notices)
    assert not any("is named as" in note for note in checks(recording))


def test_two_columns_without_a_meaning_are_both_named(put):
    heads = ["Strain (%)", "Stress (kPa)", "Colour", "Colour"]
    recording = import_file(put("a.csv", table(heads, 100 * STRAIN, STRESS, TIME, TIME)))
    assert any("columns left aside: 'Colour', 'Colour'" in note for note in recording.notices)


# Clocks.

WIRE = [20.0 + TIME, 0.1 * STRAIN, 200.0 + 0.0 * TIME]
OWN = {
    "one name": (["Time (s)", "Temperature (C)", "Time (s)", "Strain (-)", "Stress (MPa)"], [TIME, WIRE[0], 1.5 * TIME, *WIRE[1:]]),
    "with numbers": (["Time 1 (s)", "Temperature (C)", "Time 2 (s)", "Strain (-)", "Stress (MPa)"], [TIME, WIRE[0], TIME**1.1, *WIRE[1:]]),
    "with words": (["Zeit Ofen (s)", "Temperatur (C)", "Zeit Kamera (s)", "Dehnung (-)", "Spannung (MPa)"], [TIME, WIRE[0], 2 * TIME, *WIRE[1:]]),
    "in two units": (["Time (s)", "Strain (%)", "Time (min)", "Stress (kPa)"], [TIME, 100 * STRAIN, TIME / 50.0, STRESS]),
    "a time of day": (
        ["Time A", "Strain (%)", "Time B", "Stress (kPa)"],
        [[f"10:00:{k:02d}" for k in range(20)], 100 * STRAIN, [f"10:{k:02d}:00" for k in range(20)], STRESS],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", OWN)
def test_columns_with_clocks_of_their_own_are_refused(put, name):
    heads, columns = OWN[name]
    path = put("a.csv", table(heads, *columns))
    message = refusal(path)
    assert f"{heads[0]!r} (column 1) and {heads[2]!r} (column 3) run up to" in message and "--map time=1" in message
    recording = import_file(path, make_options(columns=["time=1"]))
    assert recording.columns["time_s"].size == 20


@pytest.mark.parametrize("second", [TIME, TIME / 60.0, TIME + 0.5])
def test_one_clock_that_is_written_twice_is_one(put, second):
    unit = "min" if second[-1] < 2.0 else "s"
    text = table(["Time (s)", "Strain (%)", f"Time ({unit})", "Stress (kPa)"], TIME, 100 * STRAIN, second, STRESS)
    np.testing.assert_allclose(import_file(put("a.csv", text)).columns["time_s"], TIME)


@pytest.mark.parametrize(
    ("apart", "said"),
    [
        (1.7e9, "differ by 1.7e+09 s in every row;"),
        (50.0 + 0.001 * (np.arange(len(TIME)) % 2), "differ by 50 s in every row;"),
        (50.0 + 2.5 * (np.arange(len(TIME)) % 2), "differ by 51.25 s, by up to 2.5 s more in some rows than in others;"),
    ],
)
def test_clocks_that_differ_by_a_constant_or_nearly_so_are_said(put, apart, said):
    text = table(["Time (s)", "Strain (%)", "Timestamp (s)", "Stress (kPa)"], TIME, 100 * STRAIN, TIME + apart, STRESS)
    (note,) = [note for note in checks(import_file(put("a.csv", text))) if "the clocks" in note]
    assert said in note


def test_the_clock_of_a_cycle_is_no_clock_of_its_own(put):
    heads = ["Total Time (s)", "Cycle Elapsed Time (s)", "Strain (%)", "Stress (kPa)"]
    recording = import_file(put("a.csv", table(heads, TIME, TIME % 12.0, 100 * STRAIN, STRESS)))
    np.testing.assert_allclose(recording.columns["time_s"], TIME)


@pytest.mark.parametrize("heading", ["Time of test (s)", "Zeit Kanal 1 (min)", "Time - logger (ms)"])
def test_a_clock_with_further_words_is_not_lost(put, heading):
    recording = import_file(put("a.csv", table([heading, "Strain (%)", "Stress (kPa)"], TIME, 100 * STRAIN, STRESS)))
    assert recording.columns["time_s"][-1] == pytest.approx(57.0 * {"s": 1.0, "min": 60.0, "ms": 1e-3}[heading[-4:-1].strip("( ").split("(")[-1]])


# One measurement in two units, and columns that claim to be it.


@pytest.mark.parametrize(
    ("unit", "factor", "same"),
    [("MPa", 1e-3, True), ("MPa", 2e-3, False), ("psi", 0.1450377, True), ("kgf/cm2", 0.0122, False)],
)
def test_a_column_in_another_unit_is_compared_with_the_one_that_was_taken(tmp_path, unit, factor, same):
    path = tmp_path / "two.csv"
    path.write_text(table(["Strain (%)", "Stress (kPa)", f"Stress ({unit})"], 100 * STRAIN, STRESS, factor * STRESS))
    recording = import_file(path, make_options())
    assert bool(checks(recording)) != same, recording.notices
    assert recording.columns["stress_kPa"] == pytest.approx(STRESS, abs=1e-3)


@pytest.mark.parametrize("heads", [("t_ext (s)", "t_cell (s)"), ("Time (s)", "Frame time (min)"), ("Clock (s)", "Camera elapsed (ms)")])
def test_clocks_of_any_name_that_run_apart_are_refused(tmp_path, heads):
    path = tmp_path / "clocks.csv"
    scale = {"(s)": 1.0, "(min)": 1.0 / 60.0, "(ms)": 1e3}[heads[1].split()[-1]]
    path.write_text(table([heads[0], "Strain (%)", heads[1], "Stress (kPa)"], TIME, 100 * STRAIN, 1.4 * TIME * scale, STRESS))
    assert "run up to" in refusal(path) and "--map time=1" in refusal(path)
    path.write_text(table([heads[0], "Strain (%)", heads[1], "Stress (kPa)"], TIME, 100 * STRAIN, TIME * scale, STRESS))
    assert len(import_file(path, make_options())) == 20


@pytest.mark.parametrize("heads", [("Strain (%)", "Kanal 7 (kPa)"), ("Kanal 7 (%)", "Stress (kPa)")])
def test_a_column_that_the_user_names_belongs_to_its_clock_too(put, heads):
    path = put("a.csv", table(["Time 1 (s)", heads[0], "Time 2 (s)", heads[1]], TIME, 100 * STRAIN, 1.5 * TIME, STRESS))
    options = make_options(columns=["strain=2", "stress=4"])
    with pytest.raises(InputError, match="run up to 28.5 s apart"):
        import_file(path, options)
    recording = import_file(path, make_options(columns=["strain=2", "stress=4", "time=1"]))
    np.testing.assert_allclose(recording.columns["time_s"], TIME)


@pytest.mark.parametrize(
    ("headings", "told"),
    [
        ("Time (s),Temp (°C),Displacement (mm),Load (N)", False),
        ("Time (s),Temp (°C),Spring displacement (mm),Load (N)", True),
        ("Time (s),Temp (°C),Elongation (mm),Load (N)", True),
        ("Time (s),Resistance (ohm),Displacement (mm),Load (N)", True),
    ],
)
def test_a_spring_that_nothing_tells_to_be_one_is_to_be_looked_at(put, headings, told):
    rows = [f"{8 * k},{3.4 + 0.01 * k:.2f},{0.1 * k:.2f},{9 + 0.1 * k:.2f}" for k in range(12)]
    raw = put("test.csv", "\n".join([headings, *rows]) + "\n")
    recording = import_file(raw, make_options())
    assert recording.kind == "spring"
    assert any("check: taken as kind spring" in note for note in recording.notices) != told


def test_a_mark_for_no_reading_in_a_column_that_is_not_used_asks_for_nothing(put):
    flag = np.r_[0.0, 500.0 + 0.1 * np.arange(19)]
    text = table(["Time (s)", "Strain (%)", "Stress (kPa)", "mocap_7"], TIME, 100 * STRAIN, STRESS, flag)
    recording = import_file(put("a.csv", text))
    assert not [c for c in checks(recording) if "mocap_7" in c]
    assert any("of 'mocap_7'" in note and "no reading" in note for note in recording.notices)
    spoilt = table(["Time (s)", "Strain (%)", "Stress (kPa)"], TIME, 100 * STRAIN, np.r_[STRESS[:5], -9999.0, STRESS[6:]])
    assert any("no reading" in c for c in checks(import_file(put("b.csv", spoilt))))
