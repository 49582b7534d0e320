"""Recordings of each kind as pure functions of named parameters: what fits, samplers and diagnoses stand on.

    >>> model = model_of("spring")
    >>> parameters = model.parameters_for(campaign)          # free numbers with their priors
    >>> data = stack(model.rows_for(campaign))               # arrays of one shape
    >>> fit_least_squares(residual_of("spring"), parameters, data=data, use_priors=True)
 Values are in SI under the names of calibration tables and of `[geometry]` without units (`G_m`,
`wire_diameter`, `silicone_stiffness`); those of one specimen of several carry its number, `wire_diameter__2`.
"""

from .registry import Model, model_of, observations, parameters_for, predictor_of, residual_of
from .rows import Rows, numbers, silenced, stack

__all__ = [
    "Model",
    "Rows",
    "model_of",
    "numbers",
    "observations",
    "parameters_for",
    "predictor_of",
    "residual_of",
    "silenced",
    "stack",
]
