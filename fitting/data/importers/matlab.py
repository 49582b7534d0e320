"""Files of MATLAB (.mat) and HDF5 as sheets of cells: vectors of one length stand side by side.

A structure, or a group of an HDF5 file, is a sheet. So are the variables that stand in none. Single numbers
and texts become lines above its table. So do those of the structures around it, and those of structures
without a table that stand beside it or beside one of these. A matrix joins the vectors that have as many
rows, and is a table of its own without them. What Simulink
writes as a structure with time is one table. Objects of MATLAB, such as its tables, only MATLAB can read.
"""

import io
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneusma_jax.errors import reason_of
from pneusma_jax.late import Late

from ..first_reading import fault_of_reading
from ..hdf5 import SIGNATURE, opened
from ..recordings.table import unusable

scipy_io = Late("scipy.io")
h5py = Late("h5py")

MATLAB_5, MATLAB_7_3 = b"MATLAB 5.0", b"MATLAB 7.3"
"""First bytes of the files of MATLAB 5 to 7, and of those since 7.3, which are HDF5 files."""
LEAST_ROWS = 3
"""Minimum length of a vector that becomes a column. Shorter ones are sizes, limits or settings."""
DEEPEST = 20
"""Maximum depth of structures in structures. Files of laboratories have up to five."""
MOST_CELLS = 30_000_000
"""Maximum number of numbers in a file that become cells. A text of as many has 300 MB."""
UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units")
"""Attributes of a data set of an HDF5 file that state its unit."""


@dataclass(frozen=True)
class Unread:
    """A variable that cannot become columns, with what it is."""

    what: str


@dataclass
class Sheet:
    """A table of a file in cells.

    Attributes:
        name: name of the structure, or of the length where a structure has several.
        rows: cells as text by row.
        remarks: sentences about what was left out or assumed.
    """

    name: str
    rows: list[list[str]]
    remarks: list[str] = field(default_factory=list)


def is_matlab_or_hdf5(content: bytes) -> bool:
    """True for a file of MATLAB 5 or later, or an HDF5 file."""
    return content.startswith((MATLAB_5, MATLAB_7_3, SIGNATURE))


def sheets_of(path: Path, content: bytes) -> list[Sheet]:
    """Tables of a file of MATLAB, or an HDF5 file, in cells.

    Raises:
        InputError: if the file cannot be read, or holds no columns of numbers.
    """
    variables = _variables(path, content)
    if _count(variables) > MOST_CELLS:
        raise unusable(path, f"it holds more than {MOST_CELLS:,} numbers; save the variables that are wanted")
    unread: list[str] = []
    sheets = list(_sheets(variables, "", unread, 0))
    if not sheets:
        why = f" ({'; '.join(unread)})" if unread else ""
        raise unusable(
            path, f"this file has no vectors of at least {LEAST_ROWS} numbers{why}; a table of MATLAB is"
            " written as text by writetable(T, 'T.csv')",
        )  # fmt: skip
    sheets[0].remarks += unread
    return sheets


def _count(node: Any) -> int:
    """Number of numbers in a variable and all below it."""
    if isinstance(node, dict):
        return sum(map(_count, node.values()))
    if isinstance(node, list):
        return sum(map(_count, node))
    return node.size if isinstance(node, np.ndarray) else 1


# ---- what a file holds, as dictionaries, lists, arrays and texts


def _variables(path: Path, content: bytes) -> dict[str, Any]:
    """Variables of a file by name: arrays of two dimensions, texts, lists (cells) and dictionaries."""
    if not content.startswith(MATLAB_5):
        kind = "a file of MATLAB 7.3" if content.startswith(MATLAB_7_3) else "an HDF5 file"
        with opened(content, str(path), kind, "; export it as .csv") as file:
            return _group(file, file, content.startswith(MATLAB_7_3), [])
    if fault := fault_of_reading("matlab", content):
        raise unusable(path, f"this file of MATLAB cannot be read ({fault}); export it as .csv")
    try:
        loaded = scipy_io.loadmat(io.BytesIO(content), struct_as_record=False, chars_as_strings=True)
        return {name: _plain(value, 0) for name, value in loaded.items() if not name.startswith("__")}
    except Exception as error:  # a damaged file can end anywhere in the library
        raise unusable(
            path, f"this file of MATLAB cannot be read ({reason_of(error)}); export it as .csv"
        ) from None


