"""Damaged files by the thousand: each is read rightly, or refused in one clear line.

    python tests/reliability/fuzz.py --count 20000 --seed 1 --out out/fuzz.json

Kinds: recordings and sidecars, tables of constants and studies, text files and workbooks of laboratories, and the HDF5
and stored files that commands resume from. An independent reader checks every file that is accepted: a number that
differs is a silent wrong number. A traceback, a library's warning, a reading of more than ten seconds, more than 4 GiB
of memory, or a process that dies is a failure, too. Files are read in a process of their own, so that the campaign outlives it.
"""

import argparse
import csv
import io
import json
import math
import re
import resource
import select
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from binary_files import binary_mutation, kinds, without_seal  # noqa: E402
from mutations import DATA, text_mutation, workbook, workbook_mutation  # noqa: E402

from fitting.data.importers import import_tests, make_options  # noqa: E402
from fitting.data.protocols.reading import load_protocol  # noqa: E402
from fitting.data.recordings import read_campaign  # noqa: E402
from fitting.specimens.saved_models.files import load_model  # noqa: E402
from pneusma_jax import InputError, load_calibration  # noqa: E402
from pneusma_jax.serial_chain.designs import load_chain  # noqa: E402

SECONDS = 10  # of one file
MEMORY_GIB = 4.0  # of the whole campaign
MODEL = """schema = "pneusma-model/1"
name = "A"

[base]
alloy = "krl35"
G_m = {value = 3.1, unit = "GPa", status = "fitted", source = "a fit", prior = {mean = 3.1, sd = 0.05}}

[[effect]]
slug = "mullins_softening"
[effect.parameters]
depth = {value = 0.21, unit = "1", status = "fitted", source = "a fit"}
"""


GOOD = ("accepted", "refused")
BEGIN_SECONDS = 300
"""Maximum time between two lines of a process: it starts with sampling a chain, which compiles."""


TOO_MUCH = f"some file: more than {MEMORY_GIB:g} GiB"


class TooLong(Exception):
    """A file took longer than it may."""


def _alarm(*_: object) -> None:
    raise TooLong


def recordings(
    rng: np.random.Generator, folder: Path
) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A campaign of one recording, whose CSV or sidecar is damaged."""
    kinds = ("elastomer", "tube", "wire", "spring", "actuator", "pulled_silicone")
    source = DATA / "examples" / kinds[int(rng.integers(len(kinds)))]
    files = sorted(source.glob("*.csv"))
    file = files[int(rng.integers(len(files)))]
    table = b"\n".join(file.read_bytes().split(b"\n")[:40]) + b"\n"
    beside = file.with_suffix(".toml").read_bytes()
    if rng.random() < 0.6:
        table = text_mutation(rng, table)
    else:
        beside = text_mutation(rng, beside)
    (folder / "test.csv").write_bytes(table)
    (folder / "test.toml").write_bytes(beside)
    return lambda: read_campaign(folder), lambda found: wrong_numbers(table, found.recordings[0].columns)


def wrong_numbers(table: bytes, columns: dict[str, np.ndarray]) -> str:
    """What differs between accepted columns and a plain reading of the table; empty if nothing does.

    Only columns whose heading is canonical are compared: others are converted.
    """
    text = table.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    while lines and (not lines[0].strip() or lines[0].startswith("#")):
        lines.pop(0)
    rows = [row for row in csv.reader(io.StringIO("\n".join(lines))) if row and row[0][:1] != "#"]  # no comments
    header = [name.strip() for name in rows[0]]
    for name, values in columns.items():
        if name not in header or not np.issubdtype(np.asarray(values).dtype, np.number):
            continue
        cells = [row[header.index(name)].strip() for row in rows[1:]]
        plain = [math.nan if cell in ("", "nan", "NaN") else float(cell) for cell in cells]
        if len(plain) != len(values):
            return f"{name} has {len(values)} rows, but the file has {len(plain)}"
        if not np.array_equal(np.asarray(plain), np.asarray(values, float), equal_nan=True):
            return f"{name} differs from what is written"
    return ""


def tables(rng: np.random.Generator, folder: Path) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A damaged table of constants, protocol, chain or model."""
    kind = int(rng.integers(4))
    if kind == 0:
        sources, load = sorted(DATA.glob("*.toml")), load_calibration
    elif kind == 1:
        sources, load = sorted((DATA / "examples" / "protocols").glob("*.toml")), load_protocol
    elif kind == 2:
        sources, load = sorted((DATA / "examples" / "chains").glob("*.toml")), load_chain
    else:
        sources, load = [], load_model
    content = MODEL.encode() if not sources else sources[int(rng.integers(len(sources)))].read_bytes()
    (folder / "table.toml").write_bytes(text_mutation(rng, content))
    return lambda: load(folder / "table.toml"), lambda found: ""


