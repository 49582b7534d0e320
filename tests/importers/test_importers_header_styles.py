"""Headers of twenty laboratories and machines: sizes, columns and kind as a person reads them."""

import numpy as np
import pytest
from answers import checks, refusal

from fitting.data.importers import import_file, import_tests, make_options

ROWS = 24
SPRING_SIZES = {"wire_diameter_mm": 0.25, "mandrel_diameter_mm": 0.9}


def spring(k):
    return 0.5 * k, 0.8 * k, 0.02 * k, 3.32 + 0.004 * k


def coupon(k):
    return 0.5 * k, 0.4 * k, 1.2 * (1.0 - np.exp(-0.05 * k))


def wire(k):
    return 2.0 * k, 90.0 - 2.5 * k, 0.2 + 0.15 * k, 200.0


def tube(k):
    return 1.0 * k, 2.0 * k, 120.0 + 0.05 * k


def rows(row, separator=",", decimal="."):
    """Lines of numbers of a simulated test."""
    lines = ([f"{value:.4f}".replace(".", decimal) for value in row(k)] for k in range(ROWS))
    return "".join(f"{separator.join(line)}\n" for line in lines)


def spoken(separator, *formats):
    """Lines of cells, each written by a function of a row's number."""
    return "".join(f"{separator.join(write(k) for write in formats)}\n" for k in range(ROWS))


def tab(text):
    return text.replace(";", "\t")


SPRINGS = {
    "english": (
        "# Specimen: S-07\n# Operator: J. Smith\n# wire diameter: 0.25 mm\n# mandrel: 0.9 mm\n# coils: 52\n# pitch: 0.27 mm\n"
        "Time (s),Extension (mm),Force (N),Resistance (Ohm)\n" + rows(spring),
        {**SPRING_SIZES, "active_coils": 52.0, "initial_pitch_mm": 0.27},
    ),
    "german": (
        "Probe: A7\nPrüfer: Müller\nDrahtdurchmesser: 0,25 mm\nDorndurchmesser: 0,9 mm\nWindungen (aktiv): 45\nSteigung: 0,27 mm\n"
        "\nZeit [s];Weg [mm];Kraft [N];Widerstand [Ohm]\n" + rows(spring, ";", ","),
        {**SPRING_SIZES, "active_coils": 45.0, "initial_pitch_mm": 0.27},
    ),
    "key = value": (
        "sample = A7\nd_wire = 0.25 mm\nD_mean = 1.15 mm\nN_active = 45\nL_free = 14.2 mm\n"
        + tab("Time [s];Displacement [mm];Force [N];Resistance [Ohm]\n") + rows(spring, "\t"),
        {**SPRING_SIZES, "active_coils": 45.0, "free_length_mm": 14.2},
    ),
    "units in the names": (
        "Sample ID: A7\nWire dia. [mm]: 0.25\nMandrel dia. [mm]: 0.9\nActive coils [-]: 45\n"
        "Time [s],Displacement [mm],Force [N],Resistance [Ohm]\n" + rows(spring),
        {**SPRING_SIZES, "active_coils": 45.0},
    ),
    "tolerances, all in one line": (
        "wire diameter = 0.25 ± 0.01 mm; outer diameter = 1.4 mm +/- 0.02 mm; number of active coils = 45\n"
        + tab("Time [s];Displacement [mm];Force [N];Resistance [Ohm]\n") + rows(spring, "\t"),
        {**SPRING_SIZES, "active_coils": 45.0},
    ),
    "below the table": (
        "Time <s>,Extension <mm>,Force <N>,Resistance <Ohm>\n" + rows(spring)
        + "\nWire diameter: 0.25 mm\nOperator: js\nInner coil diameter: 0.9 mm\nActive coils: 45\nend of file\n",
        {**SPRING_SIZES, "active_coils": 45.0},
    ),
    "chinese": (
        "丝径：0.25mm\n中径：1.15mm\n有效圈数：45圈\n节距：0.27mm\n时间/s,位移/mm,力/N,电阻/Ω\n" + rows(spring),
        {**SPRING_SIZES, "active_coils": 45.0, "initial_pitch_mm": 0.27},
    ),
    "russian": (
        "Диаметр проволоки: 0,25 мм\nСредний диаметр пружины: 1,15 мм\nЧисло рабочих витков: 45\n"
        "Время (с);Перемещение (мм);Сила (Н);Сопротивление (Ом)\n" + rows(spring, ";", ","),
        {**SPRING_SIZES, "active_coils": 45.0},
    ),
    "japanese": (
        "線径：0.25 mm\n平均コイル径：1.15 mm\n有効巻数：45\n自由長さ：14.2 mm\n時間【s】,変位【mm】,荷重【N】,抵抗【Ω】\n" + rows(spring),
        {**SPRING_SIZES, "active_coils": 45.0, "free_length_mm": 14.2},
    ),
}  # fmt: skip


