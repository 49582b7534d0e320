"""Strain, stress, length and resistance, derived from logged quantities: stretch, extension, load, true
strain, voltage."""

import re
import shlex
from dataclasses import replace

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import schema
from ..recordings.table import unusable
from .channels import in_unit
from .circuit import add_resistances
from .making import Channel, Making
from .sizes import SAME
from .specimen_sizes import AREAS, area_mm2, gauge_length_mm, length_at_rest_mm

LEAST = 0.2
"""Minimum part of the largest value at which a row's ratio is meaningful."""
AT_REST = 0.05
"""Maximum elongation of a tube at no pressure, over the largest one [1]. Creep of a silicone leaves less."""
FALLS = 0.5
"""Minimum fall of an elongation from the least pressure to the largest one, over its range [1]. Noise and
hysteresis make none."""
_ELSEWHERE = re.compile(
    r"(?<![a-z])(?:pos(?:ition)?|tip|stroke|travel|crosshead|course|piston|plunger|syringe)(?![a-z])|weg|ストローク"
)
"""Words of a displacement that may be of a machine, a pump or a tip rather than of a tube's end."""


def derive(making: Making) -> None:
    """Add the strain and stress of a coupon or wire where they follow from stretch, extension or load.

    A spring's or actuator's resistance follows from a voltage (`circuit`), and a tube's length from its
    elongation. So does an actuator's length, where the user names its elongation.

    Strain is stretch - 1, or extension over gauge length, or exp(true strain) - 1. It is length over that at
    rest - 1, where the user names a length. Stress is load over the
    specimen's initial area, or true stress over stretch (incompressible material). If a file has a quantity
    in two ways, both are compared, and a factor between them is reported. The channels are changed in place.

    Raises:
        InputError: if neither the user nor the file states a required dimension of the specimen.
    """
    add_resistances(making)
    if schema.KINDS[making.kind].strained:
        _derive_both(making)
    shaped = {*making.channels, *making.options.constants} & {"length", "curvature", "bend_angle"}
    if making.kind in ("tube", "actuator") and "elongation" in making.channels and not shaped:
        _derive_length(making)
    for quantity in making.options.scales:
        _scaled(making, quantity)


def _derive_both(making: Making) -> None:
    if "strain" not in making.channels:
        _derive_strain(making)
    else:
        _compare_strain(making)
    if "stress" not in making.channels:
        _derive_stress(making)
    else:
        _compare_stress(making)


def _add(making: Making, quantity: str, channel: Channel, source: str) -> None:
    making.channels[quantity] = channel
    making.sources.add(source)


def _scaled(making: Making, quantity: str) -> None:
    """Apply a factor that the user states for a derived quantity, rather than for a column of the file."""
    channel = making.channels.get(quantity)
    if channel is not None and quantity not in making.raw:
        factor = making.options.scales[quantity]
        making.channels[quantity] = replace(
            channel,
            values=factor * channel.values,
            made=f"{channel.made}, times {factor:g} (--scale {quantity})",
        )


def _derive_strain(making: Making) -> None:
    channels, place = making.channels, making.place
    if "stretch" in channels:
        stretch = channels["stretch"]
        values = in_unit(stretch, "1", "stretch", place) - 1.0
        if np.nanmin(values, initial=0.0) <= -1.0:
            raise unusable(
                place, f"{stretch.label!r} falls to {np.nanmin(stretch.values):.4g}, but a stretch is 1 at"
                f" rest and stays above 0; if it is a strain: --map strain={stretch.label!r}",
            )  # fmt: skip
        _add(making, "strain", Channel(values, "1", stretch.label, made=f"{stretch.label!r} - 1"), "stretch")
    elif "true_strain" in channels:
        true = channels["true_strain"]
        values = np.expm1(in_unit(true, "1", "true_strain", place))
        made = f"exp({true.label!r}) - 1" + ("" if true.unit else ", the true strain taken as a fraction")
        _add(making, "strain", Channel(values, "1", true.label, made=made), "true_strain")
    elif "length" in channels and "length" in making.options.columns:
        _add(making, "strain", _of_length(making), "length")
    elif "elongation" in channels:
        label = channels["elongation"].label
        gauge = gauge_length_mm(making)
        if gauge is None:
            raise unusable(
                place, f"strain needs the length between the grips, to divide {label!r} by; "
                f"state it with --dimension gauge_length_mm=...{making.may_state_sizes}",
            )  # fmt: skip
        values = in_unit(channels["elongation"], "mm", "elongation", place) / gauge
        _add(
            making,
            "strain",
            Channel(values, "1", label, made=f"{label!r} over the gauge length of {gauge:g} mm"),
            "elongation",
        )


