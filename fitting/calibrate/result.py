"""Common result of every pipeline: named parameters with their errors."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from fitting.inference.results import Result, sampler_of

SCHEMA = "pneusma-characterisation/1"


@dataclass(frozen=True)
class Estimate:
    """One fitted parameter, in the unit that files give it.

    Attributes:
        value: the number.
        sd: its standard error; NaN if the data do not determine it. Where the profile likelihood is no
            parabola it is half of the profile's 90 % interval over 1.645.
        unit: unit of both.
        at_bound: it stopped at a bound of its search.
        interval: ends of the quoted intervals by per cent (50, 68, 90); empty where none is known.
        curved: the intervals are those of a profile likelihood that is no parabola.
        determined: true for each end of the 90 % interval (lower, upper) that the recordings determine. The
            other ends come from the prior or the bound of the search.
        of_prior: width of the 90 % interval over that of the prior; None without a prior.
    """

    value: float
    sd: float
    unit: str
    at_bound: bool
    interval: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    curved: bool = False
    determined: tuple[bool, bool] = (True, True)
    of_prior: float | None = None


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
