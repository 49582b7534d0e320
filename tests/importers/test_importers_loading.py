"""Mode of loading: only what states how the specimen was loaded turns its sign; anything else is asked about."""

import numpy as np
import pytest

from fitting.data.importers import import_file, make_options
from fitting.data.importers.mode_of_loading import compression_in

STRAIN = np.linspace(0.0, 0.6, 30)
STRESS = 110.0 * (1.0 + STRAIN - (1.0 + STRAIN) ** -2)


def pull(put, *above, heads="Strain (%);Stress (kPa)"):
    rows = [f"{100 * e:.4f};{s:.4f}" for e, s in zip(STRAIN, STRESS, strict=True)]
    return put("a.csv", "\n".join([*above, heads, *rows, ""]))


def asked(recording):
    return [note for note in recording.notices if note.startswith("check:") and "speaks of compression" in note]


MACHINES = [
    "Load cell: 2 kN (tension and compression)", "Kraftaufnehmer;Zug/Druck;compression 10 kN", "Frame;compression testing machine",
    "Sensor range;1 kN in compression or tension", "Crosshead limit (compression);-5;mm", "Spring-loaded compression fixture",
]  # fmt: skip
OTHERS = [
    "Grips;compressed air, 6 bar", "Video compression;H.264", "Data compression: lossless", "Compression;none",
    "Compressor pressure;6 bar", "Export;zip;file compression on", "Compliance correction;no compression",
]  # fmt: skip
STATED = [
    "Test type;Compression", "Compression test of a silicone cylinder", "Mode: uniaxial compression", "Druckversuch DIN 53454",
    "Method;ISO 7743 compression platens, 1 kN load cell", "Essai de compression", "Cyclic compression to 60 %", "Description;foam in compression",
]  # fmt: skip


@pytest.mark.parametrize("line", MACHINES)
def test_the_name_of_a_machine_turns_nothing_and_is_asked_about(put, line):
    recording = import_file(pull(put, line))
    assert recording.columns["strain"].max() == pytest.approx(0.6) and len(asked(recording)) == 1
    assert "--compression" in asked(recording)[0]
    pressed = import_file(recording.path, make_options(compression=True))
    assert pressed.columns["strain"].min() == pytest.approx(-0.6) and not asked(pressed)


@pytest.mark.parametrize("line", OTHERS)
def test_air_and_files_are_compressed_without_a_word(put, line):
    recording = import_file(pull(put, line))
    assert recording.columns["strain"].max() == pytest.approx(0.6) and not asked(recording)


@pytest.mark.parametrize("line", STATED)
def test_a_stated_test_of_compression_becomes_negative(put, line):
    recording = import_file(pull(put, "Operator;Ada", line))
    assert recording.columns["strain"].min() == pytest.approx(-0.6) and recording.columns["stress_kPa"].min() < -100.0
    assert any("turned negative, because the file speaks of compression" in note for note in recording.notices)


@pytest.mark.parametrize("tests", ["Test type;Tensile", "Prüfart;Zugversuch", "Method: tension to 60 %"])
def test_a_stated_pull_needs_no_question_about_the_machine(put, tests):
    recording = import_file(pull(put, MACHINES[0], tests))
    assert recording.columns["strain"].max() == pytest.approx(0.6) and not asked(recording)


def test_a_heading_states_it_whatever_the_machine(put):
    recording = import_file(pull(put, MACHINES[0], heads="Compressive strain (%);Compressive stress (kPa)"))
    assert recording.columns["strain"].min() == pytest.approx(-0.6)


def test_a_sheet_states_it(put_sheet):
    rows = [[float(100 * e), float(s)] for e, s in zip(STRAIN, STRESS, strict=True)]
    head = ["Strain (%)", "Stress (kPa)"]
    for name, sign in (("Compression", -1.0), ("Tension and compression", 1.0), ("Run 1", 1.0)):
        recording = import_file(put_sheet("a.xlsx", {name: [head, *rows]}))
        assert np.sign(recording.columns["strain"].sum()) == sign


def test_lines_without_the_word_say_nothing():
    assert compression_in([["Test type", "Tensile"], [""], ["Load cell", "5 kN"]]) == ([], "")
