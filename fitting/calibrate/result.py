"""What every pipeline hands back, whatever it has fitted: named parameters with their errors."""

import abc
from dataclasses import dataclass
from typing import Any

from fitting.inference.results import Result, sampler_of

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


class Characterisation(Result, abc.ABC):
    """Result of fitting one kind of specimen."""

    @property
    @abc.abstractmethod
    def parameters(self) -> dict[str, Estimate]:
        """The material's parameters by name."""

    @property
    def law(self) -> str:
        """Name of the law whose constants these are, of kinds that know several; empty of others."""
        return ""

    def posterior(self, **options: Any) -> Result:
        """Sample the posterior of the parameters, starting from this fit; options as for `sample_problem`.

        Raises:
            InputError: if this kind of result cannot be sampled, or an option cannot be used.
        """
        return sampler_of(self)(self, **options)
