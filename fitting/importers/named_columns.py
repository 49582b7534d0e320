"""Any delimited file or sheet: columns that the person names (`--map`), or whose headings name a quantity."""

from ..recordings import Recording, schema
from ..recordings.table import refuse
from .assemble import Facts, assemble
from .channels import Channel, mapped_channels, named_channels
from .circuit import VOLTAGES, resistance_named
from .format import Format
from .grid import Sample
from .options import Options

NAME = "named-columns"


def recognises(sample: Sample) -> bool:
    """Headings that name at least two quantities."""
    return sample.grid is not None and len(named_channels(sample.grid)) >= 2


def read(sample: Sample, options: Options) -> Recording:
    """A recording of the stated kind, or of the one that the quantities fit."""
    grid = sample.require_grid()
    # Where columns are named by hand, only those are taken: a guess beside them would surprise.
    channels = mapped_channels(sample, options) if options.columns else named_channels(grid)
    kind = options.kind or _kind(sample, channels)
    notices = list(grid.notices)
    if not options.kind:
        notices.append(f"taken as kind {kind} from its columns (--kind to correct)")
    taken = {channel.label for channel in channels.values()}
    aside = [heading.text for heading in grid.headings if heading.text.strip() and heading.text not in taken]
    if aside:
        notices.append(
            f"columns left aside: {', '.join(repr(text) for text in aside)} (--map QUANTITY=COLUMN takes one)"
        )
    if grid.preamble:
        notices.append(f"{len(grid.preamble)} lines before the table were left aside")
    return assemble(sample.raw, grid, channels, kind, options, Facts(NAME), notices)


def _kind(sample: Sample, channels: dict[str, Channel]) -> str:
    """Kind whose required quantities are all there or can be derived, if there is exactly one."""
    held = set(channels)
    if held & {"stretch", "true_strain"}:
        held.add("strain")
    if "true_stress" in held:
        held.add("stress")
    held |= {resistance_named(voltage) for voltage in VOLTAGES if voltage in held}
    fits = []
    for kind, rules in schema.COLUMNS.items():
        needed = {schema.quantity_and_unit(name)[0] for name in rules.required} - {"time"}
        choice = {schema.quantity_and_unit(name)[0] for name in rules.one_of}
        if needed <= held and (not choice or choice & held):
            fits.append(kind)
    if {"wire", "elastomer"} <= set(fits):
        fits.remove("elastomer" if held & {"temperature", "resistance"} else "wire")
    if {"tube", "actuator"} <= set(fits):
        fits.remove(
            "tube" if held & {"curvature", "bend_angle", "resistance_1", "resistance_2"} else "actuator"
        )
    if len(fits) != 1:
        what = (
            f"its columns fit the kinds {', '.join(fits)}" if fits else "its columns fit no kind of recording"
        )
        labels = [heading.text for heading in sample.require_grid().headings]
        raise refuse(
            sample.raw.path, f"{what} ({', '.join(repr(label) for label in labels) or 'no headings'}); state"
            " --kind, and name the columns with --map QUANTITY=COLUMN",
        )  # fmt: skip
    return fits[0]


FORMAT = Format(
    NAME, "any table whose headings (or --map) name the quantities", recognises, read, fallback=True
)
