"""What a raw file holds: one test, or several in sheets, below each other, side by side, or by a column."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..recordings.table import refuse
from .grid import LEAST_ROWS, Grid, find_grids
from .raw import Page, RawFile
from .sizes import Sizes, may_hold_sizes, sizes_in, sizes_in_a_name, table_of_sizes
from .spelling import plain
from .words import SPECIMEN_WORDS, TEST_WORDS, meaning

_MOST_PARTS = 60
_RESTART = 0.05  # of the range of what drives a test: so near its start it begins anew
_SAME = 0.005  # of the largest value: rounding of one measurement in two units
_OUTPUTS = ("stress", "true_stress", "force")
_DRIVERS = ("strain", "true_strain", "stretch", "elongation", "pressure")
_LABEL = re.compile(
    rf"^(?:{'|'.join((*SPECIMEN_WORDS, 'test', 'run', 'versuch'))})\s*(?:label|name|id|i\."
    rf" ?d\.|designation|no\.?|number|nr\.?|#)?"
    r"\s*[:=,;#]?\s*(?P<label>\S.{0,60})$",
    re.IGNORECASE,
)
_ID_COLUMN = re.compile(
    rf"^(?P<word>{'|'.join((*SPECIMEN_WORDS, *TEST_WORDS))})\s*(?:label|name|id|i"
    rf" d|designation|no\.?|number|nr\.?|#)?$|^id$"
)


@dataclass(frozen=True)
class Sample:
    """One test of a raw file, which a format is recognised by.

    Attributes:
        raw: the file.
        grid: its table of numbers, or None if there is none.
        head: the first lines of its page as text.
        title: what tells it from the file's other tests; empty where it is the only one.
        own_specimen: whether the title names a specimen of its own, rather than a further test of one.
        sizes: of the specimen, as the file states them.
        notices: what was understood of the file as a whole.
        sheet: that it is on.
    """

    raw: RawFile
    grid: Grid | None
    head: str = ""
    title: str = ""
    own_specimen: bool = True
    sizes: Sizes = field(default_factory=dict)
    notices: tuple[str, ...] = ()
    sheet: str = ""

    def require_grid(self) -> Grid:
        """The table of numbers.

        Raises:
            InputError: if the file holds none.
        """
        if self.grid is None:
            raise refuse(
                self.raw.path, f"no table of numbers (at least {LEAST_ROWS} rows) was found in this file"
            )
        return self.grid

    def headerless(self, columns: int) -> bool:
        """Whether the file is nothing but this many columns of numbers, without header or preamble."""
        grid = self.grid
        return (
            grid is not None and not grid.headings and not grid.preamble and grid.values.shape[1] == columns
        )


def samples_of(raw: RawFile, sheet: str | None = None) -> list[Sample]:
    """Every test in a raw file, at least one (without a grid where the file holds no table).

    Args:
        raw: the file.
        sheet: name or number (from 1) of the only sheet to read.

    Raises:
        InputError: if there is no such sheet, or the file cannot be read.
    """
    pages = raw.pages if sheet is None else _wanted(raw, sheet)
    shared: Sizes = {}
    by_specimen: dict[str, Sizes] = {}
    notices: list[str] = []
    found: list[Sample] = []
    for page in raw.pages:
        kept = page in pages
        tests = _tests_on(raw, page) if kept else []
        if not tests:
            rows = page.rows if page.rows is not None else []
            own, table = sizes_in(rows), table_of_sizes(rows)
            shared = {**shared, **own}
            by_specimen |= table
            if page.is_sheet and len(raw.pages) > 1:
                notices.append(_about(page, own, table, kept))
        found += tests
    if not found:
        return [Sample(raw, None, pages[0].head(), notices=tuple(notices))]
    several = len({sample.sheet for sample in found}) > 1
    done = []
    for number, sample in enumerate(found):
        title = " ".join(part for part in (sample.sheet if several else "", sample.title) if part)
        named = {**sizes_in_a_name(raw.path.stem), **sizes_in_a_name(title), **sizes_in_a_name(sample.sheet)}
        stated = {
            **named,
            **shared,
            **_sizes_of(sample, title, number, len(found), by_specimen),
            **sample.sizes,
        }
        done.append(replace(sample, title=title, sizes=stated, notices=(*notices, *sample.notices)))
    return _named_apart(done)


def _wanted(raw: RawFile, sheet: str) -> list[Page]:
    if not raw.is_workbook:
        raise refuse(
            raw.path, f"--sheet {sheet}: this is a text file, it has no sheets; leave the option out"
        )
    names = [page.name for page in raw.pages]
    for at, name in enumerate(names):
        if name.casefold() == sheet.casefold():
            return [raw.pages[at]]
    if sheet.isdigit() and 1 <= int(sheet) <= len(names):
        return [raw.pages[int(sheet) - 1]]
    raise refuse(
        raw.path, f"--sheet {sheet}: there is no such sheet; there are {', '.join(map(repr, names))}"
    )


def _about(page: Page, sizes: Sizes, table: dict[str, Sizes], kept: bool) -> str:
    """What a sheet without a test is, in words."""
    if sizes or table:
        said = [size.said for size in sizes.values()] + [
            f"{name}: {', '.join(s.said for s in own.values())}" for name, own in table.items()
        ]
        return f"sheet {page.name!r} states sizes: {'; '.join(said)}"
    return f"sheet {page.name!r} " + (
        "holds no table of a test and was left out" if kept else "was left out (--sheet)"
    )


def _tests_on(raw: RawFile, page: Page) -> list[Sample]:
    """Tests on one page: its tables, each cut where it holds several specimens or a test begins anew."""
    grids = find_grids(raw, page)
    texts = [[[h.text for h in grid.headings], *grid.cells] for grid in grids]
    tables = [
        table_of_sizes(rows) if grid.headings and may_hold_sizes(len(grid.rows)) else {}
        for rows, grid in zip(texts, grids, strict=True)
    ]
    sized = {name: sizes for table in tables for name, sizes in table.items()}
    data = [grid for grid, table in zip(grids, tables, strict=True) if not table]
    first: Sizes = {}
    tests: list[Sample] = []
    for number, grid in enumerate(data, start=1):
        own = sizes_in(grid.preamble)
        first = first or own
        sized |= table_of_sizes(grid.preamble)
        label = _label(grid)
        title, specimen = "", True
        if len(data) > 1:
            title, specimen = (label, True) if label else (f"test {number}", False)
        sample = Sample(raw, grid, page.head(), title, specimen, {**first, **own}, (), page.name)
        tests += _split(sample)
    if len(data) > 1 and len({plain(t.title) for t in tests}) < len(tests):
        tests = [replace(t, title=f"{t.title} {k}", own_specimen=False) for k, t in enumerate(tests, start=1)]
    return [
        replace(t, sizes={**t.sizes, **_sizes_of(t, f"{page.name} {t.title}", k, len(tests), sized)})
        for k, t in enumerate(tests)
    ]


def _label(grid: Grid) -> str:
    """Name of the specimen that the lines above a table state."""
    for row in reversed(grid.preamble):
        cells = [cell.strip().strip('"') for cell in row if cell.strip().strip('"')]
        found = _LABEL.match(" ".join(cells)) if cells and len(cells) <= 3 else None
        if found:
            return found["label"] if len(cells) > 1 else cells[0]
    return ""


def _sizes_of(sample: Sample, title: str, number: int, count: int, table: dict[str, Sizes]) -> Sizes:
    """Sizes of a sample's specimen in a table of them: by its name, else by its place."""
    if not table:
        return {}
    about = plain(
        " ".join(
            [
                title,
                _label(sample.grid) if sample.grid else "",
                *(c for row in (sample.grid.preamble if sample.grid else ()) for c in row[:2]),
            ]
        )
    )
    for name in sorted(table, key=len, reverse=True):
        if plain(name) and re.search(rf"(?<!\w){re.escape(plain(name))}(?!\w)", about):
            return table[name]
    if len(table) == count:
        return list(table.values())[number]
    return {}


