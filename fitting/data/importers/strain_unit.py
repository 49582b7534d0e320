"""Units that nobody states: strain as a fraction or a percentage, and consequences of an assumed unit."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..recordings import schema
from ..recordings.columns import convert
from ..recordings.kinds import FARTHEST_STRETCH, WIRE_STRAIN_FRACTION_LIMIT, WIRE_STRAIN_LIMIT
from ..recordings.table import unusable
from .making import Channel, Making
from .spelling import dimension, unit_name

DECISIVE = 0.25
"""Maximum ratio of misfits at which one unit of strain explains another column and the other does not."""
FIRST_PART = 2.0
"""Maximum strain of the first, neo-Hookean part of a rubber's curve [1]."""


def settle_strain_unit(making: Making) -> None:
    """Assign the unit to a strain without one, and report it.

    A true strain or an extension beside it decides. Otherwise a fraction is assumed, if the numbers can be
    one.

    Raises:
        InputError: if the numbers cannot be a fraction, or fit a percentage better. Also if no specimen of
            the kind strains as far as their heading says.
    """
    channel = making.channels.get("strain")
    if channel is None or channel.trouble or not schema.KINDS[making.kind].strained:
        return
    if channel.unit is not None:
        _refuse_impossible_coupon(making, channel)
        return
    largest = float(np.nanmax(np.abs(channel.values)))
    proven = _proven_unit(making, channel)
    if proven is not None:
        unit, by = proven
        words = "percent" if unit == "percent" else "a fraction"
        making.say(f"{channel.label!r} has no unit: taken as {words}, as {by} tells")
        making.channels["strain"] = replace(channel, unit=unit)
        return
    reaches = f"{channel.label!r} has no unit and reaches {largest:.4g}"
    ask = "state it with --unit strain=percent (or --unit strain=1)"
    if making.kind == "wire" and largest > WIRE_STRAIN_LIMIT:
        raise unusable(
            making.place, f"{reaches}; as a fraction no nitinol wire"
            f" strains beyond {WIRE_STRAIN_LIMIT:g}: {ask}",
        )  # fmt: skip
    if largest > FARTHEST_STRETCH - 1.0:
        raise unusable(
            making.place, f"{reaches}, which as a fraction would be a"
            f" stretch of {1.0 + largest:.4g}: {ask}",
        )  # fmt: skip
    if _bends_as_percent(making, channel):
        raise unusable(
            making.place, f"{reaches}; as a fraction the curve would be far"
            f" straighter than any rubber's up to a strain of {min(largest, FIRST_PART):.3g}. As percent it"
            f" would not: {ask}",
        )  # fmt: skip
    making.say(f"{channel.label!r} has no unit: taken as a fraction (--unit strain=percent to correct)")
    making.channels["strain"] = replace(channel, unit="1")


def _refuse_impossible_coupon(making: Making, channel: Channel) -> None:
    """Refuse a coupon's strain whose unit, as the heading states it, makes it larger than that of any rubber.

    A unit that the user states is believed, with a `check:`: `--unit strain=1` answers the question.

    Raises:
        InputError: with the unit that is probably meant.
    """
    if making.kind != "elastomer" or dimension(channel.unit) != "number":
        return
    farthest, reaches, stated = _reach(channel)
    if farthest > FARTHEST_STRETCH - 1.0:
        if "strain" in making.options.units:
            making.warn(
                f"{reaches} is a stretch of {1.0 + farthest:.4g}, further than any rubber stretches; it was"
                f" taken so, as --unit strain={making.options.units['strain']} states"
            )
            return
        other = "1" if stated == "percent" else "percent"
        raise unusable(
            making.place, f"{reaches} would be a stretch of {1.0 + farthest:.4g}, further than any rubber"
            f" stretches; state the unit with --unit strain={other} (--unit strain={stated} keeps it)",
        )  # fmt: skip


def refuse_impossible_wire(making: Making) -> None:
    """Refuse a wire's strain whose stated unit makes it larger than that of any wire.

    Raises:
        InputError: with the kind or the unit that is probably meant.
    """
    channel = making.channels.get("strain")
    if channel is None or making.kind != "wire" or dimension(channel.unit) != "number":
        return
    farthest, reaches, stated = _reach(channel)
    if farthest <= WIRE_STRAIN_FRACTION_LIMIT:
        return
    strain = convert(channel.values, stated, "1")
    first = float(strain[np.isfinite(strain)][0])
    change = float(np.nanmax(strain) - np.nanmin(strain))
    if change <= WIRE_STRAIN_FRACTION_LIMIT:
        raise unusable(
            making.place, f"strain begins at {first:.4g}, further than any wire strains, and changes by"
            f" {change:.4g}: was it counted from another zero? --subtract strain={first:.4g}",
        )  # fmt: skip
    if channel.made:
        raise unusable(
            making.place, f"strain, which is {channel.made}, reaches {farthest:.4g}, further than any wire"
            " strains; are units and sizes right? If the specimen is of rubber: --kind elastomer",
        )  # fmt: skip
    other = "" if stated == "percent" else "; if these are percent: --unit strain=percent"
    raise unusable(
        making.place, f"{reaches} is further than any wire strains; if the specimen is of rubber: --kind"
        f" elastomer{other}",
    )  # fmt: skip


