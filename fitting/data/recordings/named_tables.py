"""Tables of an alloy or a material that a recording names."""

import functools
from pathlib import Path

from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.plausible import questions
from pneusma_jax.errors import InputError

from .questions import ask
from .recording import Recording
from .sidecar import place_of_word
from .table import unusable


def check_table_names(recording: Recording, where: Path | str) -> None:
    """Check that the alloy or material of a sidecar exists, and ask about its unusual constants.

    Nominal ones ship with the package.
    """
    for key, kind in (("alloy", "alloy"), ("material", "silicone")):
        if recording.geometry.get(key, "fit") != "fit":
            named = recording.table(key)
            try:
                table = load_named(named, kind)
            except InputError as error:
                raise unusable(where, f"{place_of_word(key, where)}: {error}") from None
            for why in questions(table.quantities):
                ask(recording, f"check: {key} {named}: {why}")
            if key == "alloy" and recording.kind == "actuator":
                _say_prestrain(recording, table)


ON_A_STAND = "of springs on a stand, pre-strain"
"""Words before the pre-strains of springs with which the description of their alloy's table ends."""


def _say_prestrain(recording: Recording, alloy: Calibration) -> None:
    """Say that springs of an actuator begin at another pre-strain than those that the alloy is known from.

    Nothing is said where the recording states its own.
    """
    begun = alloy.description.partition(f"{ON_A_STAND} ")[2]
    own = recording.full_geometry().get("prestrain")
    if not begun or "prestrain" in recording.geometry or own is None or f"{own:g}" == begun:
        return
    name = recording.geometry["alloy"]
    said = f"the alloy {name} was found with springs on a stand that began at a pre-strain of {begun}"
    here = f"in this actuator springs begin at {own:g} (prestrain under [geometry] states another)"
    ask(recording, f"{said}; {here}")


def load_named(name_or_path: str | Path, kind: str) -> Calibration:
    """A table from a file, or one of the shipped ones by its name, which is read once."""
    if isinstance(name_or_path, Path):
        return load_calibration(name_or_path, kind)  # a file of the laboratory may change at any time
    return _load_shipped(name_or_path, kind)


@functools.cache
def _load_shipped(name: str, kind: str) -> Calibration:
    return load_calibration(name, kind)
