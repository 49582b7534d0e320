"""The inputs that a study's `[vary]`, `[input]` and `[[correlation]]` describe.

A number of the model may vary by its prior. A relative tolerance, a distribution that the study states, and
the draws of a posterior each replace the prior.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fitting.data import hdf5
from fitting.inference.parameters.ties import RESERVED
from fitting.specimens.rows import MARK
from pneusma_jax.errors import InputError, counted, nearest
from pneusma_jax.units import UNITS, constant_to_si, dimension_of, is_difference, suggested_unit, to_si

from .distributions import Gaussian, Marginal, from_scipy
from .inputs import Draws, Inputs, copula_of, correlation_matrix
from .possible import check_possible, doubtful_priors, doubts, lowest_score
from .reading import number_in
from .responses import NOISE, Response, Variable
from .study import Study

CUT = 4.0
"""Number of standard deviations at which a tolerance ends on either side, as in fits."""
POSTERIOR_FILE = "posterior.nc"
"""Name of the file with draws in the folder that `pneusma posterior` leaves."""
FEWEST_DRAWS = 10
"""Minimum number of draws of a posterior."""


def plain_marginals(study: Study) -> dict[str, Marginal]:
    """Distributions of `[input]` for a study whose model is an expression: its numbers have no unit.

    Raises:
        InputError: for a table that describes no distribution, or a name that cannot be in an expression.
    """
    for name in study.inputs:
        if not name.isidentifier() or name in RESERVED:
            raise InputError(f"{study.path}: [input.{name}]: this is no name for a number in an expression")
    plain = Variable(0.0, "1")
    return {name: _marginal(entry, name, plain, study) for name, entry in study.inputs.items()}


def inputs_of(study: Study, response: Response) -> tuple[Inputs, list[str]]:
    """Inputs, and sentences about numbers that are left out.

    Args:
        study: the study.
        response: its model, which knows the numbers that may vary.

    Raises:
        InputError: for an unknown name, a table that describes no distribution, a number that varies in two
            ways, or correlations that no inputs can have.
    """
    vary, variables, notices = study.vary, response.variables, []
    draws = None if vary.posterior is None else read_draws(study.folder / vary.posterior)
    in_file = None if draws is None else draws.names
    if draws is not None:
        caution = [hdf5.uncounted(draws.source, draws.caution).rstrip(".")] if draws.caution else []
        draws, notices = _draws_of_model(draws, study, variables)
        notices = [*caution, *notices]
    _check_names(study, variables, in_file)
    marginals = _marginals_of_priors(study, variables)
    notices += _drop_tied(marginals, study, response)
    marginals |= _marginals_of_tolerances(study, variables)
    stated = {name: _marginal(entry, name, variables[name], study) for name, entry in study.inputs.items()}
    aside = {*stated, *study.vary.tolerance, *(draws.names if draws is not None else ())}
    priors = {name: prior for name, prior in marginals.items() if name not in aside}
    units = {name: variables[name].unit or "1" for name in priors}
    notices += doubtful_priors(priors, units, lowest_score(study))
    for name in (name for name in stated if variables[name].table):  # other numbers may have any name
        where = f"{study.path}: [input.{name}]"
        check_possible(stated[name], name, variables[name].unit or "1", where, lowest_score(study))
        notices += doubts(stated[name], name, variables[name].unit or "1")
    marginals |= stated
    if NOISE in variables and study.noise:
        marginals[NOISE] = from_scipy("uniform", {"loc": 0.0, "scale": 1.0}, "1", str(study.path))
    if draws is not None:
        _check_draws(draws, study, variables)
        for name in draws.names:  # a posterior replaces the prior
            marginals.pop(name, None)
    return _joined(study, marginals, draws), notices


def _check_names(study: Study, variables: Mapping[str, Variable], in_file: Sequence[str] | None) -> None:
    """Refuse names that the model does not have, and numbers that vary in two ways.

    Args:
        study: the study.
        variables: numbers of the model that may vary, by name.
        in_file: names of the draws in the posterior's file; None without a posterior.
    """
    vary = study.vary
    for name in (*study.inputs, *vary.tolerance):
        if name in vary.leave_out and in_file is None:  # with one, the input replaces the draws left out
            raise InputError(f"{study.path}: [vary] leave_out has {name!r}, which varies by itself; keep one")
    stems = {name.partition(MARK)[0] for name in in_file or ()}
    of_model = [name for name in vary.leave_out if name not in (in_file or ())]
    for name in of_model:
        variable = variables.get(name)
        prior = variable is not None and variable.prior is not None and variable.table in vary.priors
        if variable is not None and name not in stems and not prior:
            raise InputError(f"{study.path}: [vary] leave_out has {name!r}, which does not vary: drop it")
    for name in (*study.inputs, *vary.tolerance, *of_model):
        if name == NOISE and name in variables:
            raise InputError(f"{study.path}: {name!r} is drawn by [noise] already; leave it out here")
        if name not in variables:
            raise InputError(
                f"{study.path}: the model has no number {name!r} to vary, {nearest(name, variables)}"
            )


def _marginals_of_priors(study: Study, variables: Mapping[str, Variable]) -> dict[str, Marginal]:
    """Priors of the tables that `[vary] priors` names.

    Raises:
        InputError: if these tables have no prior.
    """
    vary = study.vary
    marginals: dict[str, Marginal] = {
        name: Gaussian(n.prior.mean, n.prior.sd, n.prior.min, n.prior.max)
        for name, n in variables.items()
        if n.prior is not None and n.table in vary.priors and name not in vary.leave_out
    }
    if vary.priors and not marginals:
        raise InputError(f"{study.path}: [vary] priors: none of the numbers has a prior to draw from")
    return marginals


def _marginals_of_tolerances(study: Study, variables: Mapping[str, Variable]) -> dict[str, Marginal]:
    """Gaussians about nominal values, cut off at `CUT`.

    Raises:
        InputError: for a nominal value of zero, or a number with a distribution of its own.
    """
    marginals: dict[str, Marginal] = {}
    for name, relative in study.vary.tolerance.items():
        if name in study.inputs:
            raise InputError(f"{study.path}: {name!r} has a tolerance and a table [input.{name}]; keep one")
        value = variables[name].value
        if value == 0.0:
            raise InputError(f"{study.path}: [vary] tolerance: {name} is 0, of which there is no share")
        sd = relative * abs(value)
        marginals[name] = Gaussian(value, sd, value - CUT * sd, value + CUT * sd)
        if variables[name].table:
            where = f"{study.path}: [vary] tolerance of {name}"
            check_possible(marginals[name], name, variables[name].unit or "1", where, lowest_score(study))
    return marginals


def _check_draws(draws: Draws, study: Study, variables: Mapping[str, Variable]) -> None:
    """Refuse draws of numbers that the model does not have, or that vary otherwise, too."""
    for name in draws.names:
        if name not in variables:
            raise InputError(
                f"{draws.source}: the model has no number {name!r}, {nearest(name, variables)}; state in "
                "[model] the alloy, material or model that its fit has, or name it in [vary] leave_out"
            )
        if name in study.inputs or name in study.vary.tolerance:
            raise InputError(
                f"{study.path}: {name!r} is in the posterior, and varies otherwise, too; keep one"
            )


def _draws_of_model(draws: Draws, study: Study, variables: Mapping[str, Variable]) -> tuple[Draws, list[str]]:
    """Draws of the numbers of one specimen, and sentences on what is left out.

    A posterior of several specimens has numbers with the number of the specimen, `wall_thickness__2`. Those
    of the specimen that the study means get the names of the model. Names that the model has already stay.

    Raises:
        InputError: if the study does not say which of several specimens is meant, or means one that is not
            in the posterior.
    """
    wanted, left_out = study.vary.posterior_specimen, study.vary.leave_out
    parts = {name: ("", "", "") if name in variables else name.partition(MARK) for name in draws.names}
    count = max((int(number) for _, _, number in parts.values() if number.isdigit()), default=1)
    if count > 1 and wanted is None:
        raise InputError(
            f"{draws.source}: this posterior is of {count} specimens; say in [vary] which one is meant, "
            f"posterior_specimen = 1 to {count} in the order of their campaign"
        )
    if wanted is not None and wanted > count:
        raise InputError(
            f"{study.path}: [vary] posterior_specimen = {wanted}, but {draws.source} is of {count}"
        )
    kept, names = [], []
    for column, name in enumerate(draws.names):
        stem, mark, number = parts[name]
        if not {name, stem} & set(left_out) and (not mark or number == str(wanted)):
            kept.append(column)
            names.append(stem or name)
    if not kept:
        raise InputError(f"{draws.source}: [vary] leave_out leaves nothing of this posterior")
    notices = [f"of the posterior, only the numbers of specimen {wanted} play a part"] if count > 1 else []
    return Draws(tuple(names), draws.table[:, kept], draws.source), notices


def _drop_tied(marginals: dict[str, Marginal], study: Study, response: Response) -> list[str]:
    """Remove priors of numbers that follow others from `marginals`, unless the study names them.

    Returns:
        A sentence for each of them.
    """
    notices = []
    for name, sentence in response.tied.items():
        if name in marginals and name not in study.inputs and name not in study.vary.tolerance:
            del marginals[name]
            notices.append(f"{sentence}, so its own prior is left out")
    return notices


def _joined(study: Study, marginals: dict[str, Marginal], draws: Draws | None) -> Inputs:
    """Inputs with their correlations; draws become marginals with a rank correlation if the study says so.

    Raises:
        InputError: for a correlation of a number that does not vary, or varies with its posterior.
    """
    if draws is not None and study.vary.posterior_as == "copula":
        own, correlation = copula_of(draws)
        matrix = np.eye(len(marginals) + len(own))
        matrix[len(marginals) :, len(marginals) :] = correlation
        marginals, draws = {**marginals, **own}, None
    else:
        matrix = np.eye(len(marginals) + (draws is not None))
    names = list(marginals)
    for first, second, _ in study.correlations:
        for name in (first, second):
            if draws is not None and name in draws.names:
                raise InputError(
                    f"{study.path}: [[correlation]]: {name!r} is drawn with its posterior; set posterior_as ="
                    " 'copula' to correlate it with others"
                )
            if name not in names:
                raise InputError(
                    f"{study.path}: [[correlation]]: {name!r} does not vary, {nearest(name, names)}"
                )
    where = f"{study.path}: [[correlation]]"
    return Inputs(marginals, correlation_matrix(names, study.correlations, matrix, where), draws)


def _marginal(entry: Mapping[str, Any], name: str, variable: Variable, study: Study) -> Marginal:
    """The distribution that a table `[input.NAME]` describes.

    With `distribution` it is one of SciPy. With `mean`, `sd` and perhaps `min`, `max` it is a Gaussian. With
    `low` and `high` it is uniform.

    Args:
        entry: the table.
        name: the number that varies.
        variable: its unit; any unit if that is empty. A number in kelvin is a difference of temperatures.
        study: the study, for messages.

    Raises:
        InputError: if the table describes no distribution, or is in a unit of something else.
    """
    where = f"{study.path}: [input.{name}]"
    unit = _unit_of(entry, name, variable, where)
    numbers = {key: number_in(entry, key, where) for key in entry if key not in ("distribution", "unit")}
    if "distribution" in entry:
        if not isinstance(entry["distribution"], str):
            raise InputError(f"{where}: distribution must be a name of scipy.stats, such as 'lognorm'")
        if entry["distribution"] == "uniform" and not set(numbers) <= {"loc", "scale"}:
            raise InputError(
                f"{where}: of a uniform distribution write its ends as low and high, and leave out "
                "distribution; in scipy.stats it has loc (the lower end) and scale (the width)"
            )
        return from_scipy(entry["distribution"], numbers, unit, where)
    if set(numbers) == {"low", "high"}:
        if not numbers["low"] < numbers["high"]:
            raise InputError(
                f"{where}: low = {numbers['low']:g} must be less than high = {numbers['high']:g}"
            )
        scale = numbers["high"] - numbers["low"]
        return from_scipy("uniform", {"loc": numbers["low"], "scale": scale}, unit, where)
    if not {"mean", "sd"} <= set(numbers) <= {"mean", "sd", "min", "max"}:
        raise InputError(
            f"{where} needs distribution and its numbers, or mean and sd (and min, max), or low and high;"
            f" it has {', '.join(entry) or 'nothing'}"
        )
    return _gaussian(numbers, unit, is_difference(variable.unit), where)


def _unit_of(entry: Mapping[str, Any], name: str, variable: Variable, where: str) -> str:
    """Unit of the numbers of a table; arguments as for `_marginal`, and file and table for messages."""
    usual = variable.unit or "1"
    unit = entry.get("unit", usual)
    if not isinstance(unit, str):
        raise InputError(f"{where}: unit must be a name such as 'mm', but it is {unit!r}")
    if unit not in UNITS:
        raise InputError(f"{where}: unknown unit {unit!r}, {suggested_unit(unit, dimension_of(usual))}")
    if variable.unit and dimension_of(unit) != dimension_of(usual):
        raise InputError(f"{where}: unit {unit!r} is one of {dimension_of(unit)}, but {name} is in {usual}")
    return unit


def _gaussian(numbers: Mapping[str, float], unit: str, difference: bool, where: str) -> Marginal:
    """A Gaussian by `mean`, `sd` and perhaps `min`, `max`.

    Args:
        numbers: these, in `unit`.
        unit: their unit.
        difference: true if the mean is a difference of temperatures, which has no zero to be shifted.
        where: file and table, for messages.
    """
    if numbers["sd"] <= 0.0:
        raise InputError(f"{where}: sd = {numbers['sd']:g} must be more than 0")
    low, high = numbers.get("min", -np.inf), numbers.get("max", np.inf)
    if not low < high:
        raise InputError(f"{where}: min = {low:g} must be less than max = {high:g}")
    if not (low - 5.0 * numbers["sd"] < numbers["mean"] < high + 5.0 * numbers["sd"]):
        raise InputError(f"{where}: mean = {numbers['mean']:g} lies more than 5 sd outside of min and max")
    mean, low, high = (to_si(x, unit, difference=difference) for x in (numbers["mean"], low, high))
    return Gaussian(mean, to_si(numbers["sd"], unit, difference=True), low, high)


def read_draws(place: Path) -> Draws:
    """Draws of `pneusma posterior`.

    Args:
        place: its folder, or the file `posterior.nc` in it.

    Raises:
        InputError: if there is no such file, or it has too few draws or any that is not finite.
    """
    file = place / POSTERIOR_FILE if place.is_dir() else place
    if not file.exists():
        raise InputError(f"{file}: there is no such file; `pneusma posterior` leaves one")
    with hdf5.opened(file, str(file), "a posterior of `pneusma posterior`") as content:
        group, caution = content["posterior"], hdf5.caution_of(content)
        columns = {}
        for name in group:
            if group[name].ndim == 2:
                unit = str(group[name].attrs.get("unit", "1"))
                if unit not in UNITS:
                    raise InputError(f"{file}: unknown unit {unit!r} of {name!r}, {suggested_unit(unit)}")
                with np.errstate(over="ignore"):  # infinite draws are refused below
                    columns[name] = constant_to_si(np.asarray(group[name]).ravel(), unit)
        if not columns:
            raise InputError(f"{file}: there are no draws in it; `pneusma posterior` leaves some")
        table = np.stack(list(columns.values()), axis=1)
    if len(table) < FEWEST_DRAWS or not np.all(np.isfinite(table)):
        raise InputError(f"{file}: {counted(len(table), 'draw')}: too few, or some are not finite")
    return Draws(tuple(columns), table, str(file), caution)
