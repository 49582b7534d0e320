"""Workbooks of other formats than .xlsx: read where the library is there, refused in one line where it is not."""

import base64
import io
import zipfile
import zlib

import numpy as np
import pytest

from fitting.data.importers import import_file, import_tests, left_in_folders, make_options, raw
from fitting.data.importers import other_workbooks as other
from pneusma_jax.errors import InputError

STRAIN = 0.05 * np.arange(20)
STRESS = 10.0 * ((1.0 + STRAIN) - (1.0 + STRAIN) ** -2)  # kPa
XLS = zlib.decompress(base64.b64decode(  # a sheet of 20 rows, and a hidden one of a note
    "eNrtmFtsVEUYx785e/bavXcLUkhzqKHu9iItGG2a0FMwUoLSFGhSFRO6tRvTFLayuyaiJkWwT8ZgogkRLwmBxJg0BV8sBjSUBzQpWiPGBgjalv"
    "ii8cEgxMS2h5n/2R0LzANNtAGz32b+Z87M/M439zl7vhuPTB75tHyKbrNmctCc5SXXvDTGg7dwEyaeb1kiWrh6eLCKdl+Z18MH0uWkU4HzbjGG"
    "YrynSKMT+ihXomkenqMXqa0/nTIW0TagDkkm6rCO6XzuafQBD0FahnpFoc9DS6HHUfY0tAUpb0HX8bKT7FkaN9uqG/Pz+GmtEnlBroxGwFxCSg"
    "OV0ddiHg+8zeyyTlqf6U3uujczKnQ/HSM+cq2pdCqT3DVJMT6Ex+i6ZRD9WVirZ4xi+uKmM+Lpf92a7lakv6PpRPvI6mJiIg5SgG44RI6Ttr2U"
    "NhpEAvns8W7rz6WyM2QSJxD4dtvRuztlxLMJXmR7LpPsTRvxuoQfN6ls1oj3tScT/AkdqWwu1WN07zXW9yR9YhfHqg/fsuoDWAt+rj0UQjyCFR"
    "HmjmY++eP7Ld3t5k6k7MNOb58Hq0QDyKLXBcHhIHLKoKIl1SBqoPvx1OWIl0NjvF38WtVelo9sPIAybyC3ivtZC7tgPjQvHufxwd+2nqwYvGom"
    "eHy4deqV2PCEeYQq+fnUw3nxO0C1rJYdfk/Y52bhyvI7xxXosjt2EY8Wztfdyh96IZoVQ8AtArXvRO8weafl+0rQ7Db6C3oAaXaJ+aqhvHZH+W"
    "i+jAu6FN4cmtirhJ+vJj56Jjp5wxSsQ8E6QPmgNZJ1gP32b6sxOe1sEayuYHVQQagpWR3s+9N7ttbtD4F1KlgnqCh0u2SdYH/p9g9dbYyBdSn6"
    "x27pEugL0De9hf5xK3y5UaYc+qr05Yavy2uf1H7oWAFfHgXrAVUBPShZD9gdh3esHHIZYL0K1guqEnpUsl6wjU89sml0bCVYn4K1R6QKOiJZH9"
    "hDncMj37z2INgSBVsCqho6JtkSsJkG1497VqwC61ewflAPQ3+WrB/s7JcD16aHqsAGFGwA1BroNckGwMLq42CDCtaeRY9C3azABsE2nT+0tOvj"
    "BNiQgg2BaoIul2wI7O+brn+4M1YDNqxgw6CaoaslGwY7WHllPPFyLdiIgo2A2gB9XLIRsGsOzoyeuVAHNqpg7Zm/Edop2SjYE+cu5vT4arClCr"
    "YU1GZon2RLwXaN1UxcbqoHG1OwMVBt0AHJxsD++m7rY2d/qm9p1qL0mdhU+JvRP7YYJwGTer+eBEx5EohdFr1Kql4tWtGKVrR73xjeQ+13dR1/"
    "POwzwJ3/rjPLw1zxM8n/1rZRP//l+N/SJyjNrxnau6D5s4ScrPAsdpdM4XuhsE7uPUN91I169C14/vIznM1vz12D4X9vCS3U/9xC6vkf+78Jii"
    "VvUg=="
))
READ = pytest.mark.skipif(not other.is_read(), reason="python-calamine is not installed")
SPACES = " ".join(
    f'xmlns:{name}="urn:oasis:names:tc:opendocument:xmlns:{name}:1.0"' for name in ("office", "table", "text", "style")
)


def ods(rows: str, mimetype: str = "application/vnd.oasis.opendocument.spreadsheet") -> bytes:
    """A workbook of OpenDocument with one sheet."""
    body = f'<office:spreadsheet><table:table table:name="Run 1">{rows}</table:table></office:spreadsheet>'
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        new.writestr("mimetype", mimetype, zipfile.ZIP_STORED)
        new.writestr("content.xml", f'<office:document-content {SPACES} office:version="1.2"><office:body>{body}</office:body></office:document-content>')
        manifest = "urn:oasis:names:tc:opendocument:xmlns:manifest:1.0"
        new.writestr("META-INF/manifest.xml", f'<manifest:manifest xmlns:manifest="{manifest}"/>')
    return made.getvalue()


