"""The posterior of a characterised campaign, with the data that reports need."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fitting.calibrate.result import Characterisation
from fitting.inference.results import Result, register_sampler
from pneusma_jax.calibration.records import Calibration
from pneusma_jax.errors import InputError, nearest

from .problem import Problem
from .problems import sampling_problem
from .result import Posterior
from .sampling import sample
from .settings import Settings

PREDICTED = 400
"""Number of draws for a predictive band."""


@dataclass(frozen=True)
class CampaignPosterior(Result):
    """A posterior and the campaign that it belongs to.

    Attributes:
        problem: sampled density and its campaign.
        posterior: draws and their diagnostics.
    """

    problem: Problem
    posterior: Posterior

    @property
    def converged(self) -> bool:
        """True if the numbers may be quoted."""
        return self.posterior.converged

    @cached_property
    def predictive(self) -> list[np.ndarray]:
        """Curves predicted by some hundred draws, each of shape (draws, rows), in the units of files."""
        return self.problem.predictions(self.posterior.flat(PREDICTED))


def posterior_of(
    fit: Characterisation, *, model: Calibration | None = None, **options: Any
) -> CampaignPosterior:
    """Sample the posterior of a characterisation, starting from its fit; float64 must be on.

    Args:
        fit: characterisation of any kind that can be sampled.
        model: table whose priors the parameters get.
        **options: further arguments of `sample_problem`.

    Raises:
        InputError: if this kind cannot be sampled, or `sample_problem` refuses.
    """
    _check_settings(options)
    return sample_problem(sampling_problem(fit, model), **options)


def sample_problem(
    problem: Problem,
    *,
    file: str | Path | None = None,
    resume: bool = False,
    progress: bool | None = None,
    **settings: Any,
) -> CampaignPosterior:
    """Sample the posterior of a campaign.

    Args:
        problem: density to sample, with the values to start from.
        file: HDF5 file for the chains, so that a run can be resumed; None keeps them in memory.
        resume: true to continue the chains in `file`.
        progress: true to show a bar; None shows it at a terminal, and occasional plain lines elsewhere.
        **settings: attributes of `Settings`.

    Raises:
        InputError: if there is no such setting, or `sample` refuses.
    """
    _check_settings(settings)
    posterior = sample(
        problem.target, problem.parameters, Settings(**settings), file=file, resume=resume, progress=progress
    )
    return CampaignPosterior(problem, posterior)


def _check_settings(given: Mapping[str, Any]) -> None:
    """Refuse a mistyped setting before any computation."""
    names = [field.name for field in fields(Settings)]
    for name in given:
        if name not in (*names, "file", "resume", "progress"):
            raise InputError(f"there is no setting {name!r} of a posterior, {nearest(name, names)}")


register_sampler(Characterisation, posterior_of)
