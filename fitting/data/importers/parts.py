"""Tests in a raw file: one, or several in sheets, below each other, side by side, or marked by a column."""

import re
from dataclasses import dataclass, field, replace

from pneusma_jax.errors import counted

from ..recordings.table import unusable
from .channel_lists import with_listed_units
from .grid import Grid
from .labview import with_stated_units
from .numbered_columns import with_numbered_headings
from .numerals import is_blank
from .pages import joined_pages, oldest_first, states_a_specimen
from .raw import Page, RawFile
from .row_ranges import RowRange
from .separators import LEAST_ROWS
from .serial_output import as_table
from .size_tables import may_hold_sizes, table_of_sizes
from .sizes import Sizes, beside, filled_cells, is_amount, sizes_in, sizes_in_a_name
from .spelling import dimension, narrow, plain
from .splits import split
from .tables import find_grids
from .unit_cells import with_displayed_units, without_prefixes_of_numbers, without_units
from .unit_columns import with_units_of_rows
from .words import SPECIMEN_WORDS

_LABEL = re.compile(
    rf"^(?:{'|'.join((*SPECIMEN_WORDS, 'test', 'run', 'versuch'))})(?:körper|n(?=nr|nummer|name|bez))?\s*"
    r"(?:label|name|id|i\. ?d\.|designation|no\.?|number|nr\.?|nummer|bezeichnung|#)?(?![^\W\d_])"
    r"\s*[:=,;#]?\s*(?P<label>\S.{0,60})$",
    re.IGNORECASE,
)

_GOES_ON = re.compile(
    r"(?:paused?|resumed?|continue[sd]?|interrupted|stopped|restarted|fortgesetzt|unterbrochen|angehalten)\b",
    re.IGNORECASE,
)
"""Words behind `Test` that name no specimen: the one above goes on."""
_SENSOR = re.compile(
    r"\b(?:pt ?-?1000?|ntc|ptc|thermocouple|thermoelement|thermistor|type [bejknrst]|[bejknrst]-type)\b",
    re.IGNORECASE,
)
"""Words for sensors of temperature, which are probes, too."""
_AMOUNT_LAST = re.compile(r"\d\s*(?P<unit>[^\W\d_]+)\.?$")
"""A number with a unit at the end of a text."""
_NAMING = {
    f"{word}{more}"
    for word in (*SPECIMEN_WORDS, "prüfling", "prüfkörper", "probekörper", "probenkörper")
    for more in ("", " name", " id", "-id", " label", " no", " no.", " nr", " nr.", "-nr", "-nr.", " number")
} | {"probenname", "probennummer", "probenbezeichnung", "proben-id", "proben-nr"}


@dataclass(frozen=True)
class Sample:
    """One test of a raw file, as formats recognise it.

    Attributes:
        raw: raw file.
        grid: table of numbers, or None if there is none.
        head: first lines of its page as text.
        title: text that distinguishes it from the file's other tests; empty where it is the only one.
        own_specimen: true if the title names a specimen of its own, rather than a further test of one.
        sizes: dimensions of the specimen that the file states.
        notices: sentences about the file as a whole.
        sheet: name of its sheet.
        elsewhere: rows of sheets without a test. Only sheets with few rows count, since these state sizes.
        called: name that its recording gets where several tests are imported at once; else empty.
        kept: rows that the user chose; empty for all.
        left_out: the other rows in words; empty if there are none.
    """

    raw: RawFile
    grid: Grid | None
    head: str = ""
    title: str = ""
    own_specimen: bool = True
    sizes: Sizes = field(default_factory=dict)
    notices: tuple[str, ...] = ()
    sheet: str = ""
    elsewhere: tuple[list[str], ...] = ()
    called: str = ""
    kept: tuple[RowRange, ...] = ()
    left_out: str = ""

    def require_grid(self) -> Grid:
        """The table of numbers, or an error if there is none.

        Raises:
            InputError: if the file holds none.
        """
        if self.grid is None:
            raise unusable(
                self.raw.path, f"no table of numbers (at least {LEAST_ROWS} rows) was found in this file"
            )
        return self.grid

    def headerless(self, columns: int) -> bool:
        """True if the file is nothing but this many columns of numbers, without header or preamble."""
        grid = self.grid
        return (
            grid is not None and not grid.headings and not grid.preamble and grid.values.shape[1] == columns
        )