def _of_length(making: Making) -> Channel:
    """Strain of a coupon or wire whose length the user names: marks of a video, or the gap between plates."""
    channel = making.channels["length"]
    values = in_unit(channel, "mm", "length", making.place)
    gauge = gauge_length_mm(making)
    if gauge is None:
        known = values[np.isfinite(values)]
        if not known.size:
            raise unusable(making.place, f"no number stands in {channel.label!r}, of which strain is made")
        gauge = float(known[0])
        making.warn(
            f"strain is the change of {channel.label!r} over its first value, {gauge:g} mm. If the specimen"
            " was not at rest there: --dimension gauge_length_mm=..."
        )
    if not gauge > 0.0:
        raise unusable(making.place, f"{channel.label!r} is {gauge:g} mm at first, and a length is positive")
    made = f"the change of {channel.label!r} over the length at rest of {gauge:g} mm"
    return Channel(values / gauge - 1.0, "1", channel.label, made=made)


def _derive_length(making: Making) -> None:
    """Length of a tube or an actuator: that at rest and its elongation.

    Raises:
        InputError: if nothing states the length at rest, or if the displacement may be another one: of a
            machine, a tip or an actuator that bends. The user's `--map elongation=` says that it is not.
    """
    channel, kind = making.channels["elongation"], making.kind
    option = f"--map elongation={shlex.quote(channel.label)}"
    named = "elongation" in making.options.columns
    if not named and (kind == "actuator" or _ELSEWHERE.search(channel.label.casefold())):
        rules = schema.KINDS[kind].columns
        needed = f"one of {', '.join(rules.one_of)}" if rules.one_of else "length_mm"
        others = f"; {making.unrecognised}" if making.unrecognised else ""
        raise unusable(
            making.place, f"a recording of kind {kind} needs {needed}{others}; name it with --map"
            f" QUANTITY=COLUMN. If {channel.label!r} is the change of the {kind}'s length: {option} and"
            " --dimension length_mm=... (at rest)",
        )  # fmt: skip
    rest = length_at_rest_mm(making)
    if rest is None:
        raise unusable(
            making.place, f"length needs that of the specimen at rest, to add {channel.label!r} to; state it"
            f" with --dimension length_mm=...{making.may_state_sizes}",
        )  # fmt: skip
    elongation = in_unit(channel, "mm", "elongation", making.place)
    if not named:
        making.warn(
            f"{channel.label!r} was taken as the elongation of the tube, and added to its length at rest of"
            f" {rest:g} mm. If it is, {option} says so, and this line goes"
        )
    _question_elongation(elongation, rest, making)
    values = rest + elongation
    made = f"{channel.label!r} and the length at rest of {rest:g} mm"
    _add(making, "length", Channel(values, "mm", channel.label, made=made), "elongation")


