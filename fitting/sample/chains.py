"""What every sampler offers to the entry point: chains that grow, are judged and can be put away."""

from abc import ABC, abstractmethod
from typing import Any

from jaxtyping import Float
from numpy import ndarray

from .laplace import Laplace


class Chains(ABC):
    """Independent chains of one target.

    `ensembles` counts the chains that agreement is judged between; `walkers` those that one of them holds.
    """

    @abstractmethod
    def begin(self, found: Laplace) -> None:
        """Put chains around the fit, adapt to what is there.

        Raises:
            InputError: if no usable starting points are found there.
        """

    @abstractmethod
    def resume(self) -> None:
        """Take up the chains in the file where they were left.

        Raises:
            InputError: if the file is none, or of other data, another model or other settings.
        """

    @abstractmethod
    def advance(self, steps: int) -> None:
        """Run every chain for some steps, then put the chains on disk."""

    @property
    @abstractmethod
    def steps(self) -> int:
        """Steps that every chain has made."""

    @property
    @abstractmethod
    def judged(self) -> list[Float[ndarray, "steps walkers n"]]:
        """Positions in the sampler's own coordinates, in which convergence is judged; burn-in included."""

    @property
    @abstractmethod
    def coordinates(self) -> Float[ndarray, "ensembles steps walkers n"]:
        """The same in the target's coordinates."""

    @property
    @abstractmethod
    def log_probabilities(self) -> Float[ndarray, "ensembles steps walkers"]:
        """Of the same points, as densities of the target's coordinates."""

    @property
    @abstractmethod
    def acceptance(self) -> list[float]:
        """Fraction of proposals that each chain accepted."""

    @property
    @abstractmethod
    def evaluations(self) -> int:
        """Points at which the model was asked; for a sampler that uses gradients, with its gradient."""

    @property
    @abstractmethod
    def failures(self) -> int:
        """Points inside the bounds at which the model had no finite answer; they count as impossible."""

    @property
    @abstractmethod
    def diagnostics(self) -> dict[str, Any]:
        """What only this sampler can say of its chains, as `report.json` has it."""
