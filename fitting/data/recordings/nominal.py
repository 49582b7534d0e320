"""Nominal geometry where a sidecar states none: the source's specimens, from the tables of the package."""

import functools
from collections.abc import Mapping
from typing import Any

from pneusma_jax.calibration import load_calibration, named_table
from pneusma_jax.units import from_si

from . import schema

STANDARD_DESIGN = (
    "pneusma2"  # the source's spring on a stand and tube without springs are those of this actuator
)


def design_geometry(name: str) -> dict[str, Any]:
    """Geometry of a design by canonical key, with spring keys only where the design has springs."""
    # a file of the laboratory may change at any time
    return _read_design(name) if name.endswith(".toml") else _shipped_design(name)


@functools.cache
def _shipped_design(name: str) -> dict[str, Any]:
    return _read_design(name)


def _read_design(name: str) -> dict[str, Any]:
    table = load_calibration(name, "actuator")
    values = table.values()
    geometry: dict[str, Any] = {"design": name, "orientation": schema.ORIENTATIONS[0]}
    for key in schema.GEOMETRY_NUMBERS:
        quantity = key if key in schema.GEOMETRY_WITHOUT_UNIT else schema.quantity_and_unit(key)[0]
        if quantity in values:
            unit = schema.geometry_unit(key)
            geometry[key] = float(f"{from_si(values[quantity], unit):.12g}")  # 0.269, not 0.26900000000000002
    return geometry | {key: named_table(table, key) for key in ("alloy", "material") if key in table.text}


def wound(nominal: Mapping[str, Any], stated: Mapping[str, Any]) -> dict[str, float]:
    """Coils and free length of an actuator's springs, as far as stated values change them.

    The free length is that of the coils, one pitch each.
    """
    coils, pitch, free = "active_coils", "initial_pitch_mm", "free_length_mm"
    if not all(key in nominal for key in (coils, pitch, free)) or free in stated and coils in stated:
        return {}
    turned = stated.get(pitch, nominal[pitch]) / nominal[pitch]
    if free not in stated:
        return {free: nominal[free] * turned * stated.get(coils, nominal[coils]) / nominal[coils]}
    return {} if pitch in stated else {coils: nominal[coils] * stated[free] / nominal[free]}


def nominal_geometry(kind: str, stated: dict[str, Any]) -> dict[str, Any]:
    """Nominal values of a kind's geometry keys, given the statements of the sidecar.

    Args:
        kind: kind of the recording.
        stated: checked [geometry]; its `design` selects the table, and dependent lengths follow from it.

    Returns:
        Values by canonical key in canonical units. `tip_to_base_clearance_deg` has no nominal value.
    """
    return schema.KINDS[kind].nominal(stated)
