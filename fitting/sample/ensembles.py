"""Several independent emcee ensembles that advance together, chunk by chunk, and can be put away between."""

from pathlib import Path

import emcee
import numpy as np
from jaxtyping import Float

from pneusma_jax.errors import InputError

from . import checkpoint
from .chart import Chart, choose_chart
from .checkpoint import Checkpoint
from .laplace import Laplace, start_spread
from .settings import Settings, moves
from .starts import dispersed_ball
from .target import Evaluator, Target

SAME_MODEL = 1e-6  # relative difference of log-probabilities beyond which a stored chain is of another model


class Ensembles:
    """Independent ensembles of one target.

    Args:
        target: what is sampled.
        settings: resolved.
        file: where chains are kept after every chunk, or None to keep them in memory only.
    """

    def __init__(self, target: Target, settings: Settings, file: Path | None = None):
        self.target, self.settings, self.file = target, settings, file
        self.evaluator = Evaluator(target, settings.walkers // 2)
        self.chart = Chart(np.zeros(target.dimension, int))
        self._backends: list[emcee.backends.Backend] = []
        self._samplers: list[emcee.EnsembleSampler] = []
        self._states: list[emcee.State] = []

    def begin(self, found: Laplace) -> None:
        """Put walkers around the fit.

        Raises:
            InputError: if no usable starting points are found there.
        """
        spread = start_spread(self.target, found)
        self.chart = choose_chart(self.target, found, spread, self.evaluator, self.settings.seed)
        seeds = np.random.SeedSequence(self.settings.seed).spawn(self.settings.ensembles)
        for seed in seeds:
            random = np.random.RandomState(np.random.MT19937(seed))
            points = dispersed_ball(
                self.target, found, spread, self.chart, self.evaluator, self.settings.walkers, random
            )
            backend = emcee.backends.Backend()
            self._add(backend, emcee.State(points, random_state=random.get_state()))

    def resume(self) -> None:
        """Take up the chains in the file where they were left.

        Raises:
            InputError: if the file is none, or of other data, another model or other settings.
        """
        stored = checkpoint.read(self.file)
        checkpoint.same_chain(self.file, stored, self.target.fingerprint(), self.settings.chain_identity())
        self.evaluator.evaluations = stored.counters["evaluations"]
        self.evaluator.failures = stored.counters["failures"]
        self.chart = Chart(np.asarray(stored.signs))
        density = self.chart.density(Evaluator(self.target, self.settings.walkers // 2))
        for backend in stored.backends:
            self._add(backend, backend.get_last_sample())
            known, again = backend.log_prob[-1], density(backend.chain[-1])
            if not np.allclose(known, again, rtol=SAME_MODEL, atol=SAME_MODEL):
                raise InputError(
                    f"{self.file}: this chain was sampled with another model: the same parameters now have "
                    "other probabilities; start over in another folder, or replace it with --force"
                )

    def _add(self, backend: emcee.backends.Backend, state: emcee.State) -> None:
        sampler = emcee.EnsembleSampler(
            self.settings.walkers, self.target.dimension, self.chart.density(self.evaluator),
            vectorize=True, moves=moves(), backend=backend,
        )  # fmt: skip
        self._backends.append(backend)
        self._samplers.append(sampler)
        self._states.append(state)

    @property
    def steps(self) -> int:
        """Steps that every ensemble has made."""
        return min((backend.iteration for backend in self._backends), default=0)

    @property
    def chains(self) -> list[Float[np.ndarray, "steps walkers n"]]:
        """Coordinates of walkers in every ensemble so far, burn-in included; `chart.back` gives the
        target's."""
        return [backend.chain[: self.steps] for backend in self._backends]

    @property
    def log_probabilities(self) -> list[Float[np.ndarray, "steps walkers"]]:
        """Of the same points, as densities of the target's coordinates."""
        return [
            b.log_prob[: self.steps] - self.chart.log_slope(b.chain[: self.steps]) for b in self._backends
        ]

    @property
    def acceptance(self) -> list[float]:
        """Fraction of proposals that each ensemble accepted."""
        return [float(np.mean(b.accepted) / max(b.iteration, 1)) for b in self._backends]

    def advance(self, steps: int) -> None:
        """Run every ensemble for some steps, then put the chains on disk."""
        for k, sampler in enumerate(self._samplers):
            for state in sampler.sample(self._states[k], iterations=steps, skip_initial_state_check=True):
                self._states[k] = state
            self._backends[k].random_state = sampler.random_state
        if self.file is not None:
            checkpoint.write(self.file, self._checkpoint())

    def _checkpoint(self) -> Checkpoint:
        counters = {"evaluations": self.evaluator.evaluations, "failures": self.evaluator.failures}
        settings = self.settings.chain_identity()
        return Checkpoint(
            self._backends, self.target.fingerprint(), settings, counters, self.chart.sign.tolist()
        )
