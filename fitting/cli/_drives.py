"""Options about springs: `--xi0-2 0.4`, `--xi0 2=0.4`, in a chain `--xi0 3.2=0.4`."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import click

from ._common import FINITE

_PLACE = re.compile(r"(?:(\d+)\.)?(\d+)")
STEMS = {"xi0": "", "resistance": "-ohm"}
"""Unit in the name of an option about a spring, by what it gives: martensite fraction or resistance."""


@dataclass(frozen=True)
class SpringInput:
    """One input of one spring on the command line.

    Attributes:
        stem: key of `STEMS`.
        segment: number of the segment; None for all of them.
        spring: number of the spring in its segment.
        value: martensite fraction [1], or resistance [ohm].
    """

    stem: str
    segment: int | None
    spring: int
    value: float

    @property
    def option(self) -> str:
        """The option as written on the command line."""
        if self.segment is None and self.spring <= 3:
            return f"--{self.stem}-{self.spring}{STEMS[self.stem]}"
        place = self.spring if self.segment is None else f"{self.segment}.{self.spring}"
        return f"--{self.stem} {place}="


def spring_options(command: Callable) -> Callable:
    """`--xi0-K` and `--resistance-K-ohm` for three springs, `--xi0` and `--resistance` for any."""
    for stem, unit in (("resistance", "OHM"), ("xi0", "FRACTION")):
        command = click.option(
            f"--{stem}", f"many_{stem}", multiple=True, metavar=f"[SEGMENT.]SPRING={unit}",
            help="The same for any spring; in a chain 3.2=... is of spring 2 of segment 3.",
        )(command)  # fmt: skip
    for k in (3, 2, 1):
        xi0 = click.option(
            f"--xi0-{k}", f"xi0_{k}", type=FINITE, help=f"Martensite fraction of spring {k} (1: cold)."
        )
        ohm = click.option(f"--resistance-{k}-ohm", f"resistance_{k}", type=FINITE, help="Or its resistance.")
        command = xi0(ohm(command))
    return command


def spring_inputs(options: dict[str, Any]) -> list[SpringInput]:
    """All inputs of springs on the command line, checked.

    Raises:
        click.UsageError: for a number that cannot be, or two that contradict each other.
    """
    inputs = [
        SpringInput(stem, None, k, options[f"{stem}_{k}"])
        for stem in STEMS for k in (1, 2, 3) if options[f"{stem}_{k}"] is not None
    ]  # fmt: skip
    inputs += [_parsed(stem, text) for stem in STEMS for text in options[f"many_{stem}"]]
    taken: dict[tuple, SpringInput] = {}
    for one in inputs:
        _check(one)
        before = taken.setdefault((one.segment, one.spring), one)
        if before is not one:
            raise click.UsageError(f"give either {before.option.rstrip('=')} or {one.option}, not both")
    return inputs


def of_segment(inputs: list[SpringInput], segment: int | None) -> dict[str, float]:
    """Options about one segment's springs, by `xi0_K` or `resistance_K`; a segment's own option wins over one
    for all."""
    found: dict[tuple[int], SpringInput] = {}
    for one in sorted(inputs, key=lambda one: one.segment is not None):
        if one.segment in (None, segment):
            found[one.spring] = one
    return {f"{one.stem}_{one.spring}": one.value for one in found.values()}


def _parsed(stem: str, text: str) -> SpringInput:
    place, _, number = text.partition("=")
    match = _PLACE.fullmatch(place.strip())
    try:
        value = float(number)
    except ValueError:
        match = None
    if match is None:
        raise click.UsageError(
            f"--{stem} {text!r} must be SPRING=VALUE or SEGMENT.SPRING=VALUE, such as 3.2=0.4"
        )
    return SpringInput(stem, int(match[1]) if match[1] else None, int(match[2]), value)


def _check(one: SpringInput) -> None:
    option, value = one.option, one.value
    shown = f"{option}{value:g}" if option.endswith("=") else f"{option} {value:g}"
    if one.stem == "xi0" and not 0.0 <= value <= 1.0:
        raise click.UsageError(f"{shown} must be a fraction from 0 (hot) to 1 (cold)")
    if one.stem == "resistance" and not (value > 0.0 and math.isfinite(value)):
        raise click.UsageError(f"{shown} must be a positive number of ohms")
