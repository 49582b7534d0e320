"""The kinds of recording of the project: columns, nominal geometry, and recognition of a file without a
sidecar.

The module that models a further kind also registers it (`docs/new_kind.md`).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from . import schema
from .nominal import STANDARD_DESIGN, design_geometry, wound
from .schema import Columns, Farthest, FileEvidence, Kind, register

WIRE_STRAIN_LIMIT = 0.15  # Maximum strain of a nitinol wire; a coupon of rubber is rarely pulled less
WIRE_STRAIN_FRACTION_LIMIT = 0.5
"""Maximum strain of a wire as a fraction; nitinol breaks far below, so larger numbers are percent."""
WIRE_ALLOY = "niti_wire"
"""Nominal alloy of a wire. The source's springs have no constants of a wire in tension."""
FARTHEST_STRETCH = 20.0
"""Maximum stretch [1]. The softest silicones break near a stretch of 17 (Ecoflex 00-30 in tension)."""
FAR_STRAIN = 10.0
"""Strain beyond which it is asked whether it is percent [1]. The softest silicones break at 9 to 10."""
CREDIBLE_STRESS_MPA = 1500.0
"""Maximum credible stress. Nitinol breaks near 1000 MPa, so a larger one indicates a wrong cross-section or
another metal."""
METAL_MPA = 60.0
"""Minimum stress that no elastomer bears [MPa]: natural rubber, the strongest, breaks at 30 MPa."""
METAL_UNITS = ("MPa", "GPa", "ksi")
PERCENT = "if these are percent, name the column strain_percent (on import: --unit strain=percent)"
PHASE = ("xi0", "resistance", "temperature", "current", "duty")
"""Channels of a protocol that determine a spring's phase; each spring has one of them."""
_SPRING_KEYS = ("alloy", "wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm", "active_coils")
_TUBE_KEYS = ("material", "outer_diameter_mm", "wall_thickness_mm", "length_mm")


def _of_spring(stated: Mapping[str, Any]) -> dict[str, Any]:
    standard = design_geometry(STANDARD_DESIGN)
    nominal = {key: standard[key] for key in _SPRING_KEYS}
    coils = stated.get("active_coils", nominal["active_coils"])
    pitch = stated.get("initial_pitch_mm", nominal["initial_pitch_mm"])
    return {**nominal, "free_length_mm": coils * pitch, "prestrain": 0.0, "cycles_before": 0.0}


def _of_wire(stated: Mapping[str, Any]) -> dict[str, Any]:
    return {"alloy": WIRE_ALLOY, "prestrain": 0.0, "cycles_before": 0.0}


def _of_elastomer(stated: Mapping[str, Any]) -> dict[str, Any]:
    material = design_geometry(STANDARD_DESIGN)["material"]
    return {"material": material, "law": schema.LAWS[0], "cycles_before": 0.0}


def _of_tube(stated: Mapping[str, Any]) -> dict[str, Any]:
    standard = design_geometry(STANDARD_DESIGN)
    return {**{key: standard[key] for key in _TUBE_KEYS}, "cycles_before": 0.0}


def _of_actuator(stated: Mapping[str, Any]) -> dict[str, Any]:
    nominal = dict(design_geometry(stated.get("design", STANDARD_DESIGN)))
    if "attached_length_mm" in nominal and "length_mm" in stated:
        nominal["attached_length_mm"] = stated["length_mm"]
    nominal |= wound(nominal, stated)
    return {**nominal, "cycles_before": 0.0}


def _spring_reason(header: FileEvidence) -> str | None:
    return "elongation and force" if {"elongation", "force"} <= header.held else None


def _bends(quantities: frozenset[str]) -> bool:
    bending = quantities & {"curvature", "bend_angle", "bend_direction"}
    return bool(bending) or any(quantity.startswith("resistance") for quantity in quantities)


def _actuator_reason(header: FileEvidence) -> str | None:
    if _spring_reason(header) or "pressure" not in header.held or not _bends(header.held):
        return None
    return "pressure with bending or resistance"


def _tube_reason(header: FileEvidence) -> str | None:
    if _spring_reason(header) or not {"pressure", "length"} <= header.held or _bends(header.held):
        return None
    return "pressure and length"


