"""What is known of an effect's parameters before any data."""

from typing import NamedTuple


class Spec(NamedTuple):
    """One parameter of an effect.

    Attributes:
        neutral: value at which the effect is absent; for a shape parameter, a typical one.
        low, high: physical bounds; a fit that ends on one is a warning that the explanation is wrong.
        typical: of a present effect, where a fit starts.
        unit: SI, or degC.
        text: for a report.
        shape: whether the parameter means nothing while the effect is absent (a lag, a threshold), so that it is
            scanned rather than screened by its derivative.
    """

    neutral: float
    low: float
    high: float
    typical: float
    unit: str
    text: str
    shape: bool = False
