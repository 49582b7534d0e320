"""What a study's rows go through: the model's outputs as one function of numbers that may vary."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.calibration.records import Prior

NOT_FINITE = 99
"""Status of a row whose outputs are not all finite, where the model gives no reason."""
SENTENCES = {int(status): status.sentence for status in pj.Status} | {
    NOT_FINITE: "An output is not a finite number."
}
"""Why a row has no result, by status."""


@dataclass(frozen=True)
class Known:
    """A number that may vary.

    Attributes:
        value: nominal, SI.
        unit: unit in files.
        prior: prior distribution, or None.
        table: kind of table that it belongs to; empty for others.
    """

    value: float
    unit: str
    prior: Prior | None = None
    table: str = ""


@dataclass(frozen=True)
class Driver:
    """What outputs are given along.

    Attributes:
        name: column with its unit.
        values: values in that unit, shape (points,).
    """

    name: str
    values: np.ndarray


Answer = Callable[[Mapping[str, Array]], tuple[dict[str, Array], Array]]
"""Outputs of one row in the units of their names, each of shape () or (points,), and a status code."""


@dataclass(frozen=True)
class Response:
    """The model as a study sees it.

    Attributes:
        title: title for people.
        known: numbers that may vary, by name.
        driver: or None where there is one state only.
        outputs: true for each output that is given along the driver, by name.
        answer: a pure function of the values [SI] of some of `known`.
        files: files that the numbers come from.
        notices: notices about the numbers.
        side_by_side: rows that are computed together.
    """

    title: str
    known: Mapping[str, Known]
    driver: Driver | None
    outputs: Mapping[str, bool]
    answer: Answer
    files: tuple[Path, ...] = ()
    notices: tuple[str, ...] = ()
    side_by_side: int = 64
    tied: Mapping[str, str] = field(default_factory=dict)
    """Numbers that follow others, by name, with the sentence that says so: their own priors are left out."""
