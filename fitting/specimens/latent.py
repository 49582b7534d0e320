"""Hidden states of a specimen under effects: trajectories that no column holds and that have to explain
several columns together, such as a martensite fraction."""

import abc
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Campaign
from fitting.inference.channels import Channel

from .rows import Rows

Drivers = Callable[[list[Rows]], dict[str, np.ndarray]]
"""What drives the outputs of recordings under a model, by name, each of shape (recordings, rows)."""


class LatentStates(abc.ABC):
    """The latent trajectories of one kind of specimen.

    Attributes:
        present: whether there are any.
        inside: whether the specimen's own `answer` finds them; else whoever evaluates it solves for them.
        readings: outputs beside the specimen's own that show them.
    """

    present: bool = True
    inside: bool = False
    readings: tuple[str, ...] = ()

    @abc.abstractmethod
    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Every recording as arrays whose latent trajectories are free; arguments as `Specimen.rows_for`."""

    @abc.abstractmethod
    def count(self, stacked: Rows) -> int:
        """Trajectories of a recording that are solved for outside of `answer`."""

    @abc.abstractmethod
    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]] | None = None
    ) -> Rows:
        """A stack whose trajectories wander as fast as the recordings say at these base constants.

        Args:
            values: base constants by name, SI.
            stacked: recordings.
            channels: the noise of every column as a diagnosis weighs it; as the rows do, if there are none.
        """

    @abc.abstractmethod
    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """A stack whose searches for trajectories begin where those of an evaluation ended, by its
        drivers."""

    @abc.abstractmethod
    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """Recordings whose trajectories are read anew under a model with effects."""

    @abc.abstractmethod
    def spent(self, recordings: Sequence[Rows]) -> int:
        """Measured values that trajectories take up."""


class NoLatentStates(LatentStates):
    """A specimen whose state follows from its inputs.

    Args:
        rows_for: the specimen's own.
    """

    present = False

    def __init__(self, rows_for: Callable[..., list[Rows]]):
        self._rows_for = rows_for

    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """The specimen's own rows."""
        return self._rows_for(campaign, **tables)

    def count(self, stacked: Rows) -> int:
        """None."""
        return 0

    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]] | None = None
    ) -> Rows:
        """The same stack."""
        return stacked

    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """The same stack."""
        return stacked

    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """The same recordings."""
        return recordings

    def spent(self, recordings: Sequence[Rows]) -> int:
        """None."""
        return 0
