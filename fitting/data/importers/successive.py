"""Tests of one specimen in files of their own that followed each other, joined into one recording.

Every recording begins with a specimen at rest that remembers nothing. A silicone remembers its largest
stretch, and a nitinol its last pull. So a fit sees that memory in a joined recording alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import InputError, counted

from ..recordings import Recording, check_recording, schema
from ..recordings.table import unusable
from .sizes import CONSTANTS, SAME, Sizes
from .specimen_sizes import area_of
from .start_lines import Begin
from .starts import AT_START, BEGINS

_FOR_ONE_FILE = ("--subtract", "--scale")
"""Options that a notice proposes for the numbers of one file."""
_FLAT = "is flat at"
"""Words of a notice about slack, see `slack_treatment`."""


def joined(
    recordings: Sequence[Recording],
    sizes: Sequence[Sizes],
    specimen: str | None,
    origins: Sequence[float | None] = (),
    begins: Sequence[Begin | None] = (),
) -> Recording:
    """One recording of several, one after the other in the order given.

    The clock goes on where a file begins later than the one before ends. Else it is counted on from there:
    after the pause that lines of both files state, or else a median step later. So is a column of cycles.

    Args:
        recordings: one of each file.
        sizes: dimensions of the specimen that each file states.
        specimen: name of the specimen; None takes the one that all files name, else the first one's.
        origins: moment of 0 s of each file's clock, on one calendar [s]; None where no date states it. Empty
            if no file has a date.
        begins: begin of each test by a line of its file; None where no line states it. Empty if none does.

    Returns:
        The recording. Its notices say what was joined, and how the times go on.

    Raises:
        InputError: if there are fewer than two files, if their kinds, columns or dimensions disagree, or if
            their dates contradict the order given.
    """
    if len(recordings) < 2:
        raise InputError("--successive joins two files or more; name them in the order of the tests")
    first = recordings[0]
    for other, of_other in zip(recordings[1:], sizes[1:], strict=True):
        _refuse_unlike(first, other)
        _refuse_other_sizes(first, other, sizes[0], of_other)
        _refuse_other_areas(first, other, sizes[0], of_other)
    columns = {name: np.concatenate([r.columns[name] for r in recordings]) for name in first.columns}
    said = [_order(recordings)]
    if "time_s" in columns:
        none = [None] * len(recordings)
        columns["time_s"], how = _counted_on(recordings, origins or none, begins or none)
        said += how
    if "cycle" in columns:
        columns["cycle"] = _cycles(recordings)
        said.append("cycle goes on from file to file")
    names = {recording.specimen for recording in recordings}
    whole = replace(
        first,
        name=f"{first.name}_to_{recordings[-1].name}",
        specimen=specimen or (first.specimen if len(names) == 1 else first.name),
        columns=columns,
        notices=[*said, *_notices(recordings)],
        source=_source(recordings),
    )
    check_recording(whole)
    whole.source["notes"] = list(whole.notices)
    return whole


def _place(recording: Recording) -> str:
    return str(recording.path or recording.name)


def _refuse_unlike(first: Recording, other: Recording) -> None:
    """Refuse a recording of another kind, with other columns, or of another specimen than the first."""
    place, before = _place(other), _place(first)
    if other.kind != first.kind:
        raise unusable(
            place, f"this is of kind {other.kind}, and {before} is of kind {first.kind}; --successive joins"
            " tests of one specimen",
        )  # fmt: skip
    if set(other.columns) != set(first.columns):
        lacks = ", ".join(sorted(set(first.columns) - set(other.columns))) or "nothing"
        more = ", ".join(sorted(set(other.columns) - set(first.columns))) or "nothing"
        raise unusable(
            place, f"its columns are not those of {before}, to which --successive joins it: it lacks {lacks},"
            f" and has {more} besides. Name them with --map, or import each file by itself",
        )  # fmt: skip
    for key in sorted({*first.geometry, *other.geometry}):
        one, two = (recording.geometry.get(key) for recording in (first, other))
        if one != two:
            raise unusable(
                place, f"its {key} is {two}, and that of {before} is {one}; --successive joins tests of one"
                " specimen: state its size with --dimension",
            )  # fmt: skip
    if (other.source.get(schema.CLOCK) or "") != (first.source.get(schema.CLOCK) or ""):
        raise unusable(place, f"only one of this file and {before} has a clock; state --interval")
    if other.zero or first.zero:
        raise unusable(
            place, "--slack fit leaves one zero to every recording, and joined files have one each;"
            " leave them with --slack keep, or take them off with --subtract",
        )  # fmt: skip


def _refuse_other_sizes(first: Recording, other: Recording, known: Sizes, sizes: Sizes) -> None:
    """Refuse a file that states another size of the specimen than the first one does.

    A temperature or a stress is no size: each test may have its own.
    """
    for key in sorted((known.keys() & sizes.keys()) - {*CONSTANTS}):
        one, two = known[key], sizes[key]
        if abs(one.value - two.value) > SAME * abs(one.value):
            raise unusable(
                _place(other), f"it states {two.said!r}, and {_place(first)} states {one.said!r}:"
                " --successive joins tests of one specimen. Mend the size in the file, or import each by"
                " itself",
            )  # fmt: skip


def _refuse_other_areas(first: Recording, other: Recording, known: Sizes, sizes: Sizes) -> None:
    """Refuse a coupon or wire whose file states another cross-section in other sizes: an area, a diameter."""
    if not schema.KINDS[first.kind].strained:
        return
    of_first, of_other = (
        area_of({name: size.value for name, size in part.items()}) for part in (known, sizes)
    )
    if of_first is None or of_other is None:
        return
    one, two = of_first[1], of_other[1]
    if abs(one - two) > SAME * one:
        raise unusable(
            _place(other), f"it states a cross-section of {two:.6g} mm2, and {_place(first)} states one of"
            f" {one:.6g} mm2. --successive joins tests of one specimen: mend the size in the file, or import"
            " each by itself",
        )  # fmt: skip


def _order(recordings: Sequence[Recording]) -> str:
    parts = ", ".join(f"{_name(r)} ({counted(len(r), 'row')})" for r in recordings)
    return (
        f"check: {len(recordings)} files were joined in this order, as tests of one specimen, one after"
        f" the other: {parts}"
    )


def _name(recording: Recording) -> str:
    return recording.path.name if recording.path else recording.name


def _counted_on(
    recordings: Sequence[Recording], origins: Sequence[float | None], begins: Sequence[Begin | None]
) -> tuple[np.ndarray, list[str]]:
    """Times of all files on one clock [s], and notices about each seam.

    Raises:
        InputError: if a file's date is before the end of the file before.
    """
    parts, said = [recordings[0].columns["time_s"]], []
    zero = origins[0]  # moment of 0 s of the joined clock, as far as dates state it
    for k, (recording, origin) in enumerate(zip(recordings[1:], origins[1:], strict=True), start=1):
        time, end = recording.columns["time_s"], float(np.nanmax(parts[-1]))
        dated = zero is not None and origin is not None
        if zero is not None and origin is not None:
            time = time + (origin - zero)
        begin = float(time[np.isfinite(time)][0])
        if begin > end:
            said.append(
                f"check: {_name(recording)} begins at {begin:g} s, {begin - end:.6g} s after the end of the"
                " one before: kept"
            )
            parts.append(time)
            continue
        if dated and begin < end:
            raise unusable(
                _place(recording), f"by its dates it begins {end - begin:.6g} s before the end of the file"
                " before; name the files in the order of the tests",
            )  # fmt: skip
        pause, how = _pause(recordings[k - 1], recording, begins[k - 1], begins[k])
        said.append(
            f"check: {_name(recording)} begins at {begin:g} s, and the one before ends at {end:g} s. Its"
            f" times were counted on from there, {how}"
        )
        zero = None  # times after this seam are no longer those of any calendar
        parts.append(time - begin + end + pause)
    return np.concatenate(parts), said


def _pause(
    before: Recording, recording: Recording, earlier: Begin | None, later: Begin | None
) -> tuple[float, str]:
    """Pause between two files whose clocks begin anew [s], and the words of a notice about it.

    It is the one that lines of both files state. Where none do, or where it would be negative, it is a median
    step of the later file.
    """
    times = [one.columns["time_s"][np.isfinite(one.columns["time_s"])] for one in (before, recording)]
    stated = ""
    if earlier is not None and later is not None:
        pause = later.moment - earlier.moment - float(np.ptp(times[0]))
        stated = f"by {earlier.said!r} and {later.said!r}"
        if pause > 0.0:
            return pause, (
                f"{pause:.6g} s later, {stated}: right if both state the begin of a test. A specimen that had"
                " recovered begins anew: import such files without --successive, under one --specimen"
            )
        stated = f" ({stated} it begins {-pause:.6g} s before that end)"
    steps = np.diff(times[1])
    step = float(np.median(steps[steps > 0.0])) if (steps > 0.0).any() else 0.0
    return step, (
        f"one step of {step:.3g} s later. The true pause is not known{stated}, so nothing that heals in it"
        " can be judged"
    )


def _cycles(recordings: Sequence[Recording]) -> np.ndarray:
    """Numbers of cycles that go on from file to file."""
    parts = [recordings[0].columns["cycle"]]
    for recording in recordings[1:]:
        own = recording.columns["cycle"]
        parts.append(own - np.nanmin(own) + np.nanmax(parts[-1]) + 1.0)
    return np.concatenate(parts)


def _notices(recordings: Sequence[Recording]) -> list[str]:
    """Notices of all files: once if all have it, else with the name of the file."""
    shared = [text for text in recordings[0].notices if all(text in r.notices for r in recordings)]
    own = []
    for number, recording in enumerate(recordings):
        goes_on = number > 0 and _goes_on(recordings[number - 1], recording)
        for text in (text for text in recording.notices if text not in shared):
            if goes_on and text.startswith(f"check: {BEGINS}"):
                continue  # it is the strain at which the file before ends
            mark, plain = ("check: ", text[7:]) if text.startswith("check: ") else ("", text)
            if any(option in plain for option in _FOR_ONE_FILE):
                plain += " (which acts on every file that is joined)"
            if number and _FLAT in plain:
                mark = "check: "
                plain += ". After a pull a permanent set looks the same: --slack keep leaves it to the model"
            own.append(f"{mark}{_name(recording)}: {plain}")
    return [*own, *shared]


def _goes_on(before: Recording, recording: Recording) -> bool:
    """True if the strain of a file begins where that of the file before ends."""
    strains = [r.columns.get("strain", np.zeros(0)) for r in (before, recording)]
    strains = [values[np.isfinite(values)] for values in strains]
    if not all(map(len, strains)):
        return False
    reach = max(map(np.ptp, strains))
    return bool(abs(strains[1][0] - strains[0][-1]) <= AT_START * reach)


def _source(recordings: Sequence[Recording]) -> dict[str, object]:
    """Provenance of all files; what they do not share is listed."""
    found: dict[str, object] = {}
    for key in dict.fromkeys(key for recording in recordings for key in recording.source):
        values = [recording.source[key] for recording in recordings if key in recording.source]
        if all(value == values[0] for value in values):
            found[key] = values[0]
        elif isinstance(values[0], list):
            found[key] = [line for lines in values for line in lines]
        else:
            found[key] = "; ".join(map(str, values))
    return found
