"""Format: any delimited file or sheet whose columns the user names (`--map`), or whose headings name a
quantity."""

import re
import shlex

import numpy as np

from pneusma_jax.errors import InputError

from ..recordings import Recording, schema
from ..recordings.columns import convert
from ..recordings.kinds import METAL_MPA, WIRE_STRAIN_FRACTION_LIMIT, WIRE_STRAIN_LIMIT
from ..recordings.table import unusable
from .assemble import Facts, assemble
from .channels import channels_of, in_unit, named_channels, with_options
from .circuit import VOLTAGES, resistance_named
from .columns_aside import notices_of_columns_aside
from .crosshead_speed import stated_speeds, with_displacement
from .format import Format
from .header_lines import lines_unread
from .making import Channel, Making
from .names import slug
from .options import Options
from .other_headings import unrecognised
from .parts import Sample, stated_specimen
from .specimen_sizes import area_mm2
from .spelling import dimension, unit_name
from .unmodelled import KINDS_IN_WORDS, if_a_stress, unmodelled

NAME = "named-columns"
COIL_SIZES = (
    "active_coils", "mandrel_diameter_mm", "initial_pitch_mm", "free_length_mm", "coil_diameter_mm",
    "coil_outer_diameter_mm",
)  # fmt: skip
"""Dimensions of a coil."""
NOT_ONLY_OF_COILS = ("free_length_mm", "mandrel_diameter_mm")
"""Dimensions of a coil that a file may state of a wire, or of a tube or a coupon that a mandrel formed."""
STRAIGHT_SIZES = ("gauge_length_mm", "length", "width_mm", "thickness_mm", "area_mm2")
"""Dimensions that a file states of a straight specimen."""
STEADY_K = 5.0
"""Maximum range of a temperature of a room or a chamber [K]. Alloys transform over 10 or more."""
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
    channels = with_displacement(channels_of(sample, options, notices), sample, options, notices)
    kind = options.kind or _kind(sample, with_options(channels, options), options)
    if not options.kind:
        notices.append(_taken_as(kind, sample, channels, options))
    taken = {channel.column for channel in channels.values()}
    unused = {text for text, column in grid.marked.items() if column not in taken}
    notices = [text.removeprefix("check: ") if text in unused else text for text in notices]
    notices += notices_of_columns_aside(grid, channels)
    stated = stated_specimen(grid)
    if stated and not options.specimen and not sample.title:
        notices.append(
            f"the file names the specimen {stated!r}: --specimen {shlex.quote(slug(stated))} for all of its"
            " files lets them share its constants"
        )
    return assemble(sample, channels, kind, options, Facts(NAME), notices)


def _taken_as(kind: str, sample: Sample, channels: dict[str, Channel], options: Options) -> str:
    """Sentence on the kind that was told from the columns, and on what ground.

    A spring is certain by a size of its coil, by words, or by a resistance or elongation that is named so.
    Without any of these, or beside sizes of a straight specimen, the sentence asks the user to check.
    """
    if kind != "spring":
        return f"taken as kind {kind} from its columns (--kind to correct)"
    measured = any(name.startswith("resistance") for name in _available(channels, options, sample))
    named = "elongation" in channels["elongation"].label.lower() if "elongation" in channels else False
    sizes = {key: size.said for key, size in sample.sizes.items()}
    coils = [sizes[key] for key in COIL_SIZES if key in sizes and key not in NOT_ONLY_OF_COILS]
    if coils:
        return f"taken as kind spring from its columns and {coils[0]!r} (--kind to correct)"
    if _mentions_a_spring(sample, options):
        return "taken as kind spring from its columns and the words of the file (--kind to correct)"
    others = [sizes[key] for key in (*STRAIGHT_SIZES, "mandrel_diameter_mm") if key in sizes]
    if others and "wire_diameter_mm" not in sizes:
        stated = " and ".join(map(repr, others))
        return (
            f"check: taken as kind spring by its columns, but the file states {stated}, which a wire, a"
            " coupon or a tube may have. If it is one: --kind wire or --kind elastomer, with --dimension"
            " gauge_length_mm=... and its cross-section"
        )
    if measured or named:
        return "taken as kind spring from its columns (--kind to correct)"
    return (
        "check: taken as kind spring, because it has a force and an elongation. Neither a resistance nor a"
        " word of the file says so. If it is a wire or a coupon: --kind wire or --kind elastomer, with"
        " --dimension gauge_length_mm=... and its cross-section"
    )


