"""The entry point of sampling: from a target to a posterior, with the necessary or the given number of
steps."""

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from fitting.inference.parameters import Parameters
from pneusma_jax.errors import InputError
from pneusma_jax.precision import require_float64

from .chains import Chains
from .checkpoint import settings_of
from .convergence import assess
from .ensembles import Ensembles
from .hamiltonian import HamiltonianChains
from .laplace import Laplace, laplace
from .pilot import pilot
from .progress import SamplingBar
from .result import Posterior
from .settings import Settings
from .target import Target

GROWTH = 1.1  # Factor on the number of steps between two judgements of convergence
CHAINS = {"emcee": Ensembles, "tempered": Ensembles, "nuts": HamiltonianChains}


def sample(
    target: Target,
    start: Parameters | Mapping[str, float],
    settings: Settings = Settings(),
    *,
    file: str | Path | None = None,
    resume: bool = False,
    progress: bool | None = None,
) -> Posterior:
    """Sample a posterior with independent chains until they agree, or the budget is spent.

    The sampler is that of the settings, or the one that a pilot chooses. The log-probability of half an
    ensemble of emcee is one call of one compiled program; there is no process pool.

    Sampling ends when three criteria hold. Every chain is longer than 50 integrated autocorrelation times
    after burn-in. There are 1,000 effective samples. The split, rank-normalised R-hat between chains is below
    1.01 for every parameter. Otherwise the result says that it has not converged.

    Args:
        target: target to sample.
        start: values of the free parameters; the search for the most probable point starts there.
        settings: walkers, ensembles, budget, seed; see `Settings`.
        file: HDF5 file for the chains, replaced after every chunk; None keeps them in memory.
        resume: true to continue the chains in `file`. With the same seed the result equals that of an
            uninterrupted run.
        progress: true to show a bar; None shows it at a terminal, and occasional plain lines elsewhere.

    Returns:
        The posterior; check its `converged`.

    Raises:
        InputError: if the start has no finite log-probability, nothing bounds an undetermined parameter, or
            the file holds a chain of another target.
    """
    require_float64()
    settings = settings.resolved(target.dimension)
    file = None if file is None else Path(file)
    if resume and file is None:
        raise ValueError("Argument `file` must be given with `resume`, but it is None.")
    found = laplace(target, _vector(target, start))
    _check_proper(target, found)
    began, state = time.monotonic(), None
    chains = _chains(target, found, settings, file, resume)
    with SamplingBar(progress, settings.max_steps, chains.steps) as bar:
        for goal in _judgements(settings.chunk, settings.max_steps):
            if goal < chains.steps:
                continue
            while chains.steps < goal:
                chains.advance(min(settings.chunk, goal - chains.steps))
                bar.advance_to(chains.steps)
            state = assess(chains.judged)
            bar.judged(state)
            if state.converged:
                break
    return Posterior(
        target=target,
        settings=chains.settings,
        chains=chains.coordinates,
        log_probabilities=chains.log_probabilities,
        convergence=assess(chains.judged) if state is None else state,
        laplace=found,
        acceptance=tuple(chains.acceptance),
        evaluations=chains.evaluations,
        failures=chains.failures,
        seconds=time.monotonic() - began,
        why=chains.why,
        diagnostics=chains.diagnostics,
    )


def _chains(target: Target, found: Laplace, settings: Settings, file: Path | None, resume: bool) -> Chains:
    """New or continued chains, with a sentence about the choice of the sampler. It is that of a stored chain,
    the requested one, or the one that a pilot chooses."""
    if resume:
        stored = settings_of(file)["sampler"]
        # another sampler than the stored one is refused on reading
        wanted = stored if settings.sampler == "auto" else settings.sampler
        chains = CHAINS[wanted](target, replace(settings, sampler=wanted), file)
        chains.resume()
        chains.why = chains.why or f"{stored}, with which these chains were begun."
        return chains
    why = f"{settings.sampler}, as was asked for."
    if settings.sampler == "auto":
        choice = pilot(target, found, settings)
        if choice.chains is not None:
            choice.chains.why = choice.why
            choice.chains.keep(file)
            return choice.chains
        settings, why = choice.settings, choice.why
    chains = CHAINS[settings.sampler](target, settings, file)
    chains.why = why
    chains.begin(found)
    return chains


def _judgements(chunk: int, budget: int) -> Iterator[int]:
    """Steps at which convergence is judged. The series is fixed, so that an interrupted run stops where
    another would."""
    goal = chunk
    while goal < budget:
        yield goal
        goal = chunk * math.ceil(max(goal + chunk, GROWTH * goal) / chunk)
    yield budget


def _vector(target: Target, start: Parameters | Mapping[str, float]) -> np.ndarray:
    """Coordinates of the starting values."""
    values = start.valuesdict() if isinstance(start, Parameters) else dict(start)
    missing = [name for name in target.names if name not in values]
    if missing:
        raise InputError(f"no starting value for parameter {missing[0]!r}; give one for each that is sampled")
    plain = np.array([values[name] for name in target.names], float)
    logarithmic = np.asarray(target.layout.logarithmic, bool)
    if np.any(plain[logarithmic] <= 0.0):
        raise InputError("a parameter that is fitted by its logarithm must start above zero")
    vector = np.where(logarithmic, np.log(np.where(logarithmic, plain, 1.0)), plain)
    return np.clip(vector, np.asarray(target.lower), np.asarray(target.upper))


def _check_proper(target: Target, found: Laplace) -> None:
    """Refuse a posterior that cannot be normalised, because neither data nor prior nor bounds determine a
    parameter."""
    for i, name in enumerate(target.names):
        bounded = np.isfinite(target.lower[i]) and np.isfinite(target.upper[i])
        if not (found.known[i] or found.at_bound[i] or bounded or name in target.prior_names):
            raise InputError(
                f"parameter {name!r}: the data do not determine it and nothing bounds it, so it has no "
                "posterior; give it a prior or bounds, or fix it"
            )
