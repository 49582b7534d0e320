"""Unit names, their factors to SI, and the unit suffix of a column name.

Units are converted where files are read and figures drawn, nowhere else. Values inside are SI, with one
exception: **temperatures stay in degC**, because every published constant of the model is in degC.
Differences of temperature are in K, which is the same size.
"""

import difflib
from typing import NamedTuple

from .errors import InputError, nearest


class Unit(NamedTuple):
    """Meaning of a unit's name: `internal = factor * value + offset`.

    Attributes:
        dimension: the kind of quantity, a key of `INTERNAL_UNITS`.
        factor: size of the unit in the internal unit of its dimension.
        offset: internal value of zero in this unit; only temperatures have one.
    """

    dimension: str
    factor: float
    offset: float = 0.0


TEMPERATURE = "temperature"
TEMPERATURE_DIFFERENCE = "temperature difference"

# The unit that values of a dimension have inside the package.
INTERNAL_UNITS = {
    "number": "1",
    "length": "m",
    "area": "m2",
    "time": "s",
    "rate": "1/s",
    "speed": "m/s",
    "acceleration": "m/s2",
    "mass": "kg",
    "density": "kg/m3",
    "force": "N",
    "pressure": "Pa",
    "stiffness": "N/m",
    "moment": "N m",
    "angle": "rad",
    "curvature": "1/m",
    "current": "A",
    "voltage": "V",
    "power": "W",
    "resistance": "ohm",
    "resistance per length": "ohm/m",
    TEMPERATURE: "degC",
    TEMPERATURE_DIFFERENCE: "K",
    "heat capacity": "J/(kg K)",
    "heat transfer coefficient": "W/(m2 K)",
    "number per temperature": "1/K",
    "pressure per temperature": "Pa/K",
    "number per pressure": "1/Pa",
    "force rate": "N/s",
    "pressure rate": "Pa/s",
    "temperature rate": "K/s",
    "length per force": "m/N",
    "moment per angle": "N m/rad",
    "moment per pressure": "N m/Pa",
    "temperature per pressure": "K/Pa",
}

_INCH, _POUND, _DEGREE, _GRAVITY = 0.0254, 4.4482216152605, 0.017453292519943295, 9.80665
_PSI = _POUND / _INCH**2


