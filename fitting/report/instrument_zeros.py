"""Sentences on zeros of instruments that are off or drift, and on what they and a misfit add to errors."""

from typing import Protocol

import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.lasting_noise import Lasting, variances_by_name
from fitting.inference.notes import joined
from fitting.inference.numbers import number

TELLING = 0.1
"""Growth of an error by zeros that are off, from which the report speaks of them: a digit of an error bar."""
LARGE_DRIFT = 2.0
"""Minimum drift of a zero, in units of the noise, at which the report begins with it.

In four simulated campaigns of springs zeros drifted by the noise, and were estimated at 0.8 to 1.05. Where 5
or 10 % of a wire stayed cold without the law knowing it, three campaigns had drifts of 6.7 to 19. A zero that
is off by a constant says nothing: load cells are, and the fit counts it."""


def error_factors(inflation: float, lasting: Lasting | None) -> str:
    """What the errors of a fit were multiplied by, and for what; empty where they are those of the fit alone.

    Args:
        inflation: factor for misfit and serial correlation.
        lasting: zeros of instruments that widen errors, or None.
    """
    grown = _grown(lasting) if _large(lasting) else 1.0
    doubt = "" if _told_zeros(lasting) else " that these recordings do not exclude"
    by = f"by up to {number(grown, '.2g')} for zeros of instruments{doubt}"
    zeros = by if grown >= 1.0 + TELLING else ""
    own = f"by {number(inflation, '.2g')} for misfit and correlation" if inflation > 1.0 else ""
    return f"multiplied {' and '.join(filter(None, (own, zeros)))}" if own or zeros else ""


def how_errors_grew(inflation: float, lasting: Lasting | None) -> str:
    """The same as the end of a sentence on standard errors."""
    factors = error_factors(inflation, lasting)
    return f"were {factors}" if factors else "were not multiplied"


def _grown(lasting: Lasting | None) -> float:
    """Largest growth of an error by zeros of instruments, where errors count them."""
    if lasting is None or lasting.fitted_beside_zeros:
        return 1.0
    return float(np.sqrt(np.max(lasting.variance, initial=1.0)))


def _large(lasting: Lasting | None) -> list[str]:
    """Columns whose zeros may be off by a telling amount, where that changed the fit or its errors."""
    if lasting is None or (_grown(lasting) < 1.0 + TELLING and not lasting.fitted_beside_zeros):
        return []
    return [name for name in lasting.drift if lasting.offset[name] + lasting.drift[name] > TELLING]


def _told_zeros(lasting: Lasting | None) -> list[str]:
    """Columns whose zeros are off by clear evidence, or were fitted so.

    A size alone says nothing: where recordings do not tell a zero, its size is that of the prior.
    """
    large = _large(lasting)
    if lasting is None:
        return []
    told = [name for name in large if name in lasting.told]
    return told or (large if lasting.fitted_beside_zeros else [])


class Fitted(Protocol):
    """A result with zeros of instruments, and the information whose parameters these widen the errors of."""

    lasting: Lasting | None
    information: Information


def possible_zeros(result: Fitted) -> list[str]:
    """A sentence on constants whose errors count zeros that recordings neither show nor exclude."""
    lasting = result.lasting
    maybe = _large(lasting)
    if lasting is None or not maybe or _told_zeros(lasting):
        return []
    wider = {name: np.sqrt(x) for name, x in variances_by_name(lasting, result.information.names).items()}
    wider = {name: x for name, x in wider.items() if x >= 1.0 + TELLING}
    counts = "its error counts it" if len(wider) == 1 else "their errors count it"
    return [
        f"No instrument clearly has a wrong zero. But a zero of {joined(maybe)} that is off would "
        f"look like another {joined(sorted(wider, key=lambda name: -wider[name]))}, so {counts}. "
        "Read that instrument at rest before and after each test to exclude it."
    ]


def lasting_sentence(time: float, inflation: float, lasting: Lasting | None) -> str:
    """Sentence on errors with serial correlation."""
    return (
        f"Residuals are correlated over about {time:.0f} samples, so that fewer samples count. The cause is "
        "an instrument that drifts, or a law that is not quite followed. Standard errors were "
        f"{error_factors(inflation, lasting)}."
    )


def lasting_zeros(found: Lasting | None) -> list[str]:
    """Zeros of instruments that are off or drift, in words, where they changed the fit or its errors."""
    seen = _told_zeros(found)
    if found is None or not seen:
        return []
    sizes = "; ".join(_zero(found, name) for name in seen)
    done = f"Errors were multiplied by up to {number(_grown(found), '.2g')} for that"
    if found.fitted_beside_zeros:
        done = "Constants were fitted beside such zeros, and intervals count these as noise alone"
    return [
        f"The residuals change slowly, as if instruments had wrong zeros: {sizes}. "
        f"{done}. Read the instruments at rest before and after each test."
    ]


def not_drawn(lasting: Lasting | None) -> str:
    """Sentence for captions of a fit beside zeros, which its curves do not show; empty elsewhere."""
    if lasting is None or not lasting.fitted_beside_zeros:
        return ""
    return (
        " The fit allows for zeros of instruments that are off and drift. Lines and residuals do not, so the "
        "model may lie beside the readings."
    )


def large_drifts(found: Lasting | None) -> dict[str, float]:
    """Large drifts of zeros that changed the fit or its errors, in units of the noise, by output."""
    if found is None:
        return {}
    return {name: found.drift[name] for name in _told_zeros(found) if found.drift[name] >= LARGE_DRIFT}


def _zero(found: Lasting, name: str) -> str:
    """Words on the zero of an output, in units of its noise."""
    offset, drift = (number(size[name], ".2g") for size in (found.offset, found.drift))
    return f"that of {name} is off by {offset} times its noise, and drifts by {drift} times"