def _split(sample: Sample) -> list[Sample]:
    """A table cut by a column that names specimens, by groups of columns, or where a test begins anew."""
    for cut in (_by_column, _by_groups, _by_restart):
        parts = cut(sample.require_grid())
        if len(parts) > 1:
            join = [(f"{sample.title} {title}".strip(), grid, own) for title, grid, own in parts]
            return [replace(sample, title=title, grid=grid, own_specimen=own) for title, grid, own in join]
    return [sample]


Part = tuple[str, Grid, bool]


def _by_column(grid: Grid) -> list[Part]:
    """Rows by the specimen that a column names for each, where every one has enough of them."""
    for column, heading in enumerate(grid.headings):
        found = _ID_COLUMN.match(heading.name)
        if found is None or meaning(heading) is not None:
            continue
        texts = [cells[column] if column < len(cells) else "" for cells in grid.cells]
        names = list(dict.fromkeys(text for text in texts if text))
        rows = {name: [i for i, text in enumerate(texts) if text == name] for name in names}
        if not 1 < len(names) <= _MOST_PARTS or min(map(len, rows.values())) < LEAST_ROWS:
            continue
        own = (found["word"] or "id") not in TEST_WORDS
        others = [c for c in range(len(grid.headings)) if c != column]
        word = heading.name.split()[0]
        return [
            (
                name if not re.fullmatch(r"[\d.]+", name) else f"{word} {name.removesuffix('.0')}",
                _own_notices(grid, rows[name], others),
                own,
            )
            for name in names
        ]
    return []