def _plain(value: Any, depth: int) -> Any:
    """A variable as scipy reads it, without its classes."""
    if depth > DEEPEST:
        return Unread("it is nested too deeply")
    if hasattr(value, "_fieldnames"):
        return {name: _plain(getattr(value, name), depth + 1) for name in value._fieldnames}
    if type(value).__name__ in ("MatlabOpaque", "MatlabFunction"):
        return Unread("it is a table or another object, which only MATLAB reads")
    if not isinstance(value, np.ndarray):
        return Unread("it is a sparse matrix")
    if value.dtype.kind in "US":
        return [str(text).strip() for text in value.ravel()]
    if value.dtype.kind == "O":
        parts = [_plain(part, depth + 1) for part in value.ravel()]
        one_structure = len(parts) == 1 and isinstance(parts[0], dict)
        return parts[0] if one_structure else parts
    if value.dtype.names:
        return Unread("it is a table or another object, which only MATLAB reads")
    return _array(value)


def _array(value: np.ndarray) -> Any:
    """An array in two dimensions, those of one entry left out beyond them."""
    if value.dtype.kind not in "biuf":
        return Unread("its numbers are complex" if value.dtype.kind == "c" else "it holds no numbers")
    if value.ndim > 2:
        value = np.squeeze(value)
    if value.ndim > 2:
        return Unread(f"it has {value.ndim} dimensions")
    return value.reshape(-1, 1) if value.ndim < 2 else value


def _group(group: Any, file: Any, transposed: bool, known: list[Any]) -> dict[str, Any]:
    """Items of a group of an HDF5 file by name. Those of MATLAB stand transposed in it.

    Args:
        group: the group.
        file: the file.
        transposed: true for a file of MATLAB.
        known: groups that were read already, which grow. One may stand in itself by another name.
    """
    found: dict[str, Any] = {}
    known.append(group)
    for name in group:
        if name.startswith("#"):  # where MATLAB keeps what its cells refer to
            continue
        item = group.get(name)
        if item is None:
            found[name] = Unread("it is a link to nothing")
        elif isinstance(item, h5py.Group):
            again = any(item == one for one in known)
            what = Unread("it is another name of a group that was read")
            found[name] = what if again else _group(item, file, transposed, known)
        else:
            found[_with_unit(name, item)] = _data_set(item, file, transposed)
    return found


def _with_unit(name: str, item: Any) -> str:
    """Name of a data set with the unit that an attribute states."""
    stated = next((np.ravel(item.attrs[key]) for key in UNIT_ATTRIBUTES if key in item.attrs), np.ravel(""))
    unit = stated[0] if stated.size == 1 else ""
    text = unit.decode("utf-8", "replace") if isinstance(unit, bytes) else str(unit)
    return f"{name} ({text})" if text.strip() else name


def _data_set(item: Any, file: Any, transposed: bool) -> Any:
    kind = item.attrs.get("MATLAB_class", b"")
    kind = kind.decode("ascii", "replace") if isinstance(kind, bytes) else str(kind)
    if item.size is not None and item.size > MOST_CELLS:
        return Unread(f"it has more than {MOST_CELLS:,} numbers")
    if item.attrs.get("MATLAB_empty", 0):
        return np.zeros((0, 0))
    value = item[()]
    if kind == "char" and isinstance(value, np.ndarray) and value.dtype.kind == "u":
        lines = value.T if value.ndim == 2 else value.reshape(1, -1)
        return ["".join(map(chr, line)).strip() for line in lines]
    if isinstance(value, bytes | str):
        return [value.decode("utf-8", "replace") if isinstance(value, bytes) else value]
    if isinstance(value, np.ndarray) and value.dtype.names:
        return {name: _array(np.asarray(value[name])) for name in value.dtype.names}
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        return [_referred(part, file, transposed) for part in value.ravel()]
    if kind and kind not in ("double", "single", "logical") and not kind.startswith(("int", "uint")):
        return Unread("it is a table or another object, which only MATLAB reads")
    array = _array(np.asarray(value))
    return array.T if transposed and isinstance(array, np.ndarray) and np.ndim(value) == 2 else array