def texts(rng: np.random.Generator, folder: Path) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A damaged text file of a laboratory."""
    head = "Sample: A\nTime (s),Strain (%),Stress (kPa)\n"
    rows = "".join(f"{0.5 * k},{2.0 * k},{3.0 * k + 0.01 * k**2:.3f}\n" for k in range(30))
    content = text_mutation(rng, (head + rows).encode())
    (folder / "raw.csv").write_bytes(content)
    return (
        lambda: import_tests(folder / "raw.csv", make_options(kind="elastomer")),
        lambda found: finite_recordings(found) or invented(found, written(content)),
    )


def workbooks(rng: np.random.Generator, folder: Path) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A workbook with odd cells, with a damaged container, or with a damaged part."""
    content = workbook(rng)
    if rng.random() < 0.8:
        content = workbook_mutation(rng, content)
    (folder / "raw.xlsx").write_bytes(content)
    return (
        lambda: import_tests(folder / "raw.xlsx", make_options(kind="elastomer")),
        lambda found: finite_recordings(found) or invented(found, written_in_workbook(content)),
    )


def finite_recordings(found: list) -> str:
    """What is wrong with imported recordings: a canonical column that holds no finite number at all."""
    for recording in found:
        for name in ("strain", "stress_kPa"):
            if not np.isfinite(np.asarray(recording.columns[name], float)).any():
                return f"{name} holds no number"
    return ""


NUMERAL = re.compile(r"[-+]?[\d'.,\u00a0_]*\d[\d'.,\u00a0_]*(?:[eE][-+]?\d+)?|[-+]?[.,]\d+")


def written(content: bytes) -> set[float]:
    """Every number that a text may state: decimal points or commas, in any of the codes that are known."""
    found: set[float] = set()
    for code in ("utf-8-sig", "utf-16", "utf-32", "cp500", "latin-1"):
        for numeral in NUMERAL.findall(content.decode(code, "ignore")):
            for pieces in (
                numeral,
                *re.split("[,'\u00a0]", numeral),
                numeral.replace(",", "."),
                re.sub("[,'\u00a0]", "", numeral),
            ):
                try:
                    found.add(float(pieces))
                except ValueError:
                    continue
    return found


def written_in_workbook(content: bytes) -> set[float]:
    """Every number in the parts of a workbook that can be read, values of cells and shared texts."""
    found: set[float] = set()
    with zipfile.ZipFile(io.BytesIO(content)) as book:
        for name in book.namelist():
            try:
                found |= written(book.read(name)) if name.endswith(".xml") else set()
            except (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError):
                continue
    return found


def invented(found: list, known: set[float]) -> str:
    """A stress that the file states nowhere, in kPa or in a unit that is a power of ten of it."""
    table = np.array(sorted(value for value in known if math.isfinite(value)))
    for recording in found:
        stress = np.asarray(recording.columns["stress_kPa"], float)
        for value in stress[np.isfinite(stress)]:
            factors = value * 10.0 ** np.arange(-6.0, 7.0)
            nearest = table[np.clip(np.searchsorted(table, factors), 1, len(table) - 1)]
            before = table[np.clip(np.searchsorted(table, factors) - 1, 0, len(table) - 1)]
            gap = np.minimum(np.abs(nearest - factors), np.abs(before - factors))
            if not np.any(gap <= 1e-9 * np.abs(factors) + 1e-300):
                return f"a stress of {value!r} kPa is written nowhere"
    return ""