@pytest.mark.parametrize("style", SPRINGS)
def test_sizes_of_a_spring(put, style):
    text, sizes = SPRINGS[style]
    recording = import_file(put("a.csv", text))
    assert recording.kind == "spring" and recording.geometry == sizes
    np.testing.assert_array_equal(recording.columns["elongation_mm"], [round(0.8 * k, 4) for k in range(ROWS)])
    assert not checks(recording)


COUPONS = {
    "chinese": (
        "试样编号：3\n操作员：王\n标距：25 mm\n宽度：6 mm\n厚度：2 mm\n试验速度：10 mm/min\n时间(s),位移(mm),力(N)\n" + rows(coupon)
    ).encode("gb18030"),
    "japanese machine": (
        '"試験日","2024/03/12"\n"試験片名","1 _ 1"\n"厚さ","2.0","mm"\n"幅","6.0","mm"\n"標点間距離","25","mm"\n'
        '"時間","ストローク","試験力"\n"sec","mm","N"\n' + rows(coupon)
    ).encode("shift_jis"),
    "english machine": (
        'Operator,js\nTest date,3/12/2024\nMethod,"Elastomer.im_tens"\nSpecimen label,A7\nWidth,6.00,mm\nThickness,2.00,mm\n'
        "Gauge length,25.00,mm\nRate 1,10.00,mm/min\n\nTime,Extension,Load\n(s),(mm),(N)\n" + rows(coupon)
    ),
    "german machine": (
        '"Prüfnorm";"ISO 37"\n"Probe Nr.";"1"\n"Prüfgeschwindigkeit";"10";"mm/min"\n"Messlänge L0";"25";"mm"\n'
        '"Probendicke a0";"2";"mm"\n"Probenbreite b0";"6";"mm"\n"Shore-Härte";"30"\n'
        '"Prüfzeit";"Standardweg";"Standardkraft"\n"s";"mm";"N"\n' + rows(coupon, ";", ",")
    ).encode("cp1252"),
    "french": (
        "Éprouvette : F-12\nOpérateur : Dupont\nLongueur utile : 25 mm\nLargeur : 6 mm\nÉpaisseur : 2 mm\nVitesse : 10 mm/min\n"
        + tab("Temps (s);Déplacement (mm);Force (N)\n") + rows(coupon, "\t", ",")
    ),
    "spanish": (
        "Probeta: A7\nLongitud inicial: 25 mm\nAncho: 6 mm\nEspesor: 2 mm\n"
        "Tiempo (s);Desplazamiento (mm);Fuerza (N)\n" + rows(coupon, ";")
    ),
    "korean": "시편: A7\n표점거리: 25 mm\n폭: 6 mm\n두께: 2 mm\n시간 (s),변위 (mm),하중 (N)\n" + rows(coupon),
    "blocks": (
        "[Machine]\nName = UTM 5\nLoad cell = 50 N\n\n[Specimen]\nID = A7\nGauge length = 25 mm\nWidth = 6 mm\nThickness = 2 mm\n"
        "\n[Comments]\nsecond pull after 10 min rest at 23 °C\n\n[Data]\nTime {s};Extension {mm};Load {N}\n" + rows(coupon, ";")
    ),
    "dates with decimal commas": (
        "Probe;A7\nMesslänge;25;mm\nBreite;6;mm\nDicke;2;mm\nDatum/Uhrzeit;Weg;Kraft\n;mm;N\n"
        + spoken(";", lambda k: f"12.03.2024 10:00:{k // 2:02d},{'500' if k % 2 else '000'}",
                 lambda k: f"{0.4 * k:.3f}".replace(".", ","), lambda k: f"{coupon(k)[2]:.4f}".replace(".", ","))
    ),
    "thousands": (
        "Gauge length: 25 mm\nArea: 12 mm²\nTime (ms);Extension (µm);Load (mN)\n"
        + spoken(";", lambda k: f"{500 * k:,}", lambda k: f"{400 * k:,.1f}", lambda k: f"{1e3 * coupon(k)[2]:,.4f}")
    ),
}  # fmt: skip


