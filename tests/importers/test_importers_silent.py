"""Files that were read wrongly without a word: each is read rightly now, or asks about what it leaves open."""

import numpy as np
import pytest

from fitting.data.importers import import_file, import_files, make_options
from fitting.data.importers.numerals import to_number
from fitting.data.recordings import read_recording
from pneusma_jax.errors import InputError
from tests.importers.answers import checks, refusal

N = 24
K = np.arange(N)
TIME, EXTENSION = 2.0 * K, 15.0 * K / (N - 1)
STRETCH = 1.0 + EXTENSION / 25.0
STRESS = 120.0 * (STRETCH - STRETCH**-2)
FORCE = 0.018 * STRESS  # 18 mm2
PULLED = 40.0 * K / (N - 1)
PULL, OHM = 0.025 * PULLED * (1.0 - 0.004 * PULLED), 3.32 + 0.0003 * PULLED
PRESSURE = 30.0 * K / (N - 1)
LENGTH = 56.0 + 0.1 * PRESSURE + 0.002 * PRESSURE**2
WARM = np.concatenate([np.linspace(25.0, 95.0, 12), np.linspace(95.0, 25.0, 12)])
SHRUNK = 0.045 / (1.0 + np.exp((WARM - 62.0) / 4.0))
COUPON = ("gauge_length_mm=25", "area_mm2=18")
COIL = ("wire_diameter_mm=0.25", "mandrel_diameter_mm=0.9", "initial_pitch_mm=0.269", "active_coils=52")
TUBE = ("outer_diameter_mm=10", "wall_thickness_mm=1", "length_mm=56")
PULL_HEAD, SPRING_HEAD = "Time (s),Extension (mm),Force (N)\n", "Time (s),Extension (mm),Force (N),R (Ohm)\n"


def table(*columns, mark=",", form="{:.6g}"):
    lines = zip(*columns, strict=True)
    return "".join(mark.join(x if isinstance(x, str) else form.format(x) for x in line) + "\n" for line in lines)


def as_it_was(recording, **expected):
    for name, values in expected.items():
        np.testing.assert_allclose(recording.columns[name], values, atol=3e-3 * np.max(np.abs(values)))


def with_one(values, row, value):
    changed = np.array(values)
    changed[row] = value
    return changed


