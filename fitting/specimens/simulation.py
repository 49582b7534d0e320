"""The forward model at every row of one recording, for simulations and synthetic campaigns."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from fitting.data.recordings import Campaign, Recording
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.numerics.safe import as_arrays
from pneusma_jax.pipeline import Effect
from pneusma_jax.program_cache import stored_jit

from .model_objects import BASE, named_table
from .rows import Rows, stack, with_numbers
from .saved_models import AugmentedModel
from .silicones import FACTOR
from .specimen import Courses, RowOptions, Specimen

TABLES = {"base": ("alloy", "alloy"), "material": ("material", "silicone")}
"""Key of `[geometry]` that names an option's table, and the kind of that table."""


@dataclass(frozen=True)
class Simulation:
    """Prediction of one recording. All arrays are in SI and have shape (rows,).

    Attributes:
        rows: recording as arrays, with the parameters of the model.
        outputs: instrument readings by quantity; NaN where there is no answer.
        drivers: driving quantities by name.
    """

    rows: Rows
    outputs: Courses
    drivers: Courses


def simulated(
    specimen: Specimen,
    recording: Recording,
    model: AugmentedModel = BASE,
    smooth: bool = True,
    values: Mapping[str, float] | None = None,
) -> Simulation:
    """Prediction in every row of a recording that has all drivers.

    Args:
        specimen: kind of specimen.
        recording: recording with the inputs; outputs may be missing.
        model: constants in place of the tables', and effects.
        smooth: true to smooth noisy drivers, for kinds that smooth any.
        values: parameter values that replace the model's, by name, SI.

    Raises:
        InputError: if the recording leaves its alloy or material open, or no row has all drivers.
    """
    options = RowOptions(most=None, fewest=1, smooth=smooth, compared=False)
    campaign = Campaign(recording.name, [recording], recording.path or Path(recording.name))
    (rows,) = specimen.rows_for(campaign, options, **tables_of(specimen, recording, model))
    rows = with_numbers(rows, numbers_of(specimen, model, recording.specimen))
    overrides = as_arrays(values or {})
    outputs, drivers = jax.device_get(_answer(specimen, overrides, stack([rows]), model.effects))
    count = len(rows.mask)
    cut = lambda courses: {name: np.asarray(x)[0, :count] for name, x in courses.items()}  # noqa: E731
    return Simulation(rows, cut(outputs), cut(drivers))


@stored_jit()
def _answer(
    specimen: Specimen, values: Mapping[str, jax.Array], stacked: Rows, effects: tuple[Effect, ...]
) -> Any:
    return jax.vmap(lambda rows: specimen.answer(values, rows, effects))(stacked)


def numbers_of(specimen: Specimen, model: AugmentedModel, name: str | None = None) -> dict[str, Quantity]:
    """A model's own constants, by their parameter names in `Rows`.

    Args:
        specimen: kind of specimen.
        model: loaded model.
        name: name of the specimen whose own constants count, if any.
    """
    found: dict[str, Quantity] = {}
    for kind in specimen.tables:
        for key, quantity in model.quantities(kind, name).items():
            found.setdefault(key, quantity)
    return found


def tables_of(
    specimen: Specimen, recording: Recording, model: AugmentedModel
) -> dict[str, Calibration]:
    """A recording's tables with a model's constants, by the option of `rows_for` that takes each."""
    return {name: _table(recording, name, model) for name in specimen.options}


def _table(recording: Recording, option: str, model: AugmentedModel) -> Calibration:
    """A recording's table with the model's constants, without the factor on a silicone, which `Rows`
    holds."""
    key, kind = TABLES[option]
    name = named_table(recording, key)
    table, plain = model.table(kind, name, recording.specimen), BASE.table(kind, name).quantities
    quantities = {n: q for n, q in table.quantities.items() if n != FACTOR}
    return replace(table, quantities=quantities | {n: q for n, q in plain.items() if n == FACTOR})
