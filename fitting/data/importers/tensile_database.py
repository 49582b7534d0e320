"""Format: pull-to-failure files of a materials database, with semicolons, PARAMETER;INFO lines, true and
engineering values."""

from dataclasses import replace

from ..recordings import Recording
from .assemble import Facts, assemble
from .channels import channels_of
from .format import Format
from .names import slug
from .options import Options
from .parts import Sample
from .provenance import Provenance

NAME = "tensile-database"
_SYMME = Provenance(
    citation=(
        "L. Marechal, P. Balland, L. Lindenroth, F. Petrou, C. Kontovounisios, F. Bello, Toward a common"
        " framework and database of materials for soft robotics, Soft Robotics (2020), doi"
        " 10.1089/soro.2019.0115"
    ),
    licence="ODbL 1.0 (database), DbCL 1.0 (contents)",
)


def recognises(sample: Sample) -> bool:
    """True for a first line `PARAMETER;INFO`, with engineering strain and stress below."""
    head = sample.head.lower()
    return head.startswith("parameter;info") and "engineering strain" in head and "engineering stress" in head


def read(sample: Sample, options: Options) -> Recording:
    """An elastomer coupon. True strain and stress are left out; the preamble goes into [source]."""
    grid = sample.require_grid()
    preamble = {row[0]: row[1] for row in grid.preamble if len(row) > 1 and row[0].lower() != "parameter"}
    material = preamble.get("Material", "")
    notices = [*grid.notices, *(f"preamble: {key} {text}" for key, text in preamble.items())]
    if "crosshead" in preamble.get("Strain calculation", "").lower():
        notices.append("strain is from the crosshead: shoulders and grips are in it")
    facts = Facts(
        format=NAME,
        specimen=slug(material) if material else "",
        provenance=_SYMME if "symme" in preamble.get("Lab", "").lower() else None,
        source={"material": material} if material else {},
    )
    kind = options.kind or "elastomer"
    channels = channels_of(sample, options, notices)
    if "strain" in channels and channels["strain"].unit is None:  # the database's own description
        channels["strain"] = replace(channels["strain"], unit="1")
    return assemble(sample, channels, kind, options, facts, notices)


FORMAT = Format(
    NAME, "semicolons, PARAMETER;INFO preamble, engineering strain and stress -> elastomer", recognises, read
)
