"""Strain, stress and resistance from what a machine logs: stretch, extension, load, true strain, voltage."""

import math

import numpy as np

from ..recordings.table import refuse
from .channels import Channel, in_unit
from .circuit import add_resistances
from .options import Options


def derive(
    channels: dict[str, Channel], kind: str, options: Options, place: object, notices: list[str]
) -> None:
    """Add the strain and stress of a coupon or wire where they follow from stretch, extension or load.

    A spring's or actuator's resistance follows from a voltage (`circuit`).

    Strain is stretch - 1, or extension over gauge length, or exp(true strain) - 1; stress is load over the
    specimen's first area, or true stress over stretch (an incompressible material). Changes `channels`.

    Raises:
        InputError: if a size of the specimen is needed that was not stated.
    """
    add_resistances(channels, kind, options, place, notices)
    if kind not in ("wire", "elastomer"):
        return
    if "strain" not in channels:
        _derive_strain(channels, options, place, notices)
    if "stress" not in channels:
        _derive_stress(channels, options, place, notices)


def _derive_strain(channels: dict[str, Channel], options: Options, place: object, notices: list[str]) -> None:
    if "stretch" in channels:
        stretch = channels["stretch"]
        channels["strain"] = Channel(in_unit(stretch, "1", "stretch", place) - 1.0, "1", stretch.label)
        notices.append(f"strain is {stretch.label!r} - 1")
    elif "true_strain" in channels:
        true = channels["true_strain"]
        channels["strain"] = Channel(np.expm1(in_unit(true, "1", "true_strain", place)), "1", true.label)
        notices.append(f"strain is exp({true.label!r}) - 1")
    elif "elongation" in channels:
        gauge = options.dimensions.get("gauge_length_mm")
        label = channels["elongation"].label
        if gauge is None:
            raise refuse(
                place, f"strain needs the length between the grips, to divide {label!r} by; "
                "state it with --dimension gauge_length_mm=...",
            )  # fmt: skip
        values = in_unit(channels["elongation"], "mm", "elongation", place)
        channels["strain"] = Channel(values / gauge, "1", label)
        notices.append(f"strain is {label!r} over the gauge length of {gauge:g} mm")


def _derive_stress(channels: dict[str, Channel], options: Options, place: object, notices: list[str]) -> None:
    if "force" in channels:
        area = area_mm2(options)
        label = channels["force"].label
        if area is None:
            raise refuse(
                place, f"stress needs the specimen's cross-section, to divide {label!r} by; state it with"
                " --dimension area_mm2=... (or diameter_mm=..., or width_mm=... and thickness_mm=...)",
            )  # fmt: skip
        newton = in_unit(channels["force"], "N", "force", place)
        channels["stress"] = Channel(newton / area, "MPa", label)
        notices.append(f"stress is {label!r} over the cross-section of {area:.6g} mm2")
    elif "true_stress" in channels and "strain" in channels:
        true = channels["true_stress"]
        stretch = 1.0 + in_unit(channels["strain"], "1", "strain", place)
        channels["stress"] = Channel(true.values / stretch, true.unit, true.label)
        notices.append(f"engineering stress is {true.label!r} over the stretch (volume taken as constant)")


def area_mm2(options: Options) -> float | None:
    """Cross-section of the specimen from the dimensions that were stated, or None."""
    sizes = options.dimensions
    if "area_mm2" in sizes:
        return sizes["area_mm2"]
    if "diameter_mm" in sizes:
        return math.pi * sizes["diameter_mm"] ** 2 / 4.0
    if {"width_mm", "thickness_mm"} <= sizes.keys():
        return sizes["width_mm"] * sizes["thickness_mm"]
    return None
