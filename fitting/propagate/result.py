"""A propagated study as data, and how it comes about."""

import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.engine import Rate, Scheduler, Store, in_this_process, run_tasks
from fitting.inference.results import Result
from pneusma_jax.errors import InputError
from pneusma_jax.files import write_whole

from .chunk import prepare, read_summary
from .problem import Problem, build_problem
from .rare import RareResult, estimate_rare
from .reading import read_study
from .statistics.moments import Moments
from .statistics.summary import Summary, merge_all

MANIFEST = "study.json"
"""File of an output folder that says whose chunks are in it."""
CHUNKS = "chunks"
RESULTS = (
    *("report.html", "report.json", "columns.csv", "inputs.csv", "indices.csv", "failed_rows.png"),
    *(f"{kind}_*.png" for kind in ("band", "distribution", "tornado", "indices", "failure")),
)
"""Files that the report of a study leaves in its folder; others in it are the user's."""


@dataclass(frozen=True, eq=False)
class Propagation(Result):
    """A study, done.

    Attributes:
        problem: the problem with its model.
        summary: statistics of all rows.
        nominal: columns at the nominal values.
        rare: small probabilities by the limit's words.
        computed: rows of this run; the others were there.
        seconds: duration of this run [s].
    """

    problem: Problem
    summary: Summary
    nominal: np.ndarray
    rare: dict[str, RareResult]
    computed: int
    seconds: float

    @property
    def moments(self) -> Moments:
        """Moments of every column, NaN where no row has a result."""
        return self.summary.moments.nan_where_empty

    def quantiles(self, levels: np.ndarray) -> np.ndarray:
        """Quantiles of every column, shape (levels, columns)."""
        return self.summary.sketches.quantiles(np.asarray(levels, float))


def propagate(
    study: str | Path | Problem,
    folder: str | Path,
    scheduler: Scheduler = in_this_process,
    resume: bool = False,
    force: bool = False,
    progress: Callable[[int, int], Rate] | None = None,
) -> Propagation:
    """Compute the chunks of a study that are missing, and sum all of them up; float64 must be on.

    Args:
        study: its file, or what `build_problem` made of it.
        folder: folder for the chunks, which get a folder of their own in it.
        scheduler: scheduler that computes the chunks.
        resume: go on with chunks that are in the folder.
        force: replace those of another study.
        progress: makes the display from the rows in all and those that are there.

    Raises:
        InputError: for a study that cannot be, a folder with chunks of another study, or a disk that refuses.
    """
    began = time.monotonic()  # the nominal row compiles the program
    problem = study if isinstance(study, Problem) else build_problem(read_study(study))
    if not np.all(np.isfinite(problem.nominal)):
        problem = _without_nominal(problem)
    store = open_store(problem, Path(folder), resume, force)
    tasks = problem.tasks
    missing = set(store.missing(tasks))
    rows = sum(task.size for k, task in enumerate(tasks) if k in missing)
    if progress is None:
        run_tasks(prepare(problem), tasks, store, scheduler)
    else:
        with progress(problem.rows, problem.rows - rows) as display:
            run_tasks(prepare(problem), tasks, store, scheduler, display)
    summary = merge_all(
        read_summary(store.read(task), problem.fingerprint, index, str(store.path(task)))
        for index, task in enumerate(tasks)
    )
    rare = {}
    if problem.study.rare is not None:
        rare = {limit.words: estimate_rare(problem, limit) for limit in problem.study.limits}
    return Propagation(problem, summary, problem.nominal, rare, rows, time.monotonic() - began)


def _without_nominal(problem: Problem) -> Problem:
    notice = "the model has no result at the nominal values, so figures show no nominal line"
    kept = {**problem.__dict__, "notices": (*problem.notices, notice)}
    fresh = Problem(**{name: kept[name] for name in problem.__dataclass_fields__})
    fresh.__dict__.update({name: kept[name] for name in ("evaluator", "nominal") if name in kept})
    return fresh


def open_store(problem: Problem, folder: Path, resume: bool, force: bool) -> Store:
    """The folder of a study's chunks, with its manifest written.

    Raises:
        InputError: if chunks are there that this run may not go on with.
    """
    manifest, store = folder / MANIFEST, Store(folder / CHUNKS)
    if manifest.exists() and not force:
        same = _stated(manifest) == problem.fingerprint
        if not same:
            raise InputError(
                f"{folder}: chunks of another study are here (or its files or the program changed); "
                "choose another"
                " folder, or replace them with --force"
            )
        if not resume:
            raise InputError(
                f"{folder}: this study has begun here; go on with --resume, or replace it with --force"
            )
    if force:
        _clear(folder, store, RESULTS if manifest.exists() else ())
    content = {
        "schema": "pneusma-propagation/1",
        "fingerprint": problem.fingerprint,
        "study": str(problem.study.path),
    }
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written here ({error.strerror})") from None
    if not manifest.exists() or force:
        write_whole(manifest, json.dumps(content, indent=1) + "\n")
    return store


def begun(folder: str | Path) -> bool:
    """True if chunks of a study are in a folder, or could be: its manifest is there."""
    return (Path(folder) / MANIFEST).exists()


def _clear(folder: Path, store: Store, results: tuple[str, ...]) -> None:
    """Remove chunks and results of the study that was here, so that none of them is taken for the new one's.

    Args:
        folder: folder of results.
        store: store of the chunks in it.
        results: patterns of results to remove.

    Raises:
        InputError: if they cannot be removed.
    """
    try:
        for path in (*store.folder.glob("chunk-*.h5"), *(p for form in results for p in folder.glob(form))):
            path.unlink()
    except OSError as error:
        raise InputError(f"{folder}: results here cannot be replaced ({error.strerror})") from None


def _stated(manifest: Path) -> str:
    try:
        return str(json.loads(manifest.read_text(encoding="utf-8"))["fingerprint"])
    except (OSError, ValueError, KeyError, TypeError):
        raise InputError(f"{manifest}: this is no manifest of a study; choose another folder") from None
