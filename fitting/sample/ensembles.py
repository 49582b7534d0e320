"""Independent emcee ensembles that advance together, some steps at a time, and are stored after each time."""

from pathlib import Path
from typing import Any

import emcee
import numpy as np
from jaxtyping import Float

from fitting.inference.parallel import run_parallel

from . import checkpoint
from .bend import BentChart
from .chains import Chains
from .chart import Chart, choose_chart
from .ensembles_file import Contents, contents_of, fill
from .independent import FREEDOM, SPREAD_AFTER, Proposals, proposals_about, proposals_by_spread
from .laplace import Laplace, start_spread
from .settings import Settings, moves
from .starts import dispersed_ball
from .target import LogDensity, Target
from .tempered import PARTICLES, temper
from .unbounded import WhitenedMaps


class Ensembles(Chains):
    """Independent ensembles of one target.

    Args:
        target: target to sample.
        settings: resolved settings.
        file: HDF5 file that is written whenever chains have advanced; None keeps them in memory only.
    """

    def __init__(self, target: Target, settings: Settings, file: Path | None = None):
        self.target, self.settings, self.file = target, settings, file
        self.evaluator = _evaluator(target, settings)
        self.chart = Chart(np.zeros(target.dimension, int))
        self._proposals: Proposals | None = None
        self._backends: list[emcee.backends.Backend] = []
        self._samplers: list[emcee.EnsembleSampler] = []
        self._states: list[emcee.State] = []
        self._evaluators: list[LogDensity] = []
        self._log_evidence: list[float] = []

    def begin(self, found: Laplace) -> None:
        """Start walkers around the fit.

        Raises:
            InputError: if no usable starting points are found there.
        """
        spread = start_spread(self.target, found)
        if self.settings.sampler != "tempered":  # draws from a prior may have both signs, so no logarithm
            chart = choose_chart(self.target, found, spread, self.evaluator, self.settings.seed)
            # the same chart, or one that straightens the valley where it is bent
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
        """Walkers in the chart: points of a run that starts from the prior. Its evidence is noted as well."""
        ended = temper(self.target, self.settings.seed, run, max(PARTICLES, 2 * self.settings.walkers))
        self.evaluator.evaluations += ended.evaluations
        self._log_evidence.append(ended.log_evidence)
        chosen = random.permutation(len(ended.points))[: self.settings.walkers]
        return self.chart.to_chart(ended.points[chosen])

    def resume(self) -> None:
        """Continue the chains of the file.

        Raises:
            InputError: if there is no file, or it is of other data, another model or other settings.
        """
        stored = checkpoint.header_of(self.file)
        checkpoint.same_chain(self.file, stored, self.target.fingerprint(), self.settings.chain_identity())
        self.why = stored.why
        self.evaluator.evaluations = checkpoint.counter(self.file, stored, "evaluations")
        self.evaluator.failures = checkpoint.counter(self.file, stored, "failures")
        contents = contents_of(self.file, self.settings.ensembles)
        self.chart, self._proposals = contents.chart, contents.proposals
        self._log_evidence = contents.log_evidence
        # an evaluator of its own: this check does not count as sampling
        density = self.chart.density(_evaluator(self.target, self.settings))
        for backend in contents.backends:
            self._add(backend, backend.get_last_sample())
            checkpoint.same_model(self.file, backend.log_prob[-1], density(backend.chain[-1]))

    def _add(self, backend: emcee.backends.Backend, state: emcee.State) -> None:
        """Add an ensemble that goes on from a state, its chains in a backend."""
        evaluator = _evaluator(self.target, self.settings)  # counts for itself: ensembles run side by side
        sampler = emcee.EnsembleSampler(
            self.settings.walkers, self.target.dimension, self.chart.density(evaluator),
            vectorize=True, moves=moves(self._proposals), backend=backend,
        )  # fmt: skip
        self._backends.append(backend)
        self._samplers.append(sampler)
        self._states.append(state)
        self._evaluators.append(evaluator)

    @property
    def steps(self) -> int:
        """Number of steps of every ensemble."""
        return min((backend.iteration for backend in self._backends), default=0)

    @property
    def judged(self) -> list[Float[np.ndarray, "steps walkers n"]]:
        """Coordinates of all walkers so far, ensemble by ensemble, for judging their convergence.

        They are those of the chart. From a chart that mixes constants they are taken back to the target's
        coordinates.
        """
        mixed = isinstance(self.chart, BentChart) or self.chart.plateaus is not None
        return list(self.coordinates) if mixed else self._in_chart

    @property
    def _in_chart(self) -> list[Float[np.ndarray, "steps walkers n"]]:
        """Coordinates of all walkers so far, ensemble by ensemble, in the chart in which they move."""
        return [backend.chain[: self.steps] for backend in self._backends]

    @property
    def coordinates(self) -> Float[np.ndarray, "ensembles steps walkers n"]:
        """Coordinates of all walkers so far, in the target's coordinates."""
        return self.chart.to_target(np.stack(self._in_chart))

    @property
    def log_probabilities(self) -> Float[np.ndarray, "ensembles steps walkers"]:
        """Log-densities of the same points, in the target's coordinates."""
        return np.stack(
            [
                backend.log_prob[: self.steps] - self.chart.log_jacobian(moved)
                for backend, moved in zip(self._backends, self._in_chart, strict=True)
            ]
        )

    @property
    def evaluations(self) -> int:
        """Number of evaluations of the model."""
        return self.evaluator.evaluations + sum(one.evaluations for one in self._evaluators)

    @property
    def failures(self) -> int:
        """Number of points inside the bounds without a finite answer of the model."""
        return self.evaluator.failures + sum(one.failures for one in self._evaluators)

    @property
    def share_about_the_fit(self) -> float:
        """Share of steps that are draws about the fit."""
        return 0.0 if self._proposals is None else float(self._proposals.share)

    @property
    def diagnostics(self) -> dict[str, Any]:
        """Evidence, for chains that started from the prior; else how walkers moved."""
        if self._log_evidence:
            return {"log_evidence": [float(value) for value in self._log_evidence]}
        plateaus = self.chart.plateaus
        return {
            "share_drawn_about_the_fit": self.share_about_the_fit,
            "drawn_by_their_spread": self._proposals is not None and bool(self._proposals.freedom != FREEDOM),
            "straightened": isinstance(self.chart, BentChart),
            "law_by_its_ends": None if plateaus is None else [0.0, plateaus.end],
        }

    @property
    def acceptance(self) -> list[float]:
        """Fraction of proposals that each ensemble accepted."""
        return [float(np.mean(each.accepted) / max(each.iteration, 1)) for each in self._backends]

    def advance(self, steps: int) -> None:
        """Advance every ensemble by some steps, each on a thread, then store the chains.

        After `SPREAD_AFTER` steps draws about the fit may give way to draws by the walkers' spread.
        """
        first = SPREAD_AFTER - self.steps
        if self._proposals is not None and 0 < first <= steps:
            self._sample(first)
            self._propose_by_spread()
            steps -= first
        if steps:
            self._sample(steps)
        self.store_in(self.file)

    def _propose_by_spread(self) -> None:
        """Draw proposals by the spread of all walkers from now on, where they accept these more often."""
        last = [(backend.chain[-1], backend.log_prob[-1]) for backend in self._backends]
        size = self.target.dimension
        points = np.stack([chain[self.steps // 2 :] for chain in self._in_chart]).reshape(-1, size)
        walkers, log_densities = (np.concatenate(part) for part in zip(*last, strict=True))
        density = self.chart.density(self.evaluator)
        old, seed = self._proposals, self.settings.seed
        self._proposals = proposals_by_spread(old, points, walkers, log_densities, density, seed)
        if self._proposals is old:
            return
        self.evaluator.evaluations, self.evaluator.failures = self.evaluations, self.failures
        backends = self._backends
        self._backends, self._samplers, self._states, self._evaluators = [], [], [], []
        for backend in backends:
            self._add(backend, backend.get_last_sample())

    def _sample(self, steps: int) -> None:
        """Advance every ensemble by some steps, each on a thread."""

        def one(k: int) -> None:
            sampler = self._samplers[k]
            for state in sampler.sample(self._states[k], iterations=steps, skip_initial_state_check=True):
                self._states[k] = state
            self._backends[k].random_state = sampler.random_state

        run_parallel(one, range(len(self._samplers)))

    def store_in(self, file: Path | None) -> None:
        """Store the chains now, and whenever they have advanced; None keeps them in memory only."""
        self.file = file
        if file is not None:
            self._write()

    def _write(self) -> None:
        counters = {"evaluations": self.evaluations, "failures": self.failures}
        header = checkpoint.Header(
            self.target.fingerprint(), self.settings.chain_identity(), counters, self.why
        )
        contents = Contents(self.chart, self._proposals, self._log_evidence, self._backends)
        checkpoint.write(self.file, header, lambda file: fill(file, contents))


def _evaluator(target: Target, settings: Settings) -> LogDensity:
    """Compiled for half an ensemble: emcee moves one half at a time."""
    return LogDensity(target, settings.walkers // 2)