def _reach(channel: Channel) -> tuple[float, str, str]:
    """Largest strain in size, as a fraction; the same in words; and the name of its unit."""
    unit = unit_name(str(channel.unit))
    farthest = float(np.nanmax(np.abs(convert(channel.values, unit, "1"))))
    words = {"percent": "percent", "1": "a fraction"}.get(unit, unit)
    written = float(np.nanmax(np.abs(channel.values)))
    return farthest, f"{channel.label!r} reaches {written:.4g}, which as {words}", unit


def warn_of_impossible_strain(making: Making) -> None:
    """Warn of a strain made from other columns that is larger than that of any specimen."""
    channel = making.channels.get("strain")
    if channel is None or not channel.made or making.kind != "elastomer" or channel.trouble:
        return
    farthest = float(np.nanmax(channel.values)) if np.isfinite(channel.values).any() else 0.0
    if farthest > FARTHEST_STRETCH - 1.0:
        making.warn(
            f"strain, which is {channel.made}, reaches {farthest:.4g}, a stretch of {1.0 + farthest:.4g}:"
            " further than any rubber stretches. Are units and sizes right?"
        )


def unit_assumed(channels: Mapping[str, Channel], unit: str) -> str:
    """Warning where nobody states the unit of stress: the modulus that follows from the assumed one.

    Args:
        channels: channels with `stretch` and `stress`.
        unit: assumed unit.
    """
    stretch, stress = channels["stretch"].values, channels["stress"].values
    far = int(np.nanargmax(np.abs(stretch - 1.0)))
    modulus = float(stress[far] / (stretch[far] - 1.0))
    return (
        f"check: the unit of stress is not stated and was taken as {unit}. That makes a modulus of"
        f" {modulus:.3g} {unit} (stress over strain at the farthest stretch). --unit stress=... states"
        " another"
    )


def _proven_unit(making: Making, channel: Channel) -> tuple[str, str] | None:
    """Unit of a strain that another column of the file proves, and the name of that column.

    A true strain is log(1 + strain), for one unit of either. An elongation over the gauge length is a strain.
    """
    strain = channel.values
    true = making.channels.get("true_strain")
    if true is not None and not true.trouble and true.unit is None:
        misfits = {}
        with np.errstate(invalid="ignore", divide="ignore"):
            for unit, factor in (("1", 1.0), ("percent", 0.01)):
                for true_factor in (1.0, 0.01):
                    misfit = np.log1p(factor * strain) - true_factor * true.values
                    misfits[unit, true_factor] = float(np.sqrt(np.nanmean(misfit**2)))
        best, second = sorted(misfits, key=misfits.__getitem__)[:2]
        if misfits[best] < DECISIVE * misfits[second]:
            return best[0], repr(true.label)
    extension = making.channels.get("elongation")
    gauge = making.options.dimensions.get("gauge_length_mm") or (
        making.sizes["gauge_length_mm"].value if "gauge_length_mm" in making.sizes else None
    )
    if extension is not None and gauge and not extension.trouble and dimension(extension.unit) == "length":
        made = convert(extension.values, extension.unit, "mm") / gauge
        reach, own = float(np.nanmax(made) - np.nanmin(made)), float(np.nanmax(strain) - np.nanmin(strain))
        factor = own / reach if reach > 0.0 else 0.0
        for unit, wanted in (("1", 1.0), ("percent", 100.0)):
            if 0.5 < factor / wanted < 2.0:
                if "gauge_length_mm" in making.options.dimensions:
                    making.use("--dimension", "gauge_length_mm")
                return unit, f"{extension.label!r} over the gauge length of {gauge:g} mm"
    return None


def _bends_as_percent(making: Making, channel: Channel) -> bool:
    """True if the first part of an elastomer's curve is neo-Hookean in percent, but not in fractions.

    Every rubber's tangent falls by half up to a strain of one. Up to a percent it does not fall.
    """
    stress = making.channels.get("stress") or making.channels.get("force")
    if making.kind != "elastomer" or stress is None or stress.trouble:
        return False
    finite = np.isfinite(channel.values) & np.isfinite(stress.values)
    strain, force = channel.values[finite], stress.values[finite]
    rising = slice(0, int(np.argmax(strain)) + 1) if strain.size else slice(0, 0)
    strain, force = strain[rising], force[rising]
    first = (strain >= 0.0) & (strain <= FIRST_PART)
    if first.sum() < 5 or strain[first].max() < 0.75 * FIRST_PART:
        return False
    misfits = []
    for factor in (1.0, 0.01):
        stretch = 1.0 + factor * strain[first]
        shape = stretch - stretch**-2
        columns = np.stack([shape, np.ones_like(shape)], axis=1)
        rest = force[first] - columns @ np.linalg.lstsq(columns, force[first], rcond=None)[0]
        misfits.append(float(np.sqrt(np.mean(rest**2))))
    reach = float(np.ptp(force[first]))
    return misfits[1] < DECISIVE * misfits[0] and misfits[0] > 0.02 * reach