def binaries(rng: np.random.Generator, folder: Path) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A damaged HDF5 or stored file that a command reads back."""
    names = sorted(kinds())
    kind = kinds()[names[int(rng.integers(len(names)))]]
    place = folder / kind.name
    place.write_bytes(binary_mutation(rng, kind.content))
    return lambda: kind.read(place), lambda found: other_numbers(kind, folder, found)


def foreign_binaries(
    rng: np.random.Generator, folder: Path
) -> tuple[Callable[[], object], Callable[[object], str]]:
    """The same without a digest, as other software leaves it: only its structure can show the damage."""
    names = sorted(kinds())
    kind = kinds()[names[int(rng.integers(len(names)))]]
    place = folder / kind.name
    place.write_bytes(binary_mutation(rng, without_seal(kind.content)))
    return lambda: kind.read(place), lambda found: ""


def other_numbers(kind, folder: Path, found: list[np.ndarray]) -> str:
    """What differs from the numbers of the undamaged file."""
    (folder / "whole").mkdir()
    (folder / "whole" / kind.name).write_bytes(kind.content)
    wanted = kind.read(folder / "whole" / kind.name)
    same = len(wanted) == len(found) and all(map(np.array_equal, wanted, found))
    return "" if same else "numbers differ from those of the undamaged file"


SOURCES = {
    "recording": (recordings, 0.30), "table": (tables, 0.22), "raw text": (texts, 0.14),
    "workbook": (workbooks, 0.14), "binary": (binaries, 0.14), "binary without digest": (foreign_binaries, 0.06),
}  # fmt: skip
"""Kinds of files, with the share of the campaign that each has."""
TEXTS = {name: SOURCES[name] for name in ("recording", "table", "raw text", "workbook")}
"""Those that no program has to be compiled for."""


def one(seed: int, sources: dict = SOURCES) -> tuple[str, str]:
    """Outcome of one damaged file, and what to say of it: accepted, refused, or a kind of failure."""
    rng = np.random.default_rng(seed)
    shares = np.array([share for _, share in sources.values()])
    what = list(sources)[int(rng.choice(len(sources), p=shares / shares.sum()))]
    with tempfile.TemporaryDirectory(prefix="fuzz") as place:
        read, wrong = sources[what][0](rng, Path(place))
        signal.signal(signal.SIGALRM, _alarm)
        signal.alarm(SECONDS)
        warned: list[str] = []
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always")
                for ignored in (DeprecationWarning, PendingDeprecationWarning):
                    warnings.simplefilter("ignore", ignored)  # as Python does outside of the main program
                warnings.showwarning = lambda text, kind, file, line, *_: warned.append(
                    f"{file}:{line}: {kind.__name__}: {text}"
                )
                found = read()
            signal.alarm(0)
            said = wrong(found)
            if said:
                return f"{what}: wrong number", said
            return (f"{what}: warning", warned[0]) if warned else (f"{what}: accepted", "")
        except InputError as error:
            line = str(error)
            clear = "\n" not in line and line.strip() and len(line) < 2000
            if not clear:
                return f"{what}: unclear line", line[:300]
            return (f"{what}: warning", warned[0]) if warned else (f"{what}: refused", line)
        except TooLong:
            return f"{what}: too long", ""
        except Exception:
            return f"{what}: traceback", traceback.format_exc(limit=-3)
        finally:
            signal.alarm(0)


def note(counts: Counter, failures: dict[str, list], seed: int, outcome: str, said: str) -> None:
    """Count an outcome; keep it if it is a failure."""
    counts[outcome] += 1
    if not outcome.endswith(GOOD):
        failures.setdefault(outcome, []).append({"seed": seed, "said": said})


def campaign(seeds: Sequence[int], sources: dict = SOURCES) -> tuple[Counter, dict[str, list]]:
    """Counts of outcomes, and each failure.

    Files are read in processes of their own: one that dies or hangs is a failure, and the next goes on behind it.
    """
    counts: Counter = Counter()
    failures: dict[str, list] = {}
    done = 0
    while done < len(seeds):
        words = [sys.executable, __file__, "--child", "--kinds", *sources]
        with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
            outcome = ""
            while done < len(seeds) and outcome != TOO_MUCH:
                child.stdin.write(f"{seeds[done]}\n")
                child.stdin.flush()
                ready, _, _ = select.select([child.stdout], [], [], BEGIN_SECONDS)
                line = child.stdout.readline() if ready else ""
                if not line:
                    child.kill()
                    died = "process died" if ready else "too long"
                    note(counts, failures, seeds[done], f"some file: {died}", f"exit code {child.wait()}")
                    done += 1
                    break
                outcome, said = json.loads(line)
                note(counts, failures, seeds[done], outcome, said)
                done += 1
                if done % 1000 == 0:
                    failed = sum(map(len, failures.values()))
                    print(f"{done} of {len(seeds)}, {failed} failed", flush=True)
    return counts, failures


def child(sources: dict) -> int:
    """Print the outcome of each seed that a line states, as a line; end once memory ran over its limit."""
    if sources.keys() - TEXTS.keys():
        kinds()
    out = sys.stdout
    sys.stdout = sys.stderr  # a library that prints must not disturb the lines
    for line in sys.stdin:
        outcome = one(int(line), sources)
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        if used > MEMORY_GIB:
            outcome = (TOO_MUCH, f"{used:.1f} GiB")
        print(json.dumps(outcome), file=out, flush=True)
        if outcome[0] == TOO_MUCH:
            return 3
    return 0


def main() -> int:
    """Run a campaign, print its table, write it as JSON; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=0, help="of the first file")
    parser.add_argument("--seeds", type=int, nargs="+", help="of single files, instead of --seed and --count")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--kinds", nargs="+", choices=SOURCES, default=list(SOURCES), help="kinds of files")
    given = parser.parse_args()
    sources = {name: SOURCES[name] for name in given.kinds}
    if given.child:
        return child(sources)
    seeds = given.seeds or range(given.seed, given.seed + given.count)
    counts, failures = campaign(seeds, sources)
    for outcome, count in sorted(counts.items()):
        print(f"{outcome:40s} {count:6d}")
    for outcome, examples in failures.items():
        first = examples[0]
        print(f"\n{outcome}: {len(examples)}, the first:\n{first['said']}  (seed {first['seed']})")
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
        stated = given.seeds or [seeds.start, seeds.stop]
        given.out.write_text(
            json.dumps({"seeds": stated, "counts": counts, "failures": failures}, indent=1)
        )
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