def _referred(part: Any, file: Any, transposed: bool) -> Any:
    """What a cell of MATLAB refers to, or a text of an HDF5 file."""
    if isinstance(part, bytes | str):
        return [part.decode("utf-8", "replace") if isinstance(part, bytes) else part]
    item = file[part] if isinstance(part, h5py.Reference) and part else None
    if isinstance(item, h5py.Dataset):
        return _data_set(item, file, transposed)
    return Unread("it is a cell of structures")


# ---- tables of these


def _sheets(
    node: dict[str, Any], path: str, unread: list[str], depth: int, around: tuple[list[str], ...] = ()
) -> Iterator[Sheet]:
    """Tables of a structure and of those in it.

    Args:
        node: variables by name.
        path: names of the structures around it, joined by dots.
        unread: sentences about variables that become no column, which grow.
        depth: number of these structures.
        around: lines of single values that stand in them.
    """
    if depth > DEEPEST:
        unread.append(f"{path!r} is nested too deeply and was left out")
        return
    signals = _signals(node, path, unread)
    arrays = {k: v for k, v in node.items() if isinstance(v, np.ndarray) and v.size > 1 and k not in signals}
    arrays = {**signals, **arrays}
    own = [*_single_lines(node, ""), *_lines_beside(node)]
    names = {name for name, _ in own}
    lines = [*(line for line in around if line[0] not in names), *own]
    groups: dict[int, dict[str, np.ndarray]] = {}
    for name, array in arrays.items():
        upright = array if array.shape[0] >= array.shape[1] else array.T
        groups.setdefault(upright.shape[0], {})[name] = upright
    tables = {length: group for length, group in groups.items() if length >= LEAST_ROWS}
    for length, group in groups.items():
        if length < LEAST_ROWS:
            names = ", ".join(map(repr, group))
            unread.append(f"{_of(path)}{names} has {length} numbers only and was left out")
    for length, group in tables.items():
        several = f"{length} rows" if len(tables) > 1 else ""
        named = " of ".join(part for part in (several, path) if part)
        if len(group) > 1 and all(array.shape[1] > 1 for array in group.values()):
            for name, array in group.items():  # matrices without a vector beside them are tests of their own
                yield _sheet(f"{path}.{name}" if path else name, {name: array}, lines, node)
            continue
        yield _sheet(named or "variables", group, lines, node)
    for name, value in node.items():
        inner = f"{path}.{name}" if path else name
        if isinstance(value, dict) and not (signals and name == "signals"):
            yield from _sheets(value, inner, unread, depth + 1, tuple(lines))
        elif isinstance(value, list) and not (signals and name == "signals"):
            for number, part in enumerate(value, 1):
                if isinstance(part, dict):
                    yield from _sheets(part, f"{inner}({number})", unread, depth + 1, tuple(lines))
                elif isinstance(part, np.ndarray) and part.size >= LEAST_ROWS:
                    yield from _sheets({f"{name} {number}": part}, f"{inner}({number})", unread, depth + 1)
                elif isinstance(part, Unread):
                    unread.append(f"'{inner}({number})' was left out: {part.what}")
            if len(_texts(value)) >= LEAST_ROWS and not _name_columns(value, arrays, node):
                unread.append(f"{inner!r} was left out: it holds {len(value)} texts")
        elif isinstance(value, Unread):
            unread.append(f"{inner!r} was left out: {value.what}")


def _lines_beside(node: dict[str, Any]) -> list[list[str]]:
    """Lines of single values in those structures of a structure that hold no table.

    Texts are named with their structure: `specimen name`. So are numbers that two structures state
    differently.
    """
    found: list[tuple[str, list[str]]] = []
    for name, value in node.items():
        if isinstance(value, dict) and not _holds_a_table(value):
            lines = [*_single_lines(value, f"{name} "), *_lines_beside(value)]
            found += [(name, line) for line in lines]
    values: dict[str, set[str]] = {}
    for _, (name, text) in found:
        values.setdefault(name, set()).add(text)
    return [[name if len(values[name]) == 1 else f"{within} {name}", text] for within, (name, text) in found]


