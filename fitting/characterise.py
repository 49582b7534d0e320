"""The former name of `fitting.calibrate`, for programs that were written for it."""

from fitting.calibrate import Batch, Characterisation, Estimate, characterise, characterise_batch

__all__ = ["Batch", "Characterisation", "Estimate", "characterise", "characterise_batch"]
