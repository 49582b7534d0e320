"""Registry of simulated campaigns by kind, and their writing: recordings, title and truth, all or nothing."""

import dataclasses
import functools
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import tomlkit

from fitting.data.publish import check_free, is_own, publish
from fitting.data.recordings.writing import recording_texts
from fitting.specimens import SPECIMENS, Specimen
from fitting.specimens.actuator import BendingActuator
from fitting.specimens.elastomer import Coupon
from fitting.specimens.spring import SpringOnStand
from fitting.specimens.tube import Tube
from fitting.specimens.wire import StraightWire
from pneusma_jax.errors import InputError, nearest

from . import elastomer
from .actuator import synthesise_actuator
from .instruments import Instruments, random_walk
from .spring import synthesise_spring
from .tube import synthesise_tube
from .wire import synthesise_wire
from .wishes import SPREADS, Synthetic, Wishes, stream

TRUTH_FILE = "truth.json"
SCHEMA = "pneusma-truth/1"
MOST_TESTS = 30


def synthesise_elastomer(wishes: Wishes) -> Synthetic:
    """Simulate pulls of a silicone coupon by the pattern of `fitting.synthesise.elastomer`.

    `truth` may set `mu_1`, `mu_2` [kPa], `alpha_1`, `alpha_2` of Ogden's law. The tolerance is that of
    `silicone_stiffness`, between specimens.

    Raises:
        InputError: for impossible wishes.
    """
    nominal = {f"mu_{k}": value / 1e3 for k, value in enumerate(elastomer.TRUTH["mu"], 1)}
    nominal |= {f"alpha_{k}": value for k, value in enumerate(elastomer.TRUTH["alpha"], 1)}
    for name in wishes.truth:
        if name not in nominal:
            raise InputError(f"--truth {name}: this campaign has no such number, {nearest(name, nominal)}")
    true = {**nominal, **wishes.truth}
    law = dataclasses.replace(
        elastomer.true_law(),
        mu=np.array([1e3 * true["mu_1"], 1e3 * true["mu_2"]]),
        alpha=np.array([true["alpha_1"], true["alpha_2"]]),
    )
    bench = Instruments.of("elastomer", wishes, {"stress_kPa": elastomer.NOISE / 1e3})
    batch = 0.0 if wishes.spread == "none" else wishes.tolerance.get("silicone_stiffness", elastomer.BATCH)
    fitted, check = elastomer.PULLS[:-1], elastomer.PULLS[-1]
    pulls = (*fitted[: wishes.tests], check)
    memory = elastomer.MEMORY
    if wishes.noise_time_s > 0.0:
        rate, stretch = pulls[0].rate, pulls[0].stretch
        memory = float(np.exp(-(stretch - 1.0) / rate / (elastomer.SAMPLES - 1) / wishes.noise_time_s))
    recordings, factors = elastomer.simulate_pulls(
        law, pulls, wishes.seed, 1e3 * bench.noise["stress_kPa"], memory, batch
    )
    for recording in recordings if wishes.drift > 0.0 else ():
        stress, time = recording.columns["stress_kPa"], recording.columns["time_s"]
        zero = random_walk(stream(wishes.seed, "drift", recording.name), time)
        read = stress + wishes.drift * bench.noise["stress_kPa"] * zero
        recording.columns["stress_kPa"] = np.round(read, 4)
    units = {name: "kPa" if name.startswith("mu") else "1" for name in nominal}
    record = {
        "law": "ogden",
        "parameters": {n: {"value": true[n], "nominal": nominal[n], "unit": units[n]} for n in nominal},
        "specimens": {
            name: {"silicone_stiffness": {"value": float(f), "nominal": 1.0}} for name, f in factors.items()
        },
    }
    return Synthetic("Simulated pulls of a stiffening silicone", recordings, record)


OPTIONS = {"ambient_degC": "--ambient", "interval_s": "--interval"}


@dataclasses.dataclass(frozen=True)
class Maker:
    """Maker of the campaigns of one kind.

    Attributes:
        make: function from the user's wishes to the campaign.
        takes: wishes of `CHOSEN` that apply to it.
    """

    make: Callable[[Wishes], Synthetic]
    takes: tuple[str, ...] = ()


CHOSEN = ("alloy", "design", "ambient_degC", "interval_s")
"""Wishes that not every kind takes."""


@functools.singledispatch
def maker_of(specimen: Specimen) -> Maker | None:
    """Maker of a specimen's campaigns; None if none is registered."""
    return None


@maker_of.register
def _(specimen: SpringOnStand) -> Maker:
    return Maker(synthesise_spring, ("alloy", "ambient_degC", "interval_s"))


@maker_of.register
def _(specimen: StraightWire) -> Maker:
    return Maker(synthesise_wire, ("alloy", "interval_s"))


@maker_of.register
def _(specimen: Coupon) -> Maker:
    return Maker(synthesise_elastomer)


@maker_of.register
def _(specimen: Tube) -> Maker:
    return Maker(synthesise_tube, ("interval_s",))


@maker_of.register
def _(specimen: BendingActuator) -> Maker:
    return Maker(synthesise_actuator, CHOSEN)


