"""Importers: readers of raw laboratory files, from exports of instruments and databases to recordings.

A file's format is recognised by its content. Every import reports its interpretation (`Recording.notices`). A
file that cannot be a recording is refused with one sentence: its likely content, and the missing information.
"""

from .folders import left_in_folders, raw_files
from .formats import FORMATS, detect
from .options import Options, make_options
from .parts import samples_of
from .raw import open_raw
from .run import import_file, import_files, import_tests

__all__ = [
    "FORMATS",
    "Options",
    "detect",
    "import_file",
    "import_files",
    "import_tests",
    "left_in_folders",
    "make_options",
    "open_raw",
    "raw_files",
    "samples_of",
]
