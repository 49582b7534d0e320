"""A recording and a campaign in memory: columns in the units of files or SI, and the sidecar's statements."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import to_si

from . import schema
from .nominal import nominal_geometry


@dataclass(frozen=True)
class Reduction:
    """Origin of the rows of a recording that was made from another one.

    Attributes:
        source: original recording.
        rows: index in the original of every row, ascending; None where rows are means. An added row, such as
            a turning point between two samples, repeats the index of the row before it.
        block: number of readings averaged in a row; 1 where rows were kept.
        text: description of the reduction, one sentence.
    """

    source: "Recording"
    rows: np.ndarray | None
    block: int
    text: str

    @property
    def added(self) -> int:
        """Number of rows that the original does not have."""
        return 0 if self.rows is None else int(np.sum(np.diff(self.rows) == 0))


@dataclass
class Recording:
    """One test of one specimen.

    Attributes:
        name: file name without its ending, with the folder below the campaign's in front (`"hot/run_1"`).
        path: CSV that it was read from, or None if it was made in memory.
        kind: `spring`, `wire`, `elastomer`, `tube` or `actuator`.
        role: `fit`, or `validation` (never fitted, only scored).
        specimen: name of the specimen; recordings of one specimen share parameters.
        real: true if measured, false if simulated; None where unstated.
        source: provenance, free text by key (`citation`, `licence`, ...).
        noise: standard deviation of the instrument's noise by canonical column, in that column's unit.
        noise_includes_rounding: true where a statement says that these numbers hold all that rounding adds.
        geometry: stated geometry by canonical key; `full_geometry` adds the nominal values.
        tolerance: relative standard deviations, complete where given; None where the defaults hold.
        zero: prior standard deviation of a column's zero error by canonical column, in its unit; a fit finds
            the error.
        columns: data by canonical name, in canonical units, each of shape (rows,); a missing sample is NaN.
            Columns that the kind does not know come after, under their own names (as text if they are not
            numbers).
        notices: assumptions and omissions of the reader, one sentence each.
        comments: lines before the header, without `#`.
        reduction: origin of these rows, if they were made from more of them.
        memo: cache of results about the columns (`inference.readings`); a copy by `dataclasses.replace`
            starts with none.
        full_scale: saturation value of a quantity that other recordings of the campaign show, SI
            (`inference.readings.share_full_scale`); a copy starts with none.
        written: unit in which the file has a column, and what was taken off it, in the canonical unit, for
            messages; a copy starts with none.
    """

    name: str
    path: Path | None
    kind: str
    role: str = "fit"
    specimen: str = ""
    real: bool | None = None
    source: dict[str, Any] = field(default_factory=dict)
    noise: dict[str, float] = field(default_factory=dict)
    geometry: dict[str, Any] = field(default_factory=dict)
    tolerance: dict[str, float] | None = None
    zero: dict[str, float] = field(default_factory=dict)
    columns: dict[str, np.ndarray] = field(default_factory=dict)
    notices: list[str] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    reduction: Reduction | None = None
    noise_includes_rounding: bool = False
    memo: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)
    full_scale: dict[str, float] = field(default_factory=dict, init=False, repr=False, compare=False)
    written: dict[str, tuple[str, float]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __len__(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()), ()))

    def column(self, quantity: str) -> str:
        """Canonical column that holds a quantity: `column("pressure")` is `"pressure_kPa"`.

        Raises:
            InputError: if this recording does not have it; the nearest one that it has is named.
        """
        name = self._column_or_none(quantity)
        if name is None:
            have = [schema.quantity_and_unit(name)[0] for name in self.known_columns]
            raise InputError(
                f"{self.path or self.name}: no {quantity!r} was recorded, {nearest(quantity, have)}"
            )
        return name

    def _column_or_none(self, quantity: str) -> str | None:
        """Canonical column that holds a quantity, which may be named by its column."""
        columns = self.known_columns
        column_of = {schema.quantity_and_unit(name)[0]: name for name in columns}
        return quantity if quantity in columns else column_of.get(quantity)

    @property
    def counts_rows(self) -> bool:
        """True if the time is the row's number, because the imported file has no clock."""
        return self.source.get(schema.CLOCK) == schema.COUNTED

    def has(self, quantity: str) -> bool:
        """True if a quantity (`"pressure"`, or its column `"pressure_kPa"`) was recorded."""
        return self._column_or_none(quantity) is not None

    def si(self, quantity: str) -> np.ndarray:
        """Values of a quantity in SI units (temperatures in degC); shape (rows,), NaN where missing.

        Args:
            quantity: name of the quantity (`"pressure"`, `"resistance_1"`, ...), or a canonical column name.

        Raises:
            InputError: if this recording does not have it.
        """
        name = self.column(quantity)
        return to_si(self.columns[name], schema.quantity_and_unit(name)[1])

    def noise_si(self, quantity: str) -> float | None:
        """Stated standard deviation of a quantity's noise in SI units (K for temperatures), or None where
        unstated."""
        name = self.column(quantity)
        sigma = self.noise.get(name)
        return None if sigma is None else to_si(sigma, schema.quantity_and_unit(name)[1], difference=True)

    def missing(self, quantity: str) -> np.ndarray:
        """Mask of the samples of a quantity that are missing; shape (rows,)."""
        return np.isnan(self.columns[self.column(quantity)])

    @property
    def whole(self) -> "Recording":
        """The original recording before any reduction, for estimates of its noise."""
        return self.reduction.source if self.reduction else self

    @property
    def block(self) -> int:
        """Number of readings averaged in a row."""
        return self.reduction.block if self.reduction else 1

    def rows_of_whole(self, first: int, last: int) -> tuple[int, int]:
        """Indices in `whole` of the first and the last of some rows, both included."""
        if self.reduction is None:
            return first, last
        rows = self.reduction.rows
        if rows is None:
            return first * self.block, min((last + 1) * self.block, len(self.whole)) - 1
        return int(rows[first]), int(rows[last])

    @property
    def known_columns(self) -> list[str]:
        """Canonical columns of the recording, in the file's order."""
        known = schema.KINDS[self.kind].columns.known
        return [name for name in self.columns if name in known]

    @property
    def outputs(self) -> list[str]:
        """Canonical columns of the recording that the model can predict for this kind."""
        return [name for name in schema.KINDS[self.kind].columns.outputs if name in self.columns]

    def full_geometry(self) -> dict[str, Any]:
        """Geometry with the source's nominal values where the sidecar states none; canonical keys and
        units."""
        return {**nominal_geometry(self.kind, self.geometry), **self.geometry}

    def full_tolerance(self) -> dict[str, float]:
        """The stated tolerances (complete: other quantities are exact), or the defaults where none are
        stated."""
        return dict(schema.TOLERANCE_DEFAULTS if self.tolerance is None else self.tolerance)

    def table(self, key: str) -> str | Path:
        """Table of constants of this recording: a name, `"fit"`, or the path of a TOML beside it.

        Args:
            key: `"alloy"` or `"material"`.
        """
        return locate_table(str(self.full_geometry()[key]), self.path)


