"""A file is there whole or not at all."""

import os

import pytest

from pneusma_jax.errors import InputError
from pneusma_jax.files import replacing, write_whole


def test_a_file_is_written_and_replaced(tmp_path):
    assert write_whole(tmp_path / "a.txt", "ü\n").read_bytes() == "ü\n".encode()
    assert write_whole(tmp_path / "a.txt", b"\x00\r\n").read_bytes() == b"\x00\r\n"
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]


def test_an_error_half_way_leaves_the_old_file_and_no_draft(tmp_path):
    path = write_whole(tmp_path / "a.txt", "old")
    with pytest.raises(RuntimeError, match="half way"), replacing(path) as draft:
        draft.write_text("ne")
        raise RuntimeError("half way")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_disk_that_refuses_is_one_line(tmp_path, monkeypatch):
    path = write_whole(tmp_path / "a.txt", "old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(InputError, match=r"a.txt: cannot be written here \(No space left on device\)"):
        write_whole(path, "new")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("place", ["no_such_folder/a.txt", "file/a.txt"])
def test_a_place_where_no_file_can_be_is_named(tmp_path, place):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="a.txt: cannot be written here"):
        write_whole(tmp_path / place, "new")
    assert (tmp_path / "file").read_text() == "mine"
