"""Independent emcee ensembles that advance together, chunk by chunk, and can be stored in between."""

from pathlib import Path
from typing import Any

import emcee
import h5py
import numpy as np
from jaxtyping import Float

from pneusma_jax.errors import InputError

from . import checkpoint
from .bend import BentChart
from .chains import Chains
from .chart import Chart, choose_chart
from .independent import Proposals, proposals_about
from .laplace import Laplace, start_spread
from .settings import Settings, moves
from .starts import dispersed_ball
from .target import Evaluator, Target
from .tempered import PARTICLES, temper
from .unbounded import WhitenedMaps

SAME_MODEL = 1e-6  # Maximum relative difference of log-probabilities for a stored chain of the same model


BENT = "bent"
"""Group of a chain file with the map of its walkers' whitened coordinates, where a valley is bent. The chains
of such a file are in these coordinates, not in constants."""
PROPOSALS = "proposals"
"""Group of a chain file with the proposals about the fit; older files have none, and made none."""


class Ensembles(Chains):
    """Independent ensembles of one target.

    Args:
        target: target to sample.
        settings: resolved settings.
        file: HDF5 file that is written after every chunk, or None to keep the chains in memory.
    """

    def __init__(self, target: Target, settings: Settings, file: Path | None = None):
        self.target, self.settings, self.file = target, settings, file
        self.evaluator = Evaluator(target, settings.walkers // 2)
        self.chart = Chart(np.zeros(target.dimension, int))
        self._proposals: Proposals | None = None
        self._backends: list[emcee.backends.Backend] = []
        self._samplers: list[emcee.EnsembleSampler] = []
        self._states: list[emcee.State] = []
        self._evidence: list[float] = []

    def begin(self, found: Laplace) -> None:
        """Start walkers around the fit.

        Raises:
            InputError: if no usable starting points are found there.
        """
        spread = start_spread(self.target, found)
        if self.settings.sampler != "tempered":  # logarithms need a sign, which the prior may not have
            chart = choose_chart(self.target, found, spread, self.evaluator, self.settings.seed)
            self.chart = WhitenedMaps.around(self.target, found, chart, self.settings.seed).chart
            self._proposals = proposals_about(
                self.target, found, self.chart, self.evaluator, self.settings.seed
            )
        seeds = np.random.SeedSequence(self.settings.seed).spawn(self.settings.ensembles)
        for k, seed in enumerate(seeds):
            random = np.random.RandomState(np.random.MT19937(seed))
            if self.settings.sampler == "tempered":
                points = self._from_prior(k, random)
            else:
                points = dispersed_ball(
                    self.target, found, spread, self.chart, self.evaluator, self.settings.walkers, random
                )
            backend = emcee.backends.Backend()
            self._add(backend, emcee.State(points, random_state=random.get_state()))

    def _from_prior(self, run: int, random: np.random.RandomState) -> np.ndarray:
        """Walkers from the points of a run from the prior, in the chart. The run's evidence is stored."""
        found = temper(self.target, self.settings.seed, run, max(PARTICLES, 2 * self.settings.walkers))
        self.evaluator.evaluations += found.evaluations
        self._evidence.append(found.log_evidence)
        chosen = random.permutation(len(found.points))[: self.settings.walkers]
        return self.chart.to_chart(found.points[chosen])

    def resume(self) -> None:
        """Continue the chains of the file.

        Raises:
            InputError: if the file is none, or of other data, another model or other settings.
        """
        stored = checkpoint.header_of(self.file)
        checkpoint.same_chain(self.file, stored, self.target.fingerprint(), self.settings.chain_identity())
        self.why = stored.why
        self.evaluator.evaluations = stored.counters["evaluations"]
        self.evaluator.failures = stored.counters["failures"]
        with checkpoint.opened(self.file) as file:
            sign = np.asarray(file.attrs["logarithm"], int)
            bent = {name: part[()] for name, part in file[BENT].items()} if BENT in file else None
            self.chart = Chart(sign) if bent is None else BentChart(sign, **bent)
            self._evidence = [float(value) for value in file.attrs.get("log_evidence", [])]
            self._proposals = _proposals(file)
            backends = [_read(self.file, f"ensemble_{k}") for k in range(1, self.settings.ensembles + 1)]
        density = self.chart.density(Evaluator(self.target, self.settings.walkers // 2))
        for backend in backends:
            self._add(backend, backend.get_last_sample())
            on_file, again = backend.log_prob[-1], density(backend.chain[-1])
            if not np.allclose(on_file, again, rtol=SAME_MODEL, atol=SAME_MODEL):
                raise InputError(checkpoint.other_model(self.file))

    def _add(self, backend: emcee.backends.Backend, state: emcee.State) -> None:
        sampler = emcee.EnsembleSampler(
            self.settings.walkers, self.target.dimension, self.chart.density(self.evaluator),
            vectorize=True, moves=moves(self._proposals), backend=backend,
        )  # fmt: skip
        self._backends.append(backend)
        self._samplers.append(sampler)
        self._states.append(state)

    @property
    def steps(self) -> int:
        """Number of steps of every ensemble."""
        return min((backend.iteration for backend in self._backends), default=0)

    @property
    def judged(self) -> list[Float[np.ndarray, "steps walkers n"]]:
        """Coordinates of all walkers so far: in the target's coordinates, or in a chart of logarithms."""
        if isinstance(self.chart, BentChart):
            return list(self.coordinates)
        return self._moving

    @property
    def _moving(self) -> list[Float[np.ndarray, "steps walkers n"]]:
        """The same in the chart in which they move."""
        return [backend.chain[: self.steps] for backend in self._backends]

    @property
    def coordinates(self) -> Float[np.ndarray, "ensembles steps walkers n"]:
        """Coordinates of all walkers so far, in the target's coordinates."""
        return self.chart.to_target(np.stack(self._moving))

    @property
    def log_probabilities(self) -> Float[np.ndarray, "ensembles steps walkers"]:
        """Log-densities of the same points, in the target's coordinates."""
        return np.stack(
            [
                b.log_prob[: self.steps] - self.chart.log_jacobian(b.chain[: self.steps])
                for b in self._backends
            ]
        )

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the model."""
        return self.evaluator.evaluations

    @property
    def failures(self) -> int:
        """Number of points inside the bounds without a finite answer of the model."""
        return self.evaluator.failures

    @property
    def diagnostics(self) -> dict[str, Any]:
        """Evidence, for chains that started from the prior; else how walkers moved."""
        if self._evidence:
            return {"log_evidence": [float(value) for value in self._evidence]}
        share = 0.0 if self._proposals is None else self._proposals.share
        return {"share_drawn_about_the_fit": share, "straightened": isinstance(self.chart, BentChart)}

    @property
    def acceptance(self) -> list[float]:
        """Fraction of proposals that each ensemble accepted."""
        return [float(np.mean(b.accepted) / max(b.iteration, 1)) for b in self._backends]

    def advance(self, steps: int) -> None:
        """Advance every ensemble by some steps, then store the chains."""
        for k, sampler in enumerate(self._samplers):
            for state in sampler.sample(self._states[k], iterations=steps, skip_initial_state_check=True):
                self._states[k] = state
            self._backends[k].random_state = sampler.random_state
        self.keep(self.file)

    def keep(self, file: Path | None) -> None:
        """Store the chains now and after every chunk; None keeps them in memory only."""
        self.file = file
        if file is not None:
            self._write()

    def _write(self) -> None:
        counters = {"evaluations": self.evaluations, "failures": self.failures}
        header = checkpoint.Header(
            self.target.fingerprint(), self.settings.chain_identity(), counters, self.why
        )

        def fill(file: h5py.File) -> None:
            file.attrs["logarithm"] = self.chart.sign.tolist()
            file.attrs["log_evidence"] = self._evidence
            if isinstance(self.chart, BentChart):
                group = file.create_group(BENT)
                for name in ("centre", "root", "bend"):
                    group.create_dataset(name, data=getattr(self.chart, name))
            if self._proposals is not None:
                group = file.create_group(PROPOSALS)
                for name, value in vars(self._proposals).items():
                    group.create_dataset(name, data=value)
            for k, backend in enumerate(self._backends, start=1):
                _fill(file.create_group(f"ensemble_{k}"), backend)

        checkpoint.write(self.file, header, fill)


def _fill(group: h5py.Group, backend: emcee.backends.Backend) -> None:
    """One ensemble in the layout of emcee's own backend (`HDFBackend(file, name="ensemble_1")`)."""
    count = backend.iteration
    walkers, dimension = backend.shape
    group.attrs["version"] = emcee.__version__
    group.attrs["nwalkers"], group.attrs["ndim"] = walkers, dimension
    group.attrs["has_blobs"], group.attrs["iteration"] = False, count
    for k, part in enumerate(backend.random_state):
        group.attrs[f"random_state_{k}"] = part
    group.create_dataset("accepted", data=backend.accepted)
    chain, log_prob = backend.chain[:count], backend.log_prob[:count]
    group.create_dataset("chain", data=chain, maxshape=(None, walkers, dimension))
    group.create_dataset("log_prob", data=log_prob, maxshape=(None, walkers))


def _proposals(file: h5py.File) -> Proposals | None:
    """Proposals that a chain was begun with."""
    if PROPOSALS not in file:
        return None
    return Proposals(**{name: part[()] for name, part in file[PROPOSALS].items()})


def _read(path: Path, name: str) -> emcee.backends.Backend:
    """One ensemble in memory, from emcee's own reader."""
    stored = emcee.backends.HDFBackend(str(path), name=name, read_only=True)
    backend = emcee.backends.Backend()
    backend.reset(*(int(size) for size in stored.shape))
    backend.chain, backend.log_prob = stored.get_chain(), stored.get_log_prob()
    backend.accepted, backend.iteration = stored.accepted, int(stored.iteration)
    algorithm, keys, position, has_gauss, gauss = stored.random_state
    backend.random_state = (str(algorithm), np.asarray(keys), int(position), int(has_gauss), float(gauss))
    return backend
