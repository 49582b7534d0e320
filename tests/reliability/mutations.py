"""Files that were damaged by chance, each reproducible from its seed."""

import io
import zipfile
from pathlib import Path

import numpy as np
import openpyxl

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "calibration_data"

ODD_FIELDS = (
    "", " ", "nan", "NaN", "inf", "-inf", "1e400", "-1e-400", "0x10", "1_000", "1,5", "1.2.3", "--3", "١٢", "∞", "'",
    '"', '"1', "=1+1", "9" * 400, "1e308", "-0.0", "true", "null", "\x00", "\ufeff", "é", "🙂", "a" * 3000, "#", "[", "}",
)  # fmt: skip
ODD_BYTES = (b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", b"\xe9", b"\r", b"\n\n\n", b"\x1a", b"\xc3", b"\t", b";")
DEEP_NESTS = (
    b"x = " + b"[" * 3000 + b"]" * 3000 + b"\n",
    b"x = " + b"{a=" * 3000 + b"1" + b"}" * 3000 + b"\n",
)


def text_mutation(rng: np.random.Generator, content: bytes) -> bytes:
    """One of a dozen kinds of damage to a text file."""
    lines = content.split(b"\n")
    kind = int(rng.integers(14))
    at = int(rng.integers(max(len(content), 1)))
    row, other = (int(rng.integers(len(lines))) for _ in range(2))
    if kind == 0:  # a byte is another
        return content[:at] + bytes([int(rng.integers(256))]) + content[at + 1 :]
    if kind == 1:  # cut off
        return content[:at]
    if kind == 2:  # a line is missing
        return b"\n".join(lines[:row] + lines[row + 1 :])
    if kind == 3:  # a line is there twice
        return b"\n".join(lines[: row + 1] + lines[row:])
    if kind == 4:  # two lines have changed places
        lines[row], lines[other] = lines[other], lines[row]
        return b"\n".join(lines)
    if kind in (5, 6, 7):  # a field is odd
        return b"\n".join([*lines[:row], _odd_field(rng, lines[row]), *lines[row + 1 :]])
    if kind == 8:  # odd bytes between others
        return content[:at] + ODD_BYTES[int(rng.integers(len(ODD_BYTES)))] + content[at:]
    if kind == 9:  # another code
        return content.decode("utf-8", "replace").encode(("utf-16", "utf-32", "cp500")[int(rng.integers(3))])
    if kind == 10:  # another delimiter
        return content.replace(b",", (b";", b"\t", b" ", b",,")[int(rng.integers(4))])
    if kind == 11:  # nothing, or no more than blanks
        return (b"", b"\n", b"   \n\t\n", b"\xef\xbb\xbf")[int(rng.integers(4))]
    if kind == 12:  # nested deeply
        return content + DEEP_NESTS[int(rng.integers(2))]
    return content.replace(b"\n", b"\r\n" if rng.random() < 0.5 else b"\r")


def _odd_field(rng: np.random.Generator, line: bytes) -> bytes:
    """A line, one field of which is odd: between commas in a table, after the sign of equality in TOML."""
    odd = ODD_FIELDS[int(rng.integers(len(ODD_FIELDS)))].encode("utf-8", "surrogatepass")
    if b"=" in line:
        return line.split(b"=")[0] + b"= " + odd
    fields = line.split(b",")
    fields[int(rng.integers(len(fields)))] = odd
    return b",".join(fields)


def workbook(rng: np.random.Generator) -> bytes:
    """A small workbook with a pull of a silicone; a share of its cells are odd."""
    book = openpyxl.Workbook()
    sheet = book.active
    sheet.append(["Time (s)", "Strain (%)", "Stress (kPa)"])
    odd = rng.random() < 0.5
    for k in range(12):
        row = [0.5 * k, 2.0 * k, 3.0 * k]
        if odd and rng.random() < 0.1:
            text = ODD_FIELDS[int(rng.integers(len(ODD_FIELDS)))]
            row[int(rng.integers(3))] = "".join(c for c in text if c.isprintable())
        sheet.append(row)
    made = io.BytesIO()
    book.save(made)
    return made.getvalue()


def workbook_mutation(rng: np.random.Generator, content: bytes) -> bytes:
    """A workbook whose container, or one of whose parts, is damaged."""
    kind = int(rng.integers(4))
    at = int(rng.integers(len(content)))
    if kind == 0:
        return content[:at]
    if kind == 1:
        return content[:at] + bytes([int(rng.integers(256))]) + content[at + 1 :]
    made = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as new:
        names = old.namelist()
        victim = names[int(rng.integers(len(names)))]
        for name in names:
            part = old.read(name)
            if name == victim:
                if kind == 2:
                    continue
                part = text_mutation(rng, part)
            new.writestr(name, part)
    return made.getvalue()
