"""Design studies: the dimensions of an actuator or a chain that do best what is wanted of it.

`read_study` reads a study, `run_study` solves it. docs/design.md says how.
"""

from .reading import read_study
from .run import run_study
from .study import Study

__all__ = ["Study", "read_study", "run_study"]