def locate_table(stated: str, recording: Path | None) -> str | Path:
    """Resolve the path of an alloy or material. A relative path counts from the sidecar."""
    if not (stated.endswith(".toml") or "/" in stated or "\\" in stated):
        return stated
    beside = Path(stated) if recording is None else recording.parent / stated
    return beside if beside.exists() else Path(stated)


def all_real(recordings: Iterable[Recording]) -> bool | None:
    """True if all recordings were measured, False if one was simulated, else None: one does not state it."""
    stated = {recording.real for recording in recordings}
    if False in stated:
        return False
    return None if None in stated else True


def require_fitted(recordings: Iterable[Recording], path: Path | str) -> None:
    """Refuse recordings that are all for validation.

    Raises:
        InputError: naming the path.
    """
    if not any(recording.role == "fit" for recording in recordings):
        raise InputError(
            f'{path}: every recording has role = "validation"; one with role = "fit" is needed'
        )


@dataclass
class Campaign:
    """The recordings that are fitted together.

    Attributes:
        title: title from `campaign.toml`, else the folder's name.
        recordings: recordings in the order of their names.
        path: folder, or the single CSV.
        notices: sentences about the campaign as a whole.
    """

    title: str
    recordings: list[Recording]
    path: Path
    notices: list[str] = field(default_factory=list)

    @property
    def kinds(self) -> list[str]:
        """Kinds that occur, in the order of `schema.KINDS`."""
        return [kind for kind in schema.KINDS if any(r.kind == kind for r in self.recordings)]

    def of_kind(self, kind: str) -> list[Recording]:
        """Recordings of one kind."""
        return [r for r in self.recordings if r.kind == kind]

    def fittable(self, kind: str) -> list[Recording]:
        """Recordings of one kind, of both roles.

        Raises:
            InputError: if all of them are for validation.
        """
        found = self.of_kind(kind)
        require_fitted(found, self.path)
        return found

    def specimens(self) -> dict[str, list[Recording]]:
        """Recordings by specimen, in the order in which the specimens first appear."""
        groups: dict[str, list[Recording]] = {}
        for recording in self.recordings:
            groups.setdefault(recording.specimen, []).append(recording)
        return groups