def makers() -> dict[str, Maker]:
    """Every kind whose campaigns can be simulated."""
    found = {kind: maker_of(specimen) for kind, specimen in SPECIMENS.items()}
    return {kind: maker for kind, maker in found.items() if maker is not None}


def synthesise(kind: str, **wishes: object) -> Synthetic:
    """Simulate a campaign with a known truth, labelled `real = false`.

    Args:
        kind: `spring`, `wire`, `elastomer`, `tube`, `actuator`, or another registered one.
        **wishes: fields of `Wishes`, such as `seed=1, truth={"G_m": 3.2}`.

    Returns:
        Recordings (`.campaign` for the fitting functions) and the truth.

    Raises:
        InputError: for an unknown kind or impossible wishes; names the nearest.
        RuntimeError: if float64 is off.
    """
    known = makers()
    if kind not in known:
        raise InputError(f"no campaign of kind {kind!r} can be simulated, {nearest(kind, known)}")
    asked = Wishes(**wishes)
    _check(asked)
    for name in CHOSEN:
        if name not in known[kind].takes and getattr(asked, name) is not None:
            option, takers = OPTIONS.get(name, f"--{name}"), [k for k, m in known.items() if name in m.takes]
            raise InputError(f"{option} means nothing for kind {kind}, only for {', '.join(takers)}")
    made = known[kind].make(asked)
    how = f"`pneusma synthesise {kind}`" + (f", seed {asked.seed}" if asked.reveal else "")
    for recording in made.recordings:
        if not recording.source or not asked.reveal:
            recording.source = {"citation": f"simulated by {how}; not a measurement"}
        recording.comments = ["simulated, not measured"]
    head = {"schema": SCHEMA, "simulated": True, "kind": kind, "seed": asked.seed, "spread": asked.spread}
    tail = {"noise_time_s": asked.noise_time_s, "drift": asked.drift}
    return dataclasses.replace(made, truth={**head, **made.truth, **tail})


def _check(wishes: Wishes) -> None:
    """Refuse meaningless numbers."""
    if wishes.spread not in SPREADS:
        raise InputError(f"--spread {wishes.spread}: no such spread, {nearest(wishes.spread, SPREADS)}")
    if wishes.seed < 0:
        raise InputError(f"--seed {wishes.seed}: must be 0 or more")
    if wishes.tests is not None and not 1 <= wishes.tests <= MOST_TESTS:
        raise InputError(f"--tests {wishes.tests}: must be 1 to {MOST_TESTS}")
    if wishes.interval_s is not None and not 0.0 < wishes.interval_s < np.inf:
        raise InputError(f"--interval {wishes.interval_s:g}: seconds between samples must be more than 0")
    for option, value in (("--noise-time", wishes.noise_time_s), ("--drift", wishes.drift)):
        if not 0.0 <= value < np.inf:
            raise InputError(f"{option} {value:g}: must be 0 or more")
    for option, table in (("--noise", wishes.noise), ("--tolerance", wishes.tolerance)):
        for name, value in table.items():
            if not 0.0 <= value < np.inf:
                raise InputError(f"{option} {name}={value:g}: must be 0 or more")
    for name, value in wishes.truth.items():
        if not np.isfinite(value):
            raise InputError(f"--truth {name}={value:g}: must be a number")


def write_synthetic(
    made: Synthetic, folder: str | Path, reveal: bool = True, force: bool = False
) -> list[Path]:
    """Write a campaign's recordings, `campaign.toml` and, unless it is hidden, `truth.json`.

    Args:
        made: simulated campaign.
        folder: folder to write to, made if it does not exist.
        reveal: true to write the truth too.
        force: true to replace existing files.

    Returns:
        Paths of the files.

    Raises:
        InputError: if the folder holds anything and `force` is off, or recordings of another campaign.
    """
    folder = check_folder(folder, force)
    present = sorted(p.name for p in folder.iterdir()) if folder.is_dir() else []
    ours = {f"{r.name}{ending}" for r in made.recordings for ending in (".csv", ".toml")}
    strange = [name for name in present if name.endswith(".csv") and name not in ours]
    if strange:
        raise InputError(f"{folder}: {strange[0]} is of another campaign; choose another --out")
    return publish(folder, lambda: _documents(made, folder, reveal), force)


def check_folder(folder: str | Path, force: bool) -> Path:
    """Refuse a folder that cannot take a campaign, before any computation.

    Raises:
        InputError: if it is a file, holds anything and `force` is off, or cannot be written.
    """
    folder = check_free(folder, force)
    if folder.is_dir() and any(folder.iterdir()) and not force and not is_own(folder):
        raise InputError(
            f"{folder}: this folder is not empty; choose another --out, or replace files with --force"
        )
    return folder


def _documents(made: Synthetic, folder: Path, reveal: bool) -> dict[str, bytes | str]:
    """Content of every file by name."""
    documents: dict[str, bytes | str] = {
        file.name: text
        for recording in made.recordings
        for file, text in recording_texts(recording, folder).items()
    }
    documents["campaign.toml"] = tomlkit.dumps({"title": made.title})
    if reveal:
        documents[TRUTH_FILE] = json.dumps(made.truth, indent=1) + "\n"
    return documents
