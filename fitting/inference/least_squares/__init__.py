"""Nonlinear least squares with bounds, ties, priors, standard errors and an honest status."""

from .fit import fit_least_squares
from .program import Outcome, solve
from .result import FitError, FitResult, Status
from .trust_region import Box

__all__ = ["Box", "FitError", "FitResult", "Outcome", "Status", "fit_least_squares", "solve"]