def _table() -> dict[str, Unit]:
    groups: dict[str, dict[str, float]] = {
        "number": {
            "1": 1.0, "%": 1e-2, "percent": 1e-2, "strain": 1.0, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0,
            "permille": 1e-3, "millistrain": 1e-3, "microstrain": 1e-6,
        },
        "length": {
            "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": _INCH, "ft": 12.0 * _INCH,
            "mil": 1e-3 * _INCH,
        },
        "area": {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6, "in2": _INCH**2},
        "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0, "h": 3600.0},
        "rate": {"1/s": 1.0, "1/min": 1.0 / 60.0, "Hz": 1.0},
        "speed": {"m/s": 1.0, "mm/s": 1e-3, "mm/min": 1e-3 / 60.0, "in/min": _INCH / 60.0},
        "acceleration": {"m/s2": 1.0, "mm/s2": 1e-3},
        "mass": {"kg": 1.0, "g": 1e-3, "mg": 1e-6},
        "density": {"kg/m3": 1.0, "g/cm3": 1e3},
        "force": {
            "N": 1.0, "uN": 1e-6, "mN": 1e-3, "cN": 1e-2, "daN": 10.0, "kN": 1e3, "dyn": 1e-5,
            "lbf": _POUND, "ozf": _POUND / 16.0, "kip": 1e3 * _POUND, "gf": 1e-3 * _GRAVITY,
            "kgf": _GRAVITY, "mgf": 1e-6 * _GRAVITY,
        },
        "pressure": {
            "Pa": 1.0, "hPa": 1e2, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "mbar": 1e2, "bar": 1e5,
            "N/mm2": 1e6, "psi": _PSI, "ksi": 1e3 * _PSI, "mmHg": 133.322387415, "atm": 101325.0,
            "N/m2": 1.0, "N/cm2": 1e4, "kN/m2": 1e3, "MN/m2": 1e6, "dyn/cm2": 0.1, "lbf/in2": _PSI,
            "gf/cm2": 10.0 * _GRAVITY, "gf/mm2": 1e3 * _GRAVITY,
            "kgf/cm2": 1e4 * _GRAVITY, "kgf/mm2": 1e6 * _GRAVITY, "torr": 101325.0 / 760.0,
            "inHg": 3386.388640341, "mmH2O": _GRAVITY, "cmH2O": 10.0 * _GRAVITY, "inH2O": 25.4 * _GRAVITY,
            "mH2O": 1e3 * _GRAVITY,
        },
        "stiffness": {"N/m": 1.0, "N/mm": 1e3, "mN/mm": 1.0, "lbf/in": _POUND / _INCH},
        "moment": {"N m": 1.0, "N mm": 1e-3},
        "angle": {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE},
        "curvature": {
            "1/m": 1.0, "1/cm": 1e2, "1/mm": 1e3, "1/in": 1.0 / _INCH, "1/ft": 1.0 / (12.0 * _INCH),
        },
        "current": {"A": 1.0, "mA": 1e-3, "uA": 1e-6},
        "voltage": {"V": 1.0, "mV": 1e-3, "uV": 1e-6},
        "power": {"W": 1.0, "mW": 1e-3},
        "resistance": {"ohm": 1.0, "mohm": 1e-3, "kohm": 1e3},
        "resistance per length": {"ohm/m": 1.0, "ohm/cm": 1e2, "mohm/mm": 1.0},
        "heat capacity": {"J/(kg K)": 1.0, "J/(g K)": 1e3, "kJ/(kg K)": 1e3},
        "heat transfer coefficient": {"W/(m2 K)": 1.0},
        "number per temperature": {"1/K": 1.0},
        "pressure per temperature": {"Pa/K": 1.0, "MPa/K": 1e6},
        "number per pressure": {"1/Pa": 1.0, "1/kPa": 1e-3, "1/MPa": 1e-6},
        "force rate": {"N/s": 1.0, "mN/s": 1e-3},
        "pressure rate": {"Pa/s": 1.0, "kPa/s": 1e3},
        "temperature rate": {"K/s": 1.0, "K/min": 1.0 / 60.0},
        "length per force": {"m/N": 1.0, "mm/N": 1e-3},
        "moment per angle": {"N m/rad": 1.0, "N mm/rad": 1e-3},
        "moment per pressure": {"N m/Pa": 1.0},
        "temperature per pressure": {"K/Pa": 1.0, "K/MPa": 1e-6},
    }  # fmt: skip
    units = {name: Unit(kind, factor) for kind, group in groups.items() for name, factor in group.items()}
    units["degC"] = Unit(TEMPERATURE, 1.0)
    units["K"] = Unit(TEMPERATURE, 1.0, -273.15)
    units["degF"] = Unit(TEMPERATURE, 5.0 / 9.0, -160.0 / 9.0)
    # A column name has no slash: `curvature_1pcm`, `stiffness_Npmm`. Both spellings are accepted everywhere.
    spoken = {name.replace("/", "p"): unit for name, unit in units.items() if "/" in name and "(" not in name}
    clash = spoken.keys() & units.keys()
    if clash:
        raise ValueError(f"Spellings of units without a slash must be unique, but {sorted(clash)} are not.")
    return units | spoken


UNITS = _table()
_WITH_SLASH = {name.replace("/", "p"): name for name in UNITS if "/" in name and "(" not in name}

# Names that people write out, for suggestions only: difflib cannot see that `celsius` is near `degC`.
_WRITTEN_OUT = {
    "c": "degC", "celsius": "degC", "f": "degF", "fahrenheit": "degF", "kelvin": "K", "degree": "deg",
    "radian": "rad", "newton": "N", "pascal": "Pa", "volt": "V", "amp": "A", "ampere": "A", "sec": "s",
    "second": "s", "minute": "min", "hour": "h", "gram": "g", "inch": "in", "metre": "m", "meter": "m",
    "seconds": "s", "millisecond": "ms", "millimetre": "mm", "millimeter": "mm", "centimetre": "cm",
    "centimeter": "cm", "micrometer": "um", "kilopascal": "kPa", "megapascal": "MPa", "millinewton": "mN",
    "foot": "ft", "feet": "ft", "pound": "lbf", "psig": "psi", "barg": "bar",
}  # fmt: skip

# Words that end a column's name without being its unit: `max_strain` is a strain, not a "max" in strains.
_DIMENSIONLESS_ENDINGS = ("strain", "cycle")


def find_unit(name: str) -> Unit:
    """Look a unit up.

    Args:
        name: a unit name such as `"kPa"`, `"1/m"` or `"1pm"`; upper and lower case matter.

    Returns:
        Its dimension, factor and offset.

    Raises:
        InputError: if there is no such unit; the message names the nearest known one.
    """
    try:
        return UNITS[name]
    except (KeyError, TypeError):
        raise InputError(f"unknown unit {name!r}, {suggested_unit(str(name))}") from None


