"""Correction of signs and zeros: compression counted positive, slack, a preload, an absolute pressure."""

import numpy as np

from ..recordings.table import refuse
from ..slack import Slack, noise_of_steps
from .channels import in_unit
from .making import Channel, Making
from .slack_treatment import largest, leave_to_fit, offer, slack_of, start_at
from .words import COMPRESS

ATMOSPHERE_KPA = 101.325
WEATHER_KPA = (90.0, 108.0)
"""Range of air pressures from sea level to 1000 m [kPa]. A gauge pressure does not begin within it by
chance."""
AT_START = 0.05
"""Maximum start of a strain that was counted from rest, as part of its range."""
PRELOAD = 0.01
"""Minimum reported stress at zero strain, as part of its range. Load cells are zeroed better."""
ACROSS = 0.05
"""Minimum share of rows with opposite signs of strain and stress, both beyond `AT_START`, that indicates a
shifted zero. A loop of a rubber has fewer."""
NOISES = 5.0
"""Number of standard deviations of its noise, below which a stress at the start counts as none."""
OPPOSED = 0.2
"""Minimum part of its range by which stress opposes strain, for one of them to have the wrong sign."""
FITS_BETTER = 0.5
"""Maximum ratio of misfits, pressed over pulled neo-Hookean law, at which the user is asked which it was."""
STEADY_K = 5.0
"""Maximum range of temperature of a test at one temperature [K]."""

# Driving and responding column of a test, by kind.
_PAIRS = {
    "elastomer": ("strain", "stress_kPa"),
    "wire": ("strain", "stress_MPa"),
    "spring": ("elongation_mm", "force_N"),
}


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
        making.channels["pressure"] = Channel(
            kilopascal - ATMOSPHERE_KPA, "kPa", channel.label, "gauge", made=made
        )
        return
    first = kilopascal[np.isfinite(kilopascal)][:1]
    if first.size and WEATHER_KPA[0] < first[0] < WEATHER_KPA[1]:
        making.warn(
            f"{channel.label!r} begins at {first[0]:.4g} kPa, as an absolute pressure of the open air does,"
            " and was taken as"
            f" gauge; if it is absolute: --subtract pressure_kPa={ATMOSPHERE_KPA}"
        )


def correct_signs_and_zeros(columns: dict[str, np.ndarray], making: Making, about: str) -> np.ndarray:
    """Correct signs, and begin where the specimen became taut. The columns are changed in place.

    Args:
        columns: canonical columns.
        making: state of the import with the options; notices and warnings are added to it.
        about: texts of the file (headings, preamble, sheet) that may mention the loading.

    Returns:
        Rows to keep.

    Raises:
        InputError: if stress and strain of a coupon, or of a wire at one temperature, have opposite signs.
    """
    rows = len(next(iter(columns.values())))
    keep = np.ones(rows, bool)
    pair = _PAIRS.get(making.kind)
    if pair is None or not set(pair) <= columns.keys():
        return keep
    if making.kind == "elastomer":
        _make_compression_negative(columns, making, about)
    if making.options.slack is not None:
        making.use("--slack")
    if making.kind == "wire" and not _is_isothermal(columns):
        return keep  # a flat part is then a property of the alloy
    if making.kind in ("elastomer", "wire"):
        _refuse_opposed(columns, pair, making)
        _refuse_below_minus_one(columns, pair, making)
    drive, force = (columns[name] for name in pair)
    if making.options.slack == "fit":
        leave_to_fit(columns, pair, making)
    if making.options.slack in ("keep", "fit"):
        return keep
    slack = slack_of(drive, force, making)
    if slack is None:
        _notice_start(columns, pair, making)
    elif making.options.slack is None:
        offer(slack, pair, making)
    else:
        keep = start_at(slack, columns, pair, making)
    if making.kind == "elastomer" and making.options.compression is None and not COMPRESS.search(about):
        _ask_about_compression(columns["strain"][keep], columns["stress_kPa"][keep], slack, making)
    return keep