def _holds_a_table(node: dict[str, Any]) -> bool:
    """True for a structure with a vector that becomes a column, in itself or in what it holds."""
    parts = [*node.values(), *(x for value in node.values() if isinstance(value, list) for x in value)]
    return any(
        _holds_a_table(part)
        if isinstance(part, dict)
        else isinstance(part, np.ndarray) and max(part.shape) >= LEAST_ROWS
        for part in parts
    )


def _single_lines(node: dict[str, Any], before: str) -> list[list[str]]:
    """Names and texts of the single values of a structure, `before` before the names of texts."""
    return [
        [before + name if isinstance(value, list) else name, _text(value)]
        for name, value in node.items()
        if _is_single(value)
    ]


def _of(path: str) -> str:
    return f"of {path!r}, " if path else ""


def _sheet(name: str, group: dict[str, np.ndarray], lines: list[list[str]], node: dict[str, Any]) -> Sheet:
    """A table of vectors and matrices of as many rows, below lines of single values."""
    headings: list[str] = []
    remarks = []
    for variable, array in group.items():
        width = array.shape[1]
        names = [variable] if width == 1 else _names_for(width, node)
        if width > 1 and names:
            remarks.append(f"the columns of {variable!r} were named by a list of as many names")
        alone = len(group) == 1 and not names
        headings += names or ([""] * width if alone else [f"{variable} {k + 1}" for k in range(width)])
    columns = [[_number(x) for x in array[:, k]] for array in group.values() for k in range(array.shape[1])]
    top = [headings] if any(headings) else []
    return Sheet(name, [*lines, *top, *map(list, zip(*columns, strict=True))], remarks)


def _name_columns(value: list[Any], arrays: dict[str, np.ndarray], node: dict[str, Any]) -> bool:
    """True for the list of texts that names the columns of a matrix."""
    widths = {min(array.shape) for array in arrays.values()} - {1}
    return any(_texts(value) == _names_for(width, node) for width in widths)


def _names_for(width: int, node: dict[str, Any]) -> list[str]:
    """Names of the columns of a matrix: the one list of texts of this length beside it; empty without one."""
    lists = [_texts(value) for value in node.values() if isinstance(value, list)]
    fitting = [texts for texts in lists if len(texts) == width and all(texts)]
    return fitting[0] if len(fitting) == 1 else []


def _texts(value: list[Any]) -> list[str]:
    """Texts of a list of texts, or of cells with one each; empty for another list."""
    parts = [part[0] if isinstance(part, list) and len(part) == 1 else part for part in value]
    return [str(part) for part in parts] if all(isinstance(part, str) for part in parts) else []


def _signals(node: dict[str, Any], path: str, unread: list[str]) -> dict[str, np.ndarray]:
    """Columns of what Simulink writes as a structure with time; empty for another structure.

    Args:
        node: the structure.
        path: its name.
        unread: sentences about signals that become no column, which grow.
    """
    time, found = node.get("time"), node.get("signals")
    parts = found if isinstance(found, list) else [found]
    known = all(isinstance(part, dict) and "values" in part for part in parts)
    if not isinstance(time, np.ndarray) or not known:
        return {}
    columns = {"time": time}
    for number, part in enumerate(parts, 1):
        label = _texts(part["label"])[:1] if isinstance(part.get("label"), list) else []
        name = label[0] if label and label[0] else f"signal {number}"
        if isinstance(part["values"], np.ndarray):
            columns[name if name not in columns and name not in node else f"{name} {number}"] = part["values"]
        else:
            what = part["values"].what if isinstance(part["values"], Unread) else "it holds no numbers"
            unread.append(f"{_of(path)}signal {name!r} was left out: {what}")
    return columns


def _is_single(value: Any) -> bool:
    """True for one number or one text."""
    if isinstance(value, list):
        texts = _texts(value)
        return len(texts) == 1 and bool(texts[0])
    return isinstance(value, np.ndarray) and value.size == 1


def _text(value: Any) -> str:
    return _texts(value)[0] if isinstance(value, list) else _number(value.ravel()[0])


def _number(value: Any) -> str:
    """A number with the digits that it has; empty where it is missing."""
    return "" if value != value else str(int(value) if value.dtype.kind in "biu" else value)
