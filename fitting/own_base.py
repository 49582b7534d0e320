"""The former name of `fitting.diagnose.custom_model`, for programs that were written for it."""

import fitting.report.results  # noqa: F401  says how a result looks
from fitting.diagnose.custom_model import Explained, OwnModel, OwnRecording, Term, explain_own

__all__ = ["Explained", "OwnModel", "OwnRecording", "Term", "explain_own"]
