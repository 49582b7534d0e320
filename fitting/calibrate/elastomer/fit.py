"""A fitted law: its constants, standard errors that know about misfit and serial correlation, its curve."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.inference.absorbed_noise import with_absorbed
from fitting.inference.least_squares import FitResult
from fitting.inference.parameters import Parameters
from fitting.inference.serial_correlation import lag_one
from fitting.specimens.rows import padded
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.units import from_si

from .laws import LAWS, CurveLaw
from .model import FACTOR, Zero
from .samples import Samples

SHORTEST = 128
"""Minimum number of strains that a program is compiled for, and next four times as many, and so on."""


@dataclass(frozen=True)
class LawFit:
    """A law with its constants found.

    Attributes:
        law: the fitted law.
        values: constants [SI], shape (k,).
        sd: their standard errors [SI], shape (k,); NaN where the data do not determine one or it sits at a
            bound.
        covariance: covariance of the constants [SI], shape (k, k); zero where there is no standard error.
        sd_within: standard errors for the specimens as they are, their spread left out [SI], shape (k,).
        at_bound: sentence end for each constant that stopped at a bound.
        factors: stiffness of each specimen over the material's, and its standard error.
        zeros: fitted zeros of recordings, and their standard errors [SI].
        mask: samples that were fitted, shape (n,).
        mean_square: mean square of the residuals over their spread.
        lag_one: correlation of neighbouring residuals.
        correlation_time: samples that make one independent one, with slow noise that the fit has taken up.
        absorbed: factor by which the fit made the mean square of the noise too small, 1 or more.
        inflation: factor on the standard errors for misfit and serial correlation.
        result: the engine's own result.
    """

    law: CurveLaw
    values: np.ndarray
    sd: np.ndarray
    covariance: np.ndarray
    sd_within: np.ndarray
    at_bound: dict[str, str]
    factors: dict[str, tuple[float, float]]
    zeros: dict[Zero, tuple[float, float]]
    mask: np.ndarray
    mean_square: float
    lag_one: float
    correlation_time: float
    absorbed: float
    inflation: float
    result: FitResult

    @property
    def independent(self) -> float:
        """Number of independent samples that were fitted."""
        return float(self.mask.sum() / self.correlation_time)

    @property
    def free(self) -> list[int]:
        """Indices of the constants that have a standard error."""
        return [k for k in range(len(self.values)) if self.covariance[k, k] > 0.0]

    def stress(self, strain: np.ndarray) -> np.ndarray:
        """Engineering stress of the material [Pa] at strains [1] of any one-dimensional shape."""
        return self._along(_stress, strain)

    def gradient(self, strain: np.ndarray) -> np.ndarray:
        """Derivative of the stress by the constants, shape (strains, k)."""
        return self._along(_gradient, strain)

    def _along(self, program: Callable, strain: np.ndarray) -> np.ndarray:
        """A program of the law at every strain; strains are padded, so that few lengths are compiled."""
        count, size = len(strain), SHORTEST
        while size < count:
            size *= 4
        full = padded(np.asarray(strain, float), size, fill=0.0)
        return np.asarray(program(self.law.name, full, self.values))[:count]

    def shear_modulus(self) -> tuple[float, float]:
        """Initial shear modulus (a third of the slope; every law has one) and its standard error [Pa]."""
        modulus, gradient = (np.asarray(x) for x in _modulus(self.law.name, self.values))
        return float(modulus), float(np.sqrt(gradient @ self.covariance @ gradient))

    def rested(self, samples: Samples) -> tuple[np.ndarray, np.ndarray]:
        """Strain of the taut specimens and stress by the load cell's own zero, (n,) each."""
        return samples.rested({zero: value for zero, (value, _) in self.zeros.items()})

    def predict(self, samples: Samples) -> np.ndarray:
        """Engineering stress of every sample [Pa], with its specimen's factor and its recording's zeros."""
        factors = np.array([self.factors.get(curve.specimen, (1.0, 0.0))[0] for curve in samples.curves])
        strain, stress = self.rested(samples)
        return factors[samples.owner] * self.stress(strain) + samples.stress - stress


