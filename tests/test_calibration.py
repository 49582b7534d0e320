import dataclasses
import importlib
import math
import re
import subprocess
import sys
import tomllib
from importlib import resources
from pathlib import Path

import pytest

import pneusma_jax
from pneusma_jax.calibration import (
    Calibration,
    Prior,
    Quantity,
    available,
    keys,
    load_calibration,
    named_table,
    write_calibration,
)
from pneusma_jax.calibration.toml import parse_calibration, render_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import WireAlloy

DESIGNS = ["pneuflex_s", "pneuflex_t", "pneuflex_w", "pneusma1", "pneusma2", "triad"]


def shipped_text(name):
    return resources.files("calibration_data").joinpath(f"{name}.toml").read_text(encoding="utf-8")


def refusal(path):
    with pytest.raises(InputError) as error:
        load_calibration(path)
    message = str(error.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    return message


# --- the shipped tables -------------------------------------------------------------------------------------


def test_what_is_shipped():
    assert available("alloy") == ["krl35", "krl45", "niti_wire"]
    assert available("silicone") == ["dragon_skin_10_fast"]
    assert available("actuator") == DESIGNS
    assert available() == sorted([*available("alloy"), *available("silicone"), *DESIGNS])


@pytest.mark.parametrize("name", available())
def test_shipped_tables_are_complete(name):
    table = load_calibration(name)
    assert table.name == name
    assert "Washington State University" in table.text["citation"]
    assert "E. A. Allen" in table.text["citation"]
    assert table.description
    for quantity in table.quantities.values():
        assert quantity.source.strip()
        assert quantity.status in keys.STATUSES
        if quantity.status == "corrected" or quantity.status == "reconstructed" and "Section" not in quantity.source:
            assert "orrection" in quantity.source
        if quantity.prior is not None:
            assert quantity.prior.mean == quantity.value
            assert quantity.prior.min < quantity.value < quantity.prior.max


@pytest.mark.parametrize("name", available())
def test_shipped_tables_round_trip(name, tmp_path):
    table = load_calibration(name)
    copy = tmp_path / f"{name}.toml"
    write_calibration(table, copy)
    assert load_calibration(copy) == table
    # not only equal in SI: the same decimal numbers, so 0.25 mm is not 0.25000000000000006 mm
    assert tomllib.loads(copy.read_text(encoding="utf-8")) == tomllib.loads(shipped_text(name))
    assert list(tmp_path.iterdir()) == [copy]


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        ("krl35", "beta_1", 21.9987),
        ("krl35", "beta_3", 90.5096),
        ("krl45", "beta_2", 3.7937),
        ("krl35", "ka_3", 8.0373),
        ("krl45", "km_1", -2.0476),
        ("krl35", "rho_mean", 18.8697),
        ("krl45", "rho_span", 3.1742),
        ("krl35", "alpha_1", 65.1884 - 48.0),
        ("krl45", "alpha_1", 64.9255 - 48.0),
        ("krl45", "alpha_2", -0.5693),
        ("krl35", "a", 7.8613),
        ("krl45", "b", 0.8488),
        ("krl35", "G_m", 3.0e9),
        ("krl45", "G_a", 8.25e9),
        ("krl35", "gR_shift", 1.57),
        ("krl35", "T_mid", 31.0),
        ("krl45", "T_width", 2.6),
        ("krl35", "convection", 60.0),
        ("dragon_skin_10_fast", "standard_tension.p_1", -63424.9),
        ("dragon_skin_10_fast", "tube_buckling.p_6", 3304.6),
        ("dragon_skin_10_fast", "needle_buckling.p_5", 5757.3),
        ("dragon_skin_10_fast", "bulk_compression.strain_min", -0.6),
        ("dragon_skin_10_fast", "mu", 85e3),
        ("dragon_skin_10_fast", "mu_printed", 42.5e3),
        ("dragon_skin_10_fast", "minimum_slope", 50e3),
        ("pneuflex_t", "wall_thickness", 1.5e-3),
        ("pneuflex_w", "outer_diameter", 14e-3),
        ("pneuflex_s", "fibre_stiffness", 1e6),
        ("pneusma1", "attached_length", 56e-3),
        ("pneusma2", "wire_diameter", 0.25e-3),
        ("triad", "active_coils", 52.0),
    ],
)
def test_published_numbers_in_si(name, key, value):
    assert load_calibration(name).values()[key] == pytest.approx(value, rel=1e-12)


