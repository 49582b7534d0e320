"""What a diagnosis says of physics that neither the catalogue nor the generator of the blind trial has.

    python -m benchmarks.unknown_physics --out DIR [--only NAME...]

Instruments and specimens err in ways of their own. Pulls of a silicone are made by formulas. To tubes, wires
and springs of the shipped simulator an error of one column is added. A finished campaign is not run again.
The table has, for each, what is named with its probability, the period that is told, and the held-out misfit
without and with it.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.report.diagnosis.payload import content
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax import enable_float64, load_silicone
from validation.examples.pulled_silicone import documents

SEED = 77
STIFFNESS = 1.02


def _stress(strain: np.ndarray) -> np.ndarray:
    """Stress of the silicone [kPa] at a strain [1]."""
    return STIFFNESS * np.asarray(load_silicone("dragon_skin_10_fast")(np.maximum(strain, 0.0))) / 1e3


def _wave(along: np.ndarray, period: float) -> np.ndarray:
    """Sine of a period."""
    return np.sin(2.0 * np.pi * along / period)


def _backlash(strain: np.ndarray, play: float = 0.008) -> np.ndarray:
    """Strain behind a drive with play."""
    behind, found = 0.0, np.empty_like(strain)
    for row, value in enumerate(strain):
        behind = min(max(behind, value - play), value + play)
        found[row] = behind
    return found


def _slip(strain: np.ndarray) -> np.ndarray:
    """Strain after a grip slipped once at 70 kPa."""
    slipped = np.maximum.accumulate(_stress(strain) > 70.0)
    return strain - 0.02 * slipped


def _path(strain: np.ndarray) -> np.ndarray:
    """Length of the path of a strain."""
    return np.concatenate([[0.0], np.cumsum(np.abs(np.diff(strain)))])


Pull = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""Stress [kPa] from time [s] and strain [1], each of shape (rows,)."""
PULLED: dict[str, Pull] = {
    "nothing": lambda t, e: _stress(e),
    "load cell with a quadratic error": lambda t, e: _stress(e) + _stress(e) ** 2 / 2500.0,
    "screw with an error every 0.05 of strain": lambda t, e: _stress(e + 0.004 * _wave(e, 0.05)),
    "hum of 7.3 s": lambda t, e: _stress(e) + 1.2 * _wave(t, 7.3),
    "play in the drive": lambda t, e: _stress(_backlash(e)),
    "grip that slips once": lambda t, e: _stress(_slip(e)),
    "room that warms and cools": lambda t, e: _stress(e) * (1.0 + 0.03 * _wave(t, 140.0)),
    "damage by path": lambda t, e: _stress(e) * np.exp(-0.03 * _path(e)),
    "crack at one moment": lambda t, e: _stress(e) * np.where(t > 0.62 * t[-1], 0.95, 1.0),
    "plateau above a strain of 0.45": lambda t, e: _stress(np.where(e > 0.45, 0.45 + 0.8 * (e - 0.45), e)),
    "friction in proportion to stress": lambda t, e: _stress(e) * (1.0 + 0.03 * np.sign(np.gradient(e, t))),
}
Columns = dict[str, np.ndarray]
Error = Callable[[Columns], np.ndarray | float]
"""What is added to a column, from the columns of a recording, each of shape (rows,)."""
SHOWN: dict[str, tuple[str, int, str, Error]] = {
    "tube: nothing": ("tube", 904, "length_mm", lambda c: 0.0),
    "tube: target that sticks": (
        "tube", 901, "length_mm", lambda c: 0.35 * np.tanh(np.gradient(c["pressure_kPa"]) / 0.1),
    ),
    "tube: perspective of the camera": (
        "tube", 902, "length_mm", lambda c: 0.004 * (c["length_mm"] - 56.0) ** 2,
    ),
    "tube: sway of 5 s": ("tube", 903, "length_mm", lambda c: 0.3 * _wave(c["time_s"], 5.0)),
    "wire: nothing": ("wire", 908, "strain", lambda c: 0.0),
    "wire: fixture that expands": ("wire", 905, "strain", lambda c: 2.5e-5 * (c["temperature_degC"] - 20.0)),
    "wire: grip that slips once": (
        "wire", 907, "strain", lambda c: 1.2e-3 * (np.linspace(0.0, 1.0, len(c["strain"])) > 0.55),
    ),
    "spring: nothing": ("spring", 912, "force_N", lambda c: 0.0),
    "spring: friction of a guide": (
        "spring", 909, "force_N",
        lambda c: 0.02 * np.sign(np.gradient(c["elongation_mm"])) * (1.0 + 0.5 * c["force_N"]),
    ),
    "spring: gain of the load cell that sways": (
        "spring", 911, "force_N", lambda c: 0.02 * c["force_N"] * _wave(c["time_s"], 60.0),
    ),
}  # fmt: skip
"""Kind, seed, a column of every recording, and its error."""


def write_shown(kind: str, seed: int, column: str, error: Error, folder: Path) -> None:
    """Write a simulated campaign whose instruments err."""
    write_synthetic(synthesise(kind, seed=seed), folder, force=True)
    (folder / "truth.json").unlink()
    for path in sorted(folder.glob("*.csv")):
        comment, heading, *rows = path.read_text().rstrip("\n").split("\n")
        names, cells = heading.split(","), [row.split(",") for row in rows]
        columns = {n: np.array([float(row[k]) for row in cells]) for k, n in enumerate(names)}
        columns[column] = columns[column] + error(columns)
        values = [",".join(f"{columns[n][row]:.7g}" for n in names) for row in range(len(cells))]
        path.write_text("\n".join([comment, heading, *values, ""]))


def row_of(name: str, report: dict) -> str:
    """A row of the table."""
    found = ", ".join(f"{e['name']} {e['probability']:.2f}" for e in report["effects"]) or report["verdict"]
    again, fit = report["repeats"], report["fit"]
    period = "" if again is None else f"{again['driver']} {again['period']:.3g}"
    scores = f"{fit['before']['reduced_chi2']:.3g} | {fit['after']['reduced_chi2']:.3g}"
    return f"| {name} | {found} | {period} | {scores} |"


def main() -> None:
    """Write, diagnose and tell all campaigns."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=[])
    args = parser.parse_args()
    enable_float64()
    print("| what acts | named | period | misfit held out, before | after |\n|---|---|---|---|---|")
    for name in [n for n in (*PULLED, *SHOWN) if not args.only or n in args.only]:
        folder = args.out / "".join(x if x.isalnum() else "_" for x in name)
        done = folder.with_name(f"{folder.name}.json")
        if not done.exists():
            folder.mkdir(parents=True, exist_ok=True)
            if name in PULLED:
                for file, text in documents(PULLED[name], SEED).items():
                    (folder / file).write_text(text)
            else:
                write_shown(*SHOWN[name], folder)
            done.write_text(json.dumps(content(diagnose(read_campaign(folder), seed=0)), default=float))
        print(row_of(name, json.loads(done.read_text())), flush=True)


if __name__ == "__main__":
    main()
