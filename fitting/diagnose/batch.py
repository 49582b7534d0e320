"""Many campaigns diagnosed, each a task of the engine: what is done stays after a kill, and others may help.

A campaign that cannot be used, or whose diagnosis fails in any way, is reported beside the others and stops
none. What a campaign's documents look like is handed in by the caller: this layer knows nothing of reports.
"""

import json
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from fitting.data.publish import MARK
from fitting.data.recordings import Campaign, read_campaign
from fitting.engine import Scheduler, Store, Task, digest, in_this_process, objects, unique_names
from fitting.engine.members import line_of, run_members
from fitting.engine.memory import make_room
from fitting.inference.results import Result
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.files import load_model
from pneusma_jax.errors import InputError, counted
from pneusma_jax.precision import enable_float64

from .check import with_tables
from .run import diagnose
from .verdict.conclusion import Conclusion

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Asked:
    """Options of `pneusma diagnose` for a campaign.

    Attributes:
        seed: seed of all random numbers.
        tables: names or paths by `alloy` and `material`, in the place of those that recordings name.
        model: name or path of the model to start from; None for the published one.
        thorough: fit twice as many candidates.
        effects: slugs that are asked about.
    """

    seed: int = 0
    tables: Mapping[str, str] = field(default_factory=dict)
    model: str | None = None
    thorough: bool = False
    effects: tuple[str, ...] = ()

    def command(self, campaign: str | Path, out: str | Path) -> str:
        """The command line that asks this of one campaign."""
        words = ["pneusma", "diagnose", str(campaign), "--out", str(out), "--seed", str(self.seed)]
        words += [word for key, table in self.tables.items() for word in (f"--{key}", table)]
        words += (["--model", self.model] if self.model else []) + (["--thorough"] if self.thorough else [])
        return shlex.join([*words, *(word for slug in self.effects for word in ("--effect", slug))])

    def start(self) -> AugmentedModel | None:
        """The model to start from.

        Raises:
            InputError: if there is no such model.
        """
        return load_model(self.model) if self.model else None

    def of(self, campaign: Campaign, start: AugmentedModel | None, progress: Progress) -> Conclusion:
        """The diagnosis; float64 must be on.

        Raises:
            InputError: for a campaign that cannot be diagnosed, or not so.
        """
        given = with_tables(campaign, self.tables)
        return diagnose(given, self.seed, progress, start, self.thorough, self.effects)


@dataclass(frozen=True)
class Diagnosed:
    """One campaign of many.

    Attributes:
        name: name of its folder of results, made unique.
        path: path of the campaign.
        verdict: the first sentences of its report.
        notes: cautions to show beside it.
        documents: content of its files, by file name; empty where there is no diagnosis.
        problem: why there is none, or why its files could not be written, in a line; empty otherwise.
    """

    name: str
    path: Path
    verdict: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    documents: Mapping[str, bytes] = field(default_factory=dict)
    problem: str = ""

    @property
    def done(self) -> bool:
        """True if it was diagnosed."""
        return bool(self.documents)

    @cached_property
    def content(self) -> dict[str, Any]:
        """Content of its `report.json`; empty where there is no diagnosis."""
        return json.loads(self.documents[MARK]) if self.done else {}


@dataclass(frozen=True)
class Diagnoses(Result):
    """Campaigns that were diagnosed.

    Attributes:
        members: members in the order given.
        seed: seed of every diagnosis.
    """

    members: tuple[Diagnosed, ...]
    seed: int


Present = Callable[
    [Conclusion, str, str, int, AugmentedModel | None], tuple[Sequence[str], Mapping[str, bytes]]
]
"""Sentences and documents of a conclusion, from its campaign's title, the command, the seed and the model
that it started from. A function of a module, so that it can be sent to other processes."""


@dataclass(frozen=True)
class DiagnosisJob:
    """Diagnoses campaigns by number, see `MemberJob`.

    Attributes:
        names, paths: names and paths of the campaigns; out: folder of all results, for the command that a
            report quotes.
        asked: options of every campaign.
        present: see `Present`.
    """

    names: tuple[str, ...]
    paths: tuple[Path, ...]
    out: Path
    asked: Asked
    present: Present

    def __call__(self, number: int) -> bytes:
        """The diagnosed campaign as bytes."""
        return self.packed(self.member(number, lambda _: None))

    def packed(self, member: Diagnosed) -> bytes:
        """A diagnosed campaign as bytes."""
        return objects.dump(member)

    def member(self, number: int, progress: Progress) -> Diagnosed:
        """The diagnosed campaign; every error becomes its problem."""
        enable_float64()
        make_room()
        name, path = self.names[number], self.paths[number]
        try:
            campaign, start = read_campaign(path), self.asked.start()
            conclusion = self.asked.of(campaign, start, lambda word: progress(f"{name}: {word}"))
            command = self.asked.command(path, self.out / name)
            verdict, documents = self.present(conclusion, campaign.title, command, self.asked.seed, start)
        except Exception as error:  # noqa: BLE001  one bad campaign never stops the others
            return Diagnosed(name, path, problem=line_of(error))
        notes = tuple(campaign.notices + conclusion.notes)
        return Diagnosed(name, path, tuple(verdict), notes, dict(documents))

    def tasks(self) -> list[Task]:
        """A file for each campaign, named by its content, by what is asked, and by the program's version."""
        beside = [Path(x) for x in (self.asked.model, *self.asked.tables.values()) if x and Path(x).is_file()]
        names = []
        for name, path in zip(self.names, self.paths, strict=True):
            asked = replace(self.asked, tables=dict(sorted(self.asked.tables.items())))
            names.append(f"{name}-{digest([path, *beside], asked)}.diagnosis")
        return [Task(name) for name in names]


def diagnose_batch(
    job: DiagnosisJob,
    store: Store,
    scheduler: Scheduler = in_this_process,
    finished: Callable[[Diagnosed], None] = lambda _: None,
    kept: Callable[[Diagnosed], None] | None = None,
    progress: Progress = lambda _: None,
) -> Diagnoses:
    """Diagnose campaigns; those in the store are taken from it, and those that failed are tried again.

    Args:
        job: campaigns and their options.
        store: keeps what was diagnosed.
        scheduler: scheduler that runs the diagnoses.
        finished: called with each campaign as it is done, such as to write its files.
        kept: called in place of `finished` with campaigns that come from the store.
        progress: called with a word for each step of each diagnosis that runs in this process.

    Raises:
        InputError: if none could be diagnosed; names the first reason.
    """
    members = run_members(job, store, scheduler, finished, kept or finished, progress)
    if not any(member.done for member in members):
        raise InputError(
            f"none of {counted(len(members), 'campaign')} could be diagnosed; {members[0].path}:"
            f" {members[0].problem}"
        )
    return Diagnoses(tuple(members), job.asked.seed)


def job_of(campaigns: Sequence[str | Path], out: str | Path, asked: Asked, present: Present) -> DiagnosisJob:
    """The job for campaigns: folders of recordings, or single CSVs."""
    paths = tuple(Path(path) for path in campaigns)
    return DiagnosisJob(tuple(unique_names(paths)), paths, Path(out), asked, present)
