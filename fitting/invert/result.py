"""Drives that were found for targets, as data; `fitting.report.invert` renders them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fitting.inference.results import Result


@dataclass(frozen=True)
class Inversion(Result):
    """Drives for targets; arrays have a leading axis of targets.

    Attributes:
        design: name of what is driven.
        goals: names; wanted: their values in SI, shape (targets, columns).
        springs: segment and number of every spring.
        pressure: gauge [Pa]; fractions: shape (targets, springs); resistances [ohm] and currents [A] that
            hold them in still air, the same.
        values: model's values of the goals under these drives [SI], shape (targets, columns).
        misses: distance from each goal [SI], by goal.
        met: true where every goal is met within its tolerance.
        held: the ends of drives that hold an unmet target, in words.
        ways: drives of every other solution that was found for each target, shape (ways, drives).
        unheated: martensite fraction of every spring that no current heats, in air of 22 degC [1]; highest:
            the largest that the drives may give it; shape (springs,).
        way_heat: heating power of every other solution [W], shape (ways,) of each target.
        reach: least and largest value of each goal that has one column, over states all over the limits of
            the drives [SI]; by goal.
    """

    design: str
    goals: tuple[str, ...]
    wanted: np.ndarray
    springs: tuple[tuple[int, int], ...]
    pressure: np.ndarray
    fractions: np.ndarray
    resistances: np.ndarray
    currents: np.ndarray
    values: np.ndarray
    misses: Mapping[str, np.ndarray]
    met: np.ndarray
    held: tuple[str, ...]
    ways: tuple[np.ndarray, ...]
    unheated: np.ndarray
    highest: np.ndarray
    way_heat: tuple[np.ndarray, ...]
    reach: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def heat(self) -> np.ndarray:
        """Power that holds all springs at their temperatures in air of 22 degC [W], shape (targets,)."""
        return np.sum(self.currents**2 * self.resistances, axis=1)

    @property
    def left_alone(self) -> np.ndarray:
        """Fraction from which on a spring counts as one that is left alone [1], shape (springs,)."""
        return np.maximum(self.unheated, self.highest)

    def spring_name(self, k: int) -> str:
        """Name of a spring's column: `2`, or `1.2` in a chain."""
        return spring_name(self.springs, k)


def spring_name(springs: Sequence[tuple[int, int]], k: int) -> str:
    """Name of a spring: its number, in a chain after that of its segment."""
    several = len({segment for segment, _ in springs}) > 1
    return f"{springs[k][0]}.{springs[k][1]}" if several else str(springs[k][1])
