"""Sealing and diagnosis of all cases of a plan: in pieces, with a budget, resumable after any
interruption."""

import hashlib
import multiprocessing
import os
import shutil
import time
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial

from tqdm import tqdm

from validation.blind.cases import KINDS, case_list, truth_of
from validation.blind.seal import open_seals, seal

from . import worker
from .places import commit, read, write

CHUNK = 24
"""Number of cases that are sealed and diagnosed together; within a chunk, one kind after the other."""
PER_PROCESS = 80
"""Maximum number of cases of one worker process."""


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


def run(cases, places, seed=1, workers=1, minutes=None, diagnose=worker.diagnose_folder, compare=None):
    """Seal and diagnose cases. Existing results on disk are kept.

    Args:
        cases: cases from `chosen_cases`.
        places: files of the run.
        seed: seed of the diagnoses.
        workers: number of processes; 1 runs in this one.
        minutes: time after which no case is begun [min].
        diagnose: function from (folder, seed) to a report.
        compare: function from (folder, report, seed) to answers of other methods; None for none.

    Returns:
        Cases with all requested results.
    """
    deadline = time.monotonic() + 60.0 * minutes if minutes else float("inf")
    task = partial(worker.work, places, seed=seed, commit=commit(), diagnose=diagnose, compare=compare)

    def complete(case):
        return places.report(case.name).exists() and (compare is None or places.baselines(case.name).exists())

    with tqdm(total=len(cases), unit="case", disable=None, initial=sum(map(complete, cases))) as bar:
        for first in range(0, len(cases), CHUNK):
            chunk = [case for case in cases[first : first + CHUNK] if not complete(case)]
            if not chunk or time.monotonic() > deadline:
                continue
            bar.set_description("sealing")
            sealed = _sealed(chunk, places, workers)
            bar.update(len(chunk) - len(sealed))
            bar.set_description("diagnosing")
            names = [case.name for case in sorted(sealed, key=lambda c: KINDS.index(c.kind))]
            if workers > 1:
                _in_processes(task, names, workers, deadline, bar)
            else:
                _here(task, names, deadline, bar)
            _say(cases, complete, bar)
    return [case for case in cases if complete(case)]


def _sealed(cases, places, workers):
    """Seal cases. One that cannot be made is noted and left out, which says nothing about the tool."""
    book, unmade_book = places.campaigns / "seals.json", places.folder / "unmade.json"
    unmade, seals = read(unmade_book, {}), read(book, {})
    sealed = [case for case in cases if case.name in seals and (places.campaigns / case.name).is_dir()]
    unsealed = [case for case in cases if case not in sealed and case.name not in unmade]
    for case, problem in zip(unsealed, _side_by_side(partial(_seal_alone, places), unsealed, workers), strict=True):
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


def truths(cases, places, workers=1):
    """Open the seals of cases that all have a report. Returns the truths by name, recomputed from the seeds.

    Raises:
        ValueError: a report is missing, or a truth does not match its seal.
    """
    if all(places.report(case.name).exists() for case in cases):
        book = places.campaigns / "opened.json"
        opened = read(book, {})
        unopened = [case for case in cases if case.name not in opened]
        with tqdm(total=len(unopened), unit="case", disable=None, desc="opening") as bar:
            for case, truth in zip(unopened, _side_by_side(truth_of, unopened, workers), strict=True):
                opened[case.name] = truth
                write(book, opened)
                bar.update()
    return open_seals(cases, places.campaigns, places.reports)


def _side_by_side(function, items, workers):
    """Results in order, as they become available; in processes where there is more than one worker."""
    if workers == 1 or len(items) < 2:
        yield from map(function, items)
        return
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield from pool.map(function, items)


def _here(task, names, deadline, bar):
    for name in names:
        if time.monotonic() > deadline:
            return
        task(name)
        bar.update()


def _in_processes(task, names, workers, deadline, bar):
    """Work on names in order. A broken pool is made again, and the worker counts the cause."""
    # the processes fill the cores by themselves: no threads of their own, and none of XLA's, which would wait for
    # work in a busy loop
    for threads in ("PNEUSMA_THREADS", "NPROC"):
        os.environ.setdefault(threads, "1")
    remaining = list(names)
    context = multiprocessing.get_context("spawn")
    while remaining and time.monotonic() < deadline:
        with ProcessPoolExecutor(workers, mp_context=context, max_tasks_per_child=PER_PROCESS) as pool:
            waiting = {}
            try:
                while (remaining or waiting) and (waiting or time.monotonic() < deadline):
                    while remaining and len(waiting) < workers and time.monotonic() < deadline:
                        future = pool.submit(task, remaining[0])
                        waiting[future] = remaining.pop(0)
                    done, _ = wait(waiting, return_when=FIRST_COMPLETED)
                    for future in done:
                        future.result()
                        waiting.pop(future)
                        bar.update()
            except BrokenProcessPool:
                remaining = [*waiting.values(), *remaining]


def _say(cases, complete, bar):
    if bar.disable:  # no terminal: a line for the log
        print(f"{sum(map(complete, cases))} of {len(cases)} cases done", flush=True)
