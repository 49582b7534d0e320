"""Slack at the start of a test: reported, subtracted, or left to the fits."""

import numpy as np

from pneusma_jax.errors import counted

from ..recordings import schema
from ..recordings.table import unusable
from ..slack import Rest, Slack, find_slack, noise_of_steps, reading_at_rest
from .making import Making

TWICE, LEAST_ZERO = 2.0, 0.01
"""Standard deviation of a zero for fits, as a multiple of its estimate; its minimum as part of the largest
value. Load cells and grips are set better than the minimum."""
FLAT_PART, NOISY = 0.02, 6.0
"""Changes of a reading over a stated slack above which it was not flat. The first is a part of its range, the
second a number of standard deviations of its noise. Noise alone changes by less."""
LEAST_LEFT = 3
"""Minimum number of rows beyond a slack. Two points are no test."""


def slack_of(drive: np.ndarray, force: np.ndarray, making: Making) -> Slack | None:
    """Slack as stated or as detected; None where there is none."""
    stated = making.options.slack
    if not isinstance(stated, float):
        return find_slack(drive, force)
    start = stated if largest(drive) >= 0.0 else -stated
    finite = np.isfinite(drive) & np.isfinite(force)
    stroke = finite & (np.arange(len(drive)) <= int(np.nanargmax(np.abs(drive))))
    before = stroke & (np.abs(drive) <= abs(start))
    rise = float(np.ptp(force[before])) if before.any() else 0.0
    if rise > max(FLAT_PART * float(np.ptp(force[finite])), NOISY * noise_of_steps(force[finite])):
        making.warn(
            f"up to {start:.4g}, as --slack states, the reading is not flat but changes by {rise:.4g}: was"
            " the specimen slack there?"
        )
    return Slack(start, float(np.mean(force[before])) if before.any() else 0.0, int(before.sum()))


def _text(slack: Slack, pair: tuple[str, str]) -> str:
    """Description of the slack, of the answer to a drive: their names in the canonical columns."""
    answer, unit = pair[1].rsplit("_", 1)
    drive = "strain" if pair[0] == "strain" else "elongation"
    length = "" if drive == "strain" else " mm"
    level, start = f"{slack.zero:.4g} {unit}", f"{drive} {slack.start:.4g}{length}"
    return f"{answer} is flat at {level} up to {start} ({counted(slack.rows, 'row')})"


def offer(slack: Slack, pair: tuple[str, str], making: Making) -> None:
    """Report detected slack and the options for it."""
    making.warn(
        f"{_text(slack, pair)} and rises from there: slack, and the load cell's zero. --slack auto"
        " starts there and"
        " takes the zero off; --slack keep leaves it"
        + ("; --slack fit leaves both to the fits, with their uncertainty" if pair[1] == "stress_kPa" else "")
    )


def leave_to_fit(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """State the standard deviation of both zeros: twice the estimate, or the usual minimum.

    Raises:
        InputError: if no fit of this kind finds zeros.
    """
    if making.kind not in schema.with_zeros():
        raise unusable(
            making.place, f"--slack fit: no fit of kind {making.kind} finds zeros (kinds that do:"
            f" {', '.join(schema.with_zeros())}); --slack auto takes them off",
        )  # fmt: skip
    drive, force = (columns[name] for name in pair)
    slack = slack_of(drive, force, making)
    finite = np.isfinite(drive) & np.isfinite(force)
    rest = reading_at_rest(drive[finite], force[finite]) if finite.any() else Rest(0.0)
    estimates = (slack.start, slack.zero) if slack else (0.0, rest.reading)
    for name, values, size in zip(pair, (drive, force), estimates, strict=True):
        least = LEAST_ZERO * float(np.nanmax(np.abs(values)))
        making.zero[name] = float(f"{max(TWICE * abs(size), least):.2g}")
    stated = ", ".join(f"{name} = {sd:g}" for name, sd in making.zero.items())
    none = f"no slack was found; stress is {rest.reading:.4g} kPa at strain {rest.at:.4g}"
    text = _text(slack, pair) if slack else none
    making.say(f"{text}: both zeros are left to every fit, with standard deviations of [zero] {stated}")


def start_at(
    slack: Slack, columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making
) -> np.ndarray:
    """Count strain from the point where the specimen became taut. A coupon that hung slack was longer than
    its grips' gap.

    Raises:
        InputError: if hardly any row lies beyond that point.
    """
    drive, force = pair
    sign = 1.0 if slack.start >= 0.0 else -1.0
    raw = columns[drive]
    keep = ~(sign * raw < sign * slack.start)
    left = int(np.sum(keep & np.isfinite(raw) & np.isfinite(columns[force])))
    if left < LEAST_LEFT:
        word, unit = ("strain", "") if drive == "strain" else ("elongation", " mm")
        percent = ", and a fraction, so that 5 % is 0.05" if drive == "strain" else ""
        raise unusable(
            making.place, f"--slack {making.options.slack}: {counted(left, 'row lies', 'rows lie')} beyond"
            f" it; {word} goes from"
            f" {np.nanmin(raw):.4g} to {np.nanmax(raw):.4g}{unit} here, and the slack is its first part"
            f"{percent}",
        )  # fmt: skip
    if drive == "strain":
        columns[drive] = (raw - slack.start) / (1.0 + slack.start)
        how = f"strain is counted from there, as (strain - {slack.start:.4g}) / (1 + {slack.start:.4g})"
    else:
        columns[drive] = raw - slack.start
        how = f"elongation is counted from there, {slack.start:.4g} mm less"
    columns[force] = columns[force] - slack.zero
    answer, unit = force.rsplit("_", 1)
    making.say(
        f"{_text(slack, pair)}: {counted(int((~keep).sum()), 'slack row')} left out, {how};"
        f" {slack.zero:.4g}"
        f" {unit} taken off"
        f" {answer} (--slack)"
    )
    return keep


def largest(values: np.ndarray) -> float:
    """Value of largest magnitude, with its sign; 0 where there is none."""
    finite = values[np.isfinite(values)]
    return float(finite[np.argmax(np.abs(finite))]) if finite.size else 0.0