def _strained(header: FileEvidence) -> tuple[str, str] | None:
    """Wire or elastomer, which share strain and stress, with the reason; None for recordings of neither.

    Temperature or resistance makes it a wire. No clock or a `cycle` column makes it an elastomer. Otherwise
    the unit of stress decides and, for that of a metal, the magnitude of the strain.
    """
    if (
        _spring_reason(header)
        or _tube_reason(header)
        or _actuator_reason(header)
        or not {"strain", "stress"} <= header.held
    ):
        return None
    if header.held & {"temperature", "resistance"}:
        return "wire", "strain and stress with temperature or resistance"
    if "time" not in header.held or "cycle" in header.held:
        return "elastomer", "strain and stress without a clock, or with a cycle count"
    unit = header.unit("stress") or "MPa"
    if unit not in METAL_UNITS:
        return "elastomer", f"stress in {unit}"
    if header.largest("strain") > WIRE_STRAIN_LIMIT:
        return "elastomer", f"strain beyond {WIRE_STRAIN_LIMIT:g}"
    return "wire", f"stress in {unit} and strain within {WIRE_STRAIN_LIMIT:g}"


def _wire_reason(header: FileEvidence) -> str | None:
    kind, reason = _strained(header) or ("", None)
    return reason if kind == "wire" else None


def _elastomer_reason(header: FileEvidence) -> str | None:
    kind, reason = _strained(header) or ("", None)
    return reason if kind == "elastomer" else None


SPRING = register(
    Kind(
        "spring",
        Columns(
            required=("time_s", "elongation_mm", "force_N"),
            one_of=("resistance_ohm", "temperature_degC"),  # either one determines the phase
            optional=("current_A", "setpoint_ohm"),
            outputs=("force_N", "resistance_ohm"),
        ),
        _of_spring,
        _spring_reason,
        channels=("elongation", "xi0", "resistance", "temperature"),
        needed="elongation_mm",
        responses=(("elongation_mm", "force_N"), ("elongation_mm", "resistance_ohm")),
        pulled=True,
        sizes=(
            "wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm", "active_coils", "free_length_mm",
        ),
        assumed=("alloy",),
    )
)
WIRE = register(
    Kind(
        "wire",
        Columns(
            required=("time_s", "strain", "stress_MPa"),
            optional=("temperature_degC", "resistance_ohm"),
            outputs=("strain", "stress_MPa"),
        ),
        _of_wire,
        _wire_reason,
        either=("stress_MPa", "strain"),
        responses=(("strain", "stress_MPa"),),
        pulled=True,
        bears=(CREDIBLE_STRESS_MPA, "nitinol"),
        identified="alloy",
        ranges=(
            (
                "strain",
                lambda strain: np.abs(strain) > WIRE_STRAIN_FRACTION_LIMIT,
                f"no wire strains that far; {PERCENT}",
            ),
        ),
    )
)
ELASTOMER = register(
    Kind(
        "elastomer",
        Columns(required=("strain", "stress_kPa"), optional=("time_s", "cycle"), outputs=("stress_kPa",)),
        _of_elastomer,
        _elastomer_reason,
        zeros=("strain", "stress_kPa"),
        responses=(("strain", "stress_kPa"),),
        pulled=True,
        bears=(1e3 * METAL_MPA, "rubber"),
        identified="material",
        farthest={"strain": Farthest(FARTHEST_STRETCH - 1.0, FAR_STRAIN)},
        ranges=(("strain", lambda strain: strain <= -1.0, f"engineering strain stays above -1; {PERCENT}"),),
    )
)
TUBE = register(
    Kind(
        "tube",
        Columns(required=("time_s", "pressure_kPa", "length_mm"), outputs=("length_mm",)),
        _of_tube,
        _tube_reason,
        channels=("pressure",),
        needed="pressure_kPa",
        responses=(("pressure_kPa", "length_mm"),),
        sizes=("outer_diameter_mm", "wall_thickness_mm", "length_mm"),
        assumed=("material",),
    )
)
ACTUATOR = register(
    Kind(
        "actuator",
        Columns(
            required=("time_s", "pressure_kPa"),
            one_of=("curvature_1pm", "bend_angle_deg", "length_mm"),
            optional=(
                *(f"resistance_{k}_ohm" for k in (1, 2, 3)),
                *(f"current_{k}_A" for k in (1, 2, 3)),
                "temperature_degC",
                "bend_direction_deg",
            ),
            outputs=("curvature_1pm", "bend_angle_deg", "length_mm", "bend_direction_deg"),
        ),
        _of_actuator,
        _actuator_reason,
        channels=("pressure", "ambient", *PHASE),
        needed="pressure_kPa",
        numbered=True,
        responses=(("pressure_kPa", "bend_angle_deg"), ("pressure_kPa", "curvature_1pm")),
        assumed=("material", "alloy", "orientation"),
    )
)
