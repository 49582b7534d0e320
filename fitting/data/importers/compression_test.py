"""Format: compression of a cast cylinder, with a free preamble, then time, load, negative strain and
stress."""

import re

from ..recordings import Recording
from .assemble import Facts, assemble
from .channels import channels_of
from .format import Format
from .names import slug
from .options import Options
from .parts import Sample
from .provenance import Provenance

NAME = "compression-test"
_PHANTOMS = Provenance(
    citation=(
        "A. B. Dawood, Z. Zhang, H. Suulker, D. Osman, H. Abdulali, M. Angelmahr, K. Althoefer, Tissue"
        " Phantom Material Database: Hyperelastic Characterisation of Silicone Tissue Phantoms (2026)"
    ),
    licence="CC BY 4.0",
)


def recognises(sample: Sample) -> bool:
    """True for a line `Compression test` before a header with engineering strain and stress."""
    head = sample.head.lower()
    return "compression test" in head and "engineering strain" in head and "engineering stress" in head


def read(sample: Sample, options: Options) -> Recording:
    """An elastomer coupon in compression. Strain and stress are negative, as in the recording format."""
    grid = sample.require_grid()
    lines = [" ".join(row).rstrip("; ") for row in grid.preamble]
    notices = [*grid.notices, *(f"preamble: {line}" for line in lines)]
    channels = channels_of(sample, options, notices)
    title = lines[0] if lines else ""
    named = re.fullmatch(r"(?P<specimen>.+?)_sample_(?P<repeat>\d+)", title)
    if named:
        notices.append(f"the title {title!r} is repeat {named['repeat']} of specimen {named['specimen']}")
    facts = Facts(
        format=NAME,
        specimen=slug(named["specimen"]) if named else "",
        provenance=_PHANTOMS if named and re.match(r"EF(10|30|50)_\d+T_", title) else None,
        source={"title": title} if title else {},
    )
    return assemble(sample, channels, options.kind or "elastomer", options, facts, notices)


FORMAT = Format(
    NAME, "comma, 'Compression test' preamble, engineering strain and kPa -> elastomer", recognises, read
)
