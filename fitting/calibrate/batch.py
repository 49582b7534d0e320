"""Many campaigns: a table over specimens and what they say together.

A campaign that cannot be used, or whose fit fails in any way, is reported beside the others and stops none.
With a store each campaign is a task of the engine: what is done stays after a kill, and other processes may
help.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.data.recordings import questions_of_reading, read_campaign, schema
from fitting.engine import Scheduler, Store, Task, digest, in_this_process, objects, unique_names
from fitting.engine.members import handed, line_of, run_members
from fitting.inference.notes import joined
from fitting.inference.results import Result
from fitting.specimens.priors import quantity_of
from fitting.specimens.rows import MARK
from pneusma_jax.errors import InputError, counted
from pneusma_jax.precision import enable_float64
from pneusma_jax.units import constant_from_si, from_si

from .pooling import Pooled, pool, without_priors
from .registry import characterise
from .result import Characterisation


@dataclass(frozen=True)
class Member:
    """One campaign of a batch.

    Attributes:
        name: name of its folder, made unique.
        path: path of the campaign.
        kind: kind of its recordings; empty where they could not be read.
        result: result of its fit; None if it could not be fitted.
        problem: why there is none, or why its files could not be written, in a line; empty otherwise.
        checks: questions that reading its recordings raised.
    """

    name: str
    path: Path
    kind: str
    result: Characterisation | None
    problem: str
    checks: tuple[str, ...] = ()

    @property
    def done(self) -> bool:
        """True if it has a result."""
        return self.result is not None


@dataclass(frozen=True)
class Batch(Result):
    """Characterised campaigns.

    Attributes:
        members: members in the order given.
        pooled: every constant that two or more specimens of one law inform, by name; with the law behind it
            where specimens follow several.
        left_out: why estimates do not take part in `pooled`, a line each.
    """

    members: tuple[Member, ...]
    pooled: dict[str, Pooled]
    left_out: tuple[str, ...]

    @property
    def done(self) -> list[Member]:
        """Members with a result."""
        return [member for member in self.members if member.done]


def characterise_batch(
    campaigns: Sequence[str | Path],
    finished: Callable[[Member], None] = lambda _: None,
    progress: Callable[[str], None] = lambda _: None,
    store: Store | None = None,
    scheduler: Scheduler = in_this_process,
    kept: Callable[[Member], None] | None = None,
    **options: Any,
) -> Batch:
    """Characterise campaigns; float64 must be on.

    Args:
        campaigns: folders or single CSVs.
        finished: called with each member as it is done, such as to save it.
        progress: called with a word for each step of each fit that runs in this process.
        store: keeps what was fitted; members whose campaign and options are the same are taken from it.
        scheduler: scheduler that runs the fits, if there is a store.
        kept: called in place of `finished` with members that come from the store.
        **options: options of the pipelines. An option that a kind does not know is left out for it.

    Raises:
        InputError: if none could be characterised; names the first reason.
    """
    paths = tuple(Path(path) for path in campaigns)
    job = BatchJob(tuple(unique_names(paths)), paths, options)
    if store is None:
        members = [handed(finished, job.member(k, progress)) for k in range(len(paths))]
    else:
        members = run_members(job, store, scheduler, finished, kept or finished, progress)
    if not any(member.done for member in members):
        raise InputError(
            f"none of {counted(len(members), 'campaign')} could be characterised; {members[0].path}: "
            f"{members[0].problem}"
        )
    pooled, left_out = _pooled([member for member in members if member.done])
    return Batch(tuple(members), pooled, tuple(left_out))


@dataclass(frozen=True)
class BatchJob:
    """Fits campaigns by number, see `MemberJob`."""

    names: tuple[str, ...]
    paths: tuple[Path, ...]
    options: dict[str, Any]

    def __call__(self, number: int) -> bytes:
        """The member as bytes."""
        enable_float64()
        return self.packed(self.member(number, lambda _: None))

    def tasks(self) -> list[Task]:
        """A file for each campaign, named by its content, the options and the program's version."""
        options = sorted(self.options.items())
        return [
            Task(f"{name}-{digest([path], options)}.member")
            for name, path in zip(self.names, self.paths, strict=True)
        ]

    def member(self, number: int, progress: Callable[[str], None]) -> Member:
        """The member; every error becomes its problem."""
        name, path, kind = self.names[number], self.paths[number], ""
        try:
            campaign = read_campaign(path)
            kind = campaign.kinds[0]
            result = characterise(campaign, progress=lambda word: progress(f"{name}: {word}"), **self.options)
            return Member(name, path, kind, result, "", tuple(questions_of_reading(campaign.recordings)))
        except Exception as error:  # noqa: BLE001  one bad specimen never stops the others
            return Member(name, path, kind, None, line_of(error))

    def packed(self, member: Member) -> bytes:
        """A member as bytes; one whose result cannot be kept says so, and is fitted again by a later run."""
        try:
            return objects.dump(member)
        except InputError as error:
            problem = f"its fit cannot be kept or sent: {line_of(error)}"
            return objects.dump(replace(member, result=None, problem=problem))