def _make_compression_negative(columns: dict[str, np.ndarray], making: Making, about: str) -> None:
    """Strain and stress of a specimen in compression, made negative."""
    wanted = making.options.compression
    why = "as stated with --compression"
    if wanted is None and COMPRESS.search(about):
        word = COMPRESS.search(about)
        start = max(0, about.rfind("\n", 0, word.start()) + 1)
        line = about[start:].partition("\n")[0].strip()[:60]
        wanted, why = True, f"because the file speaks of compression ({line!r}; --tension if it was pulled)"
    if making.options.compression is not None:
        making.use("--compression" if making.options.compression else "--tension")
    if wanted:
        turned = [name for name in ("strain", "stress_kPa") if largest(columns[name]) > 0.0]
        for name in turned:
            columns[name] = -columns[name] + 0.0
        if turned:
            making.say(f"{' and '.join(turned)} turned negative, {why}")
        elif making.options.compression:
            making.say("strain and stress were negative already: nothing to turn for --compression")


def _is_isothermal(columns: dict[str, np.ndarray]) -> bool:
    """True if a wire stayed at one temperature, as far as was recorded."""
    temperature = columns.get("temperature_degC", np.zeros(1))
    temperature = temperature[np.isfinite(temperature)]
    return temperature.size == 0 or float(np.ptp(temperature)) <= STEADY_K


