"""What a workbook shows beside the values of its cells: hidden rows and columns, struck cells, comments.

The cells are read by `openpyxl` in its read-only mode, which has no public way to any of them. Its other
mode has one. With it 100,000 rows of 5 columns take 270 MiB and 5.0 s, in place of 93 MiB and 3.8 s. So the
marks are read from the parts of the workbook, a zip archive of XML (ISO/IEC 29500-2), in 0.2 s more.
"""

import io
import posixpath
import re
import zipfile
from collections.abc import Sequence
from xml.etree import ElementTree

LISTED = 6
"""Number of rows, columns, cells or comments that a sentence names."""
_HIDDEN = re.compile(
    rb'<(?:\w+:)?(row|col) (?=[^>]*\b(?:hidden="(?:1|true)"|(?:ht|width)="0(?:\.0*)?"))([^>]*)>'
)
_STYLED = re.compile(rb'<(?:\w+:)?c (?=[^>]*\bs="(\d+)")[^>]*\br="([A-Z]+\d+)"')
_LONGEST_COMMENT = 60
_OFF = ("0", "false")


def sheet_remarks(content: bytes, texts: Sequence[tuple[str, list[list[str]]]]) -> dict[str, list[str]]:
    """Sentences about what the sheets of a workbook show beside their values, by the title of the sheet.

    Args:
        content: bytes of the workbook.
        texts: title and cells as text of each sheet.
    """
    remarks: dict[str, list[str]] = {}
    with zipfile.ZipFile(io.BytesIO(content)) as packed:
        book = _targets(packed, "").get("officeDocument", [""])[0]
        struck = _struck_styles(packed, _targets(packed, book).get("styles", [""])[0])
        places = _sheets(packed, book)
        for title, rows in texts:
            place = places.get(title)
            if place is None:
                continue
            source = packed.read(place)
            said = (_hidden(source, rows), _struck(source, struck), _comments(packed, place))
            remarks[title] = [text for text in said if text]
    return remarks


def _xml(packed: zipfile.ZipFile, place: str) -> ElementTree.Element | None:
    """A part of the archive, without namespaces; None where it is not there."""
    if place not in packed.namelist():
        return None
    root = ElementTree.fromstring(packed.read(place))
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    return root


def _targets(packed: zipfile.ZipFile, place: str) -> dict[str, list[str]]:
    """Parts that a part refers to, by the type of the relation, and by `#` and its name.

    The archive itself is the part without a name.
    """
    folder, name = posixpath.split(place)
    root = _xml(packed, posixpath.join(folder, "_rels", f"{name}.rels"))
    found: dict[str, list[str]] = {}
    for relation in root if root is not None else ():
        target = posixpath.normpath(posixpath.join("/", folder, relation.get("Target", ""))).lstrip("/")
        for key in (relation.get("Type", "").rpartition("/")[2], f"#{relation.get('Id')}"):
            found.setdefault(key, []).append(target)
    return found


def _sheets(packed: zipfile.ZipFile, book: str) -> dict[str, str]:
    """Part of each sheet, by its title."""
    root, targets = _xml(packed, book), _targets(packed, book)
    found = {}
    for sheet in root.iter("sheet") if root is not None else ():
        name = next((f"#{value}" for key, value in sheet.attrib.items() if key.endswith("}id")), "")
        if name in targets:
            found[sheet.get("name", "")] = targets[name][0]
    return found


def _hidden(source: bytes, texts: list[list[str]]) -> str:
    """Sentence about the filled rows and columns that a sheet hides, or draws with no height or width."""
    filled = {
        b"row": {i for i, row in enumerate(texts, start=1) if any(row)},
        b"col": {j for row in texts for j, text in enumerate(row, start=1) if text},
    }
    hidden: dict[bytes, set[int]] = {b"row": set(), b"col": set()}
    for part, stated in _HIDDEN.findall(source):
        first, last = (b"r", b"r") if part == b"row" else (b"min", b"max")
        ends = [re.search(rb'\b' + name + rb'="(\d+)"', stated) for name in (first, last)]
        if ends[0] and ends[1]:
            hidden[part] |= {i for i in filled[part] if int(ends[0][1]) <= i <= int(ends[1][1])}
    said = [_listed(word, sorted(hidden[part])) for part, word in ((b"row", "row"), (b"col", "column"))]
    parts = " and ".join(filter(None, said))
    return parts and (
        f"the sheet hides {parts}, which were read as all others; what is not to count has to be deleted in"
        " the file"
    )


def _struck_styles(packed: zipfile.ZipFile, place: str) -> set[bytes]:
    """Numbers of the styles whose font strikes through."""
    root = _xml(packed, place)
    if root is None:
        return set()
    fonts = root.find("fonts")
    struck = {
        str(number)
        for number, font in enumerate(fonts if fonts is not None else ())
        if (mark := font.find("strike")) is not None and mark.get("val") not in _OFF
    }
    styles = root.find("cellXfs")
    return {
        str(number).encode()
        for number, style in enumerate(styles if styles is not None else ())
        if style.get("fontId") in struck
    }


def _struck(source: bytes, styles: set[bytes]) -> str:
    """Sentence about the cells that a sheet strikes through."""
    cells = [name.decode() for style, name in _STYLED.findall(source) if style in styles] if styles else []
    named = _listed("cell", cells)
    return named and (
        f"the sheet strikes through {named}, which {'was' if len(cells) == 1 else 'were'} read as all others;"
        " what is not to count has to be deleted in the file"
    )


def _comments(packed: zipfile.ZipFile, sheet: str) -> str:
    """Sentence about the comments on the cells of a sheet, which change no number."""
    said = []
    for place in _targets(packed, sheet).get("comments", []):
        root = _xml(packed, place)
        for comment in root.iter("comment") if root is not None else ():
            words = " ".join("".join(part.text or "" for part in comment.iter("t")).split())
            said.append(f"{words[:_LONGEST_COMMENT]!r} (cell {comment.get('ref')})")
    more = f" and {len(said) - LISTED} more" if len(said) > LISTED else ""
    return ", ".join(said[:LISTED]) and (
        f"comments on cells were left aside: {', '.join(said[:LISTED])}{more}; what they say of a number has"
        " to be done in the file"
    )


def _listed(word: str, names: Sequence[int | str]) -> str:
    """A few of many in words: `rows 3, 4, 5, 6, 7, 8 and 12 more`; empty without any."""
    if not names:
        return ""
    more = f" and {len(names) - LISTED} more" if len(names) > LISTED else ""
    return f"{word}{'s' * (len(names) > 1)} {', '.join(map(str, names[:LISTED]))}{more}"
