"""Files of MATLAB and HDF5: vectors of one length are a table, structures are sheets, and nothing is dropped in silence."""

import io

import h5py
import numpy as np
import pytest
import scipy.io
from answers import checks, refusal

from fitting.data import first_reading
from fitting.data.importers import import_file, import_tests, make_options, matlab, raw_files
from fitting.data.importers.matlab import _plain, _sheets, sheets_of
from pneusma_jax.errors import InputError

T = np.arange(40.0) / 8.0
PULL = {"Time_s": T, "extension_mm": 0.3 * T, "force_N": 0.07 * T + 1e-3}
SIZES = {"gauge_length_mm": 20.0, "area_mm2": 4.0}


@pytest.fixture
def write(tmp_path):
    """Writes variables as a file of MATLAB."""

    def written(variables, **options):
        path = tmp_path / "a.mat"
        scipy.io.savemat(path, variables, **options)
        return path

    return written


@pytest.fixture
def save(write, monkeypatch):
    """The same of a file that is whole: no process reads it first, which takes 0.35 s."""
    monkeypatch.setattr(matlab, "fault_of_reading", lambda *_: "")
    return write


def is_the_pull(recording):
    np.testing.assert_array_equal(recording.columns["time_s"], T)
    np.testing.assert_allclose(recording.columns["strain"], 0.3 * T / 20.0, rtol=1e-14)
    np.testing.assert_allclose(recording.columns["stress_kPa"], (0.07 * T + 1e-3) / 4.0 * 1e3, rtol=1e-14)


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("upright", ["row", "column"])
def test_vectors_of_one_length_and_single_numbers_are_a_table_and_its_sizes(save, packed, upright):
    path = save(PULL | SIZES | {"operator": "A. B."}, do_compression=packed, oned_as=upright)
    recording = import_file(path, make_options())
    is_the_pull(recording)
    assert any("the gauge length is 20 mm, as the file states" in note for note in recording.notices)
    assert any("operator A. B." in note for note in recording.notices)
    assert any(note == "40 rows of 3 columns, in cells of a sheet" for note in recording.notices)
    assert not checks(recording)


def test_every_structure_is_a_test_of_its_own(save):
    path = save({"slow": PULL | SIZES, "fast": {name: x[:30] if np.ndim(x) else x for name, x in PULL.items()} | SIZES})
    slow, fast = import_tests(path, make_options())
    is_the_pull(slow)
    assert len(fast) == 30
    assert len(import_file(path, make_options(sheet="fast"))) == 30


@pytest.mark.parametrize(
    "around",
    [
        {"data": PULL, "specimen": SIZES | {"name": "EF30-07"}, "date": "2026-11-13"},
        {"data": PULL} | SIZES | {"specimen": {"name": "EF30-07"}, "date": "2026-11-13"},
        {"test": {"data": PULL, "specimen": SIZES | {"name": "EF30-07"}}, "date": "2026-11-13"},
    ],
    ids=["beside", "around", "nested"],
)
def test_sizes_in_structures_beside_and_around_a_table_are_its_own(save, around):
    recording = import_file(save(around), make_options())
    is_the_pull(recording)
    assert any("the gauge length is 20 mm, as the file states" in note for note in recording.notices)
    assert any("EF30-07" in note for note in recording.notices)
    assert any("2026-11-13" in note for note in recording.notices)
    assert not checks(recording)


def test_each_test_in_a_file_keeps_the_sizes_beside_its_table(save):
    thick = {"gauge_length_mm": 20.0, "area_mm2": 8.0}
    tests = {"one": {"data": PULL, "specimen": SIZES}, "two": {"data": PULL, "specimen": thick}}
    one, two = import_tests(save(tests), make_options())
    is_the_pull(one)
    np.testing.assert_allclose(two.columns["stress_kPa"], one.columns["stress_kPa"] / 2.0, rtol=1e-14)


def test_sizes_that_two_structures_state_differently_are_asked_for(save):
    tests = {"data": PULL, "old": SIZES, "new": SIZES | {"area_mm2": 8.0}}
    told = refusal(save(tests))
    assert "old area_mm2" in told and "new area_mm2" in told


