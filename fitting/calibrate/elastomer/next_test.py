"""Choice of the further test that shrinks the error of a simulation most, by its expected information.

The stress that an actuator's wall carries is predicted with four errors. The first is that of the law's
constants. The second is that of the law itself, since others fit as well. In strains that were not tested, it
errs as it did past each range it was fitted to. The third is that of the specimen: another batch is stiffer
or softer. The fourth is that of the rate: an actuator moves slower than a tensile test. All are small, so
they are treated as a linear Gaussian problem. Each candidate test is a set of observations. The covariances
alone give the error that remains after it, before it is made.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .fit import LawFit
from .samples import Samples
from .stability import ACTUATOR_STRAIN
from .unknowns import RATE_PER_DECADE, Unknowns, unknowns_of, updated

POINTS = 61
"""Strains at which the error of a simulation is averaged."""
INDEPENDENT = 20
"""Independent samples that a further test is taken to give."""
NEARLY = 0.95
"""A test that reaches this fraction of an actuator's strain need not be taken further."""
SLOW_RATE = 0.01
"""Strain rate of an actuator, 1/s: one that bends in some tens of seconds."""
UNKNOWN_EXTRAPOLATION = 0.1
"""Relative error past the tested strains taken where the data are too short to measure it."""
UNKNOWN_DECADES = 1.0
"""Decades between test and actuator taken where no clock was recorded."""
CAUSES = ("constants", "law", "specimen", "rate")
WORDS = {
    "constants": "the law's constants",
    "law": "the choice of law",
    "specimen": "the difference between specimens",
    "rate": "the strain rate",
}


@dataclass(frozen=True)
class Candidate:
    """A further test and what it is worth.

    Attributes:
        name: `larger_stretch`, `compression`, `another_specimen` or `slower_rate`.
        text: description of the test.
        error_after: error of a simulation after it [Pa], root mean square over the actuator's strains.
        after: the same by cause.
        information: expected gain about the unknowns [nats].
    """

    name: str
    text: str
    error_after: float
    after: dict[str, float]
    information: float


@dataclass(frozen=True)
class NextTest:
    """The candidates, best first, and the error as it stands.

    Attributes:
        error_before: error of a simulation [Pa], root mean square over the actuator's strains.
        before: the same by cause.
        candidates: candidates by increasing error after the test.
        text: the recommendation.
    """

    error_before: float
    before: dict[str, float]
    candidates: list[Candidate]
    text: str


def next_test(
    samples: Samples,
    fits: Mapping[str, LawFit],
    weights: Mapping[str, float],
    chosen: str,
    extrapolation: float | None = None,
) -> NextTest:
    """Compare further tests by the error that a simulation of an actuator would be left with.

    A larger stretch and compression are candidates only where the tests do not cover an actuator's strains.

    Args:
        samples: the tested samples.
        fits: the laws that may be right over an actuator's strains, fitted, and the chosen one.
        weights: probability of each law from its held-out error.
        chosen: the law that the simulation uses.
        extrapolation: its relative error past a range it was fitted to, as measured; None if that was not
            possible.
    """
    unknowns = unknowns_of(samples, fits, weights, chosen, extrapolation or UNKNOWN_EXTRAPOLATION)
    decades = _decades(samples)
    strain = np.linspace(*ACTUATOR_STRAIN, POINTS)
    target = unknowns.sensitivities(strain, 1.0, -decades)
    before = unknowns.error(unknowns.covariance, target)
    mask = fits[chosen].mask
    left = np.sqrt(np.mean((samples.stress - fits[chosen].predict(samples))[mask] ** 2))
    noise = max(float(left), float(samples.spread[mask].min()))
    candidates = []
    for name, text, design, common in _designs(samples, unknowns, decades):
        covariance, information = updated(unknowns.covariance, design, noise, common)
        after = unknowns.error(covariance, target)
        candidates.append(
            Candidate(name, text, after["all"], {cause: after[cause] for cause in CAUSES}, information)
        )
    candidates.sort(key=lambda candidate: candidate.error_after)
    causes = {cause: before[cause] for cause in CAUSES}
    return NextTest(before["all"], causes, candidates, _sentence(before, candidates))


def _decades(samples: Samples) -> float:
    """Decades of strain rate from the slowest test down to the actuator."""
    rates = [c.rate for c in samples.curves if c.role == "fit" and c.rate]
    return max(float(np.log10(min(rates) / SLOW_RATE)), 0.0) if rates else UNKNOWN_DECADES


def _designs(samples: Samples, unknowns: Unknowns, decades: float):
    """Name, words, sensitivities and common 1-sigma error (of a new specimen) of each candidate."""
    low, high = unknowns.tested
    further, squeeze = ACTUATOR_STRAIN[1], min(ACTUATOR_STRAIN[0], low)
    again = np.linspace(low, high, INDEPENDENT)
    curve = unknowns.fit.stress(again)
    if samples.strain[samples.fitted].max() < further * NEARLY:
        yield (
            "larger_stretch",
            f"pull the same specimen further, to stretch {1.0 + further:.3g}",
            unknowns.sensitivities(np.linspace(max(low, 0.0), further, INDEPENDENT), 0.0, 0.0),
            None,
        )
    if samples.strain[samples.fitted].min() > squeeze * NEARLY:
        yield (
            "compression",
            f"compress it to strain {squeeze:.2g} (bonded or lubricated ends stated)",
            unknowns.sensitivities(np.linspace(squeeze, 0.0, INDEPENDENT), 0.0, 0.0),
            None,
        )
    yield (
        "another_specimen",
        "repeat the test on another specimen, of another batch if there is one",
        unknowns.sensitivities(again, 1.0, 0.0),
        samples.batch * curve,
    )
    yield (
        "slower_rate",
        f"repeat the test at the rate of an actuator, about {SLOW_RATE:g} 1/s",
        unknowns.sensitivities(again, 0.0, -decades),
        None,
    )


def _sentence(before: Mapping[str, float], candidates: list[Candidate]) -> str:
    best = candidates[0]
    start = before["all"]
    shrinks = max(CAUSES, key=lambda cause: before[cause] - best.after[cause])
    others = ", ".join(f"{c.name.replace('_', ' ')} {_short(c.error_after)}" for c in candidates[1:])
    return (
        f"{best.text[0].upper()}{best.text[1:]}. Over an actuator's strains ({ACTUATOR_STRAIN[0]:g} to "
        f"{ACTUATOR_STRAIN[1]:g}) the stress is now uncertain by {_short(start)} kPa, mostly through "
        f"{WORDS[max(CAUSES, key=lambda cause: before[cause])]}. This test is expected to leave "
        f"{_short(best.error_after)} kPa by shrinking the error from {WORDS[shrinks]}. "
        f"Instead of it (kPa left): {others}. Assumed: {100 * RATE_PER_DECADE:.0f} % of stress per decade "
        "of rate."
    )


def _short(stress: float) -> str:
    """A stress [Pa] in kPa, in few digits and without an exponent."""
    value = stress / 1e3
    return f"{value:.0f}" if value >= 100.0 else f"{value:.2g}"
