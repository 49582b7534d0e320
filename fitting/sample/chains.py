"""The interface of every sampler: chains that advance, are judged and can be stored."""

from abc import ABC, abstractmethod
from typing import Any

from jaxtyping import Float
from numpy import ndarray

from .laplace import Laplace


class Chains(ABC):
    """Independent chains of one target.

    `ensembles` is the number of chains whose agreement is judged; `walkers` is the number of walkers in each.

    Attributes:
        why: sentence about the choice of the sampler; it is stored with the chains.
    """

    why: str = ""

    @abstractmethod
    def begin(self, found: Laplace) -> None:
        """Start chains around the fit and adapt the sampler.

        Raises:
            InputError: if no usable starting points are found there.
        """

    @abstractmethod
    def resume(self) -> None:
        """Continue the chains of the file.

        Raises:
            InputError: if there is no file, or it is of other data, another model or other settings.
        """

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Advance every chain by some steps, then store the chains."""

    @property
    @abstractmethod
    def steps(self) -> int:
        """Number of steps of every chain."""

    @property
    @abstractmethod
    def judged(self) -> list[Float[ndarray, "steps walkers n"]]:
        """Positions in the coordinates in which convergence is judged, burn-in included."""

    @property
    @abstractmethod
    def coordinates(self) -> Float[ndarray, "ensembles steps walkers n"]:
        """Positions in the target's coordinates."""

    @property
    @abstractmethod
    def log_probabilities(self) -> Float[ndarray, "ensembles steps walkers"]:
        """Log-densities of the same points, in the target's coordinates."""

    @property
    @abstractmethod
    def acceptance(self) -> list[float]:
        """Fraction of proposals that each chain accepted."""

    @property
    @abstractmethod
    def evaluations(self) -> int:
        """Number of evaluations of the model; with its gradient for a sampler that uses gradients."""

    @property
    @abstractmethod
    def failures(self) -> int:
        """Number of points inside the bounds without a finite answer of the model; they count as
        impossible."""

    @property
    @abstractmethod
    def diagnostics(self) -> dict[str, Any]:
        """Diagnostics of this sampler alone, as in `report.json`."""
