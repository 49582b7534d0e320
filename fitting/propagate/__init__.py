"""Batch uncertainty: what varies, through the model, to what is asked, in chunks that any machine can
compute.

`propagate(study, folder)` does a study; `docs/propagate.md` has its format and how it works.
"""

from .problem import build_problem
from .reading import read_study
from .result import Propagation, begun, propagate

__all__ = ["Propagation", "begun", "build_problem", "propagate", "read_study"]
