"""Whether a distribution of an input gives numbers that can be: positive sizes, in the unit that is meant."""

from collections.abc import Mapping

from scipy.special import ndtri

from fitting.specimens.rows import MARK
from pneusma_jax.calibration.keys import POSITIVE
from pneusma_jax.calibration.plausible import implausible, unusual
from pneusma_jax.errors import InputError
from pneusma_jax.units import amount, constant_from_si, dimension_of

from .distributions import Marginal
from .inputs import normal_scores
from .study import Study

UNSEEN = 0.01
"""Expected number of rows with impossible numbers from which on a distribution is refused [1]. Of 1,000 rows
that is a standard deviation of 23 % of the mean, of 10,000 one of 21 %."""


def lowest_score(study: Study) -> float:
    """Lowest normal score that counts: of the rows of a study, or of its search for small probabilities."""
    return float(normal_scores(0.0) if study.rare else ndtri(min(UNSEEN / study.sampling.rows, 0.5)))


def check_possible(marginal: Marginal, name: str, unit: str, where: str, lowest: float) -> None:
    """Refuse a distribution that reaches zero where only positive numbers can be, or is in another unit.

    A row with a negative size may have an equilibrium, which is that of no specimen.

    Args:
        marginal: distribution of the input.
        name: its name.
        unit: its unit in files.
        where: file and table, for messages.
        lowest: normal score of the lowest number that counts, see `lowest_score`.

    Raises:
        InputError: with the number that it reaches, or the unit that may be meant.
    """
    key = _key(name)
    if why := implausible(key, dimension_of(unit), _shown(marginal, 0.0, unit), unit):
        raise InputError(f"{where}: the median: {why}")
    if least := _impossible(marginal, name, unit, lowest):
        raise InputError(
            f"{where}: the distribution reaches {least}, but {name} must be positive; "
            f"state min in [input.{name}], or a distribution without such values, such as 'lognorm'"
        )


def doubtful_priors(priors: Mapping[str, Marginal], units: Mapping[str, str], lowest: float) -> list[str]:
    """A sentence on every prior of a table that reaches zero where only positive numbers can be.

    A table is not refused for it, since a study does not write it.

    Args:
        priors: priors that are drawn, by name.
        units: units in files, by name.
        lowest: normal score of the lowest number that counts, see `lowest_score`.
    """
    reached = {name: _impossible(prior, name, units[name], lowest) for name, prior in priors.items()}
    return [
        f"the prior of {name} reaches {least}, but {name} must be positive: rows there are of no specimen; "
        f"state min in the table, or [input.{name}]"
        for name, least in reached.items()
        if least
    ]


def _impossible(marginal: Marginal, name: str, unit: str, lowest: float) -> str:
    """The lowest number that counts, where it is not positive and has to be; empty elsewhere."""
    least = _shown(marginal, lowest, unit)
    return amount(f"{least:.3g}", unit) if _key(name) in POSITIVE and least <= 0.0 else ""


def doubts(marginal: Marginal, name: str, unit: str) -> list[str]:
    """A question about a distribution whose median is far from usual; none for others."""
    why = unusual(_key(name), dimension_of(unit), _shown(marginal, 0.0, unit), unit)
    return [f"[input.{name}]: the median: {why}"] if why else []


def _key(name: str) -> str:
    """Name of a number in its table, without the table and the specimen."""
    return name.rpartition(".")[2].partition(MARK)[0]


def _shown(marginal: Marginal, score: float, unit: str) -> float:
    return float(constant_from_si(marginal.at(score), unit))
