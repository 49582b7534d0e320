"""One sealed case: its report and the other methods' answers. Nothing here can reach a truth.

A worker gets a folder as from a laboratory, and a place for the report.
"""

import time
import traceback
from pathlib import Path

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.report.diagnosis.payload import content
from pneusma_jax import enable_float64

from .baselines import answers
from .places import read, write

ERROR = "pneusma-blind-error/1"
"""Schema of the replacement of a missing report."""
MOST_MAPS = 20_000
"""Maximum number of memory maps of this process before compiled programs are dropped (Linux allows 65530)."""
MOST_ATTEMPTS = 3
"""Maximum number of attempts of a case that kills its process, before that is recorded as its result."""


def diagnose_folder(folder, seed):
    """The report of `pneusma diagnose` on a folder, and the durations of reading and diagnosis."""

    enable_float64()

    return content(diagnose(read_campaign(folder), seed=seed))


def compare_folder(folder, report, seed):
    """Answers of the other methods on a folder."""

    return answers(folder, report, seed)


def work(places, name, seed, commit, diagnose=diagnose_folder, compare=None):
    """Write the missing results of a case. Every error becomes its result. Returns the case's name."""
    folder = places.campaigns / name
    if not places.report(name).exists():
        _attempt(places, name)
        if not places.report(name).exists():
            _timed(lambda: diagnose(folder, seed), places.report(name), places.timing(name), commit)
    if compare is not None and not places.baselines(name).exists():
        report = read(places.report(name))
        _timed(lambda: compare(folder, report, seed), places.baselines(name), None, commit)
    _tidy()
    return name


def _timed(answer, path, timing, commit):
    wall, cpu = time.perf_counter(), time.process_time()
    try:
        found = answer()
    except Exception as problem:  # a case that fails is a result, not the end of the trial
        found = {"schema": ERROR, "error": f"{type(problem).__name__}: {problem}", "trace": traceback.format_exc()}
    spent = {
        "seconds": round(time.perf_counter() - wall, 2),
        "cpu_seconds": round(time.process_time() - cpu, 2),
        "commit": commit,
    }
    if timing is not None:
        write(timing, spent)
    write(path, found)


def _attempt(places, name):
    """Count attempts on disk. A case that kills its process several times is an error, too."""
    book = places.reports / name / "attempts.json"
    before = read(book, 0)
    if before >= MOST_ATTEMPTS:
        write(places.timing(name), {"seconds": None, "cpu_seconds": None, "commit": "unknown"})
        write(places.report(name), {"schema": ERROR, "error": f"the process ended {before} times on this case", "trace": ""})
        return
    write(book, before + 1)


def _tidy():
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        import jax

        jax.clear_caches()
