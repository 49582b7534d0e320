"""A threshold as a field of a dataclass: value, sentence, unit and the measurement that it rests on."""

from collections.abc import Iterator
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

CHOSEN = "not measured: chosen"
NUMERICAL = "not measured: numerical tolerance far below any effect"


@dataclass(frozen=True)
class Threshold:
    """One threshold as a reader sees it.

    Attributes:
        name: `group.field`.
        value: a number, or a tuple of numbers.
        sentence: begins with "Minimum", "Maximum", "Factor" or "Number of".
        unit: SI unit, `sd` (standard deviations), `nat` (natural logarithm of a likelihood), or `1`.
        basis: the measurement that it rests on.
    """

    name: str
    value: Any
    sentence: str
    unit: str
    basis: str


def threshold(value: Any, sentence: str, unit: str = "1", basis: str = CHOSEN) -> Any:
    """A field with a default and the metadata of `Threshold`."""
    return field(default=value, metadata={"sentence": sentence, "unit": unit, "basis": basis})


def thresholds_of(settings: Any) -> Iterator[Threshold]:
    """Every threshold of a dataclass whose fields are groups of thresholds, in order."""
    for group in fields(settings):
        members = getattr(settings, group.name)
        if not is_dataclass(members):
            raise TypeError(f"{group.name} is no group of thresholds")
        for one in fields(members):
            about = one.metadata
            name = f"{group.name}.{one.name}"
            yield Threshold(
                name, getattr(members, one.name), about["sentence"], about["unit"], about["basis"]
            )
