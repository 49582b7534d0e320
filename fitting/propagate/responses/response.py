"""The model of a study: its outputs as one function of the numbers that may vary."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.calibration.records import Prior

NOISE = "noise"
"""Name of the input that picks the white noise of channels."""
NOT_FINITE = 99
"""Status of a row whose outputs are not all finite, where the model gives no reason. Those of `pj.Status` are
smaller."""
FIRST_OUTPUT = NOT_FINITE + 1
"""Status of a row whose first output is the first that is not finite; those of the next ones follow."""
OUTPUTS_WITH_STATUS = 256 - FIRST_OUTPUT
"""Number of outputs with a status of their own: what is left of a byte, in which a status is stored."""
SENTENCES = {int(status): status.sentence for status in pj.Status} | {
    NOT_FINITE: "An output is not a finite number."
}
"""Reasons why a row has no result, by status; see `reason`."""


def status_of_output(first: Array) -> Array:
    """Status of a row whose first output that is not finite is the one at an index.

    Args:
        first: index of the output, from 0; any shape.
    """
    return jnp.where(first < OUTPUTS_WITH_STATUS, FIRST_OUTPUT + first, NOT_FINITE)


def undefined_output(code: int, outputs: Sequence[str]) -> str | None:
    """Name of the output that a status from `status_of_output` tells; None for any other status."""
    at = int(code) - FIRST_OUTPUT
    return outputs[at] if 0 <= at < len(outputs) else None


def reason(code: int, outputs: Sequence[str]) -> str:
    """Sentence on why a row has no result.

    Args:
        code: status of the row.
        outputs: names of the study's outputs, in their order.
    """
    undefined = undefined_output(code, outputs)
    if undefined is not None:
        return f"The output {undefined} is not a finite number."
    return SENTENCES.get(code, "no result")


@dataclass(frozen=True)
class Variable:
    """A number that may vary.

    Attributes:
        value: nominal value, SI.
        unit: unit in files.
        prior: prior distribution, or None.
        table: kind of the table with this number; empty for numbers of no table.
    """

    value: float
    unit: str
    prior: Prior | None = None
    table: str = ""


@dataclass(frozen=True)
class Driver:
    """The quantity along which outputs are given, such as a pressure.

    Attributes:
        name: column with its unit.
        values: values in that unit, shape (points,).
    """

    name: str
    values: np.ndarray


Answer = Callable[[Mapping[str, Array]], tuple[dict[str, Array], Array]]
"""Outputs of one row in the units of their names, each of shape () or (points,), and a status code. Beside
them stands `touching.TOUCHING`, where there is a body."""


@dataclass(frozen=True)
class Response:
    """The model as a study sees it.

    Attributes:
        title: title for people.
        variables: numbers that may vary, by name.
        driver: the driver, or None for a single state.
        outputs: true for each output that is given along the driver, by name.
        answer: a pure function of the values [SI] of some of `variables`.
        files: files that the numbers come from.
        notices: notices about the numbers.
        batch_size: number of rows that one device computes together.
        smooth: true if the outputs have derivatives by the values.
        with_units: false for plain numbers. Otherwise an output whose name has no unit is in "1".
        tied: numbers that are computed from others, by name, each with a sentence that says how. Their own
            priors are left out.
    """

    title: str
    variables: Mapping[str, Variable]
    driver: Driver | None
    outputs: Mapping[str, bool]
    answer: Answer
    files: tuple[Path, ...] = ()
    notices: tuple[str, ...] = ()
    batch_size: int = 64
    smooth: bool = True
    with_units: bool = True
    tied: Mapping[str, str] = field(default_factory=dict)
