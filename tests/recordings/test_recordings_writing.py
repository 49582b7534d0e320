"""What is written reads back equal, whole or not at all."""

import dataclasses

import numpy as np
import pytest

from fitting.data.recordings import read_campaign, read_recording, write_recording, write_recordings
from pneusma_jax.errors import InputError


def assert_equal(one, two):
    for field in dataclasses.fields(one):
        if field.name not in ("path", "columns", "name"):
            assert getattr(one, field.name) == getattr(two, field.name), field.name
    assert list(one.columns) == list(two.columns)
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, two.columns[name])


def test_every_example_survives_the_round_trip_to_the_bit(examples, tmp_path):
    count = 0
    for folder in sorted(examples.iterdir()):
        for recording in read_campaign(folder).recordings:
            written = write_recording(recording, tmp_path / folder.name)
            assert_equal(recording, read_recording(written))
            assert written.read_text() == recording.path.read_text()
            count += 1
    assert count == 13


def test_missing_samples_text_columns_comments_and_source_survive(make, tmp_path):
    columns = make().columns
    columns["stress_kPa"][1] = np.nan
    columns["strain"][2] = 0.1 + 0.2
    columns["remark"] = np.array(["", 'says "no", twice', "ok"])
    recording = make(
        columns=columns, comments=["room at 21 degC"], real=True, role="validation",
        source={"licence": "CC BY 4.0", "notes": ["one", "two"], "bench": 3},
        noise={"stress_kPa": 0.25}, geometry={"material": "fit", "law": "yeoh"}, tolerance={},
    )  # fmt: skip
    again = read_recording(write_recording(recording, tmp_path))
    recording.notices = again.notices
    assert_equal(recording, again)
    assert again.columns["strain"][2] == 0.1 + 0.2


def test_converted_units_are_written_canonically(put, tmp_path):
    path = put("time_ms,strain_percent,stress_MPa\n0,0,0\n500,10,0.005\n", 'kind = "elastomer"\nspecimen = "E"\n')
    again = write_recording(read_recording(path), tmp_path / "out")
    assert again.read_text() == "time_s,strain,stress_kPa\n0,0,0\n0.5,0.1,5\n"


def test_relative_tables_still_lead_to_the_same_file(put, tmp_path):
    import shutil
    from importlib import resources

    shutil.copy(str(resources.files("calibration_data") / "krl45.toml"), tmp_path / "ours.toml")
    path = put(
        "time_s,elongation_mm,force_N,resistance_ohm\n0,0,0,3.7\n",
        'kind="spring"\nspecimen="S"\n[geometry]\nalloy = "ours.toml"\n',
    )
    again = read_recording(write_recording(read_recording(path), tmp_path / "a" / "b"))
    assert again.geometry["alloy"] == "../../ours.toml"
    assert again.table("alloy").resolve() == (tmp_path / "ours.toml").resolve()


def test_names_with_folders_and_names_that_leave(make, tmp_path):
    assert write_recording(make(name="hot/pull_1"), tmp_path) == tmp_path / "hot" / "pull_1.csv"
    for name in ("../pull", "/pull", "a/../../pull", "", "a\\b"):
        with pytest.raises(InputError, match="cannot be the name of a file"):
            write_recording(make(name=name), tmp_path / "inside")
    assert not (tmp_path / "inside").exists()


def test_an_unusable_recording_is_not_written(make, tmp_path):
    backwards = make(columns=make().columns | {"time_s": np.array([0.0, 2.0, 1.0])})
    with pytest.raises(InputError, match="pull, row 3, column time_s: time goes backwards"):
        write_recording(backwards, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_files_in_the_way_are_kept_unless_told_otherwise(make, tmp_path):
    path = write_recording(make(), tmp_path)
    before = path.read_text()
    changed = make(columns=make().columns | {"stress_kPa": np.array([0.0, 1.0, 2.0])})
    with pytest.raises(InputError, match=r"pull\.csv: this file is already there"):
        write_recording(changed, tmp_path, force=False)
    assert path.read_text() == before
    write_recording(changed, tmp_path, force=True)
    assert path.read_text() != before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["pull.csv", "pull.toml"]


def test_of_several_recordings_none_is_written_where_one_cannot_be(make, tmp_path):
    backwards = make(name="b", columns=make().columns | {"time_s": np.array([0.0, 2.0, 1.0])})
    with pytest.raises(InputError, match="time goes backwards"):
        write_recordings([make(name="a"), backwards], tmp_path)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match=r"a\.\w+: two recordings have this name"):
        write_recordings([make(name="a"), make(name="a")], tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert [p.name for p in write_recordings([make(name="a"), make(name="b")], tmp_path)] == ["a.csv", "b.csv"]
    with pytest.raises(InputError, match=r"b\.csv: this file is already there"):
        write_recordings([make(name="c"), make(name="b")], tmp_path, force=False)
    assert not (tmp_path / "c.csv").exists()


def test_nothing_is_left_behind_when_writing_fails(make, tmp_path, monkeypatch):
    import os

    def fail(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(InputError, match="cannot be written here"):
        write_recording(make(), tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_strain_whose_unit_would_be_asked_for_is_written_with_it(put, tmp_path):
    path = put("time_s,strain_mm/mm,stress_kPa\n0,0,0\n1,60,5\n", 'kind = "elastomer"\nspecimen = "E"\n')
    recording = read_recording(path)
    again = write_recording(recording, tmp_path / "out")
    assert again.read_text().startswith("time_s,strain_mm/mm,stress_kPa\n")
    np.testing.assert_array_equal(read_recording(again).columns["strain"], [0.0, 60.0])