def samples_of(raw: RawFile, sheet: str | None = None) -> list[Sample]:
    """Every test in a raw file, at least one (without a grid where the file holds no table).

    Args:
        raw: raw file.
        sheet: name or number (from 1) of the only sheet to read.

    Raises:
        InputError: if there is no such sheet, or the file cannot be read.
    """
    pages = raw.pages if sheet is None else _page_named(raw, sheet)
    shared: Sizes = {}
    by_specimen: dict[str, Sizes] = {}
    notices: list[str] = []
    found: list[Sample] = []
    elsewhere: list[list[str]] = []
    for page in raw.pages:
        selected = page in pages
        tests = _tests_on(raw, page) if selected else []
        if not tests:
            rows = page.rows if page.rows is not None else []
            own, table = sizes_in(rows), table_of_sizes(rows)
            shared = {**shared, **own}
            by_specimen |= table
            elsewhere += rows if selected and not table and may_hold_sizes(len(rows)) else []
            if page.is_sheet and len(raw.pages) > 1:
                notices.append(_sheet_description(page, own, table, selected))
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
            **beside(sample.sizes, shared),
        }
        said = (*notices, *sample.notices)
        done.append(replace(sample, title=title, sizes=stated, notices=said, elsewhere=tuple(elsewhere)))
    return _with_unique_titles(done)


def _page_named(raw: RawFile, sheet: str) -> list[Page]:
    """The sheet of a name or a number (from 1), as the only page to read."""
    if not raw.pages[0].is_sheet:
        raise unusable(
            raw.path, f"--sheet {sheet}: this is a text file, it has no sheets; leave the option out"
        )
    names = [page.name for page in raw.pages]
    for at, name in enumerate(names):
        if name.strip().casefold() == sheet.strip().casefold():
            return [raw.pages[at]]
    if sheet.isdecimal() and 1 <= int(sheet) <= len(names):
        return [raw.pages[int(sheet) - 1]]
    raise unusable(
        raw.path, f"--sheet {sheet}: there is no such sheet; there are {', '.join(map(repr, names))}"
    )


def _sheet_description(page: Page, sizes: Sizes, table: dict[str, Sizes], selected: bool) -> str:
    """Description of a sheet without a test."""
    if sizes or table:
        texts = list(dict.fromkeys(size.said for size in sizes.values())) + [
            f"{name}: {', '.join(dict.fromkeys(s.said for s in own.values()))}" for name, own in table.items()
        ]
        return f"sheet {page.name!r} states sizes: {'; '.join(texts)}"
    return f"sheet {page.name!r} " + (
        "holds no table of a test and was left out" if selected else "was left out (--sheet)"
    )


