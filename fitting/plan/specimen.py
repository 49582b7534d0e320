"""The user's description of the spring and its alloy, from the command line."""

from pathlib import Path
from typing import Any

from fitting.data.recordings.sidecar import read_toml
from fitting.simulate.state import read_geometry
from fitting.specimens.priors import FIT
from pneusma_jax.calibration import available, unknown
from pneusma_jax.errors import InputError, nearest


def described(
    specimen: str | None, geometry: str | Path | None = None
) -> tuple[str | Path | None, dict[str, Any]]:
    """Alloy table and dimensions.

    Args:
        specimen: name or file of an alloy table, or a TOML with `[geometry]`; None for neither.
        geometry: a TOML with `[geometry]` beside an alloy.

    Returns:
        The table (None for uncharacterised nitinol) and canonical keys of `[geometry]`.

    Raises:
        InputError: for a name that is no alloy's, or a file that is neither.
    """
    alloy: str | Path | None = None
    stated: dict[str, Any] = {}
    place = None if geometry is None else Path(geometry)
    if specimen is not None and not (specimen.endswith(".toml") or Path(specimen).exists()):
        names = [*available("alloy"), *unknown()]
        if specimen not in names:
            raise InputError(f"no alloy is called {specimen!r}, {nearest(specimen, names)}")
        alloy = specimen
    elif specimen is not None and read_toml(Path(specimen)).get("kind") == "alloy":
        alloy = Path(specimen)
    elif specimen is not None:
        if place is not None:
            raise InputError(f"{specimen}: dimensions are given twice, here and with --geometry; keep one")
        place = Path(specimen)
    if place is not None:
        stated = read_geometry(place)
        named = stated.pop("alloy", FIT)
        if alloy is None and named != FIT:
            alloy = place.parent / named if str(named).endswith(".toml") else named
    return alloy, stated
