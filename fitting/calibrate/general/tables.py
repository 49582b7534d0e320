"""Fitted numbers as tables that simulations load by path: an alloy, a material, a geometry."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import tomlkit

from fitting.calibrate.alloy_table import DIGITS, alloy_table, slug
from fitting.calibrate.result import Estimate
from fitting.data.recordings import schema
from fitting.specimens import priors, silicones
from fitting.specimens.rows import MARK
from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.records import Prior, Quantity
from pneusma_jax.units import from_si

if TYPE_CHECKING:
    from .pipeline import GeneralCharacterisation


def tables(result: "GeneralCharacterisation") -> dict[str, Calibration]:
    """`alloy.toml` where constants of an alloy were free, `material.toml` where a silicone's were."""
    found, simulated = {}, result.real is False
    alloy = _alloy(result)
    if alloy:
        begun = [r.full_geometry()["prestrain"] for r in result.fit.recordings if r.kind == "spring"]
        found["alloy.toml"] = alloy_table(
            result.title, alloy, result.fitted, simulated, result.parameters, begun
        )
    stiffness = {n: e for n, e in result.fitted.items() if n.partition(MARK)[0] == silicones.FACTOR}
    if stiffness:
        found["material.toml"] = _material(result, simulated)
    return found


def _alloy(result: "GeneralCharacterisation") -> dict[str, Quantity]:
    """Constants that the alloy was fitted from; empty where none of them was free."""
    quantities = result.specimen.alloy_quantities(result.campaign, **result.options)
    if result.model is not None:
        own = result.model.model.quantities("alloy")
        quantities = {name: own.get(name, quantity) for name, quantity in quantities.items()}
    return quantities if set(quantities) & set(result.fitted) else {}


def _material(result: "GeneralCharacterisation", simulated: bool) -> Calibration:
    """The silicone's table with the factor found: the mean of the specimens, each weighed by its error."""
    name = silicones.table_name(result.campaign, result.options.get("material"))
    table = load_calibration(name, "silicone")
    value, sd = factor_of(result.parameters)
    source = f"Fitted to {result.title}{', simulated data' if simulated else ''}"
    own = table.quantities.get(silicones.FACTOR)
    times = 1.0 if own is None else own.value
    prior = Prior(times * value, times * sd, 0.1, 10.0) if sd > 0.0 else None
    rounded = float(f"{times * value:.{DIGITS}g}")
    quantity = Quantity(silicones.FACTOR, rounded, "1", "fitted", source, prior)
    return replace(
        table,
        name=slug(f"{result.title} silicone"),
        description=f"Silicone of {result.title}, by one factor on the stress of {table.name}",
        path=None,
        quantities={**table.quantities, silicones.FACTOR: quantity},
    )


def factor_of(quoted: Mapping[str, Estimate]) -> tuple[float, float]:
    """Factor on the silicone's stress over all specimens, and its standard deviation with their spread.

    Args:
        quoted: estimates with the errors that the report quotes, by name.
    """
    mine = [e for n, e in quoted.items() if n.partition(MARK)[0] == silicones.FACTOR]
    values, errors = (np.array([getattr(e, name) for e in mine]) for name in ("value", "sd"))
    if not (np.isfinite(errors) & (errors > 0.0)).all():
        return float(values.mean()), 0.0
    weight = errors**-2.0
    mean = float(weight @ values / weight.sum())
    spread = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return mean, float(np.hypot(weight.sum() ** -0.5, spread))


def geometry_toml(result: "GeneralCharacterisation") -> str:
    """`[geometry]` with the dimensions found, for `simulate --geometry`; empty where none was free."""
    found = {}
    for name, entry in result.fitted.items():
        keys = [k for k in schema.GEOMETRY_NUMBERS if priors.quantity_of(k) == name]
        if keys:
            value = float(from_si(entry.value, schema.geometry_unit(keys[0])))
            found[keys[0]] = float(f"{value:.{DIGITS}g}")
    if not found:
        return ""
    document, table = tomlkit.document(), tomlkit.table()
    stated = result.fit.recordings[0].geometry
    keep = {k: v for k, v in stated.items() if k in schema.geometry_keys() and v != priors.FIT}
    for key, value in {**keep, **found}.items():
        table[key] = value
    document["geometry"] = table
    return tomlkit.dumps(document)