def test_averaged_exponents_are_the_averages_of_the_two_alloys():
    one, two = load_calibration("krl35").values(), load_calibration("krl45").values()
    for key in ("a", "b"):
        assert (one[key] + two[key]) / 2 == pytest.approx(one[f"{key}_mean"], abs=6e-5)
        assert one[f"{key}_mean"] == two[f"{key}_mean"]


def test_reconstructed_constants_follow_from_their_evidence():
    v = load_calibration("krl35").values()
    assert v["G_a"] / v["G_m"] == pytest.approx(11 / 4)
    detwinned = (1 + math.exp(-v["beta_1"] * 0.1924 - v["beta_2"])) ** -v["beta_3"]
    left = v["gR_amplitude"] * (1 + math.erf(v["gR_slope"] * 0.1924 - v["gR_shift"]))
    assert v["gamma_L"] * detwinned == pytest.approx(left, rel=1e-3)


@pytest.mark.parametrize("name", ["krl35", "krl45"])
def test_the_unpublished_alloy_constants_have_wide_priors(name):
    table = load_calibration(name)
    for key, least in (("G_m", 0.3), ("G_a", 0.3), ("gamma_L", 0.15), ("heat_capacity", 0.3), ("convection", 0.3)):
        quantity = table.quantities[key]
        assert quantity.prior.sd >= least * quantity.value * (1 - 1e-12)
    assert table.quantities["alpha_1"].prior.sd >= 0.4


def test_designs_name_their_sides_and_materials():
    sides = {name: [load_calibration(name).text.get(f"side_{i}") for i in (1, 2, 3)] for name in DESIGNS}
    assert sides["pneusma1"] == ["none", "spring", None]
    assert sides["pneusma2"] == ["spring", "spring", None]
    assert sides["pneuflex_t"] == ["none", "fibre", None]
    assert sides["triad"] == ["spring"] * 3
    for name in DESIGNS:
        text = load_calibration(name).text
        assert text["material"] in available("silicone")
        assert ("alloy" in text) == ("spring" in sides[name])


def test_an_alloy_table_holds_every_constant_of_the_alloy_module():
    for module, names in ((pneusma_jax.Alloy, ["krl35", "krl45"]), (WireAlloy, ["niti_wire"])):
        constants = {field.name for field in dataclasses.fields(module)} - {"name"}
        for name in names:
            assert constants <= set(load_calibration(name).quantities)


def test_the_page_of_corrections_covers_what_the_tables_cite_and_names_functions_that_exist():
    page = (Path(__file__).parents[1] / "docs" / "corrections.md").read_text(encoding="utf-8")
    rows = dict(re.findall(r"^\| (\d+) \|.*\| (.*) \|$", page, flags=re.MULTILINE))
    assert [int(number) for number in rows] == list(range(1, 16))
    for number in rows:
        assert f"\n### {number}. " in page
    for name in available():
        for quantity in load_calibration(name).quantities.values():
            assert set(re.findall(r"[Cc]orrection (\d+)", quantity.source)) <= set(rows)
    named = [name for cell in rows.values() for name in re.findall(r"`([a-z_]+(?:\.\w+)+)`", cell)]
    assert len(named) >= 13
    for name in named:
        package, *path = name.split(".")
        place = importlib.import_module(f"pneusma_jax.{package}")
        for part in path:
            if not hasattr(place, part):
                importlib.import_module(f"{place.__name__}.{part}")
            place = getattr(place, part)


