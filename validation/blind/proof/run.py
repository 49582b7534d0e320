"""Sealing and diagnosis of all cases of a plan: in pieces, with a budget, resumable after any
interruption."""

import hashlib
import json
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from tqdm import tqdm

from fitting.engine import Store, Task, in_this_process, run_tasks
from validation.blind.cases import KINDS, case_list, truth_of
from validation.blind.seal import open_seals, seal

from . import worker
from .places import as_bytes, commit, read, write

CHUNK = 24
"""Number of cases that are sealed and diagnosed together; within a chunk, one kind after the other."""


def chosen_cases(plan, seed, limit=None, kinds=None, groups=None):
    """Cases of a plan: the first `limit` of the requested kinds and groups."""
    cases = case_list(plan, seed)
    for what, asked, available in (("kind", kinds, KINDS), ("group", groups, sorted({case.group for case in cases}))):
        unknown = sorted(set(asked or ()) - set(available))
        if unknown:
            raise ValueError(f"unknown {what} {unknown[0]!r}: one of {', '.join(available)}")
    return [c for c in cases if (not kinds or c.kind in kinds) and (not groups or c.group in groups)][:limit]


def keep_plan(places, plan, seed):
    """Store a hash of the cases of a run; ValueError where the plan's cases have changed since.

    Raises:
        ValueError: the generator's plan is another one than that of the campaigns on disk.
    """
    book = places.folder / "plan.json"
    now = hashlib.sha256(repr(case_list(plan, seed)).encode()).hexdigest()
    if read(book, now) != now:
        raise ValueError(f"the cases of plan {plan} are others than when {places.folder} was begun: choose another --out")
    write(book, now)


def run(
    cases, places, seed=1, scheduler=in_this_process, minutes=None, diagnose=worker.diagnose_folder, compare=None
):
    """Seal and diagnose cases, each a task of the engine. Existing results on disk are kept.

    Args:
        cases: cases from `chosen_cases`.
        places: files of the run.
        seed: seed of the diagnoses.
        scheduler: scheduler of sealing and diagnosis; see `fitting.engine`.
        minutes: time after which no case is begun [min].
        diagnose: function from (folder, seed) to a report.
        compare: function from (folder, report, seed) to answers of other methods; None for none.

    Returns:
        Cases with all requested results.
    """
    deadline = time.monotonic() + 60.0 * minutes if minutes else float("inf")
    jobs = {"report.json": partial(worker.diagnosed, places, seed=seed, commit=commit(), diagnose=diagnose)}
    if compare is not None:
        jobs["baselines.json"] = partial(worker.compared, places, seed=seed, compare=compare)

    def complete(case):
        return all((places.reports / case.name / file).exists() for file in jobs)

    with tqdm(total=len(cases), unit="case", disable=None, initial=sum(map(complete, cases))) as bar:
        for first in range(0, len(cases), CHUNK):
            chunk = [case for case in cases[first : first + CHUNK] if not complete(case)]
            if not chunk or time.monotonic() > deadline:
                continue
            bar.set_description("sealing")
            sealed = _sealed(chunk, places, scheduler)
            bar.update(len(chunk) - len(sealed))
            bar.set_description("diagnosing")
            names = [case.name for case in sorted(sealed, key=lambda c: KINDS.index(c.kind))]
            for file, job in jobs.items():
                last = file == list(jobs)[-1]
                _all_of(names, file, job, places, scheduler, deadline, bar if last else None)
            _say(cases, complete, bar)
    return [case for case in cases if complete(case)]


def _all_of(names, file, job, places, scheduler, deadline, bar):
    """Compute one file of each case through the engine, where it is missing, until the deadline.

    A case's timing is written before its report, so that a report never stands without it.
    """
    if file != "report.json":  # what needs a report waits for it
        names = [name for name in names if places.report(name).exists()]
    tasks = [Task(f"{name}/{file}") for name in names]

    def watched(work, numbers):
        begun = (number for number in numbers if time.monotonic() <= deadline)
        for number, content in scheduler(work, begun):
            found = json.loads(content)
            if "timing" in found:
                write(places.timing(names[number]), found["timing"])
            yield number, as_bytes(found["content"])
            if bar is not None:
                bar.update()

    run_tasks(_ByName(job, tuple(names)), tasks, Store(places.reports), watched)


@dataclass(frozen=True)
class _ByName:
    """Adapter from a job that takes a case by name to one of the engine, which takes a task by number."""

    job: Callable
    names: tuple[str, ...]

    def __call__(self, number):
        return json.dumps(self.job(self.names[number])).encode()


def _sealed(cases, places, scheduler):
    """Seal cases. One that cannot be made is noted and left out, which says nothing about the tool."""
    book, unmade_book = places.campaigns / "seals.json", places.folder / "unmade.json"
    unmade, seals = read(unmade_book, {}), read(book, {})
    sealed = [case for case in cases if case.name in seals and (places.campaigns / case.name).is_dir()]
    unsealed = [case for case in cases if case not in sealed and case.name not in unmade]
    for case, problem in _side_by_side(partial(_seal_alone, places), unsealed, scheduler):
        if problem:
            unmade[case.name] = problem
            write(unmade_book, unmade)
            continue
        part = _own_folder(places, case)
        shutil.rmtree(places.campaigns / case.name, ignore_errors=True)
        places.campaigns.mkdir(parents=True, exist_ok=True)
        (part / case.name).replace(places.campaigns / case.name)
        seals |= read(part / "seals.json")
        write(book, seals)
        shutil.rmtree(part)
        sealed.append(case)
    return sealed


def _own_folder(places, case):
    return places.folder / "sealing" / case.name


def _seal_alone(places, case):
    """Seal one case in a folder of its own, so that several can be sealed at a time; returns the reason of a
    failure."""
    try:
        seal([case], _own_folder(places, case))
    except ArithmeticError as problem:
        return str(problem)
    return None


def truths(cases, places, scheduler=in_this_process):
    """Open the seals of cases that all have a report. Returns the truths by name, recomputed from the seeds.

    Raises:
        ValueError: a report is missing, or a truth does not match its seal.
    """
    if all(places.report(case.name).exists() for case in cases):
        book = places.campaigns / "opened.json"
        opened = read(book, {})
        unopened = [case for case in cases if case.name not in opened]
        with tqdm(total=len(unopened), unit="case", disable=None, desc="opening") as bar:
            for case, truth in _side_by_side(truth_of, unopened, scheduler):
                opened[case.name] = truth
                write(book, opened)
                bar.update()
    return open_seals(cases, places.campaigns, places.reports)


def _side_by_side(function, cases, scheduler):
    """Every case with the result of a function, as JSON, in the order of completion."""
    for number, content in scheduler(_ByName(function, tuple(cases)), range(len(cases))):
        yield cases[number], json.loads(content)


def _say(cases, complete, bar):
    if bar.disable:  # no terminal: a line for the log
        print(f"{sum(map(complete, cases))} of {len(cases)} cases done", flush=True)