@pytest.mark.parametrize("style", COUPONS)
def test_strain_and_stress_of_a_coupon(put, style):
    recording = import_file(put("a.csv", COUPONS[style]))
    assert recording.kind == "elastomer" and not checks(recording)
    times, strains, loads = np.array([coupon(k) for k in range(ROWS)]).T
    np.testing.assert_array_equal(recording.columns["time_s"], times)
    np.testing.assert_allclose(recording.columns["strain"], strains / 25.0, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(recording.columns["stress_kPa"], loads / 12.0 * 1e3, atol=1e-2)


WIRES = {
    "french": "Diamètre du fil : 0,5 mm\nLongueur utile : 40 mm\n"
    + tab("Temps (s);Température (°C);Déformation (%);Contrainte (MPa)\n") + rows(wire, "\t", ","),
    "thermal analysis": "Filename\tA7.tri\nSample name\tNiTi A7\nLength\t10.52 mm\nDiameter\t0.20 mm\n[step]\n"
    + tab("Time;Temperature;Strain;Stress\ns;deg_C;%;MPa\n") + rows(wire, "\t"),
    "kelvin": "Wire: W-2\nd = 0.5 mm\nTime,Temperature (K),Strain (-),Stress (MPa)\n"
    + spoken(",", lambda k: f"00:00:{2 * k:02d}.000", lambda k: f"{363.15 - 2.5 * k:.2f}",
             lambda k: f"{0.002 + 0.0015 * k:.4f}", lambda k: "200"),
}  # fmt: skip


@pytest.mark.parametrize("style", WIRES)
def test_strain_and_temperature_of_a_wire(put, style):
    recording = import_file(put("a.csv", WIRES[style]))
    assert recording.kind == "wire" and not checks(recording)
    for k, name in enumerate(("time_s", "temperature_degC")):
        np.testing.assert_array_equal(recording.columns[name], [wire(row)[k] for row in range(ROWS)])
    np.testing.assert_allclose(recording.columns["strain"], [wire(k)[2] / 100.0 for k in range(ROWS)], rtol=1e-12)


@pytest.mark.parametrize(
    "sizes",
    [
        "Probe;Schlauch 3\nAußendurchmesser;10;mm\nWandstärke;1;mm\nSchlauchlänge;120;mm\n",
        "Specimen ID;T3\nInner diameter;8;mm\nOuter diameter;10;mm\nTube length;120;mm\n",
        "外径;10;mm\n内径;8;mm\n管长度;120;mm\n",
        "OD = 0.01 m\nwall = 1 mm\ntube length = 12 cm\n",
        "Specimen OD: 10 mm\nSpecimen ID: 8 mm\nTube length: 120 mm\n",
    ],
)
def test_sizes_of_a_tube(put, sizes):
    recording = import_file(put("a.csv", sizes + "Time;Pressure;Length\ns;kPa;mm\n" + rows(tube, ";")))
    assert recording.kind == "tube" and not checks(recording)
    assert recording.geometry == {"outer_diameter_mm": 10.0, "wall_thickness_mm": 1.0, "length_mm": 120.0}


@pytest.mark.parametrize("line", ["Specimen length: 120.0 mm", "长度(mm);120", "Length: 12 cm"])
def test_a_length_that_may_be_that_of_the_tube_is_taken_and_asked_about(put, line):
    recording = import_file(put("a.csv", line + "\nTime;Pressure;Length\ns;kPa;mm\n" + rows(tube, ";")))
    assert recording.geometry == {"length_mm": 120.0}
    assert any("the tube's at rest (--dimension length_mm=... corrects it)" in note for note in checks(recording))


@pytest.mark.parametrize("name", ["Sig{}\t", "Column {}: ", "# {} = ", "列{}："])
@pytest.mark.parametrize("first", [0, 1])
def test_columns_that_a_list_names_by_number(put, name, first):
    headings = ("Time (s)", "Temperature (°C)", "Strain (%)", "Stress (MPa)")
    listed = "".join(f"{name.format(first + k)}{heading}\n" for k, heading in enumerate(headings))
    recording = import_file(put("a.txt", f"Instrument\tDMA\nNsig\t4\n{listed}Date\t12-Mar-24\nStartOfData\n" + rows(wire, "\t")))
    assert recording.kind == "wire" and recording.columns["temperature_degC"][1] == 87.5
    (asked,) = checks(recording)
    assert "named by the list above the table" in asked and asked.endswith("Stress (MPa)'")


def test_a_list_of_other_columns_names_none(put):
    listed = "Sig1\tTime (s)\nSig2\tTemperature (°C)\nSig3\tStrain (%)\n"
    assert "without headings right above them, numbers 1 to 4" in refusal(put("a.txt", listed + "StartOfData\n" + rows(wire, "\t")))


def test_two_blocks_have_sizes_of_their_own(put):
    table = "Time (s),Extension (mm),Load (N)\n" + rows(coupon)
    head = "Specimen: {}\nGauge length: {} mm\nArea: 12 mm2\nOperator: {}\n"
    one, two = import_tests(put("a.csv", head.format("A7", 25, "js") + table + "\n" + head.format("A8", 40, "kl") + table))
    assert one.columns["strain"][10] == 0.16 and two.columns["strain"][10] == 0.1
    assert "Operator: js" in " ".join(one.notices) and "Operator: kl" in " ".join(two.notices)


@pytest.mark.parametrize(
    ("heading", "offset", "factor"),
    [
        ("T/°C", 0.0, 1.0), ("Temp (oC)", 0.0, 1.0), ("Temperatur in Grad C", 0.0, 1.0), ("Temp_celsius", 0.0, 1.0),
        ("Temperature (oF)", 32.0, 1.8), ("Temp. [degF]", 32.0, 1.8), ("Temp (deg K)", 273.15, 1.0), ("T [°K]", 273.15, 1.0),
    ],
)  # fmt: skip
def test_temperatures_under_many_spellings_of_their_unit(put, heading, offset, factor):
    table = spoken(",", str, lambda k: f"{offset + factor * (90 - 2.5 * k):.2f}", lambda k: f"{0.15 * k:.2f}", lambda k: "200")
    recording = import_file(put("a.csv", f"Time (s),{heading},Strain (%),Stress (MPa)\n{table}"))
    np.testing.assert_array_equal(recording.columns["temperature_degC"], [90.0 - 2.5 * k for k in range(ROWS)])


@pytest.mark.parametrize("heading", ["Resistance (milliohms)", "Resistance_mOhm", "R / mΩ", "Widerstand <mOhm>", "电阻【mΩ】"])
def test_resistances_under_many_spellings_of_their_unit(put, heading):
    table = spoken(",", str, lambda k: f"{0.8 * k:.1f}", lambda k: f"{0.02 * k:.2f}", lambda k: str(3320 + 4 * k))
    recording = import_file(put("a.csv", f"Time (s),Extension (mm),Force (N),{heading}\n{table}"))
    np.testing.assert_array_equal(recording.columns["resistance_ohm"], [(3320 + 4 * k) / 1000 for k in range(ROWS)])


@pytest.mark.parametrize(("volts", "amperes"), [("V", "mA"), ("mV", "A"), ("mV", "mA")])
def test_a_voltage_over_a_current(put, volts, amperes):
    scales = {"V": 1e-3, "mV": 1.0, "A": 1e-3, "mA": 1.0}
    table = spoken(
        ",", str, lambda k: f"{0.8 * k:.1f}", lambda k: f"{0.02 * k:.2f}",
        lambda k: f"{scales[volts] * (332 + 0.4 * k):.7g}", lambda k: f"{scales[amperes] * 100:g}",
    )  # fmt: skip
    head = f"# spring\nTime (s),Extension (mm),Force (N),U ({volts}),I ({amperes})\n"
    recording = import_file(put("a.csv", head + table))
    np.testing.assert_array_equal(recording.columns["resistance_ohm"], [round(3.32 + 0.004 * k, 6) for k in range(ROWS)])


def test_a_current_without_its_unit_is_asked_for(put):
    table = spoken(",", str, lambda k: f"{0.8 * k:.1f}", lambda k: f"{0.02 * k:.2f}", lambda k: "0.332", lambda k: "100")
    path = put("a.csv", "# spring\nTime (s),Extension (mm),Force (N),Voltage (V),Current\n" + table)
    assert "--unit current=mA (or A)" in refusal(path)
    assert import_file(path, make_options(units=["current=mA"])).columns["resistance_ohm"][0] == 3.32


def test_a_temperature_that_is_not_recognised_is_offered(put):
    table = "Time (s),T1 [°C],Strain (%),Stress (MPa)\n" + rows(wire)
    assert any("--map temperature='T1 [°C]'" in note for note in checks(import_file(put("a.csv", table))))


@pytest.mark.parametrize("line", ["Width x thickness: 6 x 2 mm", "Width: 6.01, 6.02, 6.00 mm", "Querschnitt: 6 mm x 2 mm"])
def test_a_refusal_quotes_lines_that_may_state_what_is_missing(put, line):
    head = f"Gauge length: 25 mm\n{line}\nTime (s);Extension (mm);Load (N)\n"
    said = refusal(put("a.csv", head + rows(coupon, ";")))
    assert "the cross-section is missing" in said and repr(line) in said


def test_a_table_of_one_specimen_above_the_numbers_is_not_asked_about(put):
    head = "Sample;Wire diameter;Coils;Free length\n;mm;;mm\nS7;0.25;45;14.2\n\n"
    recording = import_file(put("a.csv", head + "Time (s);Extension (mm);Force (N);Resistance (Ohm)\n" + rows(spring, ";")))
    assert recording.geometry == {"wire_diameter_mm": 0.25, "active_coils": 45.0, "free_length_mm": 14.2}
    assert not checks(recording)
