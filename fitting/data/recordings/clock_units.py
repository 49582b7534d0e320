"""Questions about a clock that rather counts milliseconds, or seconds under another heading."""

import numpy as np

from .recording import Recording
from .unit_question import MANY_ROWS, Question

LONG_S = 10 * 3600.0
"""Minimum duration of a test whose clock may count milliseconds [s]. Slow cycles take 8 hours, with steps of
5 to 240 s. Milliseconds under seconds reach as far after 29 s, and no step tells both apart."""
COUNTED_S = 5.0
"""Minimum step of such a clock [s]. Microcontrollers log every 5 ms or slower."""
SLOWEST_K_PER_S = 0.05 / 60.0
"""Minimum rate at which a chamber is heated or cooled [K/s]; the slowest ramps have 0.05 K/min or more."""
SWEPT_K = 10.0
"""Minimum range of a temperature that is swept, and not held [K]."""
LEAPT = 0.2
"""Maximum change from one row to the next over the range of a column [1]. A creep test that is logged every
minute leaps further where it is loaded."""
HELD = 0.02
"""Maximum distance from its median at which a load or a strain is held, over its largest value [1]."""
NO_LOADS = ("time", "cycle", "current", "resistance", "setpoint", "temperature")
"""Beginnings of columns that may leap in a test of seconds, too."""
BRIEF_S = 0.5
"""Minimum duration of a test [s]. Testing machines and pumps take longer."""
BRIEF_ROWS = 10
"""Minimum number of rows of a test that is asked about because it is brief."""


def clock_questions(recording: Recording, unit: str | None) -> list[Question]:
    """Ask about a clock that counts milliseconds, or one that is far too fast and not stated in seconds."""
    time = recording.columns.get("time_s", np.zeros(0))
    if time.size < BRIEF_ROWS or recording.counts_rows:
        return []
    steps, lasts = np.diff(time), float(time[-1] - time[0])
    if 0.0 < lasts < BRIEF_S and unit != "s":
        return [
            Question(
                "time",
                f"time_s: {time.size} rows last {lasts:.3g} s together. Is the unit of time right?"
                " (on import: --unit time=s, if these are seconds)",
            )
        ]
    if time.size < MANY_ROWS:
        return []
    whole, step = bool(np.all(np.mod(time, 1.0) == 0.0)), float(np.median(steps))
    if not whole or step < COUNTED_S or lasts < LONG_S or _is_slow(recording, steps):
        return []
    return [
        Question(
            "time",
            f"time_s: the test lasts {lasts / 3600.0:.3g} h, with a row every {step:.4g} s. Are"
            f" these milliseconds? Then it lasts {1e-3 * lasts:.4g} s (on import: --unit time=ms)",
        )
    ]


def _is_slow(recording: Recording, steps: np.ndarray) -> bool:
    """True for a test of hours: a chamber is heated faster than the slowest, or a load or strain is held.

    It is held in most rows, or comes from one row to the next. Tests of creep and of relaxation do so.

    Args:
        recording: recording of a test.
        steps: time from each row to the next [s], shape (rows - 1,).
    """
    temperature = recording.columns.get("temperature_degC")
    if temperature is not None and np.nanmax(temperature) - np.nanmin(temperature) > SWEPT_K:
        rates = np.abs(np.diff(temperature))[steps > 0.0] / steps[steps > 0.0]
        return bool(np.nanpercentile(rates, 90.0) > SLOWEST_K_PER_S) if np.isfinite(rates).any() else False
    for name in recording.known_columns:
        values = recording.columns[name]
        known = values[np.isfinite(values)]
        if name.startswith(NO_LOADS) or known.size < 2:
            continue
        held = np.abs(known - np.median(known)) <= HELD * float(np.max(np.abs(known)))
        leapt = float(np.max(np.abs(np.diff(known)))) > LEAPT * float(np.ptp(known)) > 0.0
        if leapt or np.mean(held) > 0.5:
            return True
    return False
