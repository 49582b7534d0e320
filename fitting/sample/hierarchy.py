"""The joint posterior of several specimens of one material: a hierarchical model over their recordings.

Specimen k's constant is `mean + spread z_k` with `z_k ~ N(0, 1)`, or `mean exp(spread z_k)` of one that is
fitted by its logarithm. That is the non-centred form: mean, spread and z are independent before the
recordings speak, so that no funnel is sampled (O. Papaspiliopoulos and others, Stat. Sci. 22 (2007) 59). The
likelihood is that of the recordings themselves, not of estimates, so each prior counts once.

The mean has the prior of the constant. The spread has the positive half of a Gaussian whose size is that
prior's standard deviation: specimens do not differ by more than alloys do. What belongs to a specimen alone,
its dimensions, keeps its own prior, and is sampled where the shared constants leave it (`straight`).

Campaigns of one form are padded to one shape and computed side by side (`side_by_side`). No-U-turn chains are
the default sampler: the number of dimensions grows with the specimens, which costs ensembles of walkers most.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, PyTree

from fitting.calibrate.result import Characterisation
from fitting.data.recordings import schema
from fitting.inference.notes import joined
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.inference.results import Result
from fitting.specimens.priors import quantity_of
from fitting.specimens.rows import MARK
from pneusma_jax.errors import InputError
from pneusma_jax.units import constant_from_si, from_si

from .problem import Problem
from .problems import sampling_problem
from .result import Posterior
from .sampling import sample
from .settings import Settings
from .side_by_side import Form, side_by_side
from .straight import Valley, valley_of
from .target import Target

LEAST, MOST = 1e-3, 10.0
"""Bounds of a spread, in standard deviations of the prior."""
FAR = 8.0
"""Bound of a specimen's distance from the mean, in spreads; beyond it the Gaussian has 1e-15 left."""
FIRST = 0.3
"""Least start of a spread, in standard deviations of the prior; it is not small, so that z starts near 0."""


Place = tuple[int, str]
"""Number of a campaign, and the name that a constant has there."""


@dataclass(frozen=True)
class Shared:
    """A constant across specimens, in the unit of files.

    Attributes:
        specimens: name of each specimen: its campaign's, with its number where a campaign has several.
        unit: unit of the constant.
        alone, alone_sd: each specimen's own estimate, shape (specimens,).
        together, together_sd: mean and standard deviation of each specimen's constant in the joint posterior.
        mean, mean_sd: mean of the population.
        spread: 5 %, 50 % and 95 % quantiles of the standard deviation between specimens; relative where the
            constant is fitted by its logarithm.
        relative: true if `spread` is relative.
        pooling: share by which specimens are drawn to the mean: 0 none, 1 all the way (A. Gelman and I.
            Pardoe, Technometrics 48 (2006) 241).
    """

    specimens: tuple[str, ...]
    unit: str
    alone: np.ndarray
    alone_sd: np.ndarray
    together: np.ndarray
    together_sd: np.ndarray
    mean: float
    mean_sd: float
    spread: tuple[float, float, float]
    relative: bool
    pooling: float


@dataclass(frozen=True)
class Together(Result):
    """Joint posterior of several specimens.

    Attributes:
        names: names of the campaigns.
        problems: sampling problem of each by itself.
        fits: characterisation of each by itself.
        posterior: draws of means, spreads, and each specimen's distance from the mean.
    """

    names: tuple[str, ...]
    problems: tuple[Problem, ...]
    fits: tuple[Characterisation, ...]
    posterior: Posterior

    @property
    def converged(self) -> bool:
        """True if the numbers may be quoted."""
        return self.posterior.converged

    @cached_property
    def shared(self) -> dict[str, Shared]:
        """Every constant that all specimens share, by name."""
        found = shared_constants([problem.parameters for problem in self.problems])
        return {name: self._shared(name, places) for name, places in found.items()}

    def _shared(self, name: str, places: Sequence[Place]) -> Shared:
        entry, draws = self.problems[places[0][0]].parameters[places[0][1]], self.posterior.draws
        mean, spread = draws[name].ravel(), draws[spread_name(name)].ravel()
        z = np.stack([draws[distance_name(name, k)].ravel() for k in range(len(places))])
        own = np.asarray(own_value(entry, jnp.asarray(mean), jnp.asarray(spread), jnp.asarray(z)))
        away = own - mean
        drawn = 1.0 - np.var(away.mean(axis=1)) / max(float(np.mean(np.var(away, axis=0))), 1e-300)
        found = [self.fits[k].parameters[own_name] for k, own_name in places]
        value = lambda x: np.asarray(constant_from_si(x, entry.unit))  # noqa: E731
        width = lambda x: np.asarray(from_si(x, entry.unit, difference=True))  # noqa: E731
        sizes = np.quantile(spread, [0.05, 0.5, 0.95])
        return Shared(
            specimens=tuple(f"{self.names[k]} {n.partition(MARK)[2]}".strip() for k, n in places),
            unit=entry.unit,
            alone=np.array([estimate.value for estimate in found]),
            alone_sd=np.array([estimate.sd for estimate in found]),
            together=value(own.mean(axis=1)),
            together_sd=width(own.std(axis=1)),
            mean=float(value(mean.mean())),
            mean_sd=float(width(mean.std())),
            spread=tuple(map(float, sizes if entry.scale == "log" else width(sizes))),
            relative=entry.scale == "log",
            pooling=float(np.clip(drawn, 0.0, 1.0)),
        )


