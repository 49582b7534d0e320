"""Fits a law to any part of the samples, over and over, with one compiled program for each law."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Array

from fitting.inference.least_squares import fit_least_squares
from fitting.inference.parameters import Parameter, Parameters, Prior
from pneusma_jax.units import to_si

from .fit import LawFit, describe, inflation_of
from .laws import LAWS, CurveLaw, Start
from .model import FACTOR, Zero, arrays, stress_of, zeros_of_samples
from .samples import Samples

CUT = 4.0  # sigma, where a tolerance's prior ends
STARTS = 3  # fresh ones, where no fit to more samples is at hand
ONE_SD = 1.0  # difference of chi-square that one standard error of a constant makes; a lower one is none
ROUNDS = 2  # of weighting the specimens' prior against the misfit


class Engine:
    """Fits laws to parts of one stack of samples; every part has the same shape, so a law is compiled once.

    Args:
        samples: all of them.
        adjust: changes to constants by name, as of `characterise_elastomer`, which checks the names.
        seed: seed of the scattered starting points.
    """

    def __init__(
        self, samples: Samples, adjust: Mapping[str, Mapping[str, Any]] | None = None, seed: int = 0
    ):
        self.samples = samples
        self.seed = seed
        self.adjust = dict(adjust or {})
        self.specimens = samples.specimens() if samples.batch > 0.0 and len(samples.specimens()) > 1 else []
        self.zeros = zeros_of_samples(samples)
        self._arrays = arrays(samples, self.specimens, self.zeros)

    def fit(
        self,
        law: CurveLaw,
        mask: np.ndarray,
        near: LawFit | None = None,
        errors: bool = False,
        fewer: LawFit | None = None,
    ) -> LawFit:
        """Fit a law to the masked samples.

        Args:
            law: law to fit.
            mask: samples to fit, shape (n,).
            near: a fit to more samples whose constants are tried as one start, and whose inflation is taken
                over.
            errors: find the inflation; without it, standard errors are those of independent samples.
            fewer: a fit of Ogden's law with one term fewer, which is tried as one start.
        """
        fit = self._solve(law, mask, near.inflation if near else 1.0, near, fewer=fewer)
        for _ in range((ROUNDS if self.specimens else 1) if errors else 0):
            fit = self._solve(law, mask, inflation_of(fit, self.samples), fit, fresh=False)
        return fit

    def _solve(
        self,
        law: CurveLaw,
        mask: np.ndarray,
        inflation: float,
        near: LawFit | None,
        fresh: bool = True,
        fewer: LawFit | None = None,
    ) -> LawFit:
        """Fit from the constants of `near` and `fewer`, if given, and from fresh starts, if asked for."""
        samples, names = self.samples, tuple(zero.name for zero in self.zeros)
        data = {**self._arrays, "weight": np.where(mask, 1.0 / (samples.spread * inflation), 0.0)}
        begin = {zero: near.zeros[zero][0] if near else zero.begin for zero in self.zeros}
        strain, stress = (x[mask] for x in samples.rested(begin))
        starts = [law.start_at(near.values, strain)] if near else []
        starts += [law.start_at_fewer(fewer.values, strain)] if fewer else []
        if fresh:
            most = 1 if near else STARTS
            starts += law.starts(strain, stress, samples.spread[mask], self.seed, most)
        results = [
            fit_least_squares(
                Residual(law.name, len(self.specimens), names),
                self._parameters(law, start, begin),
                data=data,
                use_priors=bool(self.specimens or self.zeros),
                scale_covariance=False,
                observations=int(mask.sum()),
            )
            for start in starts
        ]
        misfits = [np.inf if r.chi_square is None else r.chi_square for r in results]
        as_good = [k for k, misfit in enumerate(misfits) if misfit <= min(misfits) + ONE_SD]
        best = min(as_good or range(len(results)), key=lambda k: (not results[k].success, misfits[k]))
        return describe(law, samples, mask, results[best], self.specimens, self.zeros, inflation)

    def _parameters(self, law: CurveLaw, start: Start, begin: Mapping[Zero, float]) -> Parameters:
        parameters = Parameters()
        for constant, value, low, high in zip(
            law.constants, start.values, start.lower, start.upper, strict=True
        ):
            entry = Parameter(
                constant.name, value=float(value), min=float(low), max=float(high), unit=constant.unit
            )
            parameters.add(entry)
        for name, change in self.adjust.items():
            if name in parameters:
                _apply(parameters[name], change)
        for k in range(len(self.specimens)):
            batch = self.samples.batch
            prior = Prior(1.0, batch, max(1.0 - CUT * batch, 1e-3), 1.0 + CUT * batch)
            parameters.add(Parameter(f"{FACTOR}{k + 1}", value=1.0, prior=prior))
        for zero in self.zeros:
            parameters.add(Parameter(zero.name, value=begin[zero], prior=zero.prior, unit=zero.unit))
        return parameters


@dataclass(frozen=True)
class Residual:
    """The residual function of a law. Its fields are the whole of its name, so its program can be stored.

    Attributes:
        law: name of the law.
        specimens: number of specimens with a factor of their own.
        zeros: names of the zeros that are fitted.
    """

    law: str
    specimens: int
    zeros: tuple[str, ...]

    def __call__(self, values: dict[str, Array], data: dict[str, Array]) -> Array:
        """Weighted residuals, (n,)."""
        stress = stress_of(LAWS[self.law], self.specimens, self.zeros)
        return (stress(values, data) - data["stress"]) * data["weight"]


def _apply(parameter: Parameter, change: Mapping[str, Any]) -> None:
    """Change a constant; numbers come in the unit of files."""
    fields = {
        key: to_si(value, parameter.unit) if key in ("value", "min", "max") else value
        for key, value in change.items()
    }
    value = fields.get("value", parameter.value)
    low, high = fields.get("min", parameter.min), fields.get("max", parameter.max)
    if "value" in change and not low <= value <= high:
        # A bound of ours gives way to a value that is asked for.
        low, high = min(low, value), max(high, value)
    parameter.set(**{**fields, "min": low, "max": high, "value": float(np.clip(value, low, high))})
