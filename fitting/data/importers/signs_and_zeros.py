"""Correction of signs and zeros: compression counted positive, slack, a preload, an absolute pressure."""

import numpy as np

from ..recordings import schema
from ..recordings.table import unusable
from .channels import in_unit
from .compression import About, ask_about_compression, make_compression_negative, source_quantity
from .making import Channel, Making
from .slack_treatment import largest, leave_to_fit, offer, slack_of, start_at
from .starts import notice_start

ATMOSPHERE_KPA = 101.325
AIR_KPA = (60.0, 108.0)
"""Range of air pressures from sea level to 4000 m [kPa]."""
AIR_APART_KPA = 2.0
"""Minimum distance of the air from `ATMOSPHERE_KPA` that is asked about [kPa]. Weather makes as much."""
WEATHER_KPA = (90.0, 108.0)
"""Range of air pressures from sea level to 1000 m [kPa]. A gauge pressure does not begin within it by
chance."""
OPPOSED = 0.2
"""Minimum part of its range by which stress opposes strain, for one of them to have the wrong sign."""
STEADY_K = 5.0
"""Maximum range of temperature of a test at one temperature [K]."""


def subtract(making: Making) -> None:
    """Subtract the offsets that the user states from the channels, in their units."""
    for quantity, (value, unit) in making.options.subtracted.items():
        channel = making.channels.get(quantity)
        if channel is None or ("--subtract", quantity) in making.options.used.names:
            continue
        values = in_unit(channel, unit, quantity, making.place) - value
        made = f"{channel.made or repr(channel.label)} less {value:g} {unit} (--subtract)"
        making.channels[quantity] = Channel(
            values, unit, channel.label, "gauge" if quantity == "pressure" else "", made=made
        )
        making.use("--subtract", quantity)


def gauge_pressure(making: Making) -> None:
    """Subtract the atmospheric pressure from a pressure with an absolute heading; ask where its numbers look
    absolute."""
    channel = making.channels.get("pressure")
    if channel is None or channel.zero == "gauge" or channel.unit is None:
        return
    kilopascal = in_unit(channel, "kPa", "pressure", making.place)
    if channel.zero == "absolute":
        made = f"{channel.label!r} less an atmosphere of {ATMOSPHERE_KPA} kPa, because it is absolute"
        begins = kilopascal[np.isfinite(kilopascal)][:1]
        off = float(begins[0]) - ATMOSPHERE_KPA if begins.size else 0.0
        if begins.size and AIR_KPA[0] < begins[0] < AIR_KPA[1] and abs(off) > AIR_APART_KPA:
            making.warn(
                f"{channel.label!r} begins at {begins[0]:.4g} kPa, and {ATMOSPHERE_KPA} kPa were taken off,"
                f" so that the test begins at {off:.3g} kPa. If the air has {begins[0]:.4g} kPa where you"
                f" are: --subtract pressure_kPa={off:.4g}"
            )
        making.channels["pressure"] = Channel(
            kilopascal - ATMOSPHERE_KPA, "kPa", channel.label, "gauge", made=made
        )
        return
    first = kilopascal[np.isfinite(kilopascal)][:1]
    if first.size and WEATHER_KPA[0] < first[0] < WEATHER_KPA[1]:
        making.warn(
            f"{channel.label!r} begins at {first[0]:.4g} kPa, as an absolute pressure of the open air does,"
            " and was taken as"
            f" gauge pressure. If it is absolute: --subtract pressure_kPa={ATMOSPHERE_KPA}"
        )


def correct_signs_and_zeros(columns: dict[str, np.ndarray], making: Making, about: About) -> np.ndarray:
    """Correct signs, and begin where the specimen became taut. The columns are changed in place.

    Args:
        columns: canonical columns.
        making: state of the import with the options; notices and warnings are added to it.
        about: texts of the file that may mention the loading.

    Returns:
        Rows to keep.

    Raises:
        InputError: if stress and strain have opposite signs, in a coupon or in a wire or spring at one
            temperature. Also if a stated slack leaves no test.
    """
    rows = len(next(iter(columns.values())))
    keep = np.ones(rows, bool)
    pair = schema.KINDS[making.kind].pull
    if not pair or not set(pair) <= columns.keys():
        return keep
    decided = "" if making.kind == "spring" else make_compression_negative(columns, pair, making, about)
    steady = making.kind == "elastomer" or _is_isothermal(columns, making.kind)
    if making.kind == "spring":
        _ask_opposed(columns, pair, making, steady)
    elif steady:
        _refuse_opposed(columns, pair, making)
        _refuse_below_minus_one(columns, pair, making)
    if making.kind == "wire" and not steady:  # a flat part is then a property of the alloy
        if making.options.slack == "keep":
            making.use("--slack")
        return keep
    if making.options.slack is not None:
        making.use("--slack")
    if making.options.slack == "fit":
        leave_to_fit(columns, pair, making)
    if making.options.slack in ("keep", "fit"):
        return keep
    slack = slack_of(*(columns[name] for name in pair), making)
    if slack is None:
        notice_start(columns, pair, making)
    elif making.options.slack is None:
        offer(slack, pair, making)
    else:
        keep = start_at(slack, columns, pair, making)
    if making.kind == "elastomer" and decided != "stated":
        ask_about_compression(
            columns["strain"][keep], columns["stress_kPa"][keep], slack, making, decided == "line"
        )
    return keep


