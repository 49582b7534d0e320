"""Forward models of recordings: for each kind of specimen, outputs as pure functions of named parameters.
Fits, samplers and diagnoses all use them.

    >>> specimen = specimen_of("spring")
    >>> parameters = specimen.parameters_for(campaign)          # free numbers with their priors
    >>> data = stack(specimen.rows_for(campaign))               # arrays of one shape
    >>> fit_least_squares(residual_of("spring"), parameters, data=data, use_priors=True)

Values are in SI. Their names are those of calibration tables and of `[geometry]`, without units (`G_m`,
`wire_diameter`, `silicone_stiffness`). A value of one specimen among several carries its number:
`wire_diameter__2`. Importing this package registers the five kinds of the project. `register` adds another
kind (`docs/new_kind.md`).
"""

from .actuator import ACTUATOR
from .elastomer import COUPON
from .registry import (
    SPECIMENS,
    candidates,
    derivative_of,
    kind_of,
    misfit_of,
    predictor_of,
    register,
    residual_of,
    specimen_of,
)
from .rows import Rows, numbers, stack
from .specimen import FITTED, Model, RowOptions, Specimen
from .spring import SPRING
from .spring_by_temperature import BY_TEMPERATURE
from .tube import TUBE
from .wire import WIRE

__all__ = [
    "ACTUATOR",
    "BY_TEMPERATURE",
    "COUPON",
    "FITTED",
    "SPECIMENS",
    "SPRING",
    "TUBE",
    "WIRE",
    "Model",
    "RowOptions",
    "Rows",
    "Specimen",
    "candidates",
    "kind_of",
    "numbers",
    "derivative_of",
    "misfit_of",
    "predictor_of",
    "register",
    "residual_of",
    "specimen_of",
    "stack",
]
