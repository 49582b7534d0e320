"""The start of a test: a strain, a stress or a force that does not begin at zero."""

import numpy as np

from pneusma_jax.errors import counted

from ..slack import noise_of_steps, reading_at_rest
from .making import Making

AT_START = 0.05
"""Maximum start of a strain that was counted from rest, as part of its range."""
PRELOAD = 0.01
"""Minimum reported stress or force at zero strain, as part of its range. Load cells are zeroed better."""
ACROSS = 0.05
"""Minimum share of rows with opposite signs of strain and stress, both beyond `AT_START`, that indicates a
shifted zero. A loop of a rubber has fewer."""
BOTH_WAYS = 0.2
"""The same share where a stress has one sign and the strain both."""
BEGINS = "strain begins at"
"""First words of a notice about a strain that may be counted from another zero."""
NOISES = 5.0
"""Number of standard deviations of its noise, below which a stress at the start counts as none."""


def notice_start(columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making) -> None:
    """Report the start of a test that does not begin at zero.

    Nothing follows from the first rows where they lack a number: the test began before.
    """
    if making.options.slack == "auto":
        making.say("no slack was found at the start: nothing was left out for --slack auto")
    drive, force = (columns[name] for name in pair)
    finite = np.isfinite(drive) & np.isfinite(force)
    if finite.sum() < 8 or not finite[0]:
        return
    x, y = drive[finite], force[finite]
    if "time_s" not in columns and _only_returns(x):
        making.warn(
            f"without a clock the order of rows is that of time, and {pair[0].removesuffix('_mm')} falls "
            "from the first row to the last, though a specimen begins at rest. If the newest row stands "
            "first, turn the rows round"
        )
    if making.kind == "spring":
        _is_a_position(x, y, making)
    elif _begins_elsewhere(x, making) or _crosses(x, y, pair, making):
        return
    _notice_rest(x, y, pair, making)


def _only_returns(x: np.ndarray) -> bool:
    """True for a strain or elongation that never grows, from its largest in the first row to about none."""
    size = np.abs(x)
    return bool(np.all(np.diff(size) <= 0.0) and size[-1] <= AT_START * size[0])


def _begins_elsewhere(x: np.ndarray, making: Making) -> bool:
    """Report a strain that begins at its smallest, and not at zero."""
    if not (abs(x[0]) > AT_START * float(np.ptp(x)) and abs(x[0]) == float(np.abs(x).min())):
        return False
    making.warn(
        f"{BEGINS} {x[0]:.4g}, not at 0: was it counted from another zero? --subtract"
        f" strain={x[0]:.4g}"
    )
    return True


def _is_a_position(x: np.ndarray, y: np.ndarray, making: Making) -> None:
    """Report an elongation that begins far from 0, with hardly a force or beyond its own range."""
    begins = abs(x[0]) > AT_START * float(np.ptp(x)) and abs(x[0]) == float(np.abs(x).min())
    if begins and (abs(y[0]) < AT_START * float(np.abs(y).max()) or abs(x[0]) > float(np.ptp(x)) > 0.0):
        making.warn(
            f"elongation begins at {x[0]:.4g} mm with a force of {y[0]:.3g} N: is it a position, counted from"
            f" another zero? --subtract elongation_mm={x[0]:.4g}"
        )


def _crosses(x: np.ndarray, y: np.ndarray, pair: tuple[str, str], making: Making) -> bool:
    """Report strain and stress of opposite signs over a part of the test: one has another zero."""
    reach = float(np.ptp(x))
    across = (x * y < 0.0) & (np.abs(x) > AT_START * reach) & (np.abs(y) > AT_START * float(np.abs(y).max()))
    least = int(np.argmin(np.abs(y)))
    answer, unit = pair[1].rsplit("_", 1)
    one_sign = not (np.any(y > 0.0) and np.any(y < 0.0))
    at_rest = abs(x[least]) <= AT_START * reach  # elsewhere the zero of the strain is another
    if np.mean(across) > BOTH_WAYS and one_sign and at_rest and x.min() < 0.0 < x.max():
        making.warn(
            f"{answer} has one sign, and strain goes both ways, so that they oppose each other in"
            f" {counted(int(across.sum()), 'row')}: was the sign of the load lost? Then write it into the"
            " file"
        )
        return True
    if not (np.mean(across) > ACROSS and abs(x[least]) > AT_START * reach):
        return False
    making.warn(
        f"strain and {answer} have opposite signs in {counted(int(across.sum()), 'row')}, so one of them was"
        f" counted from another zero. {answer} is nearest to 0, {y[least]:.4g} {unit}, at strain"
        f" {x[least]:.4g}. If the specimen was at rest there: --subtract strain={x[least]:.4g}"
    )
    return True


def _notice_rest(x: np.ndarray, y: np.ndarray, pair: tuple[str, str], making: Making) -> None:
    """Report a stress or force where there is no strain or elongation."""
    found = reading_at_rest(x, y)
    rest = found.reading
    least = max(PRELOAD * float(np.ptp(y)), NOISES * noise_of_steps(y))
    if abs(x[0]) > AT_START * float(np.ptp(x)) or abs(rest) <= least:
        return
    if abs(y[0]) <= least and rest * y[0] <= 0.0:
        return  # the first row has hardly a reading, and beyond it the curve would have to turn its sign
    answer, unit = pair[1].rsplit("_", 1)
    drive = pair[0].removesuffix("_mm")
    own = " the initial tension of a close-wound spring," if making.kind == "spring" else ""
    making.warn(
        f"{answer} is {rest:.4g} {unit} at {drive} {found.at:.4g}: a preload,{own} or the load cell's zero."
        f" If it is the zero: --subtract {pair[1]}={rest:.4g}"
    )
