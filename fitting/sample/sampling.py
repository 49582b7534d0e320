"""The entry point of sampling: from a target to a posterior, until convergence or the end of the budget."""

import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np

from fitting.inference.parameters import Parameters
from fitting.inference.progress import Steps
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

GROWTH = 1.1  # Minimum factor on the number of steps between two assessments of convergence
CHAINS = {"emcee": Ensembles, "tempered": Ensembles, "nuts": HamiltonianChains}
"""Chains of each sampler."""


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
    with Steps("preparing chains") if progress is not False else nullcontext(_unsaid) as tell:
        tell("the log-density about the fit")
        approximation = laplace(target, _vector(target, start))
        _check_proper(target, approximation)
        began, state = time.monotonic(), None
        chains = _chains(target, approximation, settings, file, resume, tell)
    with SamplingBar(progress, settings.max_steps, chains.steps) as bar:
        for goal in _assessments(settings.chunk, settings.max_steps):
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
        laplace=approximation,
        acceptance=tuple(chains.acceptance),
        evaluations=chains.evaluations,
        failures=chains.failures,
        seconds=time.monotonic() - began,
        why=chains.why,
        diagnostics=chains.diagnostics,
    )


def _unsaid(step: str) -> None:
    """Say nothing of a step that begins."""


def _chains(
    target: Target,
    approximation: Laplace,
    settings: Settings,
    file: Path | None,
    resume: bool,
    tell: Callable[[str], None],
) -> Chains:
    """New or continued chains. Their `why` states who chose the sampler: the stored chain, the caller or a
    pilot. `tell` is called with a word for each step that begins."""
    if resume:
        stored = settings_of(file)["sampler"]
        sampler = stored if settings.sampler == "auto" else settings.sampler
        chains = CHAINS[sampler](target, replace(settings, sampler=sampler), file)
        chains.resume()  # refuses another sampler than the stored one
        chains.why = chains.why or f"{stored}, with which these chains were begun."
        return chains
    why = f"{settings.sampler}, as was asked for."
    if settings.sampler == "auto":
        choice = pilot(target, approximation, settings, tell)
        if choice.chains is not None:
            choice.chains.why = choice.why
            choice.chains.store_in(file)
            return choice.chains
        settings, why = choice.settings, choice.why
    chains = CHAINS[settings.sampler](target, settings, file)
    chains.why = why
    tell("starting points")
    chains.begin(approximation)
    return chains


def _assessments(chunk: int, budget: int) -> Iterator[int]:
    """Numbers of steps at which convergence is assessed.

    They do not depend on interruptions, so that a resumed run stops where an uninterrupted one does.
    """
    goal = chunk
    while goal < budget:
        yield goal
        goal = chunk * math.ceil(max(goal + chunk, GROWTH * goal) / chunk)
    yield budget


def _vector(target: Target, start: Parameters | Mapping[str, float]) -> np.ndarray:
    """Coordinates of the starting values in the target, shape (n,), brought inside its bounds."""
    values = start.valuesdict() if isinstance(start, Parameters) else dict(start)
    missing = [name for name in target.names if name not in values]
    if missing:
        raise InputError(f"no starting value for parameter {missing[0]!r}; give one for each that is sampled")
    numbers = np.array([values[name] for name in target.names], float)
    logarithmic = np.asarray(target.layout.logarithmic, bool)
    if np.any(numbers[logarithmic] <= 0.0):
        raise InputError("a parameter that is fitted by its logarithm must start above zero")
    vector = np.where(logarithmic, np.log(np.where(logarithmic, numbers, 1.0)), numbers)
    return np.clip(vector, np.asarray(target.lower), np.asarray(target.upper))


def _check_proper(target: Target, approximation: Laplace) -> None:
    """Refuse a posterior that cannot be normalised, because neither data nor prior nor bounds determine a
    parameter."""
    lower, upper = np.asarray(target.lower), np.asarray(target.upper)
    for i, name in enumerate(target.names):
        bounded = np.isfinite(lower[i]) and np.isfinite(upper[i])
        if not (approximation.known[i] or approximation.at_bound[i] or bounded or name in target.prior_names):
            raise InputError(
                f"parameter {name!r}: the data do not determine it and nothing bounds it, so it has no "
                "posterior; give it a prior or bounds, or fix it"
            )