def _available(channels: dict[str, Channel], options: Options, sample: Sample) -> set[str]:
    """Quantities that are present, can be derived, or are stated as constant."""
    usable = {*channels, *options.constants}
    if usable & {"stretch", "true_strain"} or ("length" in options.columns and "pressure" not in usable):
        usable.add("strain")
    if "true_stress" in usable:
        usable.add("stress")
    sizes = {*options.dimensions, *sample.sizes}
    if "elongation" in usable and sizes & {"gauge_length_mm", "length"}:
        usable.add("strain")
    if "force" in usable and (sizes & {"area_mm2", "diameter_mm"} or {"width_mm", "thickness_mm"} <= sizes):
        usable.add("stress")
    if "temperature" in usable and "stress_MPa" in sizes:
        usable.add("stress")
    return usable | {resistance_named(voltage) for voltage in VOLTAGES if voltage in usable}


def _kind(sample: Sample, channels: dict[str, Channel], options: Options) -> str:
    """The one kind whose required quantities are all present or derivable; an error if it is not unique."""
    available = _available(channels, options, sample)
    fits = []
    for kind in schema.KINDS.values():
        rules = kind.columns
        needed = {schema.quantity_and_unit(name)[0] for name in rules.required} - {"time"}
        choice = {schema.quantity_and_unit(name)[0] for name in rules.one_of}
        if needed <= available and (not choice or choice & available):
            fits.append(kind.name)
    if {"wire", "elastomer"} <= set(fits):
        fits.remove("elastomer" if _is_wire(sample, channels, options, available) else "wire")
    if "spring" in fits and {"wire", "elastomer"} & set(fits):
        if _has_coils(sample, options):
            fits = ["spring"]  # its wire has a cross-section, too
        elif not _mentions_a_spring(sample, options):
            fits.remove("spring")  # a gauge length and a cross-section are those of a straight specimen
    if {"tube", "actuator"} <= set(fits):
        fits.remove(
            "tube" if available & {"curvature", "bend_angle", "resistance_1", "resistance_2"} else "actuator"
        )
    unmodelled_test = unmodelled(sample, channels)
    if unmodelled_test and (not fits or unmodelled_test.certain):
        raise unusable(sample.raw.path, unmodelled_test.sentence)
    if len(fits) != 1:
        raise _not_one_kind(sample, channels, fits, available)
    return fits[0]


def _not_one_kind(
    sample: Sample, channels: dict[str, Channel], fits: list[str], available: set[str]
) -> InputError:
    """The error for columns that fit no kind, or several: what they are, what is missing, how to state it."""
    kinds_text = (
        f"its columns fit the kinds {', '.join(fits)}" if fits else "its columns fit no kind of recording"
    )
    grid = sample.require_grid()
    columns = ", ".join(repr(heading.text) for heading in grid.headings) or "no headings"
    others = unrecognised(grid.headings, {c.column for c in channels.values()}, available)
    place = f"{sample.raw.path} ({sample.title})" if sample.title else sample.raw.path
    unread = ", ".join(map(repr, lines_unread(grid)))
    may = f"; not read, though they may state a size: {unread}" if unread else ""
    return unusable(
        place, f"{kinds_text} ({columns}){_hints(available, channels, sample)}{may}"
        f"{f'; {others}' if others else ''}; state --kind, and name the columns with --map"
        f" QUANTITY=COLUMN. Kinds: {KINDS_IN_WORDS}",
    )  # fmt: skip


def _mentions_a_spring(sample: Sample, options: Options) -> bool:
    """True if the words of the file are about a spring, or its sizes or the user's are those of a coil."""
    words = f"{sample.title} {sample.head}".lower()
    return bool(re.search(r"spring|feder|coil|ressort|弹簧|ばね", words)) or _has_coils(sample, options)


def _has_coils(sample: Sample, options: Options) -> bool:
    """True if the file states a size that only a coil has, or the user any size of a coil."""
    of_file = {*sample.sizes} - {*NOT_ONLY_OF_COILS}
    return bool({*options.dimensions, *of_file} & set(COIL_SIZES))


