"""Damaged files end in a right answer or one clear line; `make fuzz` does the same with 20,000."""

import io
import time
import zipfile
from collections import Counter

import numpy as np
import pytest
from fuzz import TEXTS, campaign, invented, one, written, written_in_workbook, wrong_numbers
from mutations import workbook

from fitting.data.importers import import_tests, make_options, raw
from fitting.data.protocols.reading import load_protocol
from fitting.data.recordings import read_recording
from pneusma_jax import InputError, load_calibration
from pneusma_jax.documents import parse_toml


def test_damaged_files_are_read_rightly_or_refused_in_one_line():
    counts, failures = campaign(range(45), TEXTS)
    assert not failures, failures
    assert sum(counts[f"{kind}: refused"] for kind in TEXTS) > 15
    assert sum(counts[f"{kind}: accepted"] for kind in TEXTS) > 9


def test_the_same_seed_damages_the_same_way():
    (first, said), (second, again) = one(11, TEXTS), one(11, TEXTS)
    assert first == second and said.split(": ", 1)[1] == again.split(": ", 1)[1]


def test_the_independent_reader_sees_a_wrong_number(tmp_path):
    text = "strain,stress_kPa\n" + "".join(f"{0.1 * k},{k}\n" for k in range(12))
    (tmp_path / "a.csv").write_text(text)
    columns = read_recording(tmp_path / "a.csv").columns
    assert wrong_numbers(text.encode(), columns) == ""
    columns["stress_kPa"] = columns["stress_kPa"].copy()
    columns["stress_kPa"][3] += 1e-9
    assert "stress_kPa" in wrong_numbers(text.encode(), columns)


def test_the_independent_reader_leaves_comments_out(tmp_path):
    text = "strain,stress_kPa\n" + "".join(f"{0.1 * k},{k}\n" for k in range(12)) + "#,12\n"
    (tmp_path / "a.csv").write_text(text)
    columns = read_recording(tmp_path / "a.csv").columns
    assert wrong_numbers(text.encode(), columns) == "" and len(columns["strain"]) == 12


def test_a_warning_of_a_library_is_a_failure():
    def warned(rng, folder):
        return lambda: np.float64(1e200) * np.full(2, 1e200), lambda found: ""

    outcome, said = one(0, {"raw text": (warned, 1.0)})
    assert outcome == "raw text: warning" and "RuntimeWarning: overflow" in said


def test_single_seeds_are_run_again(tmp_path):
    counts, failures = campaign([3, 17, 5], TEXTS)
    assert sum(counts.values()) == 3 and not failures
    assert counts == sum((Counter([one(seed, TEXTS)[0]]) for seed in (3, 17, 5)), Counter())


def test_the_independent_reader_sees_an_invented_number(tmp_path):
    text = "Strain (%),Stress (MPa)\n" + "".join(f"{2 * k},{0.003 * k:.3f}\n" for k in range(20))
    (tmp_path / "a.csv").write_text(text)
    [found] = import_tests(tmp_path / "a.csv", make_options(kind="elastomer"))
    assert invented([found], written(text.encode())) == ""
    found.columns["stress_kPa"] = found.columns["stress_kPa"].copy()
    found.columns["stress_kPa"][3] *= 1.0001
    assert "is written nowhere" in invented([found], written(text.encode()))
    assert {0.5, 6.0, 33.0} <= written_in_workbook(workbook(np.random.default_rng(2)))


@pytest.mark.parametrize("part", ["xl/worksheets/sheet1.xml", "xl/workbook.xml"])
def test_a_workbook_whose_entities_expand_to_gigabytes_is_refused(tmp_path, part):
    entities = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))
    bomb = f'<!DOCTYPE w [<!ENTITY e0 "0000000000">{entities}]><w>&e9;</w>'
    (tmp_path / "bomb.xlsx").write_bytes(packed_workbook(bomb, part))
    with pytest.raises(InputError) as refused:
        import_tests(tmp_path / "bomb.xlsx", make_options(kind="elastomer"))
    assert "\n" not in str(refused.value)


def test_a_workbook_whose_parts_have_other_names_is_refused_in_a_short_line(tmp_path):
    content = bytearray(workbook(np.random.default_rng(0)))
    header = content.index(b"xl/styles.xml") - 30  # of the part; its name is 30 bytes behind
    content[header + 26 : header + 28] = (600).to_bytes(2, "little")
    (tmp_path / "a.xlsx").write_bytes(content)
    with pytest.raises(InputError, match="not an Excel workbook that can be read") as refused:
        import_tests(tmp_path / "a.xlsx", make_options(kind="elastomer"))
    assert len(str(refused.value).removeprefix(str(tmp_path))) < 300


