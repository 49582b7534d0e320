"""The former name of `fitting.inference.parameters`, for programs that were written for it."""

from fitting.inference.parameters import Layout, Parameter, Parameters, Prior, format_estimate

__all__ = ["Layout", "Parameter", "Parameters", "Prior", "format_estimate"]
