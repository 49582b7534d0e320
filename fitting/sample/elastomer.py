"""The posterior of an elastomer's law: its constants and each specimen's stiffness factor."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.calibrate.elastomer.fit import LawFit
from fitting.calibrate.elastomer.laws import CurveLaw
from fitting.calibrate.elastomer.model import FACTOR, arrays, stress_of
from fitting.calibrate.elastomer.samples import Samples
from fitting.inference.parameters import Parameter, Parameters
from pneusma_jax.calibration.records import Calibration, Prior
from pneusma_jax.errors import InputError

from .order import keeps_order
from .problem import Curve, Problem
from .target import Target

if TYPE_CHECKING:
    from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation


def problem_of(fit: "ElastomerCharacterisation", model: Calibration | None = None) -> Problem:
    """Posterior of the law that a characterisation selected.

    The likelihood is that of the fit: residuals over the noise. The noise is inflated by the fit's factor for
    misfit and serial correlation, so that the samples count as many times as they are independent.

    Args:
        fit: characterisation of the elastomer.
        model: table whose priors the constants get; None for flat priors within the bounds of the law.

    Raises:
        InputError: if the table is of another law.
    """
    law, samples, best = fit.best.law, fit.samples, fit.best
    if model is not None and model.text.get("law") != law.law:
        raise InputError(f"{model.path or model.name}: holds law {model.text.get('law')!r}, not {law.law!r}")
    parameters = _parameters(best, {} if model is None else _priors(model, law))
    specimens, zeros = list(best.factors), list(best.zeros)
    weight = np.where(best.mask, 1.0 / (samples.spread * best.inflation), 0.0)
    data = {**arrays(samples, specimens, zeros), "weight": weight}
    stress = stress_of(law, len(specimens), [zero.name for zero in zeros])

    def residual(values: dict[str, Array], data: dict) -> Array:
        return (stress(values, data) - data["stress"]) * data["weight"]

    def log_likelihood(values: dict[str, Array], data: dict) -> Array:
        density = -0.5 * jnp.sum(residual(values, data) ** 2)
        return jnp.where(in_order(values), density, -jnp.inf)

    exponents = [name for name in law.names if name.startswith("alpha_")] if law.law == "ogden" else []
    in_order = keeps_order(parameters, exponents)
    return Problem(
        title=fit.title,
        kind="elastomer",
        real=samples.real,
        target=Target.from_log_likelihood(log_likelihood, parameters, data, residual),
        parameters=parameters,
        predict=lambda values, data: stress(values, data) / 1e3,
        data=_in_curves(samples, data),
        curves=_curves(samples, best),
        notes=_notes(samples, best, model),
        notices=samples.notices,
    )


def _parameters(best: LawFit, priors: Mapping[str, Prior]) -> Parameters:
    """Constants in the order of reports, then the specimens' factors, with the names of files."""
    law, fitted = best.law, best.result.parameters
    raw = [fitted[name] for name in law.names]
    order = law.order(np.array([p.value for p in raw]))
    if any(p.tie is not None for p in raw):
        order = np.arange(len(raw))  # ties speak of constants by the names of the search
    parameters = Parameters()
    for name, constant, k in zip(law.names, law.constants, order, strict=True):
        found = raw[k]
        parameters.add(
            Parameter(
                name, value=found.value, min=found.min, max=found.max, vary=found.vary, tie=found.tie,
                unit=constant.unit, prior=priors.get(name),
            )
        )  # fmt: skip
    for k in range(len(best.factors)):
        parameters.add(fitted[f"{FACTOR}{k + 1}"])
    for zero in best.zeros:
        parameters.add(fitted[zero.name])
    return parameters


def _priors(model: Calibration, law: CurveLaw) -> dict[str, Prior]:
    """Priors of a table for the law's constants.

    Raises:
        InputError: if it has not the law's number of terms.
    """
    missing = [name for name in law.names if name not in model.quantities]
    if missing:
        raise InputError(f"{model.path or model.name}: key {missing[0]!r} of {law.label} is missing")
    return {name: model.quantities[name].prior for name in law.names if model.quantities[name].prior}


def _in_curves(samples: Samples, data: dict) -> dict:
    """Samples in the order of the curves, recording by recording."""
    rows = np.concatenate([np.flatnonzero(samples.of(k)) for k in range(len(samples.curves))])
    return {name: column[rows] for name, column in data.items()}


def _curves(samples: Samples, best: LawFit) -> tuple[Curve, ...]:
    misfit = max(best.mean_square, 1.0) ** 0.5
    curves = []
    for k, curve in enumerate(samples.curves):
        rows = samples.of(k)
        foreign = 0.0 if curve.specimen in best.factors or not best.factors else samples.batch
        sigma = np.hypot(samples.spread[rows] * misfit, foreign * samples.stress[rows])
        strain, stress = samples.strain[rows], samples.stress[rows] / 1e3
        curves.append(Curve(curve.name, curve.role, "strain", "stress_kPa", strain, stress, sigma / 1e3))
    return tuple(curves)


def _notes(samples: Samples, best: LawFit, model: Calibration | None) -> tuple[str, ...]:
    stated = all(curve.noise_stated for curve in samples.curves if curve.role == "fit")
    noise = "stated in the recordings" if stated else "estimated from the curves"
    priors = (
        f"Priors of the constants are those of {model.path or model.name}, cut at their bounds."
        if model is not None
        else "The constants have flat priors within the bounds of the law."
    )
    notes = [
        f"Law: {best.law.label}. Gaussian likelihood; the noise is {noise}, and larger by a factor of "
        f"{best.inflation:.3g} for misfit and serial correlation ({int(best.mask.sum())} samples count as "
        f"{best.independent:.3g} independent ones), as in the fit.",
        priors,
    ]
    if best.factors:
        notes.append(
            f"Each specimen has a factor on its stress with prior 1 ± {samples.batch:g}, cut at four sigma."
        )
    if best.law.law == "ogden":
        notes.append("Exponents keep the order of the fit: terms that change places are the same law.")
    return tuple(notes)
