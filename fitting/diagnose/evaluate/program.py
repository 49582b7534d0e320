"""A campaign that can be evaluated at any base constants and any candidate effects.

One evaluation gives the whitened misfit of all recordings, with latent trajectories projected out, and its
derivatives by a few numbers. Everything else in a diagnosis is linear algebra on these results.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from weakref import WeakKeyDictionary

import numpy as np

from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import Channel
from fitting.inference.parallel import RUNS, Tally
from fitting.specimens.registry import candidates, specimen_of
from fitting.specimens.rows import Rows
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.specimen import Specimen
from pneusma_jax.calibration.records import Calibration

from ..settings import DEFAULT
from .building import Building
from .compiled import Compiled
from .evaluation import TRAJECTORY, Evaluation, Raw, row_count, trajectories_of, with_trajectories
from .inputs import changes_by_inputs, with_input_noise
from .laid_out import LaidOut
from .latent_trajectories import LatentTrajectory
from .no_answer import refuse_no_answer
from .projected import Asked, projected
from .trajectory_search import Search
from .unknowns import Unknowns
from .variable_projection import Projection, degrees_of_freedom_of

TRAJECTORIES = DEFAULT.trajectories
OPTIMISER = DEFAULT.optimiser


@dataclass
class Program:
    """A campaign that can be evaluated at any numbers.

    Attributes:
        kind: kind of the recordings.
        recordings: recordings of the campaign, in its order, reduced where they are long.
        stacked: the same as arrays.
        channels: measured outputs by recording.
        unknowns: numbers that may be free.
        fitted: recordings whose role is `fit`, shape (recordings,).
        tally: models that were fitted to the campaign and runs of the compiled program, shared by all copies
            of this one.
        failed: misfit of a row in which the model has no answer, in standard deviations. It exceeds every
            misfit of the nominal base model, so that no fit gains by failing.
        trajectory_degrees_of_freedom: degrees of freedom that latent trajectories take as they were prepared,
            (recordings,).
        process_noise: variance per second of every latent trajectory, (recordings, trajectories).
        bare: channels with their own noise only.
        outliers: readings that are not counted, see `fit.outliers`.
        untimed: slugs of effects that cannot be tested because the recordings have no clock of their own.
        nominal: the nominal base model as the program was built, with the noise and the trajectories of then.
    """

    kind: str
    recordings: list[Recording]
    stacked: Rows
    channels: list[list[Channel]]
    unknowns: Unknowns
    fitted: np.ndarray
    tally: Tally = field(default_factory=Tally)
    failed: float = OPTIMISER.failed_deviation
    trajectory_degrees_of_freedom: np.ndarray = field(default_factory=lambda: np.zeros(0))
    process_noise: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    bare: list[list[Channel]] = field(default_factory=list)
    outliers: tuple = ()
    untimed: tuple[str, ...] = ()
    nominal: Evaluation | None = field(default=None, repr=False)
    _compiled: Compiled | None = field(default=None, repr=False)
    _freedom: WeakKeyDictionary = field(default_factory=WeakKeyDictionary, init=False, repr=False)

    @classmethod
    def of(
        cls,
        campaign: Campaign,
        kind: str,
        slugs: list[str] | None = None,
        model: AugmentedModel | None = None,
        tables: Mapping[str, str | Path | Calibration] = MappingProxyType({}),
        held: Collection[str] = (),
        like: "Program | None" = None,
        progress: Callable[[str], None] = lambda _: None,
        again: str = "",
        nominal_alone: bool = False,
    ) -> "Program":
        """Build a program.

        Args:
            campaign: recordings of one kind.
            kind: kind of the recordings.
            slugs: effects to try; all of the kind if None.
            model: base model to start from: its numbers are nominal, its effects are always there.
            tables: tables to start from where an alloy or material is to be identified, as the kind's
                `rows_for` takes them.
            held: names of constants of the base model that are not free.
            like: program of the same campaign with other rows, whose compiled function is taken over.
            progress: called with the stage that runs, and with what is compiled in it.
            again: with what another program of the campaign is built again, in words; empty for the first.
            nominal_alone: true if only the nominal base model is asked for, and not what it misses in
                standard deviations. The noise of inputs is then counted only where hidden states follow it.

        Raises:
            InputError: if the recordings cannot be used together, or the model has no answer to any that is
                fitted.
        """
        specimen = specimen_of(kind)
        slugs, model = candidates(kind) if slugs is None else slugs, model or AugmentedModel()
        building = Building(progress, kind, len(slugs), again)
        building.begins()
        laid_out = LaidOut.of(campaign, specimen, slugs, model, tables, held)
        unknowns, channels = laid_out.unknowns, laid_out.channels
        program = cls(
            kind, laid_out.recordings, laid_out.stacked, channels, unknowns, laid_out.fitted, bare=channels,
            untimed=laid_out.untimed,
        )  # fmt: skip
        program.trajectory_degrees_of_freedom = np.zeros(len(channels))
        columns = specimen.latent.count(program.stacked)
        program.process_noise = np.zeros((len(channels), columns))
        program._compiled = (
            Compiled(specimen, unknowns, model.effects, columns)
            if like is None
            else like._compiled.at(unknowns)
        )
        with building.listening():
            for stage in (program.prepare, program.count_input_noise, program.prepare):
                building.begins()
                if program.hidden or not nominal_alone:
                    stage(unknowns.neutral)
            building.begins()
            program.nominal = nominal = program.evaluate(unknowns.neutral, unknowns.base[:0])
        refuse_no_answer(program.recordings, program.fitted, nominal)
        program.failed = max(
            OPTIMISER.failed_deviation, *(float(np.max(np.abs(m), initial=0.0)) for m in nominal.misfit)
        )
        return program

    @property
    def specimen(self) -> Specimen:
        """Specimen of the recordings."""
        return specimen_of(self.kind)

    @property
    def unseen(self) -> np.ndarray:
        """Mask of the recordings that only score: those that are not fitted, or all where every one is."""
        return self.fitted if self.fitted.all() else ~self.fitted

    @property
    def noise_stated(self) -> bool:
        """True if somebody states the noise of every output that is fitted."""
        return all(self._noise())

    @property
    def noise_unstated(self) -> bool:
        """True if nobody states the noise of any output that is fitted."""
        return not any(self._noise())

    def _noise(self) -> list[float | None]:
        """Stated noise of every output of every fitted recording, SI; None where nobody states it."""
        fitted = zip(self.recordings, self.channels, self.fitted, strict=True)
        return [r.noise_si(c.quantity) for r, channels, chosen in fitted if chosen for c in channels]

    @property
    def hidden(self) -> bool:
        """True if there are latent trajectories, which `prepare` looks for."""
        return self.process_noise.shape[1] > 0 or self.specimen.latent.inside

    def follows(self, quantity: str) -> bool:
        """True if latent trajectories follow an output, so that its misfit says little by itself."""
        return self.hidden and quantity.startswith("resistance")

    def prepare(self, u: np.ndarray, near: Evaluation | None = None) -> None:
        """Find latent trajectories and their process noise at the numbers of `u`, where the kind has them.

        Args:
            u: scaled numbers, (unknowns,).
            near: an evaluation close by, for kinds whose compiled program searches by itself. A recording
                begins with the trajectories of this evaluation where that ends better. Other searches go on
                from the trajectories of the stack.
        """
        nothing = self.unknowns.base[:0]
        self._freedom.clear()
        if self.process_noise.shape[1]:
            for _ in range(TRAJECTORIES.rounds if self.process_noise.any() else TRAJECTORIES.first_rounds):
                here = self._run(u, nothing, self.stacked)
                self.process_noise = here.process_noise_of_trajectories(
                    self.channels, self.stacked.extra["layout"].spring_numbers
                )
                before, now = trajectories_of(self.stacked), self.evaluate(u, nothing).trajectories
                self.stacked = with_trajectories(self.stacked, now)
                if np.max(np.abs(now - before)) < TRAJECTORIES.converged_step:
                    break
            here = self._run(u, nothing, self.stacked)
            self.trajectory_degrees_of_freedom = degrees_of_freedom_of(self._projections(here))
        elif self.specimen.latent.inside:
            values = self.unknowns.values(u)
            self.stacked = self.specimen.latent.prepared(values, self.stacked, self.channels)
            here = self.evaluate(u, nothing)
            if near is not None:
                here = here.bettered(self.evaluate(u, nothing, near=near))
            self.stacked = self.begun(self.stacked, here, u)
            self.trajectory_degrees_of_freedom = np.array(
                [np.sum(here.drivers["taken"][k]) for k in range(len(self.channels))]
            )

    def prepared(self, u: np.ndarray, near: Evaluation | None = None) -> "Program":
        """The program with latent trajectories as the model at `u` has them, see `prepare`; the original is
        left alone."""
        copy = replace(self)
        copy.prepare(u, near)
        return copy

    def followed(self, here: Evaluation) -> list[Projection | None]:
        """Free latent trajectories of every recording near an evaluation, those that the compiled program
        finds itself, too. None for a recording without them."""
        names = [f"slope_{name}" for name in self.specimen.explained]
        if names[0] not in here.drivers:
            return here.projections
        found, process_noise = [], np.asarray(self.stacked.extra["process_noise"])
        source = np.asarray(here.drivers["memory_row"], int)
        for k, channels in enumerate(self.channels):
            own, memory = (
                np.stack([np.nan_to_num(here.drivers[f"{name}_{c.quantity}"][k]) for c in channels])
                for name in ("slope", "memory")
            )
            fraction, time = here.drivers[TRAJECTORY][k], np.asarray(self.stacked.time)[k]
            count = row_count(self.stacked, k)
            own = LatentTrajectory.of(
                0, fraction, own + memory, memory, process_noise[k], time, count, source[k]
            )
            found.append(Projection([own], channels))
        return found

    def freedom_of_trajectories(self, here: Evaluation) -> np.ndarray:
        """Degrees of freedom that latent trajectories take in every recording, (recordings,)."""
        if here not in self._freedom:  # asked for again whenever fits are compared
            self._freedom[here] = degrees_of_freedom_of(self.followed(here))
        return self._freedom[here]

    def count_input_noise(self, u: np.ndarray) -> None:
        """Add what the noise of measured inputs does to the outputs, as the model at `u` has it."""
        nothing = self.unknowns.base[:0]
        changes = changes_by_inputs(
            lambda stacked: self.evaluate(u, nothing, stacked).predicted, self.recordings, self.stacked
        )
        if self.process_noise.shape[1]:
            here = self._run(u, nothing, self.stacked)
            pairs = zip(self._channels_and_process_noise(), self.recordings, strict=True)
            changes["averaging"] = [[here.averaging(k, *parts, r.block) for (k, parts), r in pairs]]
        self.channels = with_input_noise(self.bare, changes)
        self._freedom.clear()

    def _channels_and_process_noise(self) -> list[tuple[int, tuple[list[Channel], np.ndarray]]]:
        """Number of every recording, with its channels and the process noise of its latent trajectories."""
        return [(k, parts) for k, parts in enumerate(zip(self.channels, self.process_noise, strict=True))]

    def evaluate(
        self,
        u: np.ndarray,
        columns: np.ndarray,
        stacked: Rows | None = None,
        near: Evaluation | None = None,
        chosen: np.ndarray | None = None,
    ) -> Evaluation:
        """Whitened misfit of every recording, and its derivative by some of the unknowns.

        Args:
            u: scaled numbers, shape (unknowns,).
            columns: indices of unknowns, any number.
            stacked: recordings of the same shape instead of the campaign's, their latent trajectories as they
                are.
            near: an evaluation close by, from whose latent trajectories the search for those here begins.
            chosen: mask of the recordings that are asked for, (recordings,); all if None. The misfit of
                others is zero, and they keep the latent trajectories that they begin with.
        """
        u, columns = np.asarray(u, float), np.asarray(columns, int)
        if chosen is None or not self.one_by_one:
            chosen = np.ones(len(self.channels), bool)
        problem = self._problem if stacked is None else ()
        moving = stacked is None and self.process_noise.shape[1] > 0
        stacked = self.stacked if stacked is None else stacked
        width = self._compiled.width
        chunks = [columns[first : first + width] for first in range(0, max(len(columns), 1), width)]
        start = self.begun(stacked, near, u) if near is not None else stacked
        in_stack = np.zeros(len(stacked.mask), bool)
        in_stack[: len(chosen)] = chosen
        search = Search(self.channels, self.process_noise, self.failed, chosen) if moving else None
        first = self._run(u, chunks[0], start, in_stack)
        if search:
            search.add(first)
            for _ in range(TRAJECTORIES.runs - 1):
                if search.finished:
                    break
                search.add(self._run(u, chunks[0], with_trajectories(stacked, search.proposal), search.open))
            first = search.best
        rest = [self._run(u, chunk, first.stacked, in_stack) for chunk in chunks[1:]]
        names = first.slopes
        slopes = {n: np.concatenate([part.slopes[n] for part in (first, *rest)]) for n in names}
        whole = replace(first, slopes=slopes)
        projections = search.projections if search else [None] * len(self.channels)
        if search and rest:  # a row may lack a derivative by further unknowns
            projections = self._projections(whole, chosen)
        asked = Asked(u, columns, chosen)
        found = projected(whole, asked, self.channels, self.failed, projections, search)
        return replace(found, problem=problem)

    def holds(self, here: Evaluation, u: np.ndarray, columns: np.ndarray, chosen: np.ndarray) -> bool:
        """True if an evaluation may take the place of another by `evaluate`.

        It must be of this program as it is, at the same numbers, and have the same derivatives. Its latent
        trajectories are where its own search ended.

        Args:
            here: the evaluation.
            u, columns, chosen: see `evaluate`.
        """
        return (
            bool(here.problem)
            and all(a is b for a, b in zip(here.problem, self._problem, strict=True))
            and np.array_equal(here.u, u)
            and np.array_equal(here.columns, columns)
            and bool(np.all(here.asked[chosen]))
        )

    @property
    def _problem(self) -> tuple:
        """What the program holds that evaluations depend on, see `Evaluation.problem`. None of it is changed
        in place; what changes is replaced."""
        return self._compiled, self.channels, self.process_noise, self.stacked, self.failed

    @property
    def one_by_one(self) -> bool:
        """True if recordings are run by themselves, so that some of them cost less than all."""
        return self._compiled.one_by_one

    def slopes(self, here: Evaluation, columns: np.ndarray) -> dict[str, np.ndarray]:
        """Derivatives of the outputs by some unknowns where latent trajectories stay as they are, by
        quantity.

        Args:
            here: an evaluation.
            columns: indices of unknowns, any number.

        Returns:
            SI per scaled unit, (columns, recordings of the stack, rows); NaN where the model has no answer.
        """
        stacked, width = with_trajectories(self.stacked, here.trajectories), self._compiled.width
        chunks = [columns[first : first + width] for first in range(0, len(columns), width)]
        runs = [self._run(here.u, chunk, stacked) for chunk in chunks]
        return {name: np.concatenate([run.slopes[name] for run in runs]) for name in runs[0].slopes}

    def begun(self, stacked: Rows, near: Evaluation, u: np.ndarray) -> Rows:
        """Recordings with the latent trajectories of an evaluation, predicted at `u`, to start from."""
        if self.process_noise.shape[1]:
            return with_trajectories(stacked, near.trajectories_at(u))
        return self.specimen.latent.begun(stacked, near.drivers)

    def otherwise(self, here: Evaluation) -> list[Evaluation]:
        """An evaluation with other decisions of the specimen's memory, for searches to begin near."""
        return [replace(here, drivers=drivers) for drivers in self.specimen.latent.otherwise(here.drivers)]

    def _run(
        self, u: np.ndarray, columns: np.ndarray, stacked: Rows, chosen: np.ndarray | None = None
    ) -> Raw:
        """One run of the compiled program; see `Compiled.run`."""
        self.tally.count(RUNS)
        return self._compiled.run(u, columns, stacked, chosen)

    def _projections(
        self, here: Raw, chosen: np.ndarray | None = None
    ) -> list[Projection | None]:
        """Free trajectories of chosen recordings, all if None, as linear problems. None for one without."""
        chosen = np.ones(len(self.channels), bool) if chosen is None else chosen
        pairs = self._channels_and_process_noise()
        return [here.projection(k, *parts) if chosen[k] else None for k, parts in pairs]

    def observations(self, chosen: np.ndarray) -> int:
        """Measured values of some recordings, given by a mask, less those that latent trajectories take
        up."""
        return round(sum(self.count(k) * self.free_share(k) for k in np.flatnonzero(chosen)))

    def count(self, k: int) -> int:
        """Measured values of recording k."""
        return sum(channel.count for channel in self.channels[k])

    def free_share(self, k: int) -> float:
        """Part of the measured values of recording k that no latent trajectory takes up."""
        return 1.0 - float(self.trajectory_degrees_of_freedom[k]) / max(self.count(k), 1)
