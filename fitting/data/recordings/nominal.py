"""Nominal geometry where a sidecar is silent: the source's specimens, from the tables of the package."""

import functools
from typing import Any

from pneusma_jax.calibration import load_calibration, named_table
from pneusma_jax.units import from_si

from . import schema

STANDARD_DESIGN = (
    "pneusma2"  # the source's spring on a stand and tube without springs are those of this actuator
)
_SPRING_KEYS = ("alloy", "wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm", "active_coils")
_TUBE_KEYS = ("material", "outer_diameter_mm", "wall_thickness_mm", "length_mm")


def _design(name: str) -> dict[str, Any]:
    """Geometry of a design by canonical key; spring keys only where the design has springs."""
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


def _wound(nominal: dict[str, Any], stated: dict[str, Any]) -> dict[str, float]:
    """Coils and free length of an actuator's springs, as far as stated ones change them.

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
    """Nominal values of the keys that matter to a kind, given what the sidecar states.

    Args:
        kind: of the recording.
        stated: checked [geometry]; its `design` picks the table, and lengths that follow from others follow
            from it.

    Returns:
        Canonical keys in canonical units. `tip_to_base_clearance_deg` has no nominal value.
    """
    if kind == "actuator":
        nominal = dict(_design(stated.get("design", STANDARD_DESIGN)))
        if "attached_length_mm" in nominal and "length_mm" in stated:
            nominal["attached_length_mm"] = stated["length_mm"]
        nominal |= _wound(nominal, stated)
        return {**nominal, "cycles_before": 0.0}
    standard = _design(STANDARD_DESIGN)
    if kind == "spring":
        nominal = {key: standard[key] for key in _SPRING_KEYS}
        coils = stated.get("active_coils", nominal["active_coils"])
        pitch = stated.get("initial_pitch_mm", nominal["initial_pitch_mm"])
        return {**nominal, "free_length_mm": coils * pitch, "prestrain": 0.0, "cycles_before": 0.0}
    if kind == "wire":
        return {"alloy": standard["alloy"], "prestrain": 0.0, "cycles_before": 0.0}
    if kind == "tube":
        return {**{key: standard[key] for key in _TUBE_KEYS}, "cycles_before": 0.0}
    return {"material": standard["material"], "law": schema.LAWS[0], "cycles_before": 0.0}