def _own_notices(grid: Grid, rows: Sequence[int], columns: Sequence[int]) -> Grid:
    part = grid.part(rows, columns)
    part.notices = [f"{len(part.rows)} of {text}" if k == 0 else text for k, text in enumerate(part.notices)]
    return part


def _by_groups(grid: Grid) -> list[Part]:
    """Columns by the specimen that they belong to, where stress or load stands there several times."""
    means = [meaning(heading) for heading in grid.headings]
    held: dict[tuple[str, int], list[int]] = {}
    for column, means_of in enumerate(means):
        if means_of is not None and not np.isnan(grid.values[:, column]).all():
            members = held.setdefault((means_of.quantity, means_of.rank), [])
            if not any(_same_in_another_unit(grid, column, other) for other in members):
                members.append(column)
    repeated = {key: columns for key, columns in held.items() if len(columns) > 1}
    outputs = [key for key in repeated if key[0] in _OUTPUTS] or [
        key for key in repeated if key[0] == "strain" and not any(other[0] in _OUTPUTS for other in held)
    ]
    if not outputs or not any(key[0] in (*_DRIVERS, "temperature") for key in held):
        return []
    groups, named = _groups(grid, means, repeated, held[outputs[0]])
    if not 1 < len(groups) <= _MOST_PARTS:
        return []
    once = [columns[0] for key, columns in held.items() if key not in repeated]
    taken = {*once, *(c for columns in groups.values() for c in columns)}
    aside = [h.text for c, h in enumerate(grid.headings) if c not in taken and h.text.strip()]
    parts = []
    for name, columns in groups.items():
        rows = [i for i in range(len(grid.rows)) if np.isfinite(grid.values[i, columns]).any()]
        if len(rows) >= LEAST_ROWS:
            part = _own_notices(grid, rows, sorted([*once, *columns]))
            if aside:
                part.notices.append(f"columns of no specimen, left aside: {', '.join(map(repr, aside))}")
            parts.append((name if named else f"specimen {name}", part, True))
    return parts


