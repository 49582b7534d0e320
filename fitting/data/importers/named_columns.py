"""Format: any delimited file or sheet whose columns the user names (`--map`), or whose headings name a
quantity."""

import numpy as np

from ..recordings import Recording, schema
from ..recordings.columns import convert
from ..recordings.table import refuse
from .assemble import Facts, assemble
from .channels import channels_of, in_unit, named_channels
from .circuit import VOLTAGES, resistance_named
from .columns_aside import say_aside
from .derive import area_mm2
from .format import Format
from .making import Channel, Making
from .options import Options
from .parts import Sample
from .spelling import dimension, unit_name
from .unmodelled import KINDS, unmodelled

NAME = "named-columns"
METAL_MPA = 60.0
"""Minimum stress that no elastomer bears [MPa]: natural rubber, the strongest, breaks at 30 MPa."""
METAL_MODULUS_MPA = 500.0
"""Minimum modulus of a metal [MPa]; above that of any elastomer (100 MPa) and below that of any nitinol (5
GPa)."""


def recognises(sample: Sample) -> bool:
    """True for headings that name at least two quantities."""
    return sample.grid is not None and len(named_channels(sample.grid)) >= 2


def read(sample: Sample, options: Options) -> Recording:
    """A recording of the stated kind, or of the kind that the quantities fit."""
    grid = sample.require_grid()
    notices: list[str] = list(grid.notices)
    channels = channels_of(sample, options, notices)
    kind = options.kind or _kind(sample, channels, options)
    if not options.kind:
        notices.append(f"taken as kind {kind} from its columns (--kind to correct)")
    notices += say_aside(grid, channels)
    if grid.preamble:
        notices.append(
            f"{len(grid.preamble)} lines before the table were left aside, but for sizes that are named here"
        )
    return assemble(sample, channels, kind, options, Facts(NAME), notices)


def _held(channels: dict[str, Channel], options: Options, sample: Sample) -> set[str]:
    """Quantities that are present, can be derived, or are stated as constant."""
    held = {*channels, *options.constants}
    if held & {"stretch", "true_strain"}:
        held.add("strain")
    if "true_stress" in held:
        held.add("stress")
    sizes = {*options.dimensions, *sample.sizes}
    if "elongation" in held and sizes & {"gauge_length_mm", "length"}:
        held.add("strain")
    if "force" in held and (sizes & {"area_mm2", "diameter_mm"} or {"width_mm", "thickness_mm"} <= sizes):
        held.add("stress")
    if "temperature" in held and "stress_MPa" in sizes:
        held.add("stress")
    return held | {resistance_named(voltage) for voltage in VOLTAGES if voltage in held}


def _kind(sample: Sample, channels: dict[str, Channel], options: Options) -> str:
    """The one kind whose required quantities are all present or derivable; empty if there are several or
    none."""
    held = _held(channels, options, sample)
    fits = []
    for kind in schema.KINDS.values():
        rules = kind.columns
        needed = {schema.quantity_and_unit(name)[0] for name in rules.required} - {"time"}
        choice = {schema.quantity_and_unit(name)[0] for name in rules.one_of}
        if needed <= held and (not choice or choice & held):
            fits.append(kind.name)
    if {"wire", "elastomer"} <= set(fits):
        fits.remove(
            "elastomer"
            if held & {"temperature", "resistance"} or _metal(sample, channels, options)
            else "wire"
        )
    if {"tube", "actuator"} <= set(fits):
        fits.remove(
            "tube" if held & {"curvature", "bend_angle", "resistance_1", "resistance_2"} else "actuator"
        )
    told = unmodelled(sample, channels)
    if told and (not fits or told.certain):
        raise refuse(sample.raw.path, told.sentence)
    if len(fits) != 1:
        what = (
            f"its columns fit the kinds {', '.join(fits)}" if fits else "its columns fit no kind of recording"
        )
        labels = [repr(heading.text) for heading in sample.require_grid().headings]
        columns = ", ".join(labels) or "no headings"
        raise refuse(
            sample.raw.path, f"{what} ({columns}){_nearest(held)}; state"
            f" --kind, and name the columns with --map QUANTITY=COLUMN. Kinds: {KINDS}",
        )  # fmt: skip
    return fits[0]


def _nearest(held: set[str]) -> str:
    """Missing quantities of the kinds that lack one or two, and the way to state them."""
    near = []
    if {"strain", "temperature"} <= held and "stress" not in held:
        near.append("of a wire the stress is missing: if it did not change, --constant stress_MPa=...")
    if {"force", "elongation"} <= held and not held & {"strain", "stress"}:
        near.append(
            "of a coupon or wire the sizes are missing: --dimension gauge_length_mm=... and --dimension"
            " area_mm2=..."
            " (or diameter_mm, or width_mm and thickness_mm); of a spring the resistance"
        )
    elif "force" in held and "strain" in held and "stress" not in held:
        near.append(
            "of a coupon or wire the cross-section is missing: --dimension area_mm2=... (or diameter_mm=...)"
        )
    elif "stress" in held and "elongation" in held and "strain" not in held:
        near.append("of a coupon or wire the gauge length is missing: --dimension gauge_length_mm=...")
    return f"; {'; '.join(near)}" if near else ""


def _most_stress_MPa(sample: Sample, channels: dict[str, Channel], options: Options) -> float | None:
    """Largest stress, measured or as load over the cross-section [MPa]; None where neither is known."""
    stress, force = channels.get("stress"), channels.get("force")
    if stress is not None and dimension(stress.unit) == "pressure":
        return float(np.nanmax(np.abs(convert(stress.values, unit_name(str(stress.unit)), "MPa"))))
    making = Making(channels, "wire", options.alone(), sample.sizes, str(sample.raw.path), [])
    area = area_mm2(making, quiet=True)
    if area is None or force is None or dimension(force.unit) not in ("force", "mass"):
        return None
    return float(np.nanmax(np.abs(in_unit(force, "N", "force", sample.raw.path)))) / area


def _metal(sample: Sample, channels: dict[str, Channel], options: Options) -> bool:
    """True if stress over strain is that of a metal."""
    most = _most_stress_MPa(sample, channels, options)
    strain = channels.get("strain")
    if most is None:
        return False
    if most > METAL_MPA:
        return True
    if strain is None or dimension(strain.unit) != "number":
        return False
    far = float(np.nanmax(np.abs(convert(strain.values, unit_name(str(strain.unit)), "1"))))
    return far > 0.0 and most / far > METAL_MODULUS_MPA


FORMAT = Format(
    NAME, "any table whose headings (or --map) name the quantities", recognises, read, fallback=True
)