def _hints(available: set[str], channels: dict[str, Channel], sample: Sample) -> str:
    """Quantities that a kind needs beside the available ones, and how to state them, as end of a message."""
    near = []
    if {"strain", "pressure"} <= available and not available & {"stress", "force"}:
        label = channels["pressure"].label if "pressure" in channels else "..."
        near.append(if_a_stress(label))
    if {"force", "time"} <= available and not available & {"strain", "elongation", "length"}:
        speeds = stated_speeds(sample)
        option = speeds[0][1] if len(speeds) == 1 else "10mm/min"
        lines = dict.fromkeys(line for _, _, line in speeds)
        said = f"; the file states {' and '.join(map(repr, lines))}" if speeds else ""
        near.append(
            "of a coupon, a wire or a spring the strain or the elongation is missing (of one ramp at constant"
            f" speed: --speed {option}{said})"
        )
    if {"strain", "temperature"} <= available and "stress" not in available:
        near.append("of a wire the stress is missing: if it did not change, --constant stress_MPa=...")
    if {"force", "elongation"} <= available and not available & {"strain", "stress"}:
        near.append(
            "of a coupon or wire the sizes are missing: --dimension gauge_length_mm=... and --dimension"
            " area_mm2=..."
            " (or diameter_mm, or width_mm and thickness_mm); of a spring the resistance"
        )
    elif "force" in available and "strain" in available and "stress" not in available:
        near.append(
            "of a coupon or wire the cross-section is missing: --dimension area_mm2=... (or diameter_mm=...)"
        )
    elif "stress" in available and "elongation" in available and "strain" not in available:
        near.append("of a coupon or wire the gauge length is missing: --dimension gauge_length_mm=...")
    elif {"elongation", "temperature"} <= available and not available & {"force", "stress"}:
        near.append(
            "of a wire the gauge length and the stress are missing: --dimension gauge_length_mm=... and, if"
            " it did not change, --constant stress_MPa=...; of a spring the force: --constant force_N=..."
        )
    shapes = available & {"length", "curvature", "bend_angle"}
    if "pressure" in available and not shapes:
        near.append("of a tube the length is missing, of an actuator the curvature, bend angle or length")
    elif shapes and "pressure" not in available:
        near.append("of a tube or an actuator the pressure is missing")
    return f"; {'; '.join(near)}" if near else ""


def _largest_stress_MPa(sample: Sample, channels: dict[str, Channel], options: Options) -> float | None:
    """Largest stress, measured or as load over the cross-section [MPa]; None where neither is known."""
    stress, force = channels.get("stress"), channels.get("force")
    if "stress" in options.constants:
        value, unit = options.constants["stress"]
        return abs(float(convert(value, unit_name(unit), "MPa")))
    if stress is not None and dimension(stress.unit) == "pressure":
        return float(np.nanmax(np.abs(convert(stress.values, unit_name(str(stress.unit)), "MPa"))))
    making = Making(channels, "wire", options.with_own_record(), sample.sizes, str(sample.raw.path), [])
    area = area_mm2(making, quiet=True)
    if area is None or force is None or dimension(force.unit) not in ("force", "mass"):
        return None
    return float(np.nanmax(np.abs(in_unit(force, "N", "force", sample.raw.path)))) / area


def _strain_range(sample: Sample, channels: dict[str, Channel], options: Options) -> float | None:
    """Range of the strain, as a fraction; None where no unit or gauge length states it.

    A range does not depend on the zero, so a position of the machine serves as well as an extension.
    """
    strain, stretch, extension = (channels.get(name) for name in ("strain", "stretch", "elongation"))
    if strain is not None:
        stated = dimension(strain.unit) == "number"
        return _range(convert(strain.values, unit_name(str(strain.unit)), "1")) if stated else None
    if stretch is not None:
        return _range(stretch.values - 1.0)
    if "length" in options.columns and "length" in channels:
        values = channels["length"].values
        known = values[np.isfinite(values)]
        return _range(values / known[0]) if known.size and known[0] else None
    gauge = options.dimensions.get("gauge_length_mm")
    if gauge is None and "gauge_length_mm" in sample.sizes:
        gauge = sample.sizes["gauge_length_mm"].value
    if extension is None or gauge is None or dimension(extension.unit) != "length":
        return None
    return _range(convert(extension.values, unit_name(str(extension.unit)), "mm")) / gauge


def _range(values: np.ndarray) -> float:
    finite = values[np.isfinite(values)]
    return float(np.ptp(finite)) if finite.size else 0.0


def _is_wire(
    sample: Sample, channels: dict[str, Channel], options: Options, available: set[str]
) -> bool:
    """True for strain and stress of a wire, false for those of a coupon.

    Strain and stress decide first: no wire strains as far as a rubber, and no rubber bears the stress of a
    metal. Where both are possible, a temperature that changes or a resistance tells a wire, and then the
    modulus.
    """
    stress, strain = _largest_stress_MPa(sample, channels, options), _strain_range(sample, channels, options)
    if strain is not None and strain > WIRE_STRAIN_FRACTION_LIMIT:
        return False
    if stress is not None and stress > METAL_MPA:
        return True
    if stress is not None and strain is not None and strain > WIRE_STRAIN_LIMIT:
        return False
    if "resistance" in available or ("temperature" in available and not _is_steady(channels, options)):
        return True
    if "temperature" in available and (stress is None or not strain):
        return True
    return stress is not None and bool(strain) and stress / strain > METAL_MODULUS_MPA


def _is_steady(channels: dict[str, Channel], options: Options) -> bool:
    """True for a measured temperature that hardly changes, as that of a room beside a coupon."""
    temperature = channels.get("temperature")
    stated = "temperature" in options.constants
    return temperature is not None and not stated and _range(temperature.values) < STEADY_K


FORMAT = Format(
    NAME, "any table whose headings (or --map) name the quantities", recognises, read, fallback=True
)