def _question_elongation(elongation: np.ndarray, rest: float, making: Making) -> None:
    """Ask about an elongation that is not zero at no pressure, or falls as pressure rises.

    Args:
        elongation: change of the length, shape (rows,) [mm].
        rest: length at rest [mm].
        making: the state of the import, with a pressure in any unit.
    """
    pressure = making.channels["pressure"].values if "pressure" in making.channels else np.empty(0)
    if pressure.shape != elongation.shape:
        return
    both = np.isfinite(pressure) & np.isfinite(elongation)
    pressure, elongation = pressure[both], elongation[both]
    if not elongation.size or not np.ptp(pressure) > 0.0:
        return
    label = making.channels["elongation"].label
    least, largest = int(np.argmin(pressure)), int(np.argmax(pressure))
    at_least = float(elongation[least])
    begun = max(float(pressure[least]), 0.0) / float(np.max(np.abs(pressure)))
    if abs(at_least) > (AT_REST + begun) * float(np.max(np.abs(elongation))):
        itself = abs(at_least - rest) < abs(at_least)
        option = f"--map length={shlex.quote(label)}"
        making.warn(
            f"{label!r} is {at_least:.4g} mm at the least pressure: "
            + (f"is it the length itself, {rest:g} mm at rest? If so: {option}. " if itself else "")
            + f"{'Or is' if itself else 'is'} it counted from the length at rest? If not:"
            f" --subtract elongation_mm={at_least:.4g}"
        )
    if elongation[largest] - at_least < -FALLS * float(np.ptp(elongation)):
        making.warn(
            f"{label!r} falls as pressure rises: does the tube shorten? If it is counted the other way:"
            " --scale elongation=-1"
        )


def _derive_stress(making: Making) -> None:
    channels, place = making.channels, making.place
    true = "true_stress" in channels and "strain" in channels
    named = "true_stress" in making.options.columns
    if "force" in channels and not (true and (named or area_mm2(making, quiet=True) is None)):
        label = channels["force"].label
        area = area_mm2(making)
        if area is None:
            raise unusable(
                place, f"stress needs the specimen's cross-section, to divide {label!r} by; state it with"
                " --dimension area_mm2=... (or diameter_mm=..., or width_mm=... and thickness_mm=...)"
                + making.may_state_sizes,
            )  # fmt: skip
        newton = in_unit(channels["force"], "N", "force", place)
        made = f"{label!r} ({channels['force'].unit}) over the cross-section of {area:.6g} mm2"
        _add(making, "stress", Channel(newton / area, "MPa", label, made=made), "force")
    elif true:
        cauchy = channels["true_stress"]
        stretch = 1.0 + in_unit(channels["strain"], "1", "strain", place)
        made = f"{cauchy.label!r} ({cauchy.unit}) over the stretch (volume taken as constant)"
        _add(making, "stress", replace(cauchy, values=cauchy.values / stretch, made=made), "true_stress")


def question_stress(columns: dict[str, np.ndarray], making: Making) -> None:
    """Ask about a stress that no specimen of the kind bears."""
    bears, name = schema.KINDS[making.kind].bears, schema.column_of(making.kind, "stress")
    if bears is None or name not in columns:
        return
    most, matter = bears
    values = np.abs(columns[name])
    farthest = float(np.nanmax(values))
    asked = f"check: {making.channels['stress'].label!r} is " if "stress" in making.channels else "none"
    if farthest <= most or any(text.startswith(asked) for text in making.notices):
        return  # credible, or asked about beside a load
    rows = int(np.sum(values > most))
    mark = (
        ", or is it a mark for a missing reading (leave such fields empty)" if 5 * rows < len(values) else ""
    )
    making.warn(
        f"stress reaches {farthest:.4g} {name.rpartition('_')[2]} in {counted(rows, 'row')}, more than any"
        f" {matter}"
        f" bears: are its unit and the cross-section right{mark}?"
    )