def _pooled(done: Sequence[Member]) -> tuple[dict[str, Pooled], list[str]]:
    """Constants by name, each over the specimens that inform it under the same law."""
    columns: dict[tuple[str, str], dict[str, tuple[float, float]]] = {}
    units: dict[str, str] = {}
    left_out = []
    for member in done:
        alone, law = _without_shared_priors(member.result), member.result.law
        unknown = _without_known_errors(member.result)
        alone |= dict.fromkeys(getattr(member.result, "unseen", {}), (np.nan, np.nan))
        for name, estimate in member.result.parameters.items():
            stem, _, number = name.partition(MARK)
            specimen = f"{member.name} {number}".strip()
            value, sd = alone.get(name, (estimate.value, estimate.sd))
            if name in unknown:
                left_out.append(f"{specimen}: {stem} {unknown[name]}")
                continue
            if estimate.at_bound or not np.isfinite(sd) or not sd > 0.0:
                why = "at a bound" if estimate.at_bound else "not informed by the data alone"
                left_out.append(f"{specimen}: {stem} is {why}")
                continue
            columns.setdefault((law, stem), {})[specimen] = value, sd
            units[stem] = estimate.unit
    laws: dict[str, set[str]] = {}
    for law, stem in columns:
        laws.setdefault(stem, set()).add(law)
    pooled = {}
    for (law, stem), found in columns.items():
        if len(found) > 1:
            name = stem if len(laws[stem]) == 1 else f"{stem} ({law})"
            pooled[name] = pool(list(found), *np.array(list(found.values())).T, units[stem])
        elif len(laws[stem]) > 1:
            left_out.append(f"{next(iter(found))}: {stem} is of {law}, which no other specimen follows")
    return pooled, left_out


def _without_known_errors(result: Characterisation) -> dict[str, str]:
    """Why the errors of constants are not known where the misfit jumps, by name.

    A profile of a constant that jumps holds the prior that specimens share, so it does not count either.
    """
    known = getattr(result, "information", None)
    jumping, unfollowed = (known.jumping, known.unfollowed) if known else ((), ())
    others = f"has an error that holds only for {joined(unfollowed)} as found"
    found = dict.fromkeys(result.parameters, others) if unfollowed else {}
    return found | dict.fromkeys(jumping, "has no error, because the misfit jumps within it")


def _without_shared_priors(result: Characterisation) -> dict[str, tuple[float, float]]:
    """Value and error without the priors that specimens share, by name, in the unit of files.

    Those of a specimen's own dimensions are measurements of that specimen, and stay. Constants within whose
    error the misfit jumps are marginalised over with their priors, as in `Information.by_data`.
    """
    fitted, known = getattr(result, "fitted", {}), getattr(result, "information", None)
    jumping = known.jumping if known else ()
    usable = [entry for entry in fitted.values() if entry.name not in jumping] if fitted else []
    entries = [entry for entry in usable if entry.standard_error]
    own = {quantity_of(key) for key in schema.GEOMETRY_NUMBERS}  # of a specimen, the others of a material
    shared = lambda entry: entry.prior and entry.name.partition(MARK)[0] not in own  # noqa: E731
    if not any(shared(entry) for entry in entries):
        return {}
    sd = np.array([entry.standard_error for entry in entries])
    correlation = [[1.0 if a is b else a.correlations.get(b.name, 0.0) for b in entries] for a in entries]
    found = without_priors(
        np.array([entry.value for entry in entries]),
        np.array(correlation) * np.outer(sd, sd),
        np.array([entry.prior.mean if shared(entry) else entry.value for entry in entries]),
        np.array([entry.prior.sd if shared(entry) else np.inf for entry in entries]),
    )
    alone = {}
    for entry, value, error in zip(entries, *found, strict=True):
        at = float(constant_from_si(value, entry.unit))
        alone[entry.name] = at, float(from_si(error, entry.unit, difference=True))
    return alone