def row(*cells: float | str, repeated: str = "") -> str:
    def cell(value):
        if isinstance(value, str):
            return f'<table:table-cell office:value-type="string"><text:p>{value}</text:p></table:table-cell>'
        return f'<table:table-cell office:value-type="float" office:value="{value}" {repeated}/>'

    return f"<table:table-row>{''.join(map(cell, cells))}</table:table-row>"


TABLE = row("Time (s)", "Strain (-)", "Stress (kPa)") + "".join(
    row(float(k), round(e, 6), round(s, 6)) for k, (e, s) in enumerate(zip(STRAIN, STRESS, strict=True))
)


@READ
@pytest.mark.parametrize(("name", "content"), [("a.xls", XLS), ("a.ods", ods(TABLE)), ("a.dat", ods(TABLE))])
def test_a_workbook_is_read_by_what_it_is_and_its_formats_are_asked_about(tmp_path, name, content):
    (tmp_path / name).write_bytes(content)
    recording = import_file(tmp_path / name, make_options(kind="elastomer"))
    np.testing.assert_allclose(recording.columns["strain"], STRAIN, atol=1e-6)
    np.testing.assert_allclose(recording.columns["stress_kPa"], STRESS, atol=1e-5)
    notes = recording.source["notes"]
    assert any("check: number formats of" in note and "shows 5 % is taken as 0.05" in note for note in notes)
    assert content is not XLS or any("'Notes' holds no table" in note for note in notes)


def test_a_workbook_that_was_packed_again_in_another_order_is_known():
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(ods(TABLE))) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        for name in sorted(old.namelist()):
            new.writestr(name, old.read(name))
    content = made.getvalue()
    assert other.other_workbook(content) == ".ods" and not content[30:].startswith(b"mimetype")
    cut = bytearray(content)
    place = content.index(b"PK\x01\x02")
    start = content.index(b"mimetype", 0, place) + len("mimetype")
    cut[start : start + 8] = bytes(8)  # what is packed there is damaged
    assert other.other_workbook(bytes(cut)) == ""


@READ
def test_a_folder_names_none_of_them_as_left_out(tmp_path):
    (tmp_path / "a.xls").write_bytes(XLS)
    assert len(import_tests(tmp_path / "a.xls", make_options(kind="elastomer"))) == 1
    assert left_in_folders([tmp_path]) == []


@pytest.mark.parametrize(("name", "content"), [("a.xls", XLS), ("a.ods", ods(TABLE))])
def test_without_the_library_the_refusal_says_what_to_do(tmp_path, monkeypatch, name, content):
    monkeypatch.setattr(other, "is_read", lambda: False)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError) as refused:
        import_tests(tmp_path / name)
    assert f"workbook in the format {name[1:]}; save it as .xlsx or .csv, or pip install" in str(refused.value)


@READ
def test_a_packed_workbook_beyond_the_limit_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    monkeypatch.setattr(raw, "MOST_UNPACKED", 2**20)
    (tmp_path / "bomb.ods").write_bytes(ods(TABLE + "<!--" + " " * (6 * 2**20) + "-->"))
    with pytest.raises(InputError, match="unpacks to 6 MiB"):
        import_tests(tmp_path / "bomb.ods")


@READ
@pytest.mark.parametrize(("columns", "said"), [(64, "takes too long or too much memory"), (16384, "not an .ods workbook|too much memory")])
def test_a_cell_that_is_repeated_millions_of_times_is_refused(tmp_path, columns, said):
    """A process of its own runs out of time or memory. Beyond that the library refuses."""
    cells = row(1.0, repeated=f'table:number-columns-repeated="{columns}"').removeprefix("<table:table-row>")
    many = f'<table:table-row table:number-rows-repeated="1048576">{cells}'
    content = ods(TABLE + many)
    assert len(content) < 2**12
    (tmp_path / "bomb.ods").write_bytes(content)
    with pytest.raises(InputError, match=said) as refused:
        import_tests(tmp_path / "bomb.ods")
    assert "\n" not in str(refused.value)


@READ
@pytest.mark.parametrize("content", [XLS[:3000], XLS[:512] + bytes(5000), ods("<table:table-row>"), ods("")])
def test_a_damaged_or_empty_workbook_is_refused_in_one_line(tmp_path, content):
    (tmp_path / "a.xls").write_bytes(content)
    with pytest.raises(InputError) as refused:
        import_tests(tmp_path / "a.xls", make_options(kind="elastomer"))
    assert "workbook" in str(refused.value) and "\n" not in str(refused.value)