SILENT = {
    "columns of a spring swapped": (table(TIME, PULLED, PULL, OHM).join(["Time (s),Force (N),Extension (mm),R (Ohm)\n", ""]), (), "columns of force and elongation swapped"),
    "a resistance of the leads": ("# lead resistance 0.35 Ohm is included in R\n" + SPRING_HEAD + table(TIME, PULLED, PULL, OHM + 0.35), COIL, "'# lead resistance 0.35 Ohm is included in R' speaks of a zero or a factor"),
    "a factor that is not applied": ("Load cell factor: 2.0 (not applied)\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE / 2.0), COUPON, "'Load cell factor: 2.0 (not applied)' speaks of a zero or a factor"),
    "units in a line": ("Units: s, mm, mN\n" + SPRING_HEAD + table(TIME, PULLED, 50.0 * PULL, OHM), (), "states mN, and 'Force (N)' is in N: N was taken (--unit force=mN"),
    "a rate and no clock": ("Sampling rate: 10 Hz\nExtension (mm),Force (N)\n" + table(EXTENSION, FORCE), COUPON, "--interval 0.1 makes one"),
    "an interval and counted rows": ("Sample interval;0.5;s\nSample;Pressure (kPa);Length (mm)\n" + table(K, PRESSURE, LENGTH, mark=";"), TUBE, "--interval 0.5 makes one"),
    "another silicone": ("Material;Ecoflex 00-30\nTime (s);Pressure (kPa);Length (mm)\n" + table(TIME, PRESSURE, LENGTH, mark=";"), TUBE, "'Material Ecoflex 00-30' was not read, and material = \"dragon_skin_10_fast\" is taken"),
    "another alloy": ("Alloy: Flexinol 90\n" + SPRING_HEAD + table(TIME, PULLED, PULL, OHM), COIL, "'Alloy: Flexinol 90' was not read"),
    "cycles before": ("Cycles before test: 100\n" + SPRING_HEAD + table(TIME, PULLED, PULL, OHM), COIL, "--dimension cycles_before=... states it"),
    "an extension that was set to zero": (PULL_HEAD + table(TIME, np.where(K < 12, EXTENSION, EXTENSION - EXTENSION[12]), FORCE), COUPON, "strain leaps from 0.287 to 0 at row 14, and stress goes on as before"),
    "a strain in two units": ("Strain (%),Stress (kPa)\n" + table(np.where(K < 12, 100.0, 1.0) * (STRETCH - 1.0), STRESS), (), "does its unit change?"),
    "a sensor without an answer": ("Time (s),Temperature (°C),Strain (%),Stress (MPa)\n" + table(TIME, with_one(WARM, 7, -127.0), 100.0 * SHRUNK, np.full(N, 150.0)), (), "temperature_degC is -127 in row 9 alone"),
    "a sensor that was switched on": ("Time (s),Temperature (°C),Strain (%),Stress (MPa)\n" + table(TIME, with_one(WARM, 0, 85.0), 100.0 * SHRUNK, np.full(N, 150.0)), (), "temperature_degC is 85 in row 2 and 31.36 in row 3"),
    "a load cell that timed out": (PULL_HEAD + table(TIME, EXTENSION, with_one(FORCE, 10, -1.0)), COUPON, "stress_kPa is -55.5556 in row 12 alone"),
    "a supply's pressure": ("Time (s),Supply pressure (kPa),Length (mm)\n" + table(TIME, np.full(N, 400.0), LENGTH), TUBE, "pressure_kPa is 400 in every row"),
    "thin air": ("Time (s),p_abs (mbar),Length (mm)\n" + table(TIME, 10.0 * (PRESSURE + 83.4), LENGTH), TUBE, "--subtract pressure_kPa=-17.92"),
    "a field that white space hides": ("Time(s) Extension(mm) Force(N) Resistance(Ohm)\n" + table(TIME, PULLED, ["" if k == 7 else f"{f:.4f}" for k, f in enumerate(PULL)], OHM, mark=" "), COIL, "1 row has fewer fields than the 4 headings (row 9: '14 12.1739 3.32365')"),
    "seconds under milliseconds": ("Time (ms),Extension (mm),Force (N)\n" + table(TIME, EXTENSION, FORCE), COUPON, "24 rows last 0.046 s together"),
    "rows that a column marks": ("Time (s),Extension (mm),Force (N),Status\n" + table(TIME, EXTENSION, FORCE, ["ERR" if k in (9, 10) else "OK" for k in K]), COUPON, "'Status' is 'ERR' in 2 rows (11, 12), and 'OK' in all others"),
    "rows that are not valid": ("Time (s),Extension (mm),Force (N),Valid\n" + table(TIME, EXTENSION, FORCE, np.where(K == 9, 0, 1)), COUPON, "'Valid' is '0' in 1 row (11)"),
    "an extensometer that was taken off": ("Time (s),Strain (%),Stress (kPa)\n" + table(TIME, np.minimum(100.0 * (STRETCH - 1.0), 25.0), STRESS), (), "strain stays at its largest value, 0.25, from row 12 to 25"),
    "a temperature over another": ("Time (s),T-T0 (K),Strain (%),Stress (MPa)\n" + table(TIME, WARM - 25.0, 100.0 * SHRUNK, np.full(N, 150.0)), (), "not recognised: 'T-T0 (K)'"),
    "the clock of a film": ("Timecode,Pressure (kPa),Length (mm)\n" + table([f"00:00:{k // 25:02d}:{k % 25:02d}" for k in 5 * K], PRESSURE, LENGTH), TUBE, "counts the pictures of a film"),
    "a remark on a unit": (PULL_HEAD + table(TIME, EXTENSION, FORCE) + "\nAll displacements in cm\n", COUPON, "'All displacements in cm' states cm, and 'Extension (mm)' is in mm"),
    "a remark on a factor": ("Note: force channel x10\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE), COUPON, "'Note: force channel x10' speaks of a zero or a factor"),
    "springs by their sides": ("t (s),Pressure (kPa),R left (Ohm),R right (Ohm),Bend angle (deg)\n" + table(TIME, PRESSURE, OHM, OHM - 0.01 * K, 0.9 * K), (), "'R left (Ohm)', 'R right (Ohm)' may be of springs"),
    "a third spring": ("t (s),Pressure (kPa),R1 (Ohm),R2 (Ohm),R3 (Ohm),Bend angle (deg),Bend direction (deg)\n" + table(TIME, PRESSURE, OHM, OHM - 0.01 * K, OHM, 0.9 * K, 0.0 * K + 30.0), (), "design = \"triad\", since 'R3 (Ohm)'"),
    "a sum below": (PULL_HEAD + table(TIME, EXTENSION, FORCE) + "552,180.4,31.2\n", COUPON, "in row 26, the last one"),
    "pictures of a film": ("Frame rate: 25 fps\nFrame,Pressure (kPa),Length (mm)\n" + table(50 * K, PRESSURE, LENGTH), TUBE, "--interval 2 makes one"),
    "a load without its sign": (PULL_HEAD + table(TIME, -EXTENSION * (-1.0) ** K, FORCE), COUPON, "was the sign of the load lost?"),
    "layers": ("Number of layers: 3\nGauge length: 25 mm\nWidth: 6 mm\nThickness: 1 mm\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE), (), "several were tested at once"),
}  # fmt: skip


@pytest.mark.parametrize("name", SILENT)
def test_what_was_read_wrongly_in_silence_is_asked_about(put, name):
    content, sizes, said = SILENT[name]
    found = checks(import_file(put("a.csv", content), make_options(dimensions=sizes)))
    assert [note for note in found if said in note], found


def test_the_advice_about_swapped_columns_works(put):
    path = put("a.csv", SILENT["columns of a spring swapped"][0])
    swapped = ["force=Extension (mm)", "elongation=Force (N)"]
    recording = import_file(path, make_options(columns=swapped, units=["force=N", "elongation=mm"]))
    as_it_was(recording, force_N=PULL, elongation_mm=PULLED)
    assert not [note for note in checks(recording) if "swapped" in note]


ORDINARY = {
    "a spring": ("Load cell: 100 N\nGain: 1\nOffset: 0.000\n" + SPRING_HEAD + table(TIME, PULLED, PULL, OHM), COIL),
    "a coupon": ("Units: s, mm, N\nMaterial: DS10\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE), COUPON),
    "a silicone that is taken": ("Material: Dragon Skin 10 Fast\nTime (s),Pressure (kPa),Length (mm)\n" + table(TIME, PRESSURE, LENGTH), TUBE),
    "a rate beside a clock": ("Sampling rate: 10 Hz\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE), COUPON),
    "steps of a pressure": ("Time (s),Pressure (kPa),Length (mm)\n" + table(TIME, 10.0 * (K // 8), 56.0 + (K // 8)), TUBE),
    "moments and words": ("Zeroed: 2024-05-01 10:15:00\nOffset yield: 0.2 %\nSafety factor: 3\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE), COUPON),
    "a relaxation": (PULL_HEAD + table(TIME, np.where(K < 4, 0.01 * K, 10.0 + 0.01 * K), np.where(K < 4, 0.0, 2.0 * np.exp(-K / 30.0))), COUPON),
    "a temperature that stays": ("Time (s),Temperature (°C),Strain (%),Stress (MPa)\n" + table(TIME, with_one(np.full(N, 25.1), 0, 25.0), 100.0 * SHRUNK, np.full(N, 150.0)), ()),
    "a first wait": ("Time (s),Temperature (°C),Strain (%),Stress (MPa)\n" + table(600.0 * (K > 0) + 60.0 * K, with_one(WARM + 35.0, 0, 22.0), 100.0 * SHRUNK, np.full(N, 150.0)), ()),
    "pulls that end at once": (PULL_HEAD + table(TIME, 15.0 * (K % 12) / 11.0, FORCE[2 * (K % 12)]), COUPON),
}  # fmt: skip


@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_lines_and_courses_are_not_asked_about(put, name):
    content, sizes = ORDINARY[name]
    kept = checks(import_file(put("a.csv", content), make_options(dimensions=sizes)))
    assert not [note for note in kept if any(word in note for word in ("speaks of", "states ", "was not read", "leaps", " alone", "--interval", "as fast again"))]


def clocked(form):
    return PULL_HEAD.replace("Time (s)", "Time").replace(",", ";") + table([form(5.0 * t) for t in TIME], EXTENSION, FORCE, mark=";")


CLOCKS = {
    "1m30s": lambda s: f"{int(s) // 60}m{int(s) % 60:02d}s",
    "0h 1m 30.5s": lambda s: f"0h {int(s) // 60}m {s % 60.0:.1f}s",
    "1 min 30 sec": lambda s: f"{int(s) // 60} min {int(s) % 60} sec",
    "1'30\"": lambda s: f"{int(s) // 60}'{int(s) % 60:02d}\"",
    "PT1M30S": lambda s: f"PT{int(s) // 60}M{int(s) % 60}S",
    "0h01": lambda s: f"{int(6.0 * s) // 60}h{int(6.0 * s) % 60:02d}",
    "00:01:30.5": lambda s: f"00:{int(s) // 60:02d}:{s % 60.0:04.1f}",
    "1:30": lambda s: f"{int(s) // 60}:{int(s) % 60:02d}",
}


@pytest.mark.parametrize("form", CLOCKS)
def test_elapsed_times_with_letters_are_clocks(put, form):
    recording = import_file(put("a.csv", clocked(CLOCKS[form])), make_options(dimensions=COUPON))
    as_it_was(recording, time_s=(360.0 if form == "0h01" else 1.0) * 5.0 * TIME, stress_kPa=STRESS)


def test_units_that_change_behind_the_numbers_are_converted_and_asked_about(put):
    small = [f"{1e3 * f:.1f} mN" if f < 1.0 else f"{f:.4f} N" for f in FORCE]
    recording = import_file(put("a.csv", PULL_HEAD.replace(" (N)", "") + table(TIME, EXTENSION, small)), make_options(dimensions=COUPON))
    as_it_was(recording, stress_kPa=STRESS)
    assert checks(recording) == ["check: 'Force' is in several units (7 rows in mN, 17 rows in N): all are converted to N"]
    bare = [f"{1e3 * p:.0f} Pa" if p < 10.0 else f"{p:.3f}" for p in PRESSURE]
    recording = import_file(put("b.csv", "Time (s),Pressure (kPa),Length (mm)\n" + table(TIME, bare, LENGTH)), make_options(dimensions=TUBE))
    as_it_was(recording, pressure_kPa=PRESSURE)
    assert any("8 rows in Pa, 16 rows in kPa" in note for note in checks(recording))


def test_commas_that_may_be_thousands_are_refused_beside_units_that_change(put):
    pulls = [f"{1e3 * f:,.0f} mN" if f < 2.0 else f"{f:.0f} N" for f in 3.0 * FORCE]
    rows = table(TIME, EXTENSION, pulls, mark=";")
    assert "are no numbers" in refusal(put("a.csv", "Time (s);Extension (mm);Force\n" + rows), dimensions=COUPON)
    assert import_file(put("b.csv", "Time (s);Extension (mm);Force\n" + rows.replace("494 mN", "0,494 N")), make_options(dimensions=COUPON))


def test_milligrams_are_a_thousandth_of_grams(put):
    recording = import_file(put("a.csv", "Time (s),Extension (mm),Load (mg)\n" + table(TIME, EXTENSION, FORCE / 9.80665e-6)), make_options(dimensions=COUPON))
    as_it_was(recording, stress_kPa=STRESS)
    rows = "".join(f"{t},{e},{f / 9.80665e-3:.4f},g\n" if k % 2 else f"{t},{e},{f / 9.80665e-6:.1f},mg\n" for k, (t, e, f) in enumerate(zip(TIME, EXTENSION, FORCE, strict=True)))
    recording = import_file(put("b.csv", f"Time (s),Extension (mm),Load,Unit\n{rows}"), make_options(dimensions=COUPON))
    as_it_was(recording, stress_kPa=STRESS)


def test_points_group_the_thousands_of_whole_numbers(put):
    def whole(values):
        return [f"{round(x):,}".replace(",", ".") for x in values]

    content = "Zeit (s);Weg (µm);Kraft (mN)\n" + table(K * 2, whole(1e3 * EXTENSION), whole(1e3 * FORCE), mark=";")
    recording = import_file(put("a.csv", content), make_options(dimensions=COUPON))
    as_it_was(recording, strain=EXTENSION / 25.0, stress_kPa=STRESS)
    assert [note for note in checks(recording) if "thousands are grouped: '1.304' in row 4" in note]
    decimals = [f"{x:.3f}" if x % 1 else f"{x:.0f}" for x in 50.0 + np.round(EXTENSION * 8.0) / 8.0]
    recording = import_file(put("b.csv", "Pressure (kPa);Length (mm)\n" + table(PRESSURE, decimals, mark=";")), make_options(dimensions=TUBE))
    assert float(recording.columns["length_mm"].max()) == 65.0


@pytest.mark.parametrize(("text", "number"), [("1,23,456.7", 123456.7), ("1.2x10^-3", 1.2e-3), ("1.2 · 10⁻³", 1.2e-3), ("5*10^2", 500.0), ("1,2,3", None), ("2x4", None)])
def test_lakhs_and_powers_of_ten_are_numbers(text, number):
    assert to_number(text, ".") == number


def test_symbols_name_a_way_beside_a_force_and_a_length_beside_a_pressure(put):
    recording = import_file(put("a.csv", "t (s),x (mm),F (mN)\n" + table(TIME, EXTENSION, 1e3 * FORCE)), make_options(dimensions=COUPON))
    as_it_was(recording, strain=EXTENSION / 25.0)
    assert any("'x (mm)' taken as elongation" in note for note in checks(recording))
    recording = import_file(put("b.csv", "t (s),P (kPa),L (mm)\n" + table(TIME, PRESSURE, LENGTH)), make_options(dimensions=TUBE))
    as_it_was(recording, length_mm=LENGTH)
    assert "not recognised" in refusal(put("c.csv", "t (s),x (mm),y (mm),F (mN)\n" + table(TIME, EXTENSION, EXTENSION, 1e3 * FORCE)), dimensions=COUPON)


def test_sizes_side_by_side_in_one_line_are_read(put):
    content = "Gauge length (mm),25,Width (mm),6,Thickness (mm),3\n" + PULL_HEAD + table(TIME, EXTENSION, FORCE)
    as_it_was(import_file(put("a.csv", content)), strain=EXTENSION / 25.0, stress_kPa=STRESS)


def test_the_empty_end_of_a_block_is_no_text(put):
    content = (PULL_HEAD + table(TIME, EXTENSION, FORCE)).encode() + b"\0" * 300
    as_it_was(import_file(put("a.csv", content), make_options(dimensions=COUPON)), stress_kPa=STRESS)


def test_a_press_by_its_german_words(put):
    press = 0.3 * K / (N - 1)
    stress = -120.0 * ((1.0 - press) - (1.0 - press) ** -2)
    content = "Zeit (s);Stauchung (mm);Druckkraft (N)\n" + table(TIME, 25.0 * press, 0.018 * stress, mark=";")
    as_it_was(import_file(put("a.csv", content), make_options(dimensions=COUPON)), strain=-press, stress_kPa=-stress)


def test_files_one_behind_the_other_have_a_mark_of_the_code_between_them(put):
    content = PULL_HEAD + table(TIME[:9], EXTENSION[:9], FORCE[:9]) + "\ufeff" + table(TIME[9:], EXTENSION[9:], FORCE[9:])
    as_it_was(import_file(put("a.csv", content), make_options(dimensions=COUPON)), stress_kPa=STRESS)


def test_an_absolute_pressure_in_german_and_a_garbled_degree_are_read(put):
    content = "Zeit [s];Absolutdruck [mbar];Länge [mm]\n" + table(TIME, 10.0 * (PRESSURE + 101.325), LENGTH, mark=";", form="{:.8g}")
    as_it_was(import_file(put("a.csv", content), make_options(dimensions=TUBE)), pressure_kPa=PRESSURE)
    content = "Time (s),Temp (Â°C),Strain (%),Stress (MPa)\n" + table(TIME, WARM, 100.0 * SHRUNK, np.full(N, 150.0))
    as_it_was(import_file(put("b.csv", content)), temperature_degC=WARM)


def test_a_counter_of_16_bits_is_counted_on(put):
    content = "millis,ext_mm,force_mN\n" + table((5000 * K) % 65536, EXTENSION, 1e3 * FORCE)
    recording = import_file(put("a.csv", content), make_options(dimensions=COUPON))
    as_it_was(recording, time_s=5.0 * K)
    assert any("a counter of 16 bits" in note for note in checks(recording))


def test_a_number_that_cannot_be_is_told_as_the_file_has_it(put):
    for unit, told in (("psi", "190 psi, that is 1310 kPa,"), ("psia", "190 psi less 101.325 kPa, that is 1208.68 kPa,")):
        content = f"Time (s),Pressure ({unit}),Length (mm)\n0,15,56\n1,16,57\n2,190,58\n3,2,58\n"
        assert f"row 4, column pressure_kPa: {told} cannot be" in refusal(put("a.csv", content))
    path = put("b.csv", "time_s,pressure_psi,length_mm\n0,0,56\n1,1,57\n2,190,58\n")
    with pytest.raises(InputError, match="190 psi, that is 1310 kPa, cannot be"):
        read_recording(path)


def test_a_file_that_was_written_twice_is_asked_about(put):
    path = put("a.csv", 2 * (PULL_HEAD + table(TIME, EXTENSION, FORCE)))
    found = [note for made in import_files([path], make_options(dimensions=COUPON)) for note in checks(made)]
    assert any("is it a copy?" in note for note in found)
