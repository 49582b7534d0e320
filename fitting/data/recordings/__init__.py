"""The recording format: `NAME.csv` with units in its column names, `NAME.toml` with everything else about the
test.

`read_recording` and `read_campaign` return checked data in canonical units (SI by `Recording.si`).
`write_recording` writes files that read back equal. Nothing here needs JAX.
"""

from . import kinds, schema
from .campaign import read_campaign
from .checks import check_recording
from .questions import ask_about_copies, heated_unseen, notices_of_reading, questions_of_reading
from .reading import read_recording
from .recording import Campaign, Recording, Reduction, all_real, require_fitted
from .schema import NOT_STATED
from .shared import recordings_folder
from .size_limits import resistance_range, wire_length
from .unusual import ask_about_units
from .writing import target_path, write_recording, write_recordings

__all__ = [
    "NOT_STATED",
    "Campaign",
    "Recording",
    "Reduction",
    "all_real",
    "ask_about_copies",
    "ask_about_units",
    "check_recording",
    "heated_unseen",
    "kinds",
    "notices_of_reading",
    "questions_of_reading",
    "read_campaign",
    "read_recording",
    "recordings_folder",
    "require_fitted",
    "resistance_range",
    "schema",
    "target_path",
    "wire_length",
    "write_recording",
    "write_recordings",
]
