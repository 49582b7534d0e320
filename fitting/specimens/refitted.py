"""A model on disk with the parameters of a fit."""

import dataclasses
from collections.abc import Mapping, Sequence

import numpy as np

from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameter, Parameters, Prior
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.calibration.records import Quantity

from .rows import MARK
from .saved_models import AugmentedModel
from .with_saved_model import Augmented


def refitted(
    augmented: Augmented,
    campaign: Campaign,
    parameters: Parameters,
    source: str,
    errors: Mapping[str, float] | None = None,
) -> AugmentedModel:
    """The model with fitted parameters, whose standard errors become priors.

    Args:
        augmented: model that was fitted.
        campaign: recordings that it was fitted to.
        parameters: fitted parameters, SI.
        source: text for the file's field `source`.
        errors: standard errors that are quoted instead of the fit's, by name, SI.
    """
    model, errors = augmented.model, errors or {}
    base = {kind: dict(table) for kind, table in model.base.items()}
    own = {s: {kind: dict(t) for kind, t in tables.items()} for s, tables in model.specimens.items()}
    specimens = list(campaign.specimens())
    effects = {name for names in augmented.names for name in names.values()}
    for name, entry in parameters.items():
        if name in effects:
            continue
        stem, mark, number = name.partition(MARK)
        specimen = specimens[int(number) - 1] if mark else None
        if specimen is None and len(specimens) == 1 and _states(own.get(specimens[0], {}), stem):
            specimen = specimens[0]
        place = base if specimen is None else own.setdefault(specimen, {})
        table = _table_of(augmented.specimen.tables, stem)
        if table is not None:
            place.setdefault(table, {})[stem] = _quantity(stem, entry, source, errors.get(name))
    pairs = iter(zip(augmented.acting, augmented.names, strict=True))
    added = []
    for one in model.added:
        if one not in augmented.acting:
            added.append(one)
            continue
        _, names = next(pairs)
        found = {k: _quantity(k, parameters[n], source, errors.get(n)) for k, n in names.items()}
        added.append(dataclasses.replace(one, parameters={**one.parameters, **found}))
    return dataclasses.replace(
        model, base=base, specimens=own, added=tuple(added), description=source, path=None
    )


def _states(tables: Mapping[str, Mapping[str, Quantity]], name: str) -> bool:
    return any(name in table for table in tables.values())


def _table_of(tables: Sequence[str], name: str) -> str | None:
    """Kind of table that a parameter belongs to; None if no table has it."""
    return next((table for table in tables if name in QUANTITIES[table]), None)


def _quantity(name: str, entry: Parameter, source: str, error: float | None) -> Quantity:
    sd = entry.standard_error if error is None else error
    prior = None if not sd or not np.isfinite(sd) else Prior(float(entry.value), float(sd))
    note = "" if entry.free else "; held"
    return Quantity(name, float(entry.value), entry.unit, "fitted", source + note, prior)