def sample_together(
    fits: Mapping[str, Characterisation],
    *,
    file: str | Path | None = None,
    resume: bool = False,
    progress: bool | None = None,
    **settings: Any,
) -> Together:
    """Sample the joint posterior of several specimens, starting from their fits; float64 must be on.

    Args:
        fits: characterisation of each specimen, by its name; of one kind.
        file, resume, progress: as for a posterior of one specimen.
        **settings: settings of a run, see `Settings`; the sampler is "nuts" by default.

    Raises:
        InputError: if there are fewer than two, they share no constant, or their kind cannot be sampled so.
    """
    problems = tuple(sampling_problem(fit) for fit in fits.values())
    kinds = sorted({problem.kind for problem in problems})
    if len(kinds) > 1:
        raise InputError(f"a joint posterior needs specimens of one kind, not {joined(kinds)}")
    entries = [problem.parameters for problem in problems]
    if not shared_constants(entries):
        raise InputError(
            "a joint posterior needs two specimens or more that share a free constant with a prior"
        )
    target, parameters = joint_target([problem.target for problem in problems], entries)
    chosen = Settings(**{"sampler": "nuts", **settings})
    posterior = sample(target, parameters, chosen, file=file, resume=resume, progress=progress)
    return Together(tuple(fits), problems, tuple(fits.values()), posterior)


def shared_constants(entries: Sequence[Parameters]) -> dict[str, list[Place]]:
    """Constants that two or more specimens have free, with a prior, and their places.

    Dimensions are left out: they are a specimen's own. A campaign of several specimens has one place for
    each.

    Args:
        entries: parameters of each campaign.
    """
    own = {quantity_of(key) for key in schema.GEOMETRY_NUMBERS}
    found: dict[str, list[Place]] = {}
    for k, parameters in enumerate(entries):
        for name, entry in parameters.items():
            stem = name.partition(MARK)[0]
            if entry.free and entry.prior is not None and stem not in own:
                found.setdefault(stem, []).append((k, name))
    return {stem: places for stem, places in found.items() if len(places) > 1}


def spread_name(name: str) -> str:
    """Name of the parameter that is a constant's spread between specimens."""
    return f"{name}_spread"


def distance_name(name: str, number: int) -> str:
    """Name of the parameter that is a specimen's distance from the mean, in spreads."""
    return f"{name}_of_{number + 1}"


def own_name(name: str, campaign: int) -> str:
    """Name of a parameter that belongs to one campaign alone, such as a dimension.

    It is the value that the parameter would have at the shared constants of the campaign's own fit.
    """
    return f"{name}_in_{campaign + 1}"


def own_value(entry: Parameter, mean: Array, spread: Array, z: Array) -> Array:
    """A specimen's constant, kept inside the bounds of the constant, SI."""
    moved = mean * jnp.exp(spread * z) if entry.scale == "log" else mean + spread * z
    return jnp.clip(moved, entry.min, entry.max)


