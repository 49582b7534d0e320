"""Many campaigns diagnosed, each a task of `fitting.engine`.

Finished tasks stay on disk if the program is killed, and other processes may compute some of them. A campaign
that cannot be used, or whose diagnosis fails in any way, is reported beside the others and stops none. The
caller passes the function that writes a campaign's report (`Present`), because this layer knows no reports.
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
"""Receives a line of text at every step."""


@dataclass(frozen=True)
class Asked:
    """Options of `pneusma diagnose` for a campaign.

    Attributes:
        seed: seed of all random numbers.
        tables: names or paths of tables of constants, by `alloy` and `material`. They replace those that
            recordings name.
        model: name or path of the model on disk to start from; None for the published one.
        thorough: fit twice as many candidates.
        effects: slugs of effects about which the conclusion has to say something.
    """

    seed: int = 0
    tables: Mapping[str, str] = field(default_factory=dict)
    model: str | None = None
    thorough: bool = False
    effects: tuple[str, ...] = ()

    def command(self, campaign: str | Path, out: str | Path) -> str:
        """The command line that diagnoses one campaign with these options into the folder `out`."""
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

    def conclusion(self, campaign: Campaign, start: AugmentedModel | None, progress: Progress) -> Conclusion:
        """The diagnosis of one campaign; float64 must be on.

        Raises:
            InputError: for a campaign that cannot be diagnosed, or not with these options.
        """
        with_own_tables = with_tables(campaign, self.tables)
        return diagnose(with_own_tables, self.seed, progress, start, self.thorough, self.effects)


@dataclass(frozen=True)
class Diagnosed:
    """One campaign of many, and its diagnosis if there is one.

    Attributes:
        name: name of its folder of results, different from all others.
        path: path of the campaign.
        verdict: the first sentences of its report.
        notes: cautions to show beside it.
        documents: content of its files, by file name; empty if the diagnosis failed.
        problem: why it failed, or why its files could not be written, in a line; empty otherwise.
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
"""Function that writes a report: (conclusion, title, command, seed, start) -> (sentences, documents).

The title is the campaign's, and `start` is the model that the diagnosis started from. Documents are contents
of files by name. It must be a function of a module, so that it can be sent to other processes.
"""


@dataclass(frozen=True)
class DiagnosisJob:
    """Diagnoses campaigns by number, see `MemberJob`.

    Attributes:
        names, paths: names of the folders of results, and paths of the campaigns.
        out: folder of all results, for the command that a report quotes.
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
        """A diagnosed campaign as bytes, as the store keeps it."""
        return objects.dump(member)

    def member(self, number: int, progress: Progress) -> Diagnosed:
        """The diagnosed campaign; every error becomes its problem."""
        enable_float64()
        make_room()
        name, path = self.names[number], self.paths[number]
        try:
            campaign, start = read_campaign(path), self.asked.start()
            conclusion = self.asked.conclusion(campaign, start, lambda word: progress(f"{name}: {word}"))
            command = self.asked.command(path, self.out / name)
            verdict, documents = self.present(conclusion, campaign.title, command, self.asked.seed, start)
        except Exception as error:  # noqa: BLE001  one bad campaign never stops the others
            return Diagnosed(name, path, problem=line_of(error))
        notes = tuple(campaign.notices + conclusion.notes)
        return Diagnosed(name, path, tuple(verdict), notes, dict(documents))

    def tasks(self) -> list[Task]:
        """A file of the store for each campaign.

        Its name has a digest of the campaign's files, of all options, and of the program's version. So a
        result is found again only if all of them are the same.
        """
        own_files = [
            Path(x) for x in (self.asked.model, *self.asked.tables.values()) if x and Path(x).is_file()
        ]
        names = []
        for name, path in zip(self.names, self.paths, strict=True):
            asked = replace(self.asked, tables=dict(sorted(self.asked.tables.items())))
            names.append(f"{name}-{digest([path, *own_files], asked)}.diagnosis")
        return [Task(name) for name in names]


def diagnose_batch(
    job: DiagnosisJob,
    store: Store,
    scheduler: Scheduler = in_this_process,
    finished: Callable[[Diagnosed], None] = lambda _: None,
    kept: Callable[[Diagnosed], None] | None = None,
    progress: Progress = lambda _: None,
) -> Diagnoses:
    """Diagnose campaigns, except those whose diagnosis is in the store already.

    Campaigns whose diagnosis failed are tried again.

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
    """The job that diagnoses campaigns.

    Args:
        campaigns: folders of recordings, or single CSVs.
        out: folder of all results.
        asked: options of every campaign.
        present: see `Present`.
    """
    paths = tuple(Path(path) for path in campaigns)
    return DiagnosisJob(tuple(unique_names(paths)), paths, Path(out), asked, present)
