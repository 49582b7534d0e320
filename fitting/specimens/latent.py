"""Interface for hidden states of a specimen under effects.

A latent trajectory, such as a martensite fraction, is in no column and has to explain several columns
together.
"""

import abc
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign
from fitting.inference.channels import Channel

from .rows import Rows

Drivers = Callable[[list[Rows]], dict[str, np.ndarray]]
"""Drivers of recordings under a model, by name, each of shape (recordings, rows)."""


class LatentStates(abc.ABC):
    """Latent trajectories of one kind of specimen.

    Attributes:
        present: true if the kind has latent trajectories.
        inside: true if the specimen's own `answer` finds them; otherwise the caller solves for them.
        may_rest: true if a trajectory may be constant at an unknown value, as of a wire at full heat.
        readings: outputs, beside the specimen's own, that depend on the trajectories.
    """

    present: bool = True
    inside: bool = False
    may_rest: bool = False
    readings: tuple[str, ...] = ()

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Recordings as arrays whose latent trajectories are free; arguments as for `Specimen.rows_for`."""

    @abc.abstractmethod
    def count(self, stacked: Rows) -> int:
        """Number of trajectories per recording that are solved for outside of `answer`."""

    @abc.abstractmethod
    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]]
    ) -> Rows:
        """A stack with the process-noise variance that its recordings imply at these base constants.

        Args:
            values: base constants by name, SI.
            stacked: stack of recordings.
            channels: noise of every column as a diagnosis weights it.
        """

    @abc.abstractmethod
    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """A stack whose searches for trajectories start at the end of an earlier evaluation, given by its
        drivers."""

    def resting(self, stacked: Rows) -> np.ndarray:
        """Mask of the recordings of a stack whose trajectories are constant; none by default."""
        return np.zeros(len(stacked.mask), bool)

    def with_resting(self, stacked: Rows, chosen: np.ndarray) -> Rows:
        """A stack with the trajectories of chosen recordings constant, where the kind allows that.

        Args:
            stacked: stack of recordings.
            chosen: mask of them, (recordings of the stack,).
        """
        return stacked

    def otherwise(self, drivers: Mapping[str, Array]) -> list[dict[str, Array]]:
        """Drivers of an evaluation with other decisions of a specimen's memory, to begin searches with; none
        by default."""
        return []

    @abc.abstractmethod
    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """Recordings whose trajectories are found anew under a model with effects."""


class NoLatentStates(LatentStates):
    """A specimen whose state follows from its inputs.

    Args:
        rows_for: row builder of the specimen.
    """

    present = False

    def __init__(self, rows_for: Callable[..., list[Rows]]):
        self._rows_for = rows_for

    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Recordings from the specimen's own row builder."""
        return self._rows_for(campaign, **tables)

    def count(self, stacked: Rows) -> int:
        """Zero."""
        return 0

    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]]
    ) -> Rows:
        """The same stack."""
        return stacked

    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """The same stack."""
        return stacked

    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """The same recordings."""
        return recordings
