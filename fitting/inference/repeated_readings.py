"""Whether a channel is slower than the clock, so that a logger wrote its readings again."""

import numpy as np

from .noise import common_step, standing

LONG = 5
"""Stretches of equal readings from which anything is told by them."""
STEPS = 2.5
"""Median move between readings, in least moves, from which rows that stand still were not read: rounded
readings of a slow course move by one step, seldom by two."""
AS_OFTEN = 0.7
"""Share of stretches of one length from which a logger made them."""
MANY, EVEN, SLOWEST = 20, 0.95, 10
"""Changes from which it is asked at which rows they are; share of them that must agree, as some rows are
lost; rows for each reading at most."""
TWICE, CHANCES = 1.15, 4.0
"""Mean rows for each reading from which a channel is slower than the clock, and standard deviations of the
count of moves by one step that rows which stand still exceed it by."""


def slower(values: np.ndarray, moves: np.ndarray) -> bool:
    """Whether a channel is slower than the clock, by its readings and their moves."""
    if not moves.any() or len(standing(moves)) <= LONG:
        return False
    return (
        copied(moves)
        and not _in_steps(values, moves)
        or _at_even_rows(moves)
        or _now_and_then(values, moves)
    )


def _at_even_rows(moves: np.ndarray) -> bool:
    """Whether readings change at every k-th row only, by more than one size, as a slow channel's do in
    whatever steps: chance puts twenty changes there once in a million times."""
    at, sizes = np.flatnonzero(moves), np.round(moves[moves > 0.0] / moves[moves > 0.0].min(), 3)
    if len(at) < MANY or np.unique(sizes, return_counts=True)[1].max() > EVEN * len(at):
        return False
    return any(np.bincount(at % k).max() >= EVEN * len(at) for k in range(2, SLOWEST + 1))


def _now_and_then(values: np.ndarray, moves: np.ndarray) -> bool:
    """Whether readings come once or twice in turn, more of them twice than rounding makes: rounded readings
    stand still half as often as they move by one step either way."""
    stands = np.sort(standing(moves))
    usual = stands[: int(np.ceil(EVEN * len(stands)))]
    if usual[-1] != 2 or usual.mean() < TWICE:
        return False
    step = common_step(values)
    by_one = float(np.sum(np.round(moves / step) == 1.0)) if step > 0.0 else 0.0
    return float(np.sum(moves == 0.0)) > by_one + CHANCES * np.sqrt(by_one + 1.0)


def _in_steps(values: np.ndarray, moves: np.ndarray) -> bool:
    """Whether readings stand still because they move by whole steps, or not within a dead band: as long as
    their course takes for that, while a logger writes each as often as the last."""
    step, usual = common_step(values), float(np.median(moves[moves > 0.0]))
    if step > 0.0:
        return usual <= STEPS * step
    return bool(usual <= STEPS * moves[moves > 0.0].min()) and not regular(moves)


def regular(moves: np.ndarray) -> bool:
    """Whether most stretches of equal readings are equally long."""
    stands = standing(moves)
    return bool(np.mean(stands == np.median(stands)) >= AS_OFTEN)


def everywhere(moves: np.ndarray) -> bool:
    """Whether hardly any row comes alone: a logger that writes rows again does so all the way, while a slow
    channel leaves whole rows equal only where everything else stands still."""
    return bool(np.mean(standing(moves) > 1.0) >= EVEN)


def copied(moves: np.ndarray) -> bool:
    """Whether most readings come more than once in a row, by what each moved from the one before."""
    stands = standing(moves)
    return len(stands) > LONG and bool(np.median(stands) > 1.0)
