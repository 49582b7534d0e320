"""Files that are recordings already, so that there is nothing to import."""

from ..recordings import schema
from .channels import named_channels
from .parts import Sample

SENTENCE = (
    "this already is in the recording format; it can be used as it is. Options that mend it, such as"
    " --compression or --slack auto, are applied if stated"
)
"""What is said of such a file, unless options mend it."""


def is_recording(sample: Sample) -> bool:
    """True for a header of canonical names with every required column of some kind, and no other clock."""
    if sample.raw.is_workbook or sample.grid is None:
        return False
    clock = named_channels(sample.grid).get("time")
    if clock is not None and not clock.label.startswith("time_"):
        return False
    lines = (line for page in sample.raw.pages for line in page.lines)
    first = next((line for line in lines if line.strip() and not line.startswith("#")), "")
    header = {name.strip() for name in first.split(",")}
    return any(set(kind.columns.required) <= header for kind in schema.KINDS.values())
