"""Binary files carry a digest: damage is told before a library of others reads them, and others still read them."""

import io

import h5py
import numpy as np
import pytest
from binary_files import binary_mutation, kinds, without_seal

from fitting.data import first_reading, hdf5
from fitting.data.sealed import SEAL, check_seal, sealed
from pneusma_jax.errors import InputError


@pytest.fixture(scope="module")
def binary():
    return kinds()


def test_a_flipped_bit_anywhere_is_told_and_what_is_whole_passes():
    whole = sealed(bytes(range(200)))
    check_seal(whole, "a")
    for at in range(200):
        with pytest.raises(InputError, match="a: damaged or altered"):
            check_seal(whole[:at] + bytes([whole[at] ^ 4]) + whole[at + 1 :], "a")
    for none in (b"", b"short", whole[:-SEAL], bytes(500)):
        check_seal(none, "a")  # a file of others has no digest


def test_a_file_of_several_blocks_is_checked_to_its_end(tmp_path):
    content = bytearray(sealed(np.random.default_rng(0).bytes(3 * 2**20 + 7)))
    (tmp_path / "a").write_bytes(content)
    check_seal(tmp_path / "a", "a")
    content[3 * 2**20 + 5] ^= 1
    (tmp_path / "a").write_bytes(content)
    with pytest.raises(InputError, match="damaged or altered"):
        check_seal(tmp_path / "a", "a")


def test_other_software_reads_a_sealed_file_and_may_change_it(tmp_path):
    stream = io.BytesIO()
    with h5py.File(stream, "w") as file:
        file["numbers"] = np.arange(9.0)
    (tmp_path / "a.h5").write_bytes(sealed(stream.getvalue()))
    with h5py.File(tmp_path / "a.h5", "r+") as file:
        np.testing.assert_array_equal(file["numbers"][()], np.arange(9.0))
        file["numbers"][3] = 5.0
        file["more"] = np.arange(1000.0)
    with hdf5.opened(tmp_path / "a.h5", "a.h5", "a table") as file:
        assert file["numbers"][3] == 5.0 and file["more"][7] == 7.0


@pytest.mark.parametrize("name", ["posterior, for studies", "chunk of a study", "stored result"])
def test_damage_that_reaches_into_the_digest_is_told(binary, tmp_path, name):
    """The mark is gone, so the file looks like one without a digest; its bytes behind the content tell."""
    kind = binary[name]
    place, content, end = tmp_path / kind.name, kind.content, len(kind.content) - SEAL
    noise = np.random.default_rng(4).bytes(600)
    damages = {
        "noise": content[: end - 300] + noise[:305] + content[end + 5 :],
        "zeros": content[: end - 60] + bytes(60 + SEAL),
        "more": content[: end + 3] + noise[:50] + content[end + 3 :],
        "mark": content[: end + 4] + b"x" + content[end + 5 :],
        "cut": content[: end + 9],
        "missing": content[: end - 20] + content[end + 20 :],
    }
    for damage, damaged in damages.items():
        place.write_bytes(damaged)
        with pytest.raises(InputError) as refused:
            kind.read(place)
        assert "\n" not in str(refused.value), damage


@pytest.mark.parametrize("version", ["earliest", "v108", "v110"])
def test_a_file_of_others_is_as_long_as_it_states(tmp_path, version):
    with h5py.File(tmp_path / "a.h5", "w", libver=version) as file:
        file["numbers"] = np.arange(9.0)
    content = (tmp_path / "a.h5").read_bytes()
    with hdf5.opened(content, "a.h5", "a table") as file:
        assert file["numbers"][3] == 3.0
    for changed, words in (
        (content[:-1], "damaged, "),
        (content + b"x", "1 byte that is no digest follows its content"),
        (content + bytes(70), "70 bytes that are no digest follow its content"),
    ):
        with pytest.raises(InputError, match=f"^a.h5: .*{words}"), hdf5.opened(changed, "a.h5", "a table"):
            pass


def test_a_file_that_the_library_reads_without_end_is_refused(binary, tmp_path, monkeypatch):
    """One bit makes a text of the global heap longer than the heap. HDF5 2.0 looks for its end for ever."""
    monkeypatch.setattr(first_reading, "READ_S", 1.0)
    kind = binary["posterior, for studies"]
    damaged = bytearray(without_seal(kind.content))
    damaged[damaged.index(b"GCOL") + 48] ^= 128
    for source in (bytes(damaged), tmp_path / "posterior.nc"):
        (tmp_path / "posterior.nc").write_bytes(damaged)
        with pytest.raises(InputError, match=r"posterior.nc: .*\(reading it takes too long or too much memory\)"):
            with hdf5.opened(source, "posterior.nc", "a posterior"):
                raise AssertionError("the file was opened here")


def test_a_file_that_needs_more_memory_than_a_process_may_take_is_refused(tmp_path):
    """Its numbers were never written, so that it has a few kilobytes."""
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("numbers", (2**30,), "f8", chunks=(2**20,))
    with pytest.raises(InputError, match=r"^a.h5: .*\(reading it takes too long or too much memory\)"):
        with hdf5.opened(tmp_path / "a.h5", "a.h5", "a table"):
            raise AssertionError("the file was opened here")


def test_a_file_that_ends_the_process_is_refused(tmp_path, monkeypatch):
    (tmp_path / "reader.py").write_text("import os\nprint('ready', flush=True)\nos.abort()\n")
    monkeypatch.setattr(first_reading, "READER", tmp_path / "reader.py")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["numbers"] = np.arange(9.0)
    with pytest.raises(InputError, match="reading it ends the process that does"):
        with hdf5.opened(tmp_path / "a.h5", "a.h5", "a table"):
            pass


@pytest.mark.parametrize(
    "fault", [KeyError("x"), ValueError("a\nb"), RuntimeError("deep"), TypeError(), MemoryError()]
)
def test_any_fault_of_a_file_is_one_line(tmp_path, fault):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["numbers"] = np.arange(9.0)
    with pytest.raises(InputError, match=r"^a.h5: cannot be read as a table \(") as refused:
        with hdf5.opened(tmp_path / "a.h5", "a.h5", "a table", "; make another"):
            raise fault
    assert "\n" not in str(refused.value) and str(refused.value).endswith("; make another")


def test_every_binary_file_of_the_project_is_read_whole_and_refused_damaged(binary, tmp_path):
    for name, kind in binary.items():
        place = tmp_path / kind.name
        place.write_bytes(kind.content)
        assert all(np.asarray(values).size for values in kind.read(place)), name
        place.write_bytes(without_seal(kind.content))
        wanted = kind.read(place)
        rng = np.random.default_rng(5)
        for _ in range(12):
            damaged = binary_mutation(rng, kind.content)
            place.write_bytes(damaged)
            try:
                found = kind.read(place)
            except InputError as error:
                assert "\n" not in str(error), name
            else:
                assert all(map(np.array_equal, wanted, found)), name
