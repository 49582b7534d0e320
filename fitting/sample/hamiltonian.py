"""Chains of the no-U-turn sampler (blackjax), which follow gradients, for curved but smooth posteriors.

Every chain moves in the whitened coordinates of `unbounded`. Its warm-up adapts the step and a metric of
diagonal plus low rank (A. Seyboldt and others, 2026, as in blackjax). Chains are independent, warm-up
included, and run side by side in threads.

The random key of each draw follows from the seed, the chain and the number of the draw. A resumed chain
therefore continues to the same bytes.
"""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import equinox as eqx
import h5py
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.parallel import run_parallel
from pneusma_jax.late import Late

from . import checkpoint
from .chains import Chains
from .chart import PROBES, choose_chart
from .gradients import differentiation, with_gradient
from .laplace import Laplace, start_spread
from .plateaus import store_plateaus, stored_plateaus
from .settings import Settings
from .starts import CLOSER, TRIES, no_start
from .target import LogDensity, Target
from .unbounded import WhitenedMaps

blackjax, adaptation_base = Late("blackjax"), Late("blackjax.adaptation.base")
hmc, metrics = Late("blackjax.mcmc.hmc"), Late("blackjax.mcmc.metrics")

ACCEPTANCE = 0.9
"""Target of the warm-up for the mean acceptance along trajectories. Curved valleys need more than the usual
0.8, at which 0.6 % of a banana's transitions diverged."""
DOUBLINGS = 10
"""Maximum number of doublings of a trajectory, so 1,023 gradients. With 6, a flat ridge was left at an R-hat
of 1.06 with ten times the divergences."""
ENERGY = 0.3
"""Minimum of the energy's Bayesian fraction of missing information. Below it a chain moves too slowly between
levels of energy (M. Betancourt, arXiv:1604.00695)."""


class Draws(NamedTuple):
    """One chain so far; the first axis is the draw.

    Attributes:
        u: positions in the target's coordinates, shape (draws, n).
        log_probability: log-density at u, shape (draws,).
        energy: energy of the transition, shape (draws,).
        evaluations: gradients of the transition, shape (draws,).
        divergent: true if the integration diverged, shape (draws,).
        acceptance: mean acceptance along the trajectory, shape (draws,).
    """

    u: np.ndarray
    log_probability: np.ndarray
    energy: np.ndarray
    evaluations: np.ndarray
    divergent: np.ndarray
    acceptance: np.ndarray


@dataclass
class _Chain:
    """State of one chain between two calls."""

    state: "hmc.HMCState"
    step: Array
    metric: "metrics.LowRankInverseMassMatrix"
    warm_up: int
    draws: Draws


