"""What every pipeline hands back, whatever it has fitted: words, figures, and files that appear together."""

import abc
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from pneusma_jax.calibration.records import Calibration
from pneusma_jax.errors import InputError

if TYPE_CHECKING:
    from fitting.sample.campaign import CampaignPosterior
    from fitting.sample.problem import Problem

SCHEMA = "pneusma-characterisation/1"


@dataclass(frozen=True)
class Estimate:
    """One fitted parameter, in the unit that files give it.

    Attributes:
        value: the number.
        sd: its standard error; NaN if the data do not determine it.
        unit: of both.
        at_bound: it stopped at a bound of its search.
    """

    value: float
    sd: float
    unit: str
    at_bound: bool


class Characterisation(abc.ABC):
    """Result of fitting one kind of specimen."""

    @property
    @abc.abstractmethod
    def verdict(self) -> list[str]:
        """What was found, in a few sentences, the most important first."""

    @property
    @abc.abstractmethod
    def parameters(self) -> dict[str, Estimate]:
        """The material's parameters by name."""

    @property
    def law(self) -> str:
        """Name of the law whose constants these are, of kinds that know several; empty of others."""
        return ""

    @abc.abstractmethod
    def report(self) -> str:
        """The whole result as plain text."""

    @abc.abstractmethod
    def plot(self) -> dict[str, Figure]:
        """Figures by name; nothing is fitted or drawn on a screen."""

    @abc.abstractmethod
    def documents(self) -> dict[str, str | bytes]:
        """Content of every file of the result, by file name."""

    def sampling_problem(self, model: Calibration | None = None) -> "Problem":
        """What `posterior` samples; `model` is a table whose priors the parameters get.

        Raises:
            InputError: if this kind of result cannot be sampled.
        """
        raise InputError(f"a posterior of this kind of result ({type(self).__name__}) cannot be sampled")

    def posterior(self, **options: Any) -> "CampaignPosterior":
        """Sample the parameters' posterior, starting from this fit; options as for `posterior_of`.

        Raises:
            InputError: if this kind of result cannot be sampled, or an option cannot be used.
        """
        from fitting.sample.campaign import posterior_of

        return posterior_of(self, **options)

    def save(self, folder: str | Path, force: bool = False) -> list[Path]:
        """Write all files; they appear together or not at all.

        Args:
            folder: made if it does not exist.
            force: replace files of these names that are there already.

        Returns:
            Paths of the files.

        Raises:
            InputError: if files are in the way, or the place cannot be written.
        """
        from fitting.data.publish import publish

        return publish(folder, self.documents, force)