def _same_in_another_unit(grid: Grid, column: int, other: int) -> bool:
    """Whether two columns are one measurement in two units, rather than those of two specimens."""
    if grid.headings[column].unit == grid.headings[other].unit:
        return False
    first, second = grid.values[:, other], grid.values[:, column]
    there = np.isfinite(first) & np.isfinite(second)
    if not there.any() or not np.abs(first[there]).max() > 0.0:
        return False
    scale = float(first[there] @ second[there]) / float(first[there] @ first[there])
    rest = float(np.abs(second[there] - scale * first[there]).max())
    return rest <= _SAME * float(np.abs(second[there]).max())


def _groups(
    grid: Grid, means: list, repeated: dict[tuple[str, int], list[int]], outputs: list[int]
) -> tuple[dict[str, list[int]], bool]:
    """Columns of each group by its name, and whether the file names them: by titles above, tags, or order."""
    columns = sorted(c for members in repeated.values() for c in members)
    spans = _titles(grid)
    titles = {c: spans[c] for c in columns if c in spans}
    if len(titles) == len(columns) and len({titles[c] for c in outputs}) == len(outputs):
        return {
            t: [c for c in columns if titles[c] == t] for t in dict.fromkeys(titles[c] for c in columns)
        }, True
    tags = {c: means[c].tag for c in columns}
    if len({tags[c] for c in outputs}) == len(outputs):
        order = list(dict.fromkeys(tags[c] for c in outputs))
        names = {tag: tag or "0" for tag in order}
        named = all(re.search(r"[a-z]", name) for name in names.values())
        if all(tags[c] in names for c in columns):
            return {names[tag]: [c for c in columns if tags[c] == tag] for tag in order}, named
    counts = {len(members) for members in repeated.values()}
    if len(counts) == 1:
        (count,) = counts
        return {str(k + 1): [members[k] for members in repeated.values()] for k in range(count)}, False
    return {}, False


def _titles(grid: Grid) -> dict[int, str]:
    """Titles that stand over groups of columns, by column: the row above the headings, its gaps filled."""
    row = grid.preamble[-1] if grid.preamble else []
    if len({cell for cell in row if cell}) < 2:
        return {}
    spans, last = {}, ""
    for column in range(len(grid.headings)):
        last = row[column] if column < len(row) and row[column] else last
        if last:
            spans[column] = last
    return spans


def _by_restart(grid: Grid) -> list[Part]:
    """Rows cut where the clock and what drives the test both begin anew, and no count of cycles says why."""
    means = [meaning(heading) for heading in grid.headings]
    column = {m.quantity: c for c, m in reversed(list(enumerate(means))) if m is not None}
    driver = next((column[name] for name in _DRIVERS if name in column), None)
    if "time" not in column or driver is None or "cycle" in column:
        return []
    time, drive = grid.values[:, column["time"]], grid.values[:, driver]
    reach = float(np.nanmax(drive) - np.nanmin(drive)) if np.isfinite(drive).any() else 0.0
    length = float(np.nanmax(time) - np.nanmin(time)) if np.isfinite(time).any() else 0.0
    if not reach > 0.0 or not length > 0.0:
        return []
    back = np.diff(time) < 0.0
    anew = (time[1:] - time[0] <= _RESTART * length) & (np.abs(drive[1:] - drive[0]) <= _RESTART * reach)
    cuts = [0, *(int(i) + 1 for i in np.flatnonzero(back & anew)), len(time)]
    parts = [range(a, b) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]
    if len(parts) < 2 or len(parts) > _MOST_PARTS or min(map(len, parts)) < LEAST_ROWS:
        return []
    return [
        (f"test {k}", _own_notices(grid, rows, range(grid.values.shape[1])), False)
        for k, rows in enumerate(parts, start=1)
    ]


def _named_apart(samples: list[Sample]) -> list[Sample]:
    """Titles made different from each other where several tests have one."""
    titles = [plain(sample.title) for sample in samples]
    if len(set(titles)) == len(samples):
        return samples
    return [
        replace(sample, title=f"{sample.title} {number}".strip())
        for number, sample in enumerate(samples, start=1)
    ]
