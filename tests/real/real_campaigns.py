"""Other laboratories' recordings as campaigns whose names tell nothing: the tool sees numbers and roles only.

Every case has two folders: `seen` is diagnosed, `unseen` holds what is kept out of it altogether. A pull is split
by leaving its stress empty in some blocks of rows, so that both parts keep the whole course of strain.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fitting.data.importers import import_file, make_options
from fitting.data.recordings import Recording, recordings_folder, write_recording

FOLDERS = ("viscoelastic", "soft_robotics_materials", "tissue_phantoms", "sma_react")
KEPT_OUT = (2, 4, 6)
"""Blocks of a pull, of seven, that nothing is fitted to; the last is an extrapolation to the largest stretch."""
BLOCKS = 7
LOOSE = 0.5
"""Relative 1-sigma of a base modulus that is read off a curve."""


OPEN_WIRE = {
    "T_mid": 1.0, "T_width": 0.5, "eps_L": 0.3, "E_m": 0.25, "E_a": 0.2, "beta_1": 0.3, "beta_2": 0.15, "beta_3": 0.3,
}  # fmt: skip
"""Relative 1-sigma of the constants of a wire of unknown alloy, those of stress-induced martensite left out."""


@dataclass(frozen=True)
class Case:
    """One campaign with what is kept out of it.

    Attributes:
        name: for the table; the tool never sees it.
        seen: recordings that are diagnosed.
        unseen: recordings that are only predicted, at the end.
        table: base law of the material as TOML, or "".
        kind: of the recordings.
    """

    name: str
    seen: list[Recording]
    unseen: list[Recording]
    table: str
    kind: str

    def write(self, folder: Path, seed: int = 0) -> tuple[Path, Path]:
        """Folders of what is seen, and of that with the unseen beside it as validation; names say nothing."""
        folder.mkdir(parents=True, exist_ok=True)
        order = np.random.default_rng(seed).permutation(len(self.seen))
        shuffled = [self.seen[k] for k in order]
        known = {name: f"specimen_{k}" for k, name in enumerate(dict.fromkeys(r.specimen for r in shuffled), 1)}
        for name, members in (("seen", shuffled), ("all", [*shuffled, *self.unseen])):
            place = folder / name
            place.mkdir(exist_ok=True)
            if self.table:
                (place / "base.toml").write_text(self.table)
            for k, recording in enumerate(members):
                hidden = k >= len(shuffled)
                write_recording(_nameless(recording, k, known, place, hidden), place)
        return folder / "seen", folder / "all"


def _nameless(
    recording: Recording, k: int, known: dict[str, str], place: Path, hidden: bool
) -> Recording:
    """A recording without its file's name, laboratory, remarks or unused columns."""
    return replace(
        recording,
        name=f"recording_{k + 1:02d}",
        path=place / "raw.csv",
        specimen=known[recording.specimen],
        role="validation" if hidden else recording.role,
        source={"citation": "withheld from the tool", "licence": "that of the laboratory, see its provenance"},
        columns={name: recording.columns[name] for name in recording.known_columns},
        notices=[],
        comments=[],
    )


def loading_unloading(held_out: str) -> Case:
    """Three stretch rates of one soft polymer, pulled to twice its length and let back; one rate is kept out."""
    recordings = {
        rate: _raw(f"viscoelastic/loading_2d0_unloading_0d{rate}.xlsx") for rate in ("01", "03", "05")
    }
    seen = [r for rate, r in recordings.items() if rate != held_out]
    return _elastic(f"rate 0.{held_out}/s kept out", seen, [recordings[held_out]])


