"""Drives of an actuator in a study: pressure and springs, each fixed, varied, or along the driver."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.documents import check_keys
from pneusma_jax.errors import InputError
from pneusma_jax.units import dimension_of, from_si, to_si, unit_of_column

from .response import Driver, Variable

STEMS = {"pressure": "kPa", "xi0": "1", "resistance": "ohm", "temperature": "degC"}
"""Quantities that drive, and their units in files."""
MOST_POINTS = 1001
"""Points of a driver: more draw no finer figure, and every one is a column of results."""


def channel_of(key: str) -> tuple[str, str] | None:
    """Channel and unit that a key of a study's `[model]` names, None if it is none.

    `pressure_kPa` is ("pressure", "kPa"); `xi0_2` is ("xi0_2", "1"), `resistance_1_ohm` ("resistance_1",
    "ohm").
    """
    stem = key.partition("_")[0]
    if stem == "xi0":
        return (key, "1") if key[4:].isdecimal() else None
    if stem not in STEMS:
        return None
    try:
        name, unit = unit_of_column(key)
    except InputError:
        return None
    right = name == "pressure" if stem == "pressure" else name[len(stem) + 1 :].isdecimal()
    return (name, unit) if right else None


def points_of(entry: Any, where: str) -> float | np.ndarray:
    """A number, or the points of a driver.

    Args:
        entry: a number, a list of them, or `{from, to, points}`.
        where: file and key, for messages.

    Raises:
        InputError: for anything else.
    """
    shape = "a number, a list of numbers, or {from, to, points}"
    if isinstance(entry, bool) or not isinstance(entry, int | float | list | dict):
        raise InputError(f"{where} must be {shape}, but it is {entry!r}")
    if isinstance(entry, int | float):
        return float(_finite([entry], where, shape)[0])
    if isinstance(entry, list):
        values = _finite(entry, where, shape)
    else:
        for key in ("from", "to", "points"):
            if key not in entry:
                raise InputError(f"{where} must be {shape}, but {key!r} is missing")
        check_keys(entry, ("from", "to", "points"), where)
        ends, count = _finite([entry["from"], entry["to"]], where, shape), entry["points"]
        if not isinstance(count, int) or isinstance(count, bool) or not 2 <= count <= MOST_POINTS:
            raise InputError(f"{where}: points = {count!r} must be a whole number from 2 to {MOST_POINTS}")
        values = np.linspace(*ends, count)
    if not 2 <= len(values) <= MOST_POINTS:
        raise InputError(f"{where} has {len(values)} points, but a driver has 2 to {MOST_POINTS}")
    if np.any(np.diff(values) <= 0.0):
        raise InputError(f"{where} must rise from point to point, but it does not")
    return values


def _finite(values: list, where: str, shape: str) -> np.ndarray:
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise InputError(f"{where} must be {shape} (finite), but it has {value!r}")
    return np.asarray(values, float)


def read_channels(
    model: Mapping[str, Any], springs: tuple[int, ...], where: str
) -> tuple[dict[str, np.ndarray], Driver | None]:
    """Channels [SI] by name, each of shape () or (points,), and the driver.

    Args:
        model: a study's `[model]`.
        springs: numbers of the existing springs.
        where: file and table, for messages.

    Raises:
        InputError: for two drivers, an impossible value, or a spring that is not there.
    """
    channels, driver = {}, None
    for key, entry in model.items():
        named = channel_of(key)
        if named is None:
            continue
        name, unit = named
        usual = STEMS[name.partition("_")[0]]
        if dimension_of(unit) != dimension_of(usual):
            raise InputError(f"{where} {key} must be a {dimension_of(usual)}, such as in {usual}")
        if name in channels:
            raise InputError(f"{where} {key}: the {dimension_of(usual)} is stated already, in another unit")
        values = points_of(entry, f"{where} {key}")
        if np.ndim(values):
            if driver is not None:
                raise InputError(f"{where} {key}: {driver.name!r} is the driver already; one can be")
            driver = Driver(key, np.asarray(values))
        channels[name] = np.asarray(to_si(values, unit))
        _check_channel(name, channels[name], springs, f"{where} {key}")
    if "pressure" not in channels:
        raise InputError(f"{where} needs pressure_kPa: a number, or {{from, to, points}}")
    for number in springs:
        said = [n for n in channels if n.endswith(f"_{number}")]
        if len(said) > 1:
            raise InputError(f"{where}: {said[0]!r} and {said[1]!r} both say how warm spring {number} is")
    return channels, driver


def _check_channel(name: str, values: np.ndarray, springs: tuple[int, ...], where: str) -> None:
    stem, _, number = name.partition("_")
    if stem == "xi0" and np.any((values < 0.0) | (values > 1.0)):
        raise InputError(f"{where} must be a fraction from 0 (hot) to 1 (cold)")
    if stem == "pressure" and np.any((values <= -102e3) | (values >= 1000e3)):
        raise InputError(f"{where} must be a gauge pressure between -102 and 1000 kPa")
    if stem == "resistance" and np.any(values <= 0.0):
        raise InputError(f"{where} must be more than 0 ohm")
    if number and int(number) not in springs:
        there = ", ".join(map(str, springs)) or "none"
        raise InputError(f"{where}: there is no spring {number}; those that are there: {there}")


def drive_numbers(channels: Mapping[str, np.ndarray]) -> dict[str, Variable]:
    """Numbers by which drives may vary: a channel itself where it is one number, else its offset and gain."""
    found = {}
    for name, values in channels.items():
        unit = STEMS[name.rpartition(".")[2].partition("_")[0]]
        if np.ndim(values) == 0:
            found[name] = Variable(float(values), unit)
            continue
        found[f"{name}_offset"] = Variable(0.0, "K" if unit == "degC" else unit)
        found[f"{name}_gain"] = Variable(1.0, "1")
    return found


def units_of(channels: Collection[str]) -> dict[str, str]:
    """Unit in files of each channel, by its name."""
    return {name: STEMS[name.rpartition(".")[2].partition("_")[0]] for name in channels}


def driven(name: str, values: Array, numbers: Mapping[str, Array]) -> Array:
    """A channel with what a row changes in it."""
    given = numbers.get(name, values)
    return given * numbers.get(f"{name}_gain", 1.0) + numbers.get(f"{name}_offset", 0.0)


def activation(alloy: Any, name: str, value: Array) -> Any:
    """Activation of a spring from its channel."""
    stem = name.partition("_")[0]
    if stem == "resistance":
        return pj.Resistance(value)
    if stem == "temperature":
        return pj.MartensiteFraction(alloy.martensite_fraction_at(value))
    return pj.MartensiteFraction(value)


def spring_channel(channels: Mapping[str, Any], number: int, before: str = "") -> str | None:
    """Name of the channel that drives a spring, None for a cold one."""
    names = (f"{before}{stem}_{number}" for stem in STEMS if stem != "pressure")
    return next((name for name in names if name in channels), None)


def shown(column: str, value: Array) -> Array:
    """A value [SI] in the unit of its column."""
    return from_si(value, unit_of_column(column)[1])


def worst(status: Array) -> Array:
    """One status of several: the largest, which is the one with least of a result."""
    return jnp.max(status)