def _is_isothermal(columns: dict[str, np.ndarray], kind: str) -> bool:
    """True if a wire or spring stayed in one phase, as far as was recorded: no heat, no current.

    A resistance does not tell: strain changes it as much as the phase does.
    """
    told = kind == "wire"
    for name, most in (("temperature_degC", STEADY_K), ("current_A", 0.0)):
        values = columns.get(name, np.zeros(0))
        values = values[np.isfinite(values)]
        told |= values.size > 0
        if values.size and float(np.ptp(values)) > most:
            return False
    return told


def _opposed(x: np.ndarray, y: np.ndarray) -> int | None:
    """Row at the largest of either of two courses, from their starts, where they go opposite ways; None if
    there is none.

    Args:
        x: strain or elongation, finite, shape (rows,).
        y: stress or force, finite, shape (rows,).
    """
    x, y = x - x[0], y - y[0]
    for at in (int(np.argmax(np.abs(x))), int(np.argmax(np.abs(y)))):
        apart = abs(y[at]) > OPPOSED * float(np.ptp(y)) and abs(x[at]) > OPPOSED * float(np.ptp(x))
        if x[at] * y[at] < 0.0 and apart:
            return at
    return None


def _refuse_opposed(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Refuse stress and strain of opposite signs at the largest of either."""
    strain, stress = columns["strain"], columns[pair[1]]
    finite = np.flatnonzero(np.isfinite(strain) & np.isfinite(stress))
    if finite.size < 3 or not np.ptp(stress[finite]) > 0.0 or strain[finite].min() <= -1.0:
        return  # nothing to compare, or numbers that another check refuses
    strain, stress = strain[finite], stress[finite]
    at = _opposed(strain, stress)
    if at is None:
        return
    sources = [source_quantity(making, family) for family in ("strain", "stress")]
    unit = pair[1].rpartition("_")[2]
    raise unusable(
        making.place, f"stress goes to {stress[at]:.4g} {unit} while strain goes to"
        f" {strain[at]:.4g}: one of them is counted the other way. Pulled: --scale"
        f" {sources[1 if stress[at] < stress[0] else 0]}=-1, pressed: --scale"
        f" {sources[0 if strain[at] > strain[0] else 1]}=-1",
    )  # fmt: skip


def _ask_opposed(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making, steady: bool) -> None:
    """Refuse a spring's force that is opposed to its elongation in one phase; ask about one under heat."""
    elongation, force = (columns[name] for name in pair)
    finite = np.isfinite(elongation) & np.isfinite(force)
    x, y = elongation[finite], force[finite]
    if x.size < 3 or not np.ptp(y) > 0.0:
        return
    at = _opposed(x, y)
    against = largest(x) * largest(y) < 0.0
    if at is not None and steady:
        turned = "force" if y[at] < y[0] else "elongation"
        raise unusable(
            making.place, f"force goes to {y[at]:.4g} N while elongation goes to {x[at]:.4g} mm, and the"
            f" phase stays. One of them is counted the other way: --scale {turned}=-1",
        )  # fmt: skip
    if against:
        turned = "force" if largest(y) < 0.0 else "elongation"
        making.warn(
            f"force goes to {largest(y):.4g} N and elongation to {largest(x):.4g} mm, of opposite signs: is"
            f" one of them counted the other way? --scale {turned}=-1"
        )


def _refuse_below_minus_one(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Refuse a strain of -1 and less with negative stress: a pull that is counted with the wrong sign."""
    least, stress = float(np.nanmin(columns["strain"])), largest(columns[pair[1]])
    if least <= -1.0 and stress < 0.0 and making.channels["strain"].made:
        elongation, force = source_quantity(making, "strain"), source_quantity(making, "stress")
        raise unusable(
            making.place, f"strain goes to {least:.4g} and stress to {stress:.4g}: nothing can be pressed to"
            " less than no length. If it was pulled, both are counted the other way: --scale"
            f" {elongation}=-1 --scale {force}=-1",
        )  # fmt: skip