def dimension_of(name: str) -> str:
    """Dimension of a unit, in words (`"length"`, `"pressure"`, ...).

    Raises:
        InputError: if there is no such unit.
    """
    return find_unit(name).dimension


def to_si(value, unit: str, difference: bool = False):
    """Convert to the internal unit of the dimension: SI, and degC for temperatures.

    Args:
        value: number or array in `unit`; anything with `*` and `+`.
        unit: name of its unit.
        difference: the value is a difference or a spread (a standard deviation, a width), so that zero stays
            zero; this only matters for temperatures.

    Returns:
        The value in the internal unit, of the same shape.

    Raises:
        InputError: if there is no such unit.
    """
    _, factor, offset = find_unit(unit)
    scaled = value * factor
    return scaled if difference or offset == 0.0 else scaled + offset


def from_si(value, unit: str, difference: bool = False):
    """Convert from the internal unit of the dimension; the inverse of `to_si`.

    Args:
        value: number or array in the internal unit.
        unit: name of the unit wanted.
        difference: same as in `to_si`.

    Returns:
        The value in `unit`, of the same shape.

    Raises:
        InputError: if there is no such unit.
    """
    _, factor, offset = find_unit(unit)
    shifted = value if difference or offset == 0.0 else value - offset
    return shifted / factor


def is_difference(unit: str) -> bool:
    """True for the unit in which a constant is a difference of temperatures: K, as of `T_width`.

    A difference has no zero to be shifted. A constant that is a temperature is in degC.
    """
    return unit == INTERNAL_UNITS[TEMPERATURE_DIFFERENCE]


def constant_to_si(value, unit: str):
    """Convert a constant to the internal unit; as `to_si`, but a constant in K is a difference."""
    return to_si(value, unit, is_difference(unit))


def constant_from_si(value, unit: str):
    """Convert a constant from the internal unit; the inverse of `constant_to_si`."""
    return from_si(value, unit, is_difference(unit))


def written(unit: str) -> str:
    """A unit as people write it: `1/m` for `1pm`, which is its spelling in the names of columns."""
    return _WITH_SLASH.get(unit, unit)


def amount(number: str, unit: str) -> str:
    """A number as text with its unit behind it; a plain number (`1`) and a word have none.

    Args:
        number: number, or several of them, as text.
        unit: name of the unit; `1` or nothing for a plain number.
    """
    return number if unit in ("1", "") else f"{number} {written(unit)}"


def unit_of_column(name: str) -> tuple[str, str]:
    """Split a column name into the quantity and the unit after the last underscore.

    `force_mN` is `("force", "mN")`, `resistance_2_ohm` is `("resistance_2", "ohm")`. A name without an
    underscore, or one that ends in `strain` or `cycle`, is a plain number: `strain` is `("strain", "1")`.

    Args:
        name: the column's name.

    Returns:
        The quantity, and a unit that `to_si` accepts.

    Raises:
        InputError: if what follows the last underscore is not a known unit; names the nearest.
    """
    quantity, underscore, unit = name.rpartition("_")
    if not underscore or unit in _DIMENSIONLESS_ENDINGS:
        return name, "1"
    if not quantity or unit.isdigit():  # `resistance_1` is spring 1, without its unit
        raise InputError(f"column {name!r} must end in a unit, such as `resistance_1_ohm` or `force_N`")
    if unit not in UNITS:
        raise InputError(
            f"column {name!r}: unknown unit {unit!r} after the last underscore, {suggested_unit(unit)}"
        )
    return quantity, unit


def suggested_unit(name: str, dimension: str | None = None) -> str:
    """Sentence fragment that offers the unit that a mistyped name is nearest to.

    A slip of the shift key (`kpa`) is nearest, then exchanged letters (`bra`), then any other spelling.

    Args:
        name: a name that no unit has.
        dimension: dimension that the unit must have; None for any.

    Returns:
        `"did you mean 'kPa'?"`, or a list of units if none is close.
    """
    folded: dict[str, str] = {}
    for known, unit in UNITS.items():
        if dimension in (None, unit.dimension):
            folded.setdefault(known.casefold(), known)
    out = {word: unit for word, unit in _WRITTEN_OUT.items() if unit in folded.values()}
    words, given = {**out, **folded}, name.casefold()
    exchanged = [word for word in words if word.isalpha() and sorted(word) == sorted(given)]
    close = [given] if given in words else exchanged or difflib.get_close_matches(given, words, 1, 0.6)
    if close:
        return f"did you mean {words[close[0]]!r}?"
    return nearest(name, INTERNAL_UNITS.values() if dimension is None else folded.values())