def test_a_structure_with_time_of_simulink_is_one_table(save):
    signals = np.array([{"values": 5.0 * T, "label": "pressure_kPa"}, {"values": 3.0 * T, "label": "bend_angle_deg"}])
    recording = import_file(save({"Data": {"time": T, "signals": signals, "blockName": "a/b"}}), make_options(units=["time=s"]))
    np.testing.assert_allclose(recording.columns["pressure_kPa"], 5.0 * T, rtol=1e-14)
    np.testing.assert_allclose(recording.columns["bend_angle_deg"], 3.0 * T, rtol=1e-14)


def test_a_matrix_takes_its_names_from_the_list_beside_it_and_else_has_none(save):
    data = np.stack([T, 0.05 * T, 90.0 * T], axis=1)
    names = np.array(["Time (s)", "Strain (-)", "Stress (kPa)"], dtype=object)
    recording = import_file(save({"data": data, "names": names}), make_options())
    np.testing.assert_allclose(recording.columns["strain"], 0.05 * T, rtol=1e-14)
    assert [note for note in checks(recording) if "the columns of 'data' were named by a list" in note]
    named = make_options(columns=["time=1", "strain=2", "stress=3"], units=["time=s", "stress=kPa"])
    turned = import_file(save({"data": data.T}), named)
    np.testing.assert_allclose(turned.columns["strain"], 0.05 * T, rtol=1e-14)


def test_what_becomes_no_column_is_told(save):
    path = save(PULL | SIZES | {"limits": [1.0, 2.0], "cube": np.zeros((3, 3, 3)), "wave": T + 2j, "empty": []})
    said = "\n".join(checks(import_file(path, make_options())))
    for words in ("'limits' has 2 numbers only", "'cube' was left out: it has 3 dimensions", "'wave' was left out: its numbers are complex"):
        assert words in said
    assert "no vectors of at least 3 numbers ('limits' has 2 numbers only" in refusal(save({"limits": [1.0, 2.0]}))


def told_of(path):
    """Cells of the first table, and remarks of a file."""
    first, *_ = sheets_of(path, path.read_bytes())
    return first.rows, "\n".join(first.remarks)


def test_nothing_beside_the_signals_of_simulink_is_dropped_in_silence(save):
    """A vector beside `signals`, and a signal of three dimensions, were in no table and no remark."""
    signals = np.array([{"values": 5.0 * T, "label": "time"}, {"values": np.zeros((40, 2, 3)), "label": "frames"}])
    rows, said = told_of(save({"log": {"time": T, "signals": signals, "strain": 0.05 * T}}))
    assert rows[0] == ["time", "time 1", "strain"] and len(rows) == 41
    assert "of 'log', signal 'frames' was left out: it has 3 dimensions" in said


def test_texts_beside_the_rows_are_told(save):
    states = np.array(["hold", "pull"] * 20, dtype=object)
    names = np.array(["a", "b", "c"], dtype=object)
    _, said = told_of(save({**PULL, "state": states, "data": np.zeros((40, 3)), "names": names}))
    assert "'state' was left out: it holds 40 texts" in said and "'names' was left out" not in said


def test_cells_that_only_matlab_reads_are_told():
    found = {"time": T[:, None], "parts": [np.zeros((40, 1)), _plain(scipy.io.matlab.MatlabOpaque(np.zeros(1, dtype=[("s0", "O")])), 0)]}
    unread = []
    assert len(list(_sheets(found, "", unread, 0))) == 2
    assert unread == ["'parts(2)' was left out: it is a table or another object, which only MATLAB reads"]


def test_units_in_lists_and_truth_values_of_an_hdf5_file_are_read(tmp_path):
    """The heading of a list of one unit was "force (['N'])", and truth values were words."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, unit in (("force", ["N"]), ("time", np.array([b"s"])), ("length", ["mm", "m"])):
            file.create_dataset(name, data=T).attrs["units"] = unit
        file["closed"] = T > 2.0
    rows, _ = told_of(tmp_path / "a.h5")
    assert rows[0] == ["closed", "force (N)", "length", "time (s)"]
    assert rows[1][0] == "0" and rows[-1][0] == "1"


def test_a_group_that_stands_in_itself_is_read_once(tmp_path):
    """It was read twenty times, and two such groups in each other a million times."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        group = file.create_group("g")
        group["time"] = T
        for name in ("up", "again", "more"):
            group[name] = file["/"] if name == "up" else group
    sheets = sheets_of(tmp_path / "a.h5", (tmp_path / "a.h5").read_bytes())
    assert [sheet.name for sheet in sheets] == ["g"]
    assert "'g.more' was left out: it is another name of a group that was read" in "\n".join(sheets[0].remarks)


