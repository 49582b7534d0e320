import pytest

from fitting.recordings import recordings_folder


@pytest.fixture
def measured():
    """Finds a raw file of the measured recordings, or skips."""

    def find(name):
        folder = recordings_folder()
        if folder is None or not (folder / name).exists():
            pytest.skip(f"measured recordings are not here: {name} (PNEUSMA_RECORDINGS, or ../shared/recordings)")
        return folder / name

    return find


@pytest.fixture
def put(tmp_path):
    """Writes a raw file of its own making and returns its path."""

    def write(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8"))
        return path

    return write


@pytest.fixture
def put_sheet(tmp_path):
    """Writes rows as an Excel workbook."""
    import openpyxl

    def write(name, rows):
        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(list(row))
        book.save(tmp_path / name)
        return tmp_path / name

    return write
