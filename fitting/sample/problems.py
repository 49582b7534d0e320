"""The sampling problem of each type of characterisation."""

import functools
from dataclasses import replace

from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation
from fitting.calibrate.general.fit import inflated
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.result import Characterisation
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.specimens.saved_model_notes import notes_on
from pneusma_jax.calibration.records import Calibration
from pneusma_jax.errors import InputError

from .elastomer import problem_of
from .models import model_problem
from .problem import Problem


@functools.singledispatch
def sampling_problem(fit: Characterisation, model: Calibration | None = None) -> Problem:
    """Sampling problem of a characterisation.

    Args:
        fit: characterisation of any type.
        model: table whose priors the parameters get.

    Raises:
        InputError: if this type of result cannot be sampled, or takes no table.
    """
    raise InputError(f"a posterior of this kind of result ({type(fit).__name__}) cannot be sampled")


@sampling_problem.register
def _(fit: ElastomerCharacterisation, model: Calibration | None = None) -> Problem:
    """The selected law, with its constants and the stiffness of the specimens."""
    return replace(problem_of(fit, model), fit=fit)


@sampling_problem.register
def _(fit: SpringCharacterisation, model: Calibration | None = None) -> Problem:
    """The joint posterior from the fit's own values, with the martensite fractions profiled out.

    The decisions of the residual strain's rule at the fit are held.
    """
    if model is not None:
        raise InputError(f"{model.name}: priors of springs come from their campaign, not from a table")
    recordings, problem = [test.recording for test in fit.tests], fit.joint.problem
    rows = problem.with_decisions(fit.joint.values)
    return replace(model_problem(fit.title, recordings, rows, problem.parameters), fit=fit)


@sampling_problem.register
def _(fit: GeneralCharacterisation, model: Calibration | None = None) -> Problem:
    """The joint posterior, from the fit's own values, its priors and its noise."""
    if model is not None:
        raise InputError(f"{model.name}: priors of this kind come from the campaign, not from a table")
    rows = inflated(fit.fit.rows, fit.fit.inflation)
    notes = [] if fit.model is None else notes_on(fit.model, fit.campaign)
    found = model_problem(fit.title, fit.fit.recordings, rows, fit.fitted, notes, model=fit.fit.model)
    return replace(found, fit=fit)