def test_an_object_of_matlab_is_named_with_the_command_that_writes_it():
    held = scipy.io.matlab.MatlabOpaque(np.zeros(1, dtype=[("s0", "O"), ("arr", "O")]))
    assert "only MATLAB reads" in _plain(held, 0).what
    content = io.BytesIO()
    scipy.io.savemat(content, {"n": 3.0})
    with pytest.raises(InputError, match="writetable"):
        sheets_of("a.mat", content.getvalue())


def test_names_that_capitals_divide_are_read(save):
    path = save({"Time": T, "EnggStrain": 0.05 * T, "EnggStress": 90.0 * T})
    recording = import_file(path, make_options(units=["time=s", "stress=kPa"]))
    np.testing.assert_allclose(recording.columns["strain"], 0.05 * T, rtol=1e-14)


def of_7_3(path, variables):
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            if isinstance(value, str):
                item = file.create_dataset(name, data=np.array([[ord(c)] for c in value], dtype=np.uint16))
                item.attrs["MATLAB_class"] = np.bytes_("char")
            else:
                item = file.create_dataset(name, data=np.atleast_2d(value))
                item.attrs["MATLAB_class"] = np.bytes_("double")
    content = bytearray(path.read_bytes())
    content[:34] = b"MATLAB 7.3 MAT-file, Platform: PC "
    path.write_bytes(bytes(content))
    return path


def test_a_file_of_matlab_7_3_is_read(tmp_path):
    recording = import_file(of_7_3(tmp_path / "a.mat", PULL | SIZES | {"operator": "A. B."}), make_options())
    is_the_pull(recording)
    assert any("operator A. B." in note for note in recording.notices)


def test_an_hdf5_file_is_read_with_the_units_of_its_attributes(tmp_path):
    with h5py.File(tmp_path / "log.h5", "w") as file:
        for name, unit, values in (("time", "s", T), ("strain", "%", 5.0 * T), ("stress", "kPa", 90.0 * T)):
            file.create_dataset(f"pull/{name}", data=values).attrs["units"] = unit
    recording = import_file(tmp_path / "log.h5", make_options())
    np.testing.assert_allclose(recording.columns["strain"], 0.05 * T, rtol=1e-14)
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["log"] = np.array(list(zip(T, 0.05 * T, 90.0 * T, strict=True)), dtype=[("time_s", "f8"), ("strain", "f8"), ("stress_kPa", "f8")])
    np.testing.assert_array_equal(import_file(tmp_path / "b.h5", make_options()).columns["stress_kPa"], 90.0 * T)


def test_single_precision_is_written_with_the_digits_that_it_has(save):
    values = np.float32(0.1) * np.arange(12, dtype=np.float32)
    (sheet,) = sheets_of("a.mat", save({"a": values}).read_bytes())
    assert sheet.rows[2][0] == "0.1"


@pytest.mark.parametrize("seed", range(10))
def test_a_damaged_file_is_read_or_refused_in_one_line(write, seed):
    rng = np.random.default_rng(seed)
    path = write({"slow": PULL | SIZES}, do_compression=bool(seed % 2))
    content = bytearray(path.read_bytes())
    for at in rng.integers(128, len(content), 3):
        content[at] = int(rng.integers(256))
    path.write_bytes(bytes(content[: len(content) // 2] if seed == 9 else content))
    try:
        import_file(path, make_options())
    except InputError as error:
        assert "\n" not in str(error)


def test_a_file_that_a_first_reading_does_not_end_is_refused(write, monkeypatch, tmp_path):
    path = write(PULL | SIZES)
    is_the_pull(import_file(path, make_options()))
    (tmp_path / "reader.py").write_text("import sys\nprint('ready', flush=True)\nsys.exit(1)\n")
    monkeypatch.setattr(first_reading, "READER", tmp_path / "reader.py")
    assert "reading it takes too long or too much memory" in refusal(path)


def test_a_folder_leaves_a_file_of_settings_aside_and_imports_the_others(save, tmp_path):
    save({"gain": 3.0}).rename(tmp_path / "settings.mat")
    save(PULL | SIZES)
    wanted, aside = raw_files([tmp_path])
    assert [path.name for path in wanted] == ["a.mat"]
    assert [path.name for path in aside] == ["settings.mat"]