def tension(file: str, longest: float = np.inf) -> Case:
    """One pull of a silicone to failure, or to a largest strain; three of seven blocks are kept out."""
    whole = _raw(f"soft_robotics_materials/{file}.csv")
    there = whole.columns["strain"] <= longest
    whole.columns = {name: values[there] for name, values in whole.columns.items()}
    block = np.minimum(np.arange(len(whole)) * BLOCKS // len(whole), BLOCKS - 1)
    out = np.isin(block, KEPT_OUT)
    label = f"{file.removesuffix(' MEDIUM')} to {100 * whole.columns['strain'].max():.0f} %"
    return _elastic(label, [_without(whole, out)], [_without(whole, ~out)])


def two_laboratories() -> Case:
    """A silicone of one name, pulled in one laboratory and pressed in another; repeats are kept out.

    One law is shared; each specimen's stiffness may differ as batches do, five per cent.
    """
    pulled = _raw("soft_robotics_materials/Ecoflex 00-30.csv")
    there = pulled.columns["strain"] <= 1.0
    pulled.columns = {name: values[there] for name, values in pulled.columns.items()}
    pressed = {k: _raw(f"tissue_phantoms/EF30_0T/EF30_0T_{k}.csv") for k in ("A1", "A3", "B2", "A5", "B4")}
    for recording in pressed.values():
        kept = recording.columns["strain"] >= -0.5
        recording.columns = {
            name: values[kept][::4] for name, values in recording.columns.items() if name != "time_s"
        }
    seen = [pulled, *(pressed[k] for k in ("A1", "A3", "B2"))]
    case = _elastic("tension and compression", seen, [pressed["A5"], pressed["B4"]], batch=0.05)
    return case


def thermal_cycles(held_out: int, stress_induced: bool = False) -> Case:
    """A wire cooled and heated under four stresses; one stress is kept out.

    Args:
        held_out: stress that is kept out [MPa].
        stress_induced: identify the whole alloy. Its curve of stress-induced martensite then imitates a shift by
            stress; where it is that of the table, the base is blind to stress in these tests, as it should be.
    """
    cycles = {load: _raw(f"sma_react/cal_sample_1/{load} MPa.txt") for load in (7, 50, 150, 200)}
    for recording in cycles.values():
        recording.geometry = {"alloy": "fit" if stress_induced else "niti_wire"}
        recording.tolerance = None if stress_induced else OPEN_WIRE
    seen = [r for load, r in cycles.items() if load != held_out]
    return Case(f"{held_out} MPa kept out", seen, [cycles[held_out]], "", "wire")


def available() -> bool:
    """Whether the laboratories' files are here."""
    folder = recordings_folder()
    return folder is not None and all((folder / name).is_dir() for name in FOLDERS)


def _raw(name: str) -> Recording:
    return import_file(recordings_folder() / name, make_options())


def _without(recording: Recording, out: np.ndarray) -> Recording:
    """The same course of strain, the stress empty where `out`."""
    stress = np.where(out, np.nan, recording.columns["stress_kPa"])
    return replace(recording, columns=recording.columns | {"stress_kPa": stress})


def _elastic(
    name: str, seen: list[Recording], unseen: list[Recording], batch: float | None = None
) -> Case:
    """A neo-Hookean base whose modulus is read off the first half of strain of what is seen."""
    modulus = _first_modulus(seen)
    tolerance = {"mu": LOOSE} | ({"silicone_stiffness": batch} if batch else {})
    geometry = {"material": "base.toml", "law": "neo_hookean"}
    dressed = [replace(r, geometry=geometry, tolerance=tolerance) for r in (*seen, *unseen)]
    return Case(name, dressed[: len(seen)], dressed[len(seen) :], _table(modulus), "elastomer")


def _first_modulus(recordings: Iterable[Recording]) -> float:
    """Shear modulus [kPa] that fits the stress up to half a strain best."""
    above = below = 0.0
    for recording in recordings:
        stretch, stress = 1.0 + recording.columns["strain"], recording.columns["stress_kPa"]
        there = np.isfinite(stress) & (np.abs(stretch - 1.0) <= 0.5)
        shape = stretch[there] - stretch[there] ** -2
        above, below = above + float(shape @ stress[there]), below + float(shape @ shape)
    return above / below


def _table(modulus: float) -> str:
    assumed = 'status = "assumed", source = "read off the first half of strain"'
    return (
        'schema = "pneusma-calibration/1"\nname = "base"\nkind = "silicone"\nlaw = "neo_hookean"\n'
        'description = "a soft solid"\ncitation = "none"\n'
        f'mu = {{value = {modulus:.3f}, unit = "kPa", {assumed}}}\n'
        'density = {value = 1000.0, unit = "kg/m3", status = "assumed", source = "not used"}\n'
    )
