"""Detection of a channel that is slower than the clock, so that a logger repeated its readings."""

import numpy as np

from .noise import common_step, standing

LONG = 5
"""Minimum number of stretches of equal readings for a conclusion from them."""
STEPS = 2.5
"""Minimum median move between readings, in least moves, for rows that stand still to be copies. Rounded
readings of a slow trend move by one step, seldom by two."""
AS_OFTEN = 0.7
"""Minimum share of stretches of one length for copies by a logger."""
MANY, EVEN, SLOWEST = 20, 0.95, 10
"""MANY: minimum number of changes for a test of their rows. EVEN: minimum share of them that must agree, as
some rows are lost. SLOWEST: maximum number of rows for each reading."""
TWICE, CHANCES = 1.15, 4.0
"""Minimum mean number of rows for each reading of a slow channel. Second, minimum excess of rows that stand
still over moves by one step, in standard deviations of the count."""


def slower(values: np.ndarray, moves: np.ndarray) -> bool:
    """True if a channel is slower than the clock, by its readings and their moves."""
    if not moves.any() or len(standing(moves)) <= LONG:
        return False
    return (
        copied(moves)
        and not _in_steps(values, moves)
        or _at_even_rows(moves)
        or _once_or_twice(values, moves)
    )


def _at_even_rows(moves: np.ndarray) -> bool:
    """True if readings change at every k-th row only, by more than one size, as those of a slow channel do in
    any steps. Chance puts twenty changes there once in a million times."""
    at, sizes = np.flatnonzero(moves), np.round(moves[moves > 0.0] / moves[moves > 0.0].min(), 3)
    if len(at) < MANY or np.unique(sizes, return_counts=True)[1].max() > EVEN * len(at):
        return False
    return any(np.bincount(at % k).max() >= EVEN * len(at) for k in range(2, SLOWEST + 1))


def _once_or_twice(values: np.ndarray, moves: np.ndarray) -> bool:
    """True if readings come once or twice in turn, more of them twice than by rounding. Rounded readings
    stand still half as often as they move by one step either way."""
    stands = np.sort(standing(moves))
    usual = stands[: int(np.ceil(EVEN * len(stands)))]
    if usual[-1] != 2 or usual.mean() < TWICE:
        return False
    step = common_step(values)
    by_one = float(np.sum(np.round(moves / step) == 1.0)) if step > 0.0 else 0.0
    return float(np.sum(moves == 0.0)) > by_one + CHANCES * np.sqrt(by_one + 1.0)


def _in_steps(values: np.ndarray, moves: np.ndarray) -> bool:
    """True if readings stand still because they move by whole steps, or not within a dead band. They then
    stand as long as their trend needs for a step, while a logger repeats each as often as the last."""
    step, usual = common_step(values), float(np.median(moves[moves > 0.0]))
    if step > 0.0:
        return usual <= STEPS * step
    return bool(usual <= STEPS * moves[moves > 0.0].min()) and not regular(moves)


def regular(moves: np.ndarray) -> bool:
    """True if most stretches of equal readings are equally long."""
    stands = standing(moves)
    return bool(np.mean(stands == np.median(stands)) >= AS_OFTEN)


def everywhere(moves: np.ndarray) -> bool:
    """True if hardly any row comes alone. A logger that repeats rows does so throughout. A slow channel
    leaves whole rows equal only where everything else stands still."""
    return bool(np.mean(standing(moves) > 1.0) >= EVEN)


def copied(moves: np.ndarray) -> bool:
    """True if most readings come more than once in a row, by the move of each from the one before."""
    stands = standing(moves)
    return len(stands) > LONG and bool(np.median(stands) > 1.0)
