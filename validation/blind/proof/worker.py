"""One sealed case: its report and the other methods' answers. Nothing here can reach a truth.

A worker gets a folder as from a laboratory, and a place for the report.
"""

import time
import traceback

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.engine.memory import make_room
from fitting.report.diagnosis.payload import content
from pneusma_jax import enable_float64

from .baselines import answers
from .places import read, write

ERROR = "pneusma-blind-error/1"
"""Schema of the replacement of a missing report."""
MOST_ATTEMPTS = 3
"""Maximum number of attempts of a case that kills its process, before that is recorded as its result."""


def diagnose_folder(folder, seed):
    """The report of `pneusma diagnose` on a folder, and the durations of reading and diagnosis."""

    enable_float64()

    return content(diagnose(read_campaign(folder), seed=seed))


def compare_folder(folder, report, seed):
    """Answers of the other methods on a folder."""

    return answers(folder, report, seed)


def diagnosed(places, name, seed, commit, diagnose=diagnose_folder):
    """Report of a case and its duration; every error becomes its report."""
    before = _attempts(places, name)
    if before >= MOST_ATTEMPTS:
        error = {"schema": ERROR, "error": f"the process ended {before} times on this case", "trace": ""}
        return {"content": error, "timing": {"seconds": None, "cpu_seconds": None, "commit": "unknown"}}
    wall, cpu = time.perf_counter(), time.process_time()
    found = _answered(lambda: diagnose(places.campaigns / name, seed))
    spent = {
        "seconds": round(time.perf_counter() - wall, 2),
        "cpu_seconds": round(time.process_time() - cpu, 2),
        "commit": commit,
    }
    return {"content": found, "timing": spent}


def compared(places, name, seed, compare=compare_folder):
    """Other methods' answers on a case with a report; every error becomes its answer."""
    return {"content": _answered(lambda: compare(places.campaigns / name, read(places.report(name)), seed))}


def _answered(answer):
    make_room()
    try:
        return answer()
    except Exception as problem:  # a case that fails is a result, not the end of the trial
        return {"schema": ERROR, "error": f"{type(problem).__name__}: {problem}", "trace": traceback.format_exc()}


def _attempts(places, name):
    """Number of earlier attempts, counted on disk. A case that kills its process several times is an error,
    too."""
    book = places.reports / name / "attempts.json"
    before = read(book, 0)
    write(book, before + 1)
    return before