def packed_workbook(sheet: str, part: str = "xl/worksheets/sheet1.xml") -> bytes:
    """A workbook with one sheet, one part of which is given as XML."""
    content, made = io.BytesIO(workbook(np.random.default_rng(0))), io.BytesIO()
    with zipfile.ZipFile(content) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            new.writestr(name, sheet if name == part else old.read(name))
    return made.getvalue()


def test_a_workbook_that_unpacks_to_more_than_the_limit_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(raw, "MOST_UNPACKED", 2**20)  # gigabytes take a minute to pack
    bomb = packed_workbook("<!--" + " " * (6 * 2**20) + "-->")
    assert len(bomb) < 2**15
    (tmp_path / "bomb.xlsx").write_bytes(bomb)
    with pytest.raises(InputError, match="unpacks to 6 MiB"):
        import_tests(tmp_path / "bomb.xlsx")


def test_a_sheet_that_states_billions_of_cells_is_read_by_those_it_has(tmp_path):
    rows = [["Strain", "Stress (kPa)"], *([f"{0.02 * k:.2f}", f"{3 * k}"] for k in range(12))]
    xml = "".join(
        "<row>" + "".join(f'<c t="inlineStr"><is><t>{cell}</t></is></c>' for cell in row) + "</row>"
        for row in rows
    )
    space = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    sheet = (
        f'<worksheet xmlns="{space}"><dimension ref="A1:XFD1048576"/><sheetData>{xml}</sheetData></worksheet>'
    )
    (tmp_path / "wide.xlsx").write_bytes(packed_workbook(sheet))
    found = import_tests(tmp_path / "wide.xlsx", make_options(kind="elastomer"))
    assert len(found[0]) == 12


@pytest.mark.parametrize(
    "nest",
    [
        "x = " + "[" * 5000 + "]" * 5000,
        "x = " + "{a=" * 5000 + "1" + "}" * 5000,
        "a." * 5000 + "b = 1",
        "[" + "a." * 5000 + "b]",
        "x = '['  # [\ny = " + "[" * 101 + "]" * 101,
    ],
)
def test_toml_that_is_nested_to_exhaust_the_stack_is_refused(tmp_path, nest):
    (tmp_path / "deep.toml").write_text(nest + "\n")
    with pytest.raises(InputError, match="nested too deeply"):
        load_calibration(tmp_path / "deep.toml")


def test_brackets_in_texts_and_comments_nest_nothing():
    brackets = "[" * 200
    text = f"a = '{brackets}'\nb = \"\\\"{brackets}\"\nc = \"\"\"{brackets}\n{brackets}\"\"\"\n# {brackets}\n"
    found = parse_toml(text + "d = [[1], [[[2]]]]\n", "a.toml")
    assert found["a"] == brackets and found["b"] == '"' + brackets and found["d"] == [[1], [[[2]]]]


@pytest.mark.parametrize("text", ['"\\' * 100_000, "'" + "''a" * 100_000, '["' * 100_000, "[#" * 100_000])
def test_texts_without_end_are_refused_at_once(text):
    start = time.process_time()
    with pytest.raises(InputError, match="not a TOML file"):
        parse_toml("x = " + text, "a.toml")
    assert time.process_time() - start < 5.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("repeat = 2", "repeat = 100000000"), "are too many"),
        (("repeat = 2", f"repeat = {'9' * 400}"), "an integer of 400 digits"),
        (("interval_s = 0.5", "interval_s = 1e-300"), "rows are too many"),
        (("duration_s = 40.0", f"duration_s = {'9' * 400}"), "an integer of 400 digits"),
    ],
)
def test_a_protocol_without_end_is_refused(tmp_path, change, words):
    text = 'schema = "pneusma-protocol/1"\ninterval_s = 0.5\nrepeat = 2\n[start]\npressure_kPa = 20.0\nxi0_2 = 1.0\n'
    text += "[[step]]\nduration_s = 40.0\nxi0_2 = 0.4\n"
    (tmp_path / "long.toml").write_text(text.replace(*change))
    with pytest.raises(InputError, match=words):
        load_protocol(tmp_path / "long.toml")
