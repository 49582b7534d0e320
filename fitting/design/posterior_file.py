"""A `posterior.nc` of `pneusma posterior`, as draws of what a design study knows."""

import dataclasses
from pathlib import Path

import numpy as np

from fitting.data import hdf5
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy
from pneusma_jax.units import TEMPERATURE_DIFFERENCE, UNITS, to_si

SPRINGS = {field.name for field in dataclasses.fields(Alloy)}
"""Constants of an alloy that springs have."""
WHAT = "the `posterior.nc` of `pneusma posterior`"
_KNOWN = (
    {name: dimension for name, dimension in QUANTITIES["alloy"].items() if name in SPRINGS}
    | {"silicone_stiffness": "number"}
    | QUANTITIES["actuator"]
)


def posterior_caution(path: Path) -> str:
    """What the draws of a `posterior.nc` do not count, in sentences; empty where they count everything.

    Raises:
        InputError: if the file cannot be read.
    """
    with hdf5.opened(path, str(path), WHAT) as file:
        return hdf5.caution_of(file)


def posterior_draws(path: Path, specimen: int | None = None) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Draws of a `posterior.nc` that the model knows, by name [SI], shape (draws,); and the names of others.

    Args:
        path: file.
        specimen: number of the specimen whose own constants count, where the posterior is of several.

    Raises:
        InputError: if the file cannot be read, has nothing that the model knows, or is of several specimens
            and none or an unknown one is named. Also if a draw is not finite.
    """
    try:
        with hdf5.opened(path, str(path), WHAT) as file:
            group = file["posterior"]
            found = {
                n: (np.ravel(d[()]), d.attrs.get("unit", "1")) for n, d in group.items() if np.ndim(d) == 2
            }
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file") from None
    numbers = sorted({int(n.partition("__")[2]) for n in found if n.partition("__")[2].isdecimal()})
    if len(numbers) > 1 and specimen is None:
        raise InputError(f"{path}: it is of several specimens: add posterior_specimen = {numbers[0]}")
    if specimen is not None and specimen not in numbers:
        raise InputError(
            f"{path}: posterior_specimen is {specimen}, known: {', '.join(map(str, numbers)) or 'none'}"
        )
    known: dict[str, np.ndarray] = {}
    others: list[str] = []
    for name, (values, unit) in found.items():
        plain, _, own = name.rpartition(".")[2].partition("__")
        if specimen is not None and own not in ("", str(specimen)):
            continue
        plain = plain if plain in _KNOWN else plain.rpartition("_")[0]
        if plain in known:
            raise InputError(f"{path}: {plain} is there more than once")
        if plain in _KNOWN and unit in UNITS:
            with np.errstate(over="ignore"):  # infinite draws are refused
                known[plain] = to_si(values, unit, _KNOWN[plain] == TEMPERATURE_DIFFERENCE)
            if not np.all(np.isfinite(known[plain])):
                raise InputError(f"{path}: draws of {plain} are not finite")
        else:
            others.append(name)
    if not known:
        raise InputError(
            f"{path}: none of its parameters ({', '.join(found)}) is one of alloy, silicone or design"
        )
    return known, tuple(others)