# --- reading ------------------------------------------------------------------------------------------------


def test_values_by_nested_table():
    table = load_calibration("dragon_skin_10_fast", kind="silicone")
    tension = table.table("standard_tension")
    assert list(tension) == ["p_1", "p_2", "p_3", "p_4", "p_5", "strain_min", "strain_max"]
    assert tension["strain_max"] == 1.5
    assert table.require(["mu"]) == {"mu": 85e3}
    with pytest.raises(InputError, match="key 'j_m' is needed here, but it is missing"):
        table.require(["mu", "j_m"])


def test_a_width_in_kelvin_is_a_difference_and_a_spread_has_no_offset(tmp_path):
    text = shipped_text("krl35").replace("{value = 31.0, unit = \"degC\"", "{value = 304.15, unit = \"K\"")
    text = text.replace("prior = {mean = 31.0, sd = 3.0, min = 19.0, max = 43.0}", "prior = {mean = 304.15, sd = 3.0}")
    path = tmp_path / "warm.toml"
    path.write_text(text, encoding="utf-8")
    table = load_calibration(path)
    assert table.quantities["T_mid"].value == pytest.approx(31.0)
    assert table.quantities["T_mid"].prior.mean == pytest.approx(31.0)
    assert table.quantities["T_mid"].prior.sd == 3.0
    assert table.quantities["T_mid"].prior.min == -math.inf
    assert table.quantities["T_width"].value == 2.5


