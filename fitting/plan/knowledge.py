"""Prior knowledge of an alloy before its first test: means and standard deviations of its constants, possible
alloys."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.specimens.priors import NEW_ALLOY, PER_LENGTH, REFERENCE_WIRE
from pneusma_jax.calibration import Calibration, load_calibration, unknown
from pneusma_jax.calibration.records import Prior
from pneusma_jax.errors import InputError
from pneusma_jax.program_cache import stored_jit

CONSTANTS = tuple(field.name for field in dataclasses.fields(pj.Alloy) if field.name != "name")
NOT_SEEN = ("gamma_max", "poisson_ratio", "T_mid", "T_width", "density", "heat_capacity", "convection")
"""Constants that tests on a stand do not identify: conventions, and constants of heating."""
NITINOL = ("c",)
"""Optional constants of nitinol; unknown only where a table has a prior for them."""
BATCH = 64
MOST_BATCHES = 40


@dataclass(frozen=True)
class Knowledge:
    """Independent Gaussian knowledge of the unknown constants, SI.

    Attributes:
        table: nominal constants.
        names: names of the unknown constants.
        mean, sd: mean and standard deviation, shape (unknowns,).
        bounds: lower and upper bound, shape (unknowns, 2).
    """

    table: Calibration
    names: tuple[str, ...]
    mean: np.ndarray
    sd: np.ndarray
    bounds: np.ndarray

    @property
    def nominal(self) -> dict[str, float]:
        """All constants of the alloy at their nominal values."""
        return {name: self.table.quantities[name].value for name in CONSTANTS}

    def draws(self, count: int, seed: int) -> dict[str, np.ndarray]:
        """Physically possible alloys, each constant of shape (count,); the first is the nominal one.

        Raises:
            InputError: if next to none of the alloys that the priors allow can exist.
        """
        random = np.random.default_rng(seed)
        nominal = self.nominal
        batches = [self.mean[None]]
        for _ in range(MOST_BATCHES):
            if sum(map(len, batches)) >= count:
                break
            batch = self.mean + self.sd * random.standard_normal((BATCH, len(self.mean)))
            inside = np.all((batch >= self.bounds[:, 0]) & (batch <= self.bounds[:, 1]), axis=1)
            values = {name: np.full(BATCH, nominal[name]) for name in CONSTANTS}
            values |= {name: np.clip(batch[:, k], *self.bounds[k]) for k, name in enumerate(self.names)}
            batches.append(batch[inside & np.asarray(_possible(values))])
        found = np.concatenate(batches)[:count]
        if len(found) < count:
            raise InputError(
                f"{self.table.name}: of the alloys that its priors allow next to none can exist. Stress must"
                " rise with strain, and the cold wire resist more. Narrow the priors of gamma_L, beta or ka"
            )
        spread = {name: np.full(count, nominal[name]) for name in CONSTANTS}
        return spread | {name: found[:, k] for k, name in enumerate(self.names)}


def knowledge_of(alloy: str | Path | None = None, wire_diameter: float = REFERENCE_WIRE) -> Knowledge:
    """Prior knowledge of an alloy, from the priors of its table.

    A constant without a prior is as uncertain as that of uncharacterised nitinol, around its own value. The
    alloy is new, and its table is a first guess.

    Args:
        alloy: name or path of a table; None for uncharacterised nitinol.
        wire_diameter: wire diameter of the spring [m]; where there is no table, resistances are scaled to it.

    Raises:
        InputError: if the table cannot be used, or lacks a spring's constant.
    """
    anything = load_calibration(NEW_ALLOY, "alloy")
    table = anything if alloy is None else load_calibration(alloy, "alloy")
    table.require(CONSTANTS)
    if table.name in unknown():
        table = _of_wire(table, (REFERENCE_WIRE / wire_diameter) ** 2)
    names = tuple(name for name in CONSTANTS if name not in NOT_SEEN and _open(table, name))
    priors = [_prior(table, anything, name) for name in names]
    return Knowledge(
        table,
        names,
        mean=np.array([p.mean for p in priors]),
        sd=np.array([p.sd for p in priors]),
        bounds=np.array([(p.min, p.max) for p in priors]),
    )


def _open(table: Calibration, name: str) -> bool:
    return name not in NITINOL or table.quantities[name].prior is not None


def _of_wire(table: Calibration, factor: float) -> Calibration:
    """A table with its resistances per length, and their priors, multiplied by a factor."""
    scaled = dict(table.quantities)
    for name in PER_LENGTH:
        quantity = scaled[name]
        prior = Prior(*(factor * x for x in dataclasses.astuple(quantity.prior)))
        scaled[name] = dataclasses.replace(quantity, value=factor * quantity.value, prior=prior)
    return dataclasses.replace(table, quantities=scaled)


def _prior(table: Calibration, anything: Calibration, name: str) -> Prior:
    quantity, usual = table.quantities[name], anything.quantities[name].prior
    if quantity.prior is not None:
        return dataclasses.replace(quantity.prior, mean=quantity.value)
    if usual is None:
        raise InputError(f"{anything.name}: {name} has no prior")
    signed = usual.min < 0.0 < usual.max
    scale = 1.0 if signed else abs(quantity.value / usual.mean)
    ends = sorted(quantity.value + scale * (end - usual.mean) for end in (usual.min, usual.max))
    low, high = (-math.inf, math.inf) if signed else ends
    return Prior(quantity.value, scale * usual.sd, low, high)


@stored_jit()
def _possible(values: dict[str, jax.Array]) -> jax.Array:
    """Mask of possible alloys, shape (alloys,): stress rises with strain, the cold wire resists more."""

    def one(values: dict[str, jax.Array]) -> jax.Array:
        alloy = pj.Alloy(**values)
        gamma = jnp.linspace(0.0, alloy.gamma_max, 100)
        rising = [jnp.all(jnp.diff(alloy.shear_stress(gamma, x, 0.0)) > 0.0) for x in (0.0, 1.0)]
        zero = jnp.asarray(0.0)
        return rising[0] & rising[1] & (alloy.rho_m(zero) > alloy.rho_a(zero))

    return jax.vmap(one)(values)