def _refuse_opposed(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Refuse stress and strain of opposite signs at the largest of either."""
    strain, stress = columns["strain"], columns[pair[1]]
    finite = np.flatnonzero(np.isfinite(strain) & np.isfinite(stress))
    if finite.size < 3 or not np.ptp(stress[finite]) > 0.0 or strain[finite].min() <= -1.0:
        return  # nothing to compare, or numbers that another check refuses
    x, y = strain[finite] - strain[finite[0]], stress[finite] - stress[finite[0]]
    for at in (int(np.argmax(np.abs(x))), int(np.argmax(np.abs(y)))):
        gone, answered = float(x[at]), float(y[at])
        if (
            gone * answered < 0.0
            and abs(answered) > OPPOSED * float(np.ptp(y))
            and abs(gone) > OPPOSED * float(np.ptp(x))
        ):
            sources = [_source_quantity(making, family) for family in ("strain", "stress")]
            unit = pair[1].rpartition("_")[2]
            raise refuse(
                making.place, f"stress goes to {stress[finite[at]]:.4g} {unit} while strain goes to"
                f" {strain[finite[at]]:.4g}: one of them is counted the other way; pulled: --scale"
                f" {sources[1 if answered < 0.0 else 0]}=-1, pressed: --scale"
                f" {sources[0 if gone > 0.0 else 1]}=-1",
            )  # fmt: skip


def _refuse_below_minus_one(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Refuse a strain of -1 and less with negative stress: a pull that is counted with the wrong sign."""
    least, stress = float(np.nanmin(columns["strain"])), largest(columns[pair[1]])
    if least <= -1.0 and stress < 0.0 and making.channels["strain"].made:
        elongation, force = _source_quantity(making, "strain"), _source_quantity(making, "stress")
        raise refuse(
            making.place, f"strain goes to {least:.4g} and stress to {stress:.4g}: nothing can be pressed to"
            " less than no length. If it was pulled, both are counted the other way: --scale"
            f" {elongation}=-1 --scale {force}=-1",
        )  # fmt: skip


def _source_quantity(making: Making, quantity: str) -> str:
    """Quantity whose sign must be turned for strain or stress: its source column if it was derived."""
    if not making.channels[quantity].made:
        return quantity
    return next(
        (
            name
            for name in ("elongation", "force")
            if name in making.sources and (name == "force") == (quantity == "stress")
        ),
        quantity,
    )


def _notice_start(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Report the start of a test that does not begin at zero."""
    if making.options.slack == "auto":
        making.say("no slack was found at the start: nothing was left out for --slack auto")
    drive, force = (columns[name] for name in pair)
    finite = np.isfinite(drive) & np.isfinite(force)
    if making.kind not in ("elastomer", "wire") or finite.sum() < 8:
        return
    answer_name, unit = pair[1].rsplit("_", 1)
    x, y = drive[finite], force[finite]
    reach, answer = float(np.ptp(x)), float(np.ptp(y))
    if abs(x[0]) > AT_START * reach and abs(x[0]) == float(np.abs(x).min()):
        making.warn(
            f"strain begins at {x[0]:.4g}, not at 0: was it counted from another zero? --subtract"
            f" strain={x[0]:.4g}"
        )
        return
    across = (x * y < 0.0) & (np.abs(x) > AT_START * reach) & (np.abs(y) > AT_START * float(np.abs(y).max()))
    least = int(np.argmin(np.abs(y)))
    if np.mean(across) > ACROSS and abs(x[least]) > AT_START * reach:
        making.warn(
            f"strain and {answer_name} have opposite signs in {int(across.sum())} rows, so one of them was"
            f" counted from another zero; {answer_name} is nearest to none, {y[least]:.4g} {unit}, at strain"
            f" {x[least]:.4g}. If the specimen was at rest there: --subtract strain={x[least]:.4g}"
        )
        return
    near = slice(0, max(5, x.size // 20))
    slope = float(np.polyfit(x[near], y[near], 1)[0]) if np.ptp(x[near]) > 0.0 else 0.0
    rest = float(y[0] - slope * x[0])
    if abs(x[0]) <= AT_START * reach and abs(rest) > max(PRELOAD * answer, NOISES * noise_of_steps(y)):
        making.warn(
            f"{answer_name} is {rest:.4g} {unit} at strain 0: a preload, or the load cell's zero. If it is"
            f" the zero: --subtract {pair[1]}={rest:.4g}"
        )


def _ask_about_compression(
    strain: np.ndarray, stress: np.ndarray, slack: Slack | None, making: Making
) -> None:
    """Ask if a test that only stiffens was in compression, and if one of negative strain that softens was in
    tension. A pulled rubber softens first; a pressed one stiffens."""
    finite = np.isfinite(strain) & np.isfinite(stress)
    x, y = strain[finite], stress[finite]
    way = 1.0 if x.size and x.max() >= -x.min() else -1.0
    x, y = way * x, way * y
    if (
        x.size < 8
        or not x.max() > 0.0
        or x.min() < -0.02 * x.max()
        or x.max() >= 0.95
        or y[int(np.argmax(x))] <= 0.0
    ):
        return
    if slack is not None and making.options.slack is None:
        begun, zero = way * slack.start, way * slack.zero
        x, y = x[x >= begun] - begun, y[x >= begun] - zero
    rising = slice(0, int(np.argmax(x)) + 1)
    x, y = x[rising], y[rising]
    if x.size < 8 or x.max() < 0.05:
        return
    misfits = []
    for stretch in (1.0 + way * x, 1.0 - way * x):
        shape = np.abs(stretch - stretch**-2)
        columns = np.stack([shape, np.ones_like(shape)], axis=1)
        rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
        misfits.append(float(np.sqrt(np.mean(rest**2))))
    if misfits[1] >= FITS_BETTER * misfits[0]:
        return
    if way > 0.0:
        making.warn(
            "stress only stiffens over strain, as a pressed rubber does and a pulled one does not at first;"
            " if the specimen"
            " was pressed, turn it with --compression (--tension if it was pulled, and this line goes)"
        )
        return
    turned = " ".join(f"--scale {_source_quantity(making, name)}=-1" for name in ("strain", "stress"))
    making.warn(
        "strain and stress are negative, but stress softens over strain, as a pulled rubber does and a"
        f" pressed one does not; if the specimen was pulled: {turned} (--compression if it was pressed, and"
        " this line goes)"
    )