def test_text_with_a_separator_or_suffix_is_a_path(tmp_path, monkeypatch):
    (tmp_path / "mine.toml").write_text(shipped_text("krl35"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load_calibration("mine.toml") == load_calibration("./mine.toml") == load_calibration("krl35")
    assert load_calibration(Path("mine.toml"), kind="alloy").path == Path("mine.toml")


def test_a_table_is_parsed_once_and_a_changed_file_again(tmp_path, monkeypatch):
    path, parsed = tmp_path / "a.toml", []
    text = (resources.files("calibration_data") / "krl35.toml").read_text()
    parse = pneusma_jax.calibration.parse_calibration
    monkeypatch.setattr(pneusma_jax.calibration, "parse_calibration", lambda *given: parsed.append(1) or parse(*given))
    path.write_text(text)
    first = load_calibration(path)
    first.quantities.pop("G_m")  # which no other reader notices
    first.text["name"] = "mine"
    assert "G_m" in load_calibration(path).quantities and "name" not in load_calibration(path).text and len(parsed) == 1
    path.write_text(text.replace('name = "krl35"', 'name = "another"'))
    assert load_calibration(path).name == "another" and len(parsed) == 2


def test_a_missing_file(tmp_path):
    assert refusal(tmp_path / "absent.toml").endswith("there is no such file")


def test_a_file_that_is_not_text(tmp_path):
    path = tmp_path / "binary.toml"
    path.write_bytes(b"\xff\xfe\x00")
    assert refusal(path).endswith("cannot be read as a text file (not UTF-8: invalid start byte)")
    assert refusal(tmp_path).endswith("this is a folder, and a file is needed")


def test_a_file_that_is_not_toml(tmp_path):
    path = tmp_path / "odd.toml"
    path.write_text('name = "x"\nthis is no TOML\n', encoding="utf-8")
    message = refusal(path)
    assert "not a TOML file" in message
    assert "line 2" in message and "decimal" not in message
    for line in ("b = 0,03", "b = -0,03  # 3 %\r"):
        path.write_text(f'name = "x"\n{line}\nc = 1\n', encoding="utf-8", newline="")
        assert refusal(path).endswith("a number has a decimal point: " + line.split()[2].replace(",", "."))


def test_an_unknown_name():
    with pytest.raises(InputError, match="no table of constants is called 'krl53', did you mean 'krl"):
        load_calibration("krl53")
    with pytest.raises(InputError, match=r"did you mean 'krl45'\? Known of kind alloy: krl35, krl45, new_nitinol, new_sma, niti_wire$"):
        load_calibration("krl53", kind="alloy")
    with pytest.raises(InputError, match="known: dragon_skin_10_fast"):
        load_calibration("ecoflex", kind="silicone")


def test_a_table_of_another_kind():
    with pytest.raises(InputError, match="krl35.toml: kind is 'alloy', but a table of kind 'silicone' is needed"):
        load_calibration("krl35", kind="silicone")


GM = 'G_m = {value = 3.0, unit = "GPa", status = "reconstructed", source = "x", prior = {mean = 3.0, sd = 0.9}}'


def with_line(name, key, line):
    """The shipped table with the line of one key replaced (or removed)."""
    lines = shipped_text(name).splitlines()
    hits = [i for i, text in enumerate(lines) if text.startswith(f"{key} = ")]
    lines[hits[0]] = line
    return "\n".join(lines)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("", "key 'G_m' is missing, and this alloy cannot do without it"),
        (GM.replace("G_m", "g_m"), "unknown key 'g_m', did you mean 'G_m'?"),
        (GM + "\nmodulus_of_things = 3.0", "unknown key 'modulus_of_things', known: "),
        ("G_m = 3.0", "key 'G_m' must be {value, unit, status, source}, but it is 3.0"),
        (GM.replace("GPa", "Gpa"), "key 'G_m': unknown unit 'Gpa', did you mean 'GPa'?"),
        (GM.replace("GPa", "mm"), "key 'G_m': unit 'mm' measures a length, but a pressure is needed, for example in 'Pa'"),
        (GM.replace('unit = "GPa"', "unit = 3"), "key 'G_m': unknown unit 3, "),
        (GM.replace("reconstructed", "corected"), "key 'G_m': status is 'corected', did you mean 'corrected'?"),
        (GM.replace('source = "x"', 'source = " "'), "key 'G_m': source must say where the number comes from"),
        (GM.replace('source = "x", ', ""), "key 'G_m': field 'source' is missing"),
        (GM.replace('unit = "GPa", ', ""), "key 'G_m': field 'unit' is missing"),
        (GM.replace("value", "vaule"), "key 'G_m': unknown field 'vaule', did you mean 'value'?"),
        (GM.replace("value = 3.0", 'value = "3.0"'), "key 'G_m': value must be a finite number, but it is '3.0'"),
        (GM.replace("value = 3.0", "value = true"), "key 'G_m': value must be a finite number, but it is True"),
        (GM.replace("value = 3.0", "value = nan"), "key 'G_m': value must be a finite number, but it is nan"),
        (GM.replace("value = 3.0", "value = -3.0"), "key 'G_m': value must be positive, but it is -3"),
        (GM.replace("sd = 0.9", "sd = 0.0"), "key 'G_m': prior sd must be positive, but it is 0"),
        (GM.replace(", sd = 0.9", ""), "key 'G_m': prior: field 'sd' is missing"),
        (GM.replace("sd = 0.9", "sd = 0.9, mode = 3.0"), "key 'G_m': prior: unknown field 'mode', known: max, mean, min, sd"),
        (GM.replace("sd = 0.9", 'sd = "0.9"'), "key 'G_m': prior sd must be a finite number, but it is '0.9'"),
        (GM.replace("sd = 0.9", "sd = 0.9, min = 4.0, max = 2.0"), "key 'G_m': prior min is 4, above its max of 2"),
        (
            GM.replace("mean = 3.0, sd = 0.9", "mean = 9.0, sd = 0.9, min = 1.0, max = 8.0"),
            "key 'G_m': prior: the mean 9 is outside min 1 to max 8",
        ),
        (
            GM.replace("value = 3.0", "value = 0.5").replace("sd = 0.9", "sd = 0.9, min = 1.0"),
            "key 'G_m': prior: the value 0.5 is outside min 1 to max inf",
        ),
        (GM.replace("{mean = 3.0, sd = 0.9}", "3.0"), "key 'G_m': prior must be {mean, sd, min, max}, but it is 3.0"),
    ],
)
def test_refusals_of_a_number(line, message, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(with_line("krl35", "G_m", line), encoding="utf-8")
    assert f"{path}: {message}" in refusal(path)


@pytest.mark.parametrize(
    ("name", "key", "line", "message"),
    [
        ("krl35", "schema", 'schema = "pneusma-calibration/9"', "schema is 'pneusma-calibration/9'"),
        ("krl35", "schema", "", "key 'schema' is missing"),
        ("krl35", "kind", 'kind = "aloy"', "kind is 'aloy', did you mean 'alloy'?"),
        ("krl35", "name", "name = 35", "key 'name' must be text, but it is 35"),
        ("krl35", "citation", 'citaton = "x"', "unknown key 'citaton', did you mean 'citation'?"),
        ("krl35", "T_width", 'T_width = {value = 1.0, unit = "1", status = "assumed", source = "x"}',
         "unit '1' measures a number, but a temperature difference is needed, for example in 'K'"),
        ("dragon_skin_10_fast", "law", "", "key 'law' is missing; it must be one of regularised, polynomial"),
        ("dragon_skin_10_fast", "law", 'law = "neohookean"', "law is 'neohookean', did you mean 'neo_hookean'?"),
        ("dragon_skin_10_fast", "law", 'law = "ogden"', "key 'mu_1' is missing, and this silicone"),
        ("dragon_skin_10_fast", "p_2", "", "key 'standard_tension.p_2' is missing"),
        ("dragon_skin_10_fast", "strain_max", "", "key 'standard_tension.strain_max' is missing"),
        ("dragon_skin_10_fast", "p_1", 'p_0 = {value = 1.0, unit = "kPa", status = "printed", source = "x"}',
         "unknown key 'standard_tension.p_0', did you mean 'standard_tension.p_"),
        ("dragon_skin_10_fast", "p_1", "p_1 = 3.0", "key 'standard_tension.p_1' must be {value, unit, status, source}"),
        ("pneusma2", "side_1", 'side_1 = "sprong"', "side_1 is 'sprong', did you mean 'spring'?"),
        ("pneusma2", "side_2", "", "key 'side_2' is missing; it must be one of spring, fibre, none"),
        ("pneusma2", "prestrain", "", "key 'prestrain' is missing, and this actuator"),
        ("pneusma2", "length", 'length = {value = 0.0, unit = "mm", status = "fitted", source = "x"}',
         "key 'length': value must be positive, but it is 0"),
    ],
)  # fmt: skip
def test_refusals_of_a_table(name, key, line, message, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(with_line(name, key, line), encoding="utf-8")
    assert message in refusal(path)


def test_a_wire_needs_its_own_constants_and_not_those_of_a_spring(tmp_path):
    spring = load_calibration("krl35")
    moduli = {
        key: Quantity(key, value, "GPa", "fitted", "pull of a wire") for key, value in (("E_m", 8e9), ("E_a", 22e9))
    }
    shared = {
        key: quantity
        for key, quantity in spring.quantities.items()
        if key.startswith(("beta_", "ka_", "T_m", "T_w"))
    }
    path = tmp_path / "wire.toml"
    incomplete = Calibration("wire", "alloy", "", None, {**shared, **moduli})
    with pytest.raises(InputError, match="key 'eps_L' is missing"):
        write_calibration(incomplete, path)
    assert list(tmp_path.iterdir()) == []
    strain = {"eps_L": Quantity("eps_L", 0.05, "%", "fitted", "pull of a wire", Prior(0.05, 0.01))}
    wire = dataclasses.replace(incomplete, quantities={**incomplete.quantities, **strain})
    write_calibration(wire, path)
    assert load_calibration(path) == wire
    assert "value = 5.0, unit = \"%\"" in path.read_text(encoding="utf-8")
    mixed = dataclasses.replace(wire, quantities={**wire.quantities, "G_m": spring.quantities["G_m"]})
    with pytest.raises(InputError, match="key 'rho_mean' is missing"):
        write_calibration(mixed, path)


# --- writing ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["mm", "in", "um", "cm", "m"])
def test_fitted_numbers_survive_writing_in_any_unit(unit, tmp_path):
    table = load_calibration("pneusma2")
    length = Quantity("length", 0.1 * math.pi / 6, unit, "fitted", "fit", Prior(0.05, 1 / 3e3, 0.01, 0.09))
    path = tmp_path / "fitted.toml"
    write_calibration(dataclasses.replace(table, quantities={**table.quantities, "length": length}), path)
    back = load_calibration(path).quantities["length"]
    assert back.value == pytest.approx(length.value, rel=1e-15)
    assert dataclasses.astuple(back.prior) == pytest.approx(dataclasses.astuple(length.prior), rel=1e-15)


def test_a_table_that_would_be_refused_is_not_written(tmp_path):
    table = load_calibration("krl35")
    path = tmp_path / "krl35.toml"
    write_calibration(table, path)
    before = path.read_bytes()
    bad = dataclasses.replace(table.quantities["G_m"], value=math.nan)
    with pytest.raises(InputError, match="key 'G_m': value must be a finite number"):
        write_calibration(dataclasses.replace(table, quantities={**table.quantities, "G_m": bad}), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written(tmp_path):
    path = tmp_path / "no_such_folder" / "krl35.toml"
    with pytest.raises(InputError, match="cannot be written"):
        write_calibration(load_calibration("krl35"), path)


def test_reading_tables_needs_no_jax():
    package = str(Path(pneusma_jax.__file__).parent)
    code = (
        "import sys, types\n"
        "package = types.ModuleType('pneusma_jax')\n"
        f"package.__path__ = [{package!r}]\n"  # skip the package's own imports: the question is this module's
        "sys.modules['pneusma_jax'] = package\n"
        "from pneusma_jax.calibration import load_calibration\n"
        "assert load_calibration('krl35').values()['G_m'] == 3e9\n"
        "assert 'jax' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_an_interval_is_read_in_its_unit_and_written_back(tmp_path):
    text = render_calibration(load_calibration("krl35", "alloy"))
    line = next(one for one in text.splitlines() if one.startswith("G_m = "))
    with_interval = text.replace(line, line[:-1] + ", interval90 = [2.5, 3.75]}")
    table = parse_calibration(with_interval, "krl35.toml")
    assert table.quantities["G_m"].interval90 == (2.5e9, 3.75e9)
    assert parse_calibration(render_calibration(table), "krl35.toml") == table
    for wrong, words in (("[1.0]", "must be"), ("[3.0, 2.0]", "above its end"), ('["a", 1.0]', "finite number")):
        with pytest.raises(InputError, match=words):
            parse_calibration(with_interval.replace("[2.5, 3.75]", wrong), "krl35.toml")


@pytest.mark.parametrize(
    ("key", "name", "said"),
    [
        ("material", "dragon_skin_10_fst", "did you mean 'dragon_skin_10_fast'"),
        ("alloy", "krl53", "did you mean 'krl"),
        ("material", "rubber.toml", "there is no file "),
    ],
)
def test_a_misspelt_table_is_told_with_the_file_that_names_it(tmp_path, key, name, said):
    """The message named no file, and in a study that of the study."""
    text = (resources.files("calibration_data") / "pneusma2.toml").read_text()
    (tmp_path / "mine.toml").write_text(re.sub(rf'(?m)^{key} = .*$', f'{key} = "{name}"', text))
    table = load_calibration(tmp_path / "mine.toml", "actuator")
    with pytest.raises(InputError) as caught:
        named_table(table, key)
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}: {key} = '{name}': ") and said in str(caught.value)
