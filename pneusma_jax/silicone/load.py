"""Silicone laws from calibration tables."""

from pathlib import Path

import numpy as np

from ..calibration import Calibration, load_calibration
from .laws import Gent, NeoHookean, Ogden, SiliconeLaw, Yeoh
from .polynomial import PolynomialFit
from .regularised import RegularisedSilicone


def _numbered(values: dict[str, float], stem: str) -> np.ndarray:
    """Values `stem_1, stem_2, ...` in order."""
    names = sorted(
        (n for n in values if n.startswith(stem + "_") and n[len(stem) + 1 :].isdigit()), key=_index
    )
    return np.asarray([values[name] for name in names])


def _index(name: str) -> int:
    return int(name.rsplit("_", 1)[1])


def _regularised(table: Calibration) -> RegularisedSilicone:
    values = table.values()
    return RegularisedSilicone(
        tension=_numbered(table.table("standard_tension"), "p"),
        compression=_numbered(table.table("needle_buckling"), "p"),
        half_width=values["blend_half_width"],
        lower=values["clip_min"],
        upper=values["clip_max"],
        least_slope=values["minimum_slope"],
        stiffness=values.get("silicone_stiffness", 1.0),
    )


def _polynomial(table: Calibration) -> PolynomialFit:
    values = table.values()
    table.require(["p_1", "p_2"])
    low, high = values.get("strain_min", -np.inf), values.get("strain_max", np.inf)
    return PolynomialFit(_stiffness(table) * _numbered(values, "p"), low, high)


def _stiffness(table: Calibration) -> float:
    """Factor on the stress; every law here is linear in its moduli."""
    return table.values().get("silicone_stiffness", 1.0)


_BUILDERS = {
    "regularised": _regularised,
    "polynomial": _polynomial,
    "neo_hookean": lambda t: NeoHookean(_stiffness(t) * t.values()["mu"]),
    "yeoh": lambda t: Yeoh(*(_stiffness(t) * t.values()[key] for key in ("c_10", "c_20", "c_30"))),
    "gent": lambda t: Gent(_stiffness(t) * t.values()["mu"], t.values()["j_m"]),
    "ogden": lambda t: Ogden(_stiffness(t) * _numbered(t.values(), "mu"), _numbered(t.values(), "alpha")),
}


def load_silicone(
    name_or_path: str | Path | Calibration = "dragon_skin_10_fast", law: str | None = None
) -> SiliconeLaw:
    """Silicone law by the name of a shipped table, from a TOML file, or from a loaded table.

    Args:
        name_or_path: name such as `"dragon_skin_10_fast"`, or a `material.toml` that a fit has written. Its
            `silicone_stiffness`, where it has one, multiplies the stress of any law.
        law: name of another law of the table; the table's own by default.

    Raises:
        InputError: if there is no such table, or it lacks a number of the law.
    """
    table = load_calibration(name_or_path, kind="silicone")
    law = law or table.text.get("law", "regularised")
    if law not in _BUILDERS:
        raise ValueError(f"Argument `law` must be one of {sorted(_BUILDERS)}, but it is {law!r}.")
    try:
        return _BUILDERS[law](table)  # type: ignore[return-value]
    except KeyError as missing:
        table.require([missing.args[0]])
        raise


def load_silicone_test(test: str, name_or_path: str | Path = "dragon_skin_10_fast") -> PolynomialFit:
    """One of the five mechanical tests of Table 3.1.

    Args:
        test: name of the test: `"standard_tension"`, `"bulk_compression"`, `"tube_tension"`,
            `"tube_buckling"` or `"needle_buckling"`.
        name_or_path: name or path of the table.
    """
    table = load_calibration(name_or_path, kind="silicone")
    values = table.table(test)
    if not values:
        tests = sorted({name.split(".")[0] for name in table.values() if "." in name})
        raise ValueError(f"Argument `test` must be one of {tests}, but it is {test!r}.")
    return PolynomialFit(_numbered(values, "p"), values["strain_min"], values["strain_max"])
