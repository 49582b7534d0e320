"""Binary files carry a digest: damage is told before a library of others reads them, and others still read them."""

import io

import h5py
import numpy as np
import pytest
from binary_files import binary_mutation, kinds, without_seal

from fitting.data import hdf5
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