class HamiltonianChains(Chains):
    """Independent chains of the no-U-turn sampler.

    Args:
        target: target to sample.
        settings: resolved settings.
        file: HDF5 file that is written after every chunk, or None to keep the chains in memory.
    """

    def __init__(self, target: Target, settings: Settings, file: Path | None = None):
        self.target, self.settings, self.file = target, settings, file
        self._maps: WhitenedMaps | None = None
        self._chains: list[_Chain] = []
        self._how: str | None = None

    @property
    def _key(self) -> Array:
        return jax.random.key(self.settings.seed)

    def begin(self, found: Laplace) -> None:
        """Start chains around the fit and warm them up."""
        chart = choose_chart(
            self.target, found, start_spread(self.target, found), LogDensity(self.target, PROBES),
            self.settings.seed,
        )  # fmt: skip
        self._maps = WhitenedMaps.around(self.target, found, chart, self.settings.seed)
        leaves, programs = self._programs()

        def one(k: int) -> _Chain:
            key = jax.random.fold_in(self._key, k)
            start = self._start(programs.density, leaves, jax.random.fold_in(key, 0))
            state, step, metric, evaluations = programs.warm_up(leaves, jax.random.fold_in(key, 1), start)
            return _Chain(state, step, metric, int(evaluations), _none(self.target.dimension))

        self._chains = run_parallel(one, range(self.settings.ensembles))

    def _start(self, density: Callable, leaves: list[Array], key: Array) -> Array:
        closeness = 1.0
        for attempt in range(TRIES):
            z = closeness * jax.random.normal(jax.random.fold_in(key, attempt), (self.target.dimension,))
            if np.isfinite(float(density(leaves, z))):
                return z
            closeness *= CLOSER
        raise no_start("a chain finds")

    def _programs(self) -> tuple[list[Array], "_Programs"]:
        arrays, fixed = eqx.partition((self.target, self._maps), eqx.is_array)
        leaves, structure = jax.tree.flatten(arrays)
        functions, static = jax.tree.flatten(fixed)
        if self._how is None:
            self._how = differentiation(
                lambda z: self._maps.log_density(self.target, z), jnp.zeros(self.target.dimension)
            )
        return leaves, _programs(
            tuple(functions), static, structure, self._how, self.settings.chunk, self.settings.warm_up
        )

    def advance(self, steps: int) -> None:
        """Advance every chain by some steps, then store the chains."""
        leaves, programs = self._programs()

        def one(job: tuple[int, _Chain]) -> _Chain:
            k, chain = job
            key = jax.random.fold_in(jax.random.fold_in(self._key, k), 2)
            state, parts, remaining = chain.state, [chain.draws], steps
            done = len(chain.draws.energy)
            while remaining > 0:
                count = min(remaining, self.settings.chunk)
                state, new = programs.advance(leaves, key, state, chain.step, chain.metric, done, count)
                parts.append(Draws(*(np.asarray(column)[:count] for column in new)))
                done, remaining = done + count, remaining - count
            draws = Draws(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
            return _Chain(state, chain.step, chain.metric, chain.warm_up, draws)

        self._chains = run_parallel(one, list(enumerate(self._chains)))
        if self.file is not None:
            self._write()

    @property
    def steps(self) -> int:
        """Number of draws of every chain."""
        return min((len(chain.draws.energy) for chain in self._chains), default=0)

    def _stacked(self, name: str) -> np.ndarray:
        return np.stack([getattr(chain.draws, name)[: self.steps] for chain in self._chains])

    @property
    def judged(self) -> list[Float[np.ndarray, "steps 1 n"]]:
        """Positions in the target's coordinates. The sampler's own are ambiguous because of the mirrors."""
        return list(self.coordinates)

    @property
    def coordinates(self) -> Float[np.ndarray, "ensembles steps 1 n"]:
        """Positions in the target's coordinates."""
        return self._stacked("u")[:, :, None, :]

    @property
    def log_probabilities(self) -> Float[np.ndarray, "ensembles steps 1"]:
        """Log-densities of the same points."""
        return self._stacked("log_probability")[:, :, None]

    @property
    def acceptance(self) -> list[float]:
        """Mean acceptance along trajectories of every chain."""
        return [float(value) for value in self._stacked("acceptance").mean(axis=1)]

    @property
    def evaluations(self) -> int:
        """Number of gradients, warm-up included."""
        return int(self._stacked("evaluations").sum()) + sum(chain.warm_up for chain in self._chains)

    @property
    def failures(self) -> int:
        """Number of divergent transitions."""
        return int(self._stacked("divergent").sum())

    @property
    def diagnostics(self) -> dict[str, Any]:
        """Divergences, energy, steps and gradients."""
        energy = self._stacked("energy")
        # The fraction does not depend on the unit of energy. One that is a power of two keeps every digit and
        # the squares of any stored energy finite.
        _, exponent = np.frexp(np.max(np.abs(energy), axis=1, keepdims=True, initial=0.0))
        energy = np.ldexp(energy, -exponent)
        change, spread = np.mean(np.diff(energy, axis=1) ** 2, axis=1), np.var(energy, axis=1)
        fraction = np.where(spread > 0.0, change / np.where(spread > 0.0, spread, 1.0), 0.0)
        return {
            "divergences": self.failures,
            "energy_fraction": [float(value) for value in fraction],
            "step_size": [float(chain.step) for chain in self._chains],
            "gradients_per_draw": float(self._stacked("evaluations").mean()),
            "warm_up_gradients": sum(chain.warm_up for chain in self._chains),
            "gradient": self._how,
        }

    def _write(self) -> None:
        counters = {"evaluations": self.evaluations}
        header = checkpoint.Header(
            self.target.fingerprint(), self.settings.chain_identity(), counters, self.why
        )

        def fill(file: h5py.File) -> None:
            store_plateaus(file, self._maps.plateaus)
            for name, value in vars(self._maps).items():
                if name != "plateaus":
                    file.create_dataset(f"maps/{name}", data=np.asarray(value))
            for k, chain in enumerate(self._chains, start=1):
                group = file.create_group(f"chain_{k}")
                group.attrs["warm_up"] = chain.warm_up
                group.create_dataset("step", data=np.asarray(chain.step))
                for part in (chain.state, chain.metric, chain.draws):
                    for name, value in part._asdict().items():
                        group.create_dataset(f"{type(part).__name__}/{name}", data=np.asarray(value))

        checkpoint.write(self.file, header, fill)

    def resume(self) -> None:
        """Continue the chains of the file."""
        header = checkpoint.header_of(self.file)
        checkpoint.same_chain(self.file, header, self.target.fingerprint(), self.settings.chain_identity())
        self.why = header.why
        with checkpoint.opened(self.file) as file:
            maps = {name: jnp.asarray(part[()]) for name, part in file["maps"].items()}
            size = self.target.dimension
            bend = maps.pop("bend", jnp.zeros((size, size, size)))  # older files: none
            self._maps = WhitenedMaps(**maps, bend=bend, plateaus=stored_plateaus(file))
            self._chains = [_read(file[f"chain_{k}"]) for k in range(1, self.settings.ensembles + 1)]
        leaves, programs = self._programs()
        for chain in self._chains:
            again = float(programs.density(leaves, chain.state.position))
            checkpoint.same_model(self.file, float(chain.state.logdensity), again)


def _none(dimension: int) -> Draws:
    column = np.empty(0)
    return Draws(np.empty((0, dimension)), column, column, np.empty(0, int), np.empty(0, bool), column)


def _read(group: h5py.Group) -> _Chain:
    def part(kind: type) -> Any:
        return kind(*(group[f"{kind.__name__}/{name}"][()] for name in kind._fields))

    kinds = hmc.HMCState, metrics.LowRankInverseMassMatrix
    state, metric = (jax.tree.map(jnp.asarray, part(kind)) for kind in kinds)
    draws = part(Draws)
    for name in ("u", "log_probability", "energy"):
        if not np.all(np.isfinite(getattr(draws, name))):
            raise ValueError(f"{name} of some draws is not finite")
    return _Chain(state, jnp.asarray(group["step"][()]), metric, int(group.attrs["warm_up"]), draws)


class _Programs(NamedTuple):
    """Compiled programs of one structure of a target."""

    density: Callable
    warm_up: Callable
    advance: Callable


@functools.lru_cache(maxsize=32)
def _programs(
    functions: tuple, static: Any, structure: Any, how: str, chunk: int, warm_up_steps: int
) -> _Programs:
    """Programs whose arguments are the numbers of a target."""

    def parts(leaves: list[Array]) -> tuple[Target, WhitenedMaps]:
        return eqx.combine(jax.tree.unflatten(structure, leaves), jax.tree.unflatten(static, functions))

    def plain(z: Array, leaves: list[Array]) -> Array:
        target, maps = parts(leaves)
        return maps.log_density(target, z)

    density = with_gradient(plain, how)
    kernel = blackjax.nuts.build_kernel()
    keep = adaptation_base.get_filter_adapt_info_fn(
        {"position", "logdensity", "logdensity_grad"}, {"num_integration_steps"}, {"mu_star"}
    )

    @jax.jit
    def warm_up(leaves: list[Array], key: Array, z: Array) -> tuple:
        adapt = blackjax.window_adaptation_low_rank(
            blackjax.nuts, lambda p: density(p, leaves), adaptation_info_fn=keep,
            max_rank=min(10, z.size), gradient_based_init=True, target_acceptance_rate=ACCEPTANCE,
            max_num_doublings=DOUBLINGS,
        )  # fmt: skip
        found, adaptation = adapt.run(key, z, num_steps=warm_up_steps)
        last = jax.tree.map(lambda column: column[-1], adaptation.state)
        return (
            last,
            found.parameters["step_size"],
            found.parameters["inverse_mass_matrix"],
            jnp.sum(adaptation.info.num_integration_steps),
        )

    @jax.jit
    def advance(leaves, key, state, step, metric, done, count) -> tuple:
        target, maps = parts(leaves)
        n = state.position.size

        def one(i: Array, carry: tuple) -> tuple:
            state, rows = carry
            own = jax.random.fold_in(key, done + i)
            state, info = kernel(own, state, lambda p: density(p, leaves), step, metric, DOUBLINGS)
            u = maps.coordinates(state.position)
            row = Draws(
                u, state.logdensity - maps.log_jacobian(state.position), info.energy,
                info.num_integration_steps, info.is_divergent, info.acceptance_rate,
            )  # fmt: skip
            return state, jax.tree.map(lambda column, value: column.at[i].set(value), rows, row)

        def empty(dtype: Any, *shape: int) -> Array:
            return jnp.zeros((chunk, *shape), dtype)

        real = state.position.dtype
        rows = Draws(empty(real, n), empty(real), empty(real), empty(int), empty(bool), empty(real))
        return jax.lax.fori_loop(0, count, one, (state, rows))

    return _Programs(jax.jit(lambda leaves, z: plain(z, leaves)), warm_up, advance)
