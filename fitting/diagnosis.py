"""The former name of `fitting.diagnose`, for programs that were written for it."""

from fitting.diagnose import Conclusion, diagnose

__all__ = ["Conclusion", "diagnose"]