def _ratio(above: np.ndarray, below: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Ratio of two columns in the rows where both are large enough, and those rows; None without any."""
    finite = np.isfinite(above) & np.isfinite(below)
    if not finite.any() or not np.abs(below[finite]).max() > 0.0 or not np.abs(above[finite]).max() > 0.0:
        return None
    large = finite & (np.abs(below) > LEAST * np.abs(below[finite]).max())
    return above[large] / below[large], large


def _compare_stress(making: Making) -> None:
    """Compare a file's stress with its load: find the cross-section between them, and check that it is the
    initial one."""
    channels = making.channels
    if "force" not in channels or channels["stress"].made or "stress" in making.options.columns:
        return
    stress, force = (in_unit(channels[q], u, q, making.place) for q, u in (("stress", "MPa"), ("force", "N")))
    stated_before = making.options.dimensions
    area = area_mm2(making, quiet=True)
    found = _ratio(stress, force)
    if found is None:
        return
    making.sources.add("force")
    per_load, rows = found
    label, load = channels["stress"].label, channels["force"].label
    strain = _fraction(making)
    if strain is not None and (true := _growth_with_stretch(per_load, strain[rows])):
        making.warn(
            f"{label!r} grows against {load!r} as the stretch does ({true:.0%} over the test): it is true"
            " stress, "
            f"not engineering stress. Name it so: --map true_stress={label!r}"
        )
        return
    implied = 1.0 / float(np.median(per_load))
    if area is None:
        if float(np.ptp(per_load)) < SAME * abs(float(np.median(per_load))):
            making.say(f"{label!r} and {load!r} imply a cross-section of {abs(implied):.4g} mm2")
        return
    factor = area / implied
    if abs(abs(factor) - 1.0) <= SAME:
        sign = ", but for the sign" if factor < 0.0 else ""
        making.say(f"{label!r} agrees with {load!r} over the cross-section of {area:.6g} mm2{sign}")
        return
    stated = any(set(names) <= stated_before.keys() for names in AREAS)
    source = f"{load!r} over the cross-section" if stated else repr(label)
    making.warn(
        f"{label!r} is {factor:.4g} times {load!r} over the cross-section of {area:.6g} mm2 (its own would be"
        f" {abs(implied):.4g} mm2); {source} was taken"
        + ("" if stated else ", state the right size with --dimension if the load is right")
    )
    if stated:
        del channels["stress"]
        _derive_stress(making)


def _compare_strain(making: Making) -> None:
    """Compare a file's strain with its extension and find the gauge length between them."""
    channels = making.channels
    strain = _fraction(making)
    if "elongation" not in channels or channels["strain"].made or strain is None:
        return
    extension = channels["elongation"]
    if extension.unit is None or extension.trouble:
        return
    millimetres = in_unit(extension, "mm", "elongation", making.place)
    gauge = gauge_length_mm(making, quiet=True)
    found = _ratio(strain, millimetres - millimetres[np.isfinite(millimetres)][0])
    if found is None:
        return
    making.sources.add("elongation")
    per_mm = float(np.median(found[0]))
    label = channels["strain"].label
    if gauge is None:
        if float(np.ptp(found[0])) < SAME * abs(per_mm):
            making.say(
                f"{label!r} and {extension.label!r} imply a gauge length of {abs(1.0 / per_mm):.4g} mm"
            )
        return
    factor = per_mm * gauge
    sign = ", but for the sign" if factor < 0.0 else ""
    if abs(abs(factor) - 1.0) <= SAME:
        making.say(f"{label!r} agrees with {extension.label!r} over the gauge length of {gauge:g} mm{sign}")
    else:
        making.warn(
            f"{label!r} is {factor:.4g} times {extension.label!r} over the gauge length of {gauge:g} mm;"
            f" {label!r} was"
            f" taken. To take the extension instead: --map elongation={extension.label!r}"
        )


def _fraction(making: Making) -> np.ndarray | None:
    """Strain as a fraction; None where its unit is uncertain."""
    channel = making.channels.get("strain")
    if channel is None or channel.trouble:
        return None
    return in_unit(channel, "1", "strain", making.place)


def _growth_with_stretch(per_load: np.ndarray, strain: np.ndarray) -> float | None:
    """Growth of stress over load, if it grows as the stretch and not as a constant; None if it does not.

    An initial cross-section gives a constant ratio; the current one of an incompressible specimen gives the
    stretch. The test is made where the stretch changes by more than the error of calipers.
    """
    stretch = 1.0 + strain
    finite = np.isfinite(stretch) & (stretch > 0.0)
    if finite.sum() < 3 or float(np.ptp(stretch[finite])) < 3.0 * SAME:
        return None
    ratio, stretch = per_load[finite], stretch[finite]
    misfits = []
    for shape in (np.ones_like(stretch), stretch):
        scale = float(shape @ ratio) / float(shape @ shape)
        misfits.append(float(np.sqrt(np.mean((ratio - scale * shape) ** 2))))
    grows = float(np.ptp(stretch)) / float(np.min(stretch))
    return grows if misfits[1] < 0.3 * misfits[0] and misfits[0] > 0.0 else None
