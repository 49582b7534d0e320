"""Readers of raw laboratory files: from what instruments and databases export to recordings.

A file's format is recognised by its content. Every import says what it understood (`Recording.notices`), and
a file that cannot be a recording is refused with a sentence that says what it is and what would be needed.
"""

from .options import Options, make_options
from .parts import samples_of
from .raw import open_raw
from .registry import FORMATS, detect, import_file, import_files, import_tests, raw_files

__all__ = [
    "FORMATS",
    "Options",
    "detect",
    "import_file",
    "import_files",
    "import_tests",
    "make_options",
    "open_raw",
    "raw_files",
    "samples_of",
]
