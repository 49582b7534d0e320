"""Damaged files by the thousand: each is read rightly, or refused in one clear line.

    python tests/reliability/fuzz.py --count 20000 --seed 1 --out out/fuzz.json

An independent reader of plain CSV and TOML checks every file that is accepted: a number that differs is a silent
wrong number. A traceback, a reading of more than ten seconds, or more than 4 GiB of memory is a failure, too.
"""

import argparse
import csv
import io
import json
import math
import resource
import signal
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

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
    rows = [row for row in csv.reader(io.StringIO("\n".join(lines))) if row]
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


def raw_files(rng: np.random.Generator, folder: Path) -> tuple[Callable[[], object], Callable[[object], str]]:
    """A damaged file of a laboratory: text or a workbook."""
    if rng.random() < 0.15:
        content, name = workbook(rng), "raw.xlsx"
        if rng.random() < 0.7:
            content = workbook_mutation(rng, content)
    else:
        head = "Sample: A\nTime (s),Strain (%),Stress (kPa)\n"
        rows = "".join(f"{0.5 * k},{2.0 * k},{3.0 * k + 0.01 * k**2:.3f}\n" for k in range(30))
        content, name = text_mutation(rng, (head + rows).encode()), "raw.csv"
    (folder / name).write_bytes(content)
    return lambda: import_tests(folder / name, make_options(kind="elastomer")), finite_recordings


def finite_recordings(found: list) -> str:
    """What is wrong with imported recordings: a canonical column that holds no finite number at all."""
    for recording in found:
        for name in ("strain", "stress_kPa"):
            if not np.isfinite(np.asarray(recording.columns[name], float)).any():
                return f"{name} holds no number"
    return ""


def one(seed: int) -> tuple[str, str]:
    """Outcome of one damaged file, and what to say of it: accepted, refused, or a kind of failure."""
    rng = np.random.default_rng(seed)
    sources = {"recording": recordings, "table": tables, "raw file": raw_files}
    what = ("recording", "table", "raw file")[int(rng.choice(3, p=(0.45, 0.3, 0.25)))]
    with tempfile.TemporaryDirectory(prefix="fuzz") as place:
        read, wrong = sources[what](rng, Path(place))
        signal.signal(signal.SIGALRM, _alarm)
        signal.alarm(SECONDS)
        try:
            found = read()
            signal.alarm(0)
            said = wrong(found)
            return (f"{what}: wrong number", said) if said else (f"{what}: accepted", "")
        except InputError as error:
            line = str(error)
            clear = "\n" not in line and line.strip() and len(line) < 2000
            return (f"{what}: refused", line) if clear else (f"{what}: unclear line", line[:300])
        except TooLong:
            return f"{what}: too long", ""
        except Exception:
            return f"{what}: traceback", traceback.format_exc(limit=-3)
        finally:
            signal.alarm(0)


GOOD = ("accepted", "refused")


def campaign(seeds: range) -> tuple[Counter, dict[str, list]]:
    """Counts of outcomes, and the first examples of each failure."""
    counts: Counter = Counter()
    failures: dict[str, list] = {}
    for seed in seeds:
        outcome, said = one(seed)
        counts[outcome] += 1
        if not outcome.endswith(GOOD):
            failures.setdefault(outcome, []).append({"seed": seed, "said": said})
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    if used > MEMORY_GIB:
        failures["memory"] = [{"seed": seeds.start, "said": f"{used:.1f} GiB"}]
    return counts, failures


def main() -> int:
    """Run a campaign, print its table, write it as JSON; 1 if anything failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20000)
    parser.add_argument("--seed", type=int, default=0, help="of the first file")
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    counts, failures = campaign(range(given.seed, given.seed + given.count))
    for outcome, count in sorted(counts.items()):
        print(f"{outcome:28s} {count:6d}")
    for outcome, examples in failures.items():
        print(
            f"\n{outcome}: {len(examples)}, the first:\n{examples[0]['said']}  (seed {examples[0]['seed']})"
        )
    if given.out:
        given.out.parent.mkdir(parents=True, exist_ok=True)
        given.out.write_text(json.dumps({"counts": counts, "failures": failures}, indent=1))
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
