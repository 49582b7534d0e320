"""A table of numbers from a raw file."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .spelling import Heading


@dataclass
class Grid:
    """A table of numbers from a raw file.

    Attributes:
        headings: column headings, or none if the file has no header.
        values: numbers, shape (rows, columns), NaN where a field is blank.
        rows: line number in the file (from 1) of each row.
        preamble: fields of the lines before the header.
        notices: sentences about delimiter, decimal mark and dropped rows.
        cells: the fields of each row as text.
        described: words about the columns and what separates them, with which the first notice ends.
        troubles: reason why a column's numbers are doubtful, by column; a sentence without subject.
        trouble_rows: line numbers of the only rows that make a column's numbers doubtful, by column, where
            that is known.
        doubt: reason why no column can be told from another; empty where there is none.
        contradictions: two units that one heading states, by column; or those that its numbers may be in, and
            how the sheet displays them.
        breaks: lines of text between the rows, by the position of the row below them.
        by_row: columns whose unit a column beside them stated row by row.
        origins: moment of 0 s of the columns that hold a dated clock, by column (`clocks.EPOCH`) [s].
        read_along: columns that are one with another one, such as the date beside a time of day.
        clocks: columns whose seconds were read from dates or times of day.
        marked: column of each notice about marks for no reading, by the notice.
        decimal: decimal mark of the numbers.
        below: fields of the lines of text below the last row of numbers.
    """

    headings: list[Heading]
    values: np.ndarray
    rows: list[int]
    preamble: list[list[str]]
    notices: list[str] = field(default_factory=list)
    cells: list[list[str]] = field(default_factory=list)
    troubles: dict[int, str] = field(default_factory=dict)
    doubt: str = ""
    contradictions: dict[int, tuple[str, ...]] = field(default_factory=dict)
    breaks: dict[int, list[list[str]]] = field(default_factory=dict)
    by_row: set[int] = field(default_factory=set)
    origins: dict[int, float] = field(default_factory=dict)
    read_along: set[int] = field(default_factory=set)
    clocks: set[int] = field(default_factory=set)
    marked: dict[str, int] = field(default_factory=dict)
    described: str = ""
    decimal: str = "."
    below: list[list[str]] = field(default_factory=list)
    trouble_rows: dict[int, frozenset[int]] = field(default_factory=dict)

    def texts(self, column: int) -> list[str]:
        """The fields of a column as text, empty where a row ends before it."""
        return [cells[column] if column < len(cells) else "" for cells in self.cells]

    def part(self, rows: Sequence[int] | slice, columns: Sequence[int] | None = None) -> "Grid":
        """Some rows and columns, as a table of their own."""
        picked = list(range(len(self.rows)))[rows] if isinstance(rows, slice) else list(rows)
        chosen = list(range(self.values.shape[1])) if columns is None else list(columns)
        return Grid(
            headings=[self.headings[c] for c in chosen] if self.headings else [],
            values=self.values[np.ix_(picked, chosen)],
            rows=[self.rows[i] for i in picked],
            preamble=self.preamble,
            notices=list(self.notices),
            cells=[[self.cells[i][c] if c < len(self.cells[i]) else "" for c in chosen] for i in picked],
            doubt=self.doubt,
            by_row={k for k, c in enumerate(chosen) if c in self.by_row},
            read_along={k for k, c in enumerate(chosen) if c in self.read_along},
            clocks={k for k, c in enumerate(chosen) if c in self.clocks},
            marked={text: k for k, c in enumerate(chosen) for text, at in self.marked.items() if at == c},
            described=self.described,
            decimal=self.decimal,
            below=self.below,
            origins={k: self.origins[c] for k, c in enumerate(chosen) if c in self.origins},
            troubles={k: self.troubles[c] for k, c in enumerate(chosen) if c in self.troubles},
            trouble_rows={k: self.trouble_rows[c] for k, c in enumerate(chosen) if c in self.trouble_rows},
            contradictions={
                k: self.contradictions[c] for k, c in enumerate(chosen) if c in self.contradictions
            },
        )

    def cut(self, rows: Sequence[int] | slice, columns: Sequence[int] | None = None) -> "Grid":
        """Rows and columns of one of several tests. Its first notice says how many rows of all these are."""
        part = self.part(rows, columns)
        part.notices[:1] = [f"{len(part.rows)} of {text}" for text in part.notices[:1]]
        return part
