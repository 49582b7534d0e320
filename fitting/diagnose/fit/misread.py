"""Columns that may be in another unit than is stated, of the other sign, or of the other spring.

A slip of ten in a pressure makes a gross misfit, and a named effect of an absurd strength may explain it all.
A slip needs no number that is fitted. The column is off by a ratio of two units, or by its sign, or springs 1
and 2 are exchanged. So each such slip is tried where the base model misses grossly, or where nothing explains
the recordings. One that explains as much as a right effect does is told before every name.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fitting.data.recordings import Recording, schema
from fitting.data.recordings.checks import check_recording
from fitting.inference.notes import joined
from fitting.inference.numbers import number
from pneusma_jax.actuator.designs import layout
from pneusma_jax.errors import InputError

from ..evaluate.evaluation import Evaluation
from ..evaluate.program import Program
from ..settings import DEFAULT
from .base_fit import base_fit
from .confused_units import SPRING, differ_less, factors_of, units_of
from .misfit import relative_errors
from .refit import Fit

SEARCH = DEFAULT.search
SHARE = DEFAULT.share
Build = Callable[[Sequence[Recording], bool], Program]
"""Makes a program of the same campaign from recordings with other values. The truth value is
`nominal_alone` of `Program.of`."""


@dataclass(frozen=True)
class Misread:
    """A slip in the columns of recordings that explains them as soon as it is put right.

    Attributes:
        column: canonical column; the first one where springs are exchanged.
        factor: number by which its readings are multiplied [1]; None where the columns of springs 1 and 2 are
            exchanged.
        recordings: names of the recordings in which they are; empty where it is all of them.
        before, after: largest root mean square error of an output over its range in a recording [1]. They are
            of the base model refitted to the readings as they are, and as they would be.
        total: sum of the squares of the errors after, over all recordings [1].
        alike: other slips that explain about as much, the best first. Of equal ones those between units are,
            and of these the powers of ten.
    """

    column: str
    factor: float | None
    recordings: tuple[str, ...]
    before: float
    after: float
    total: float
    alike: tuple["Misread", ...] = ()

    @property
    def between_units(self) -> bool:
        """True if the factor leads from one unit to another: a slip that people make."""
        return self.factor is not None and bool(units_of(self.column, self.factor))

    @property
    def text(self) -> str:
        """The question, and what it rests on, in sentences."""
        if self.factor is None:
            question = f"Are the springs 1 and 2{self._where} exchanged?"
        else:
            what = "sign" if self.factor < 0.0 else "unit"
            question = f"Has {self.column}{self._where} the right {what}?"
        before, after = (f"{number(100.0 * x, '.2g')} %" for x in (self.before, self.after))
        does = f"does by {before}" if np.isfinite(self.before) else "has no answer to some of them"
        told = (
            f"{question} With {self._how('these readings')} the refitted base model misses "
            f"outputs by at most {after} of their range. With the readings as they are it {does}."
        )
        if not self.alike:
            return told
        others = [
            f"{one._how(f'the readings of {one.column}')}{one._where}" for one in self.alike
        ]
        return f"{told} As much is explained by {joined(others, 'or')}."

    @property
    def _where(self) -> str:
        return f" in {joined(self.recordings)}" if self.recordings else ""

    def _how(self, readings: str) -> str:
        if self.factor is None:
            return "the columns of springs 1 and 2 exchanged"
        if self.factor < 0.0:
            return f"the other sign of {readings}"
        units = units_of(self.column, self.factor)
        units = f" ({units})" if units else ""
        if self.factor > 1.0:
            return f"{number(self.factor)} times {readings}{units}"
        return f"1/{number(1.0 / self.factor)} of {readings}{units}"


def misread_in(
    program: Program,
    base: Fit,
    build: Build,
    unexplained: bool = False,
) -> Misread | None:
    """The slip that explains most of a gross misfit; None where there is none.

    Args:
        program: program of a campaign.
        base: its refitted base model.
        build: see `Build`.
        unexplained: true if no effects explain the recordings. Then slips are tried however small the misfit:
            what mainly heats, such as an actuator, hardly shows a pressure that is off by ten.
    """
    errors = _errors(program, base.evaluation)
    if not (unexplained or np.max(errors) > SHARE.minor):
        return None
    promising, found = _promising(program, _sum(errors), build), list[Misread]()
    for total, (column, factor, chosen) in promising:
        if found and promising[0][0] < SHARE.minor * total:
            break  # this one and all that follow are far from as good
        misread = _refitted(program, errors, column, factor, chosen, build)
        if misread is not None:
            found.append(misread)
    if not found:
        return None
    most = (1.0 + SHARE.alike) ** 2 * min(one.total for one in found)
    alike = [one for one in found if one.total <= most]
    equal = (1.0 + SHARE.same) ** 2 * min(one.total for one in alike)
    alike.sort(key=lambda one: (max(one.total, equal), not one.between_units, not _is_ten(one.factor)))
    best, *others = [alike[k] for k in _apart([(one.column, one.factor) for one in alike])]
    return dataclasses.replace(best, alike=tuple(others))


def _apart(slips: Sequence[tuple[str, float | None]]) -> list[int]:
    """Indices of slips without those whose factor is nearly that of one before, such as 9.81 after 10."""
    found = list[int]()
    for k, slip in enumerate(slips):
        if not any(_near(slip, slips[known]) for known in found):
            found.append(k)
    return found


def _is_ten(factor: float | None) -> bool:
    """True for a power of ten, the plainest of factors that a refitted model does not tell apart."""
    return factor is not None and factor > 0.0 and bool(np.log10(factor) % 1.0 == 0.0)


def _near(one: tuple[str, float | None], other: tuple[str, float | None]) -> bool:
    """True if two factors multiply one column, and a refitted model hardly tells them apart."""
    if one[0] != other[0] or one[1] is None or other[1] is None or min(one[1], other[1]) < 0.0:
        return False
    return differ_less(one[1], other[1], SHARE.alike)


def _promising(
    program: Program, most: float, build: Build
) -> list[tuple[float, tuple[str, float | None, np.ndarray]]]:
    """Slips with which the nominal base model misses least, and recordings that they help.

    Before each stands the sum of squared relative errors that it leaves [1], ascending. All but the first
    leave less than `most`, which is that of the refitted base model. The nominal model does not tell factors
    that are nearly equal, such as 9.81 and 10. They count as one slip, and all of them come.
    """
    here = program.evaluate(program.unknowns.neutral, program.unknowns.base[:0])
    nominal, tried = _errors(program, here), []
    spring = _of_springs(program.recordings)
    for column in dict.fromkeys(name for r in program.recordings for name in r.known_columns):
        quantity = schema.quantity_and_unit(column)[0]
        compared = _is_compared(program, column) and not program.follows(quantity)
        extremes, unchanged = factors_of(column)[:2], set[float]()
        for factor in [*([None] if column == spring else []), *factors_of(column)]:
            if not _possible(program, column, factor):
                continue
            if compared and factor is not None:
                errors = _errors(program, here, quantity, factor)
            else:
                errors = _nominal_errors(program, column, factor, build)
                if factor in extremes and np.allclose(errors, nominal, rtol=SHARE.alike):
                    unchanged.add(factor)
                    if len(unchanged) > 1:
                        break  # neither far more nor far less: the base model hardly uses this column
            helped = errors < nominal
            tried.append((_sum(np.where(helped, errors, nominal)), (column, factor, helped)))
    tried.sort(key=lambda one: one[0])
    slips = [(column, factor) for _, (column, factor, _) in tried]
    firsts = _apart(slips)[: SEARCH.refitted_slips]
    near = [k in firsts or any(_near(slip, slips[first]) for first in firsts) for k, slip in enumerate(slips)]
    best = [one for one, is_near in zip(tried, near, strict=True) if is_near and one[0] < _sum(nominal)]
    return [one for k, one in enumerate(best) if k == 0 or one[0] < most]


def _is_compared(program: Program, column: str) -> bool:
    """True if the model predicts a column wherever it is. The stress of a wire drives it, or is predicted."""
    quantity = schema.quantity_and_unit(column)[0]
    return all(
        any(channel.quantity == quantity for channel in channels)
        for recording, channels in zip(program.recordings, program.channels, strict=True)
        if column in recording.columns
    )


def _refitted(
    program: Program,
    errors: np.ndarray,
    column: str,
    factor: float | None,
    chosen: np.ndarray,
    build: Build,
) -> Misread | None:
    """A column multiplied in chosen recordings, if the base model refitted to that leaves little.

    Args:
        program: program of the campaign as it is.
        errors: relative errors of its refitted base model by recording [1].
        column, factor: canonical column, and the number that multiplies it.
        chosen: mask of the recordings, shape (recordings,).
        build: as of `misread_in`.
    """
    pairs = list(zip(program.recordings, chosen, strict=True))
    try:
        changed = [scaled(r, column, factor) if there else r for r, there in pairs]
        trial, fit = base_fit(build(changed, False))
    except InputError:  # no model for both together
        return None
    after = _errors(trial, fit.evaluation)
    gross = np.max(after) >= SHARE.minor
    if gross or _sum(after) > SHARE.small * _sum(errors):
        return None
    names = () if chosen.all() else tuple(r.name for r, there in pairs if there)
    return Misread(column, factor, names, float(np.max(errors)), float(np.max(after)), _sum(after))


def _errors(program: Program, evaluation: Evaluation, quantity: str = "", factor: float = 1.0) -> np.ndarray:
    """Relative errors by recording [1]; an output that does not vary tells nothing of a slip."""
    return relative_errors(program, evaluation, quantity, factor, still=0.0)


def _sum(errors: np.ndarray) -> float:
    return float(np.sum(errors**2))


def scaled(recording: Recording, column: str, factor: float | None) -> Recording:
    """A recording with a slip put right: a column is multiplied, with what is stated of its noise and zero.

    Args:
        recording: any recording; one without the column stays as it is.
        column, factor: see `Misread`.
    """
    if factor is None:
        return _with_tables(recording, _exchanged, _exchanged)
    if column not in recording.columns:
        return recording

    def times(number: float) -> Callable[[Mapping], dict]:
        return lambda table: {name: number * x if name == column else x for name, x in table.items()}

    return _with_known_readings(_with_tables(recording, times(factor), times(abs(factor))), recording, column)


def _with_known_readings(made: Recording, recording: Recording, column: str) -> Recording:
    """A scaled recording that knows which rows of its other columns are readings. These depend on where the
    scaled column changes, and not on its unit."""
    own = schema.quantity_and_unit(column)[0]
    made.memo.update({key: known for key, known in recording.memo.items() if key[1] not in (own, column)})
    made.full_scale.update({name: level for name, level in recording.full_scale.items() if name != own})
    if made.reduction is not None and recording.reduction is not None:
        _with_known_readings(made.reduction.source, recording.reduction.source, column)
    return made


def _with_tables(
    recording: Recording, of_columns: Callable[[Mapping], dict], of_sizes: Callable[[Mapping], dict]
) -> Recording:
    """A recording whose columns, and whose noise and zeros by column, are made by two functions."""
    reduction = recording.reduction
    if reduction is not None:
        source = _with_tables(reduction.source, of_columns, of_sizes)
        reduction = dataclasses.replace(reduction, source=source)
    return dataclasses.replace(
        recording, columns=of_columns(recording.columns), noise=of_sizes(recording.noise),
        zero=of_sizes(recording.zero), reduction=reduction, notices=list(recording.notices),
    )  # fmt: skip


def _of_springs(recordings: Sequence[Recording]) -> str | None:
    """The first resistance of one of springs 1 and 2; None where there is none, or only one of them."""
    names = (name for recording in recordings for name in recording.known_columns)
    found = next((name for name in names if name.startswith("resistance") and SPRING.search(name)), None)
    if found is None:
        return None
    springs = [set(layout(recording.full_geometry()["design"]).spring_numbers) for recording in recordings]
    return found if all({1, 2} <= own for own in springs) else None


def _exchanged(table: Mapping) -> dict:
    """Values by column with the columns of springs 1 and 2 exchanged."""
    return {SPRING.sub(lambda at: "_2" if at[1] == "1" else "_1", name): x for name, x in table.items()}


def _possible(program: Program, column: str, factor: float | None) -> bool:
    """True if a column may be multiplied in all recordings without impossible values."""
    try:
        for recording in program.recordings:
            check_recording(scaled(recording, column, factor))
    except InputError:
        return False
    return True


def _nominal_errors(program: Program, column: str, factor: float | None, build: Build) -> np.ndarray:
    """Relative errors by recording [1] of the nominal base model with a column multiplied everywhere.

    Infinite where the model has no answer.
    """
    try:
        trial = build([scaled(recording, column, factor) for recording in program.recordings], True)
    except InputError:
        return np.full(len(program.recordings), np.inf)
    return _errors(trial, trial.nominal)