def describe(
    law: CurveLaw,
    samples: Samples,
    mask: np.ndarray,
    result: FitResult,
    specimens: Sequence[str],
    zeros: Sequence[Zero],
    used: float,
) -> LawFit:
    """Summary of a fit of a law.

    Args:
        law: the law that was fitted.
        samples: all of them.
        mask: true for samples that were fitted, shape (n,).
        result: fit of the residuals over `used` times their spread.
        specimens: names of specimens with a factor of their own.
        zeros: zeros of recordings that were fitted with it.
        used: inflation of the standard errors.
    """
    series = samples.series(result.residual * used, mask)
    noise = with_absorbed(series, _directions(law, samples, mask, result, specimens))
    values = np.array([result.values[name] for name in law.names])
    covariance, sd, within = _constants(law, result)
    bounds, errors = _bounds(law, result.parameters), result.standard_errors
    names = [f"{FACTOR}{k + 1}" for k in range(len(specimens))]
    asked = any(not result.parameters[name].free for name in law.names)
    order = np.arange(len(values)) if asked else law.order(values)
    return LawFit(
        law=law,
        values=values[order],
        sd=sd[order],
        covariance=covariance[np.ix_(order, order)],
        sd_within=within[order],
        at_bound={law.names[k]: bounds[law.names[i]] for k, i in enumerate(order) if law.names[i] in bounds},
        factors={s: (result.values[n], errors[n] or np.nan) for s, n in zip(specimens, names, strict=True)},
        zeros={zero: (result.values[zero.name], errors[zero.name] or np.nan) for zero in zeros},
        mask=mask,
        mean_square=float(np.sum(np.concatenate(series) ** 2) / mask.sum()),
        lag_one=lag_one(series),
        correlation_time=noise.correlation_time,
        absorbed=noise.mean_square,
        inflation=used,
        result=result,
    )


def inflation_of(fit: LawFit, samples: Samples) -> float:
    """Factor on standard errors that the residuals of a fit ask for.

    The root of their mean square, with what the fit has taken up of it, and of the number of samples that
    repeat each other. A noise that somebody stated is not shrunk.
    """
    misfit = fit.mean_square * fit.absorbed
    if any(curve.noise_stated for curve in samples.curves):
        misfit = max(misfit, 1.0)
    return float(np.sqrt(misfit * fit.correlation_time))


def _directions(
    law: CurveLaw, samples: Samples, mask: np.ndarray, result: FitResult, specimens: Sequence[str]
) -> list[np.ndarray]:
    """Derivatives of residuals by constants and factors, of each fitted recording, of shape (n_i, k)."""
    values = np.array([result.values[name] for name in law.names])
    free = [k for k, name in enumerate(law.names) if result.parameters[name].free]
    strain = np.asarray(samples.strain)
    names = np.array([curve.specimen for curve in samples.curves])[samples.owner]
    stress = np.asarray(_stress(law.name, strain, values))
    factors = [stress * (names == name) for name in specimens]
    columns = [*np.asarray(_gradient(law.name, strain, values)).T[free], *factors]
    return samples.series((np.array(columns) / samples.spread).T, mask)


@stored_jit()
def _stress(law: str, strain: Array, values: Array) -> Array:
    """Stress of a law, (n,) [Pa]."""
    return LAWS[law].stress(strain, values)


@stored_jit()
def _gradient(law: str, strain: Array, values: Array) -> Array:
    """Derivative of the stress by the constants, (n, k)."""
    return jax.jacfwd(LAWS[law].stress, argnums=1)(strain, values)


@stored_jit()
def _modulus(law: str, values: Array) -> tuple[Array, Array]:
    """Initial shear modulus [Pa], and its derivative by the constants, (k,)."""
    slope = jax.grad(lambda strain, values: LAWS[law].stress(strain[None], values)[0] / 3.0)
    return jax.value_and_grad(lambda values: slope(jnp.zeros(()), values))(values)


def _constants(law: CurveLaw, result: FitResult) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Covariance of the constants, standard errors, and these with the specimens' factors held."""
    known, everything = result.uncertainty.names, result.uncertainty.covariance
    places = [(i, known.index(name)) for i, name in enumerate(law.names) if name in known]
    rows, own = [i for i, _ in places], [a for _, a in places]
    others = [k for k, name in enumerate(known) if name.startswith(FACTOR)]
    joint, cross = everything[np.ix_(own, own)], everything[np.ix_(own, others)]
    # a factor that the recordings do not tell apart has no covariance, and is held as it is
    beside = everything[np.ix_(others, others)]
    inverse = np.linalg.pinv(beside, hermitian=True) if others else np.zeros((0, 0))
    conditional = joint - cross @ inverse @ cross.T
    covariance = np.zeros((len(law.names),) * 2)
    covariance[np.ix_(rows, rows)] = joint
    parameters, errors = result.parameters, result.standard_errors
    held = {name for name in law.names if not parameters[name].free and parameters[name].tie is None}
    sd = np.array(
        [0.0 if name in held else np.nan if errors[name] is None else errors[name] for name in law.names]
    )
    within = sd.copy()
    within[rows] = np.sqrt(np.maximum(np.diag(conditional), 0.0))
    return covariance, sd, within


def _bounds(law: CurveLaw, parameters: Parameters) -> dict[str, str]:
    found = {}
    for constant in law.constants:
        entry = parameters[constant.name]
        if entry.free and entry.at_bound:
            lower = abs(entry.value - entry.min) <= abs(entry.value - entry.max)
            bound = from_si(entry.min if lower else entry.max, constant.unit)
            found[constant.name] = f"its {'lower' if lower else 'upper'} bound {bound:.4g} {constant.unit}"
    return found