def _tests_on(raw: RawFile, page: Page) -> list[Sample]:
    """Tests on one page: its tables, each split where it holds several specimens or a test restarts."""
    table, labels = as_table(page)
    shown, displayed = with_displayed_units(table)
    plain_page, units = without_units(shown)
    plain_page, prefixes = without_prefixes_of_numbers(plain_page)
    named = [with_numbered_headings(grid) for grid in find_grids(plain_page)]
    found = [with_stated_units(with_units_of_rows(grid)) for grid in named]
    grids = [oldest_first(grid) for grid in with_listed_units(found)]
    for grid in grids:
        grid.notices += [*labels, *displayed, *units, *prefixes]
    grids = joined_pages(grids, [states_a_specimen(grid, _label(grid)) for grid in grids])
    texts = [[[h.text for h in grid.headings], *grid.cells] for grid in grids]
    tables = [
        table_of_sizes(rows) if grid.headings and may_hold_sizes(len(grid.rows)) else {}
        for rows, grid in zip(texts, grids, strict=True)
    ]
    sized = {name: sizes for table in tables for name, sizes in table.items()}
    data = [grid for grid, table in zip(grids, tables, strict=True) if not table]
    for grid, table in zip(grids, tables, strict=True):
        if table and data:
            headings = ", ".join(repr(heading.text) for heading in grid.headings)
            said = f"the table {headings} was read as sizes of {counted(len(table), 'specimen')}, and no test"
            data = [replace(other, notices=[*other.notices, said]) for other in data]
    first: Sizes = {}
    tests: list[Sample] = []
    for number, grid in enumerate(data, start=1):
        below = sizes_in(grid.below, grid.decimal)
        own = {**below, **beside(sizes_in(grid.preamble, grid.decimal), below)}
        first = first or own
        sized |= table_of_sizes(grid.preamble)
        label = _label(grid)
        title, specimen = "", True
        if len(data) > 1:
            title, specimen = (label, True) if label else (f"test {number}", False)
        sample = Sample(raw, grid, page.head(), title, specimen, {**first, **own}, (), page.name)
        tests += [
            replace(
                sample,
                title=f"{title} {part.title}".strip(),
                grid=part.grid,
                own_specimen=part.own_specimen if part.title else specimen,
                sizes=sample.sizes
                if part.grid.preamble is grid.preamble
                else {**first, **beside(sizes_in(part.grid.preamble, grid.decimal), below)},
            )
            for part in split(grid)
        ]
    if len(data) > 1 and len({plain(t.title) for t in tests}) < len(tests):
        tests = [replace(t, title=f"{t.title} {k}", own_specimen=False) for k, t in enumerate(tests, start=1)]
    return [
        replace(t, sizes={**t.sizes, **_sizes_of(t, f"{page.name} {t.title}", k, len(tests), sized)})
        for k, t in enumerate(tests)
    ]


def stated_specimen(grid: Grid) -> str:
    """Name of the specimen in a line above a table (`Sample;NT-38-A`, `# Probe: A7`), or nothing."""
    for row in grid.preamble:
        cells = filled_cells(row)
        if len(cells) == 1:
            cells = re.split(r"\s*[:=]\s*", narrow(cells[0]).strip("#%!/* "), maxsplit=1)
        cells = [cell.strip('": ') for cell in cells]
        if len(cells) == 2 and plain(cells[0]) in _NAMING and _may_be_a_name(cells[1]):
            return cells[1]
    return ""


def _may_be_a_name(text: str) -> bool:
    """True if a text behind `Sample:` or `Probe:` may name a specimen.

    `Specimen ID: 8.0 mm` is the bore of a tube, `Sample: every 0.1 s` a setting, `Probe: PT100` a sensor.
    """
    if not re.search(r"[^\W\d]", text) or is_blank(text) or is_amount(text) or _SENSOR.search(text):
        return False
    amount = _AMOUNT_LAST.search(text)
    return amount is None or dimension(amount["unit"]) not in ("time", "frequency")


def _label(grid: Grid) -> str:
    """Name of the specimen that the lines above a table state."""
    for row in reversed(grid.preamble):
        cells = [cell.strip().strip('"') for cell in row if cell.strip().strip('"')]
        found = _LABEL.match(" ".join(cells)) if cells and len(cells) <= 3 else None
        if found and not _GOES_ON.match(found["label"]):
            return found["label"] if len(cells) > 1 else cells[0]
    return ""


def _sizes_of(sample: Sample, title: str, number: int, count: int, table: dict[str, Sizes]) -> Sizes:
    """Dimensions of a sample's specimen in a table of them: by its name, else by its position."""
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


def _with_unique_titles(samples: list[Sample]) -> list[Sample]:
    """Titles made unique where several tests have one."""
    titles = [plain(sample.title) for sample in samples]
    if len(set(titles)) == len(samples):
        return samples
    return [
        replace(sample, title=f"{sample.title} {number}".strip())
        for number, sample in enumerate(samples, start=1)
    ]
