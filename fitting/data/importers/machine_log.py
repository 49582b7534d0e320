"""Format: logs of a testing machine with a quoted preamble (`Test Method`, `Sample I. D.`), headings, and
`****` for blanks."""

import numpy as np

from ..recordings import Recording
from ..recordings.kinds import CREDIBLE_STRESS_MPA
from ..recordings.table import unusable
from .assemble import Facts, assemble
from .channels import channels_of, in_unit
from .format import Format
from .grid import Grid
from .making import Channel
from .names import slug
from .options import Options
from .parts import Sample

NAME = "machine-log"


def recognises(sample: Sample) -> bool:
    """True for lines `Test Method` and `Specimen Number` before headings of time and load."""
    head = sample.head.lower()
    return "test method" in head and "specimen number" in head and "time (" in head and "load (" in head


def read(sample: Sample, options: Options) -> Recording:
    """Recording of a wire in tension. A bent beam of stated span and depth counts as a wire: its surface."""
    grid = sample.require_grid()
    kind = options.kind or "wire"
    preamble = {row[0].strip('"'): row[1].strip('"') for row in grid.preamble if len(row) > 1}
    notices = [*grid.notices, *(f"preamble: {key} {text}" for key, text in preamble.items())]
    channels = channels_of(sample, options, notices)
    probe = next((h for h in grid.headings if h.unit == "degC" and "temperature" not in channels), None)
    if probe is not None:
        column = grid.headings.index(probe)
        channels["temperature"] = Channel(grid.values[:, column], "degC", probe.text, column=column)
    if "temperature" in channels and "chamber" in channels["temperature"].label.lower():
        notices.append(
            f"{channels['temperature'].label!r} is the chamber's temperature; the specimen's may lag behind"
        )
    notices += _blank_columns(grid)
    if kind == "wire":
        if _is_bending(preamble, grid):
            _bend(channels, grid, options, sample, notices)
        else:
            _check_sizes(channels, options, sample)
    facts = Facts(
        format=NAME,
        specimen=slug(preamble.get("Sample I. D.", "").rpartition(".")[0])
        if "Sample I. D." in preamble
        else "",
        source={key.lower().replace(" ", "_").replace(".", ""): text for key, text in preamble.items()},
    )
    return assemble(sample, channels, kind, options, facts, notices)


def _blank_columns(grid: Grid) -> list[str]:
    blank = [h.text for i, h in enumerate(grid.headings) if np.isnan(grid.values[:, i]).all()]
    return [f"column {text!r} is blank in every row and was left out" for text in blank]


def _is_bending(preamble: dict[str, str], grid: Grid) -> bool:
    words = " ".join([*preamble.values(), *(heading.text for heading in grid.headings)]).lower()
    return "bending" in words or "flexure" in words


def _bend(
    channels: dict[str, Channel], grid: Grid, options: Options, sample: Sample, notices: list[str]
) -> None:
    """Stress and strain of the surface of a beam in three-point bending (ASTM D790, Eq. 5).

    strain = 6 depth deflection / span^2. Both get the sign that makes the stretched side positive.
    """
    span, depth = options.dimensions.get("span_mm"), options.dimensions.get("depth_mm")
    stress = next((i for i, h in enumerate(grid.headings) if h.name == "flexurestress"), None)
    if span is None or depth is None or stress is None or "elongation" not in channels:
        raise unusable(
            sample.raw.path, "this is three-point bending, not a wire pulled straight; give --dimension"
            " span_mm=... and --dimension depth_mm=... to take the surface of the beam for a wire",
        )  # fmt: skip
    deflection = in_unit(channels["elongation"], "mm", "elongation", sample.raw.path)
    sign = -1.0 if np.nanmean(deflection) < 0.0 else 1.0
    label = channels["elongation"].label
    for name in ("span_mm", "depth_mm"):
        options.used.names.add(("--dimension", name))
    made = f"{label!r} times 6 depth over span squared"
    channels["strain"] = Channel(sign * 6.0 * depth * deflection / span**2, "1", label, made=made)
    heading = grid.headings[stress]
    turned = f"{heading.text!r} ({heading.unit})" + (", turned" if sign < 0.0 else "")
    channels["stress"] = Channel(sign * grid.values[:, stress], heading.unit, heading.text, made=turned)
    notices.append(
        f"stress and strain are those of the stretched surface of a bent beam (span {span:g} mm, depth"
        f" {depth:g} mm). A wire has the same strain all through, so fitted stiffness is only indicative"
    )


def _check_sizes(channels: dict[str, Channel], options: Options, sample: Sample) -> None:
    """Ask for missing dimensions, and for the cross-section where the machine's stress is impossible."""
    named = {*options.dimensions, *sample.sizes}
    area = (
        bool(named & {"area_mm2", "diameter_mm", "wire_diameter_mm"}) or {"width_mm", "thickness_mm"} <= named
    )
    missing = []
    if "strain" not in channels and not named & {"gauge_length_mm", "length"}:
        missing.append("gauge_length_mm (there is no strain, only extension)")
    if "stress" not in channels and not area:
        missing.append("area_mm2 (there is no stress, only load)")
    elif "stress" in channels and "stress" not in options.columns and not area:
        largest = float(np.nanmax(np.abs(in_unit(channels["stress"], "MPa", "stress", sample.raw.path))))
        if largest > CREDIBLE_STRESS_MPA:
            missing.append(
                f"area_mm2 (its stress reaches {largest:.0f} MPa, more than any nitinol bears: the machine"
                " was told a wrong cross-section)"
            )
    if missing:
        raise unusable(
            sample.raw.path, "this log makes a wire when the specimen's sizes are known; state with"
            " --dimension "
            + " and ".join(missing),
        )  # fmt: skip


FORMAT = Format(NAME, "quoted testing-machine log (Test Method, Load, Extension) -> wire", recognises, read)