def joint_target(targets: Sequence[Target], entries: Sequence[Parameters]) -> tuple[Target, Parameters]:
    """Density of means, spreads, distances and what is a specimen's own; and its parameters at their start.

    Args:
        targets: density of each campaign by itself, of known noise.
        entries: parameters of each, at its fit.

    Raises:
        InputError: if the noise of a campaign is not known.
    """
    forms = side_by_side(targets)
    shared = shared_constants(entries)
    at = {place: (stem, k) for stem, places in shared.items() for k, place in enumerate(places)}

    def here(values: Mapping[str, Array], campaign: int, name: str) -> Array:
        """A free parameter of a campaign, SI."""
        if (campaign, name) not in at:
            return values[own_name(name, campaign)]
        stem, k = at[campaign, name]
        entry = entries[campaign][name]
        return own_value(entry, values[stem], values[spread_name(stem)], values[distance_name(stem, k)])

    valleys = [valley_of(own, [n for c, n in at if c == k]) for k, own in enumerate(entries)]

    def placed(values: Mapping[str, Array], form: Form, of: Valley) -> tuple[Array, Array, Array]:
        """Coordinates of every campaign of a form, shape (campaigns, n), distances from priors, Jacobians."""
        found = [jnp.stack([here(values, k, name) for name in form.layout.free]) for k in form.members]
        there, away, jacobian = jax.vmap(lambda valley, x: valley.moved(x))(of, jnp.stack(found))
        logs = jnp.asarray(form.layout.logarithmic, bool)
        return jnp.where(logs, jnp.log(jnp.where(logs, there, 1.0)), there), away, jacobian

    def residual(values: Mapping[str, Array], data: PyTree) -> Array:
        parts = []
        for form, (own, of) in zip(forms, data, strict=True):
            vectors, away, _ = placed(values, form, of)
            parts += [jnp.ravel(jax.vmap(form.rows)(vectors, *own)), jnp.ravel(away)]
        return jnp.concatenate(parts)

    def log_likelihood(values: Mapping[str, Array], data: PyTree) -> Array:
        total = jnp.zeros(())
        for form, (own, of) in zip(forms, data, strict=True):
            vectors, away, jacobian = placed(values, form, of)
            found = jnp.sum(jax.vmap(form.likelihood)(vectors, *own))
            total += found - 0.5 * jnp.sum(away**2) + jnp.sum(jacobian)
        return total

    parameters = _parameters(shared, entries, valleys)
    data = [(form.data, _together([valleys[k] for k in form.members])) for form in forms]
    return Target.from_log_likelihood(log_likelihood, parameters, data, residual), parameters


def _together(valleys: Sequence[Valley]) -> Valley:
    """Valleys of campaigns of one form along a leading axis."""
    return jax.tree.map(lambda *leaves: jnp.stack(leaves), *valleys)


def _parameters(
    shared: Mapping[str, Sequence[Place]], entries: Sequence[Parameters], valleys: Sequence[Valley]
) -> Parameters:
    """Parameters of the joint density at their start: the specimens' mean, and each where its fit ended.

    Those that move along a valley have no prior here; the density has it at the place where they are.
    """
    parameters = Parameters()
    for stem, places in shared.items():
        entry = entries[places[0][0]][places[0][1]]
        found = np.array([entries[k][name].value for k, name in places])
        logarithmic = entry.scale == "log"
        mean = float(np.exp(np.mean(np.log(found))) if logarithmic else np.mean(found))
        size = entry.prior.sd / entry.prior.mean if logarithmic else entry.prior.sd
        parameters.add(Parameter(stem, mean, unit=entry.unit, prior=entry.prior, scale=entry.scale))
        away = np.log(found / mean) if logarithmic else found - mean
        ends = LEAST * size, MOST * size
        spread = float(np.clip(max(float(np.std(away)), FIRST * size), *ends))
        unit, prior = "1" if logarithmic else entry.unit, Prior(0.0, size, *ends)
        parameters.add(Parameter(spread_name(stem), spread, unit=unit, prior=prior, scale="log"))
        for k, moved in enumerate(away):
            z = float(np.clip(moved / spread, -0.9 * FAR, 0.9 * FAR))
            parameters.add(Parameter(distance_name(stem, k), z, prior=Prior(0.0, 1.0, -FAR, FAR)))
    known = {place for places in shared.values() for place in places}
    for k, own in enumerate(entries):
        for name, entry in own.items():
            if entry.free and (k, name) not in known:
                at = own.layout().free.index(name)
                moves, power = bool(valleys[k].moves[at]), bool(valleys[k].power[at])
                parameters.add(_coordinate(entry, own_name(name, k), moves, power))
    return parameters


def _coordinate(entry: Parameter, name: str, moves: bool, power: bool) -> Parameter:
    """A parameter of one campaign under its name in the joint posterior.

    One that moves has neither its prior nor its bounds there: both are those of the value that it moves to.
    """
    if not moves:
        ends, prior = (entry.min, entry.max), entry.prior
    else:
        ends, prior = (0.0 if power else -np.inf, np.inf), None
    return Parameter(name, entry.value, *ends, unit=entry.unit, prior=prior, scale=entry.scale)
