"""Every law on one range of the samples: fitted, scored on held-out data, compared, and one taken."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .choice import Choice, choose
from .drift import Drift, drift
from .engine import Engine
from .fit import LawFit
from .held_out import HeldOut, held_out
from .laws import CurveLaw
from .stability import ACTUATOR_STRAIN, Stability, stability


@dataclass(frozen=True)
class Analysis:
    """Results of a set of laws over a range of strain; every dictionary is by name of the law.

    Attributes:
        scope: mask of the samples that were fitted, bool (n,).
        strain_min, strain_max: range of their strain [1].
        fits: the laws fitted to all of them.
        held: their held-out errors.
        drifts: changes of their constants with the range.
        tested: their tangents over the fitted strains.
        actuator: their tangents over an actuator's strains.
        choice: the ranking, and the law taken.
    """

    scope: np.ndarray
    strain_min: float
    strain_max: float
    fits: dict[str, LawFit]
    held: dict[str, HeldOut]
    drifts: dict[str, list[Drift]]
    tested: dict[str, Stability]
    actuator: dict[str, Stability]
    choice: Choice

    @property
    def best(self) -> LawFit:
        """Fit of the law that was taken."""
        return self.fits[self.choice.chosen]


def analyse(
    engine: Engine,
    laws: Sequence[CurveLaw],
    scope: np.ndarray,
    for_actuator: bool,
    progress: Callable[[str], None] = lambda _: None,
) -> Analysis:
    """Fit and compare laws on the samples in scope.

    Args:
        engine: fits the laws.
        laws: laws to compare.
        scope: mask of the samples to use, bool (n,).
        for_actuator: the law that is taken must serve over all of an actuator's strains, tested or not.
        progress: called with the label of each law before it is fitted.
    """
    strain = engine.samples.strain[scope]
    low, high = float(strain.min()), float(strain.max())
    fits, held, drifts, tested, actuator = {}, {}, {}, {}, {}
    for law in laws:
        progress(law.label)
        terms = len(law.constants) // 2  # Ogden's laws are in ascending order, so the shorter one is there
        fewer = fits.get(f"ogden_{terms - 1}") if law.law == "ogden" else None
        fit = engine.fit(law, scope, errors=True, fewer=fewer)
        fits[law.name], held[law.name] = fit, held_out(engine, fit, scope)
        drifts[law.name] = drift(law, held[law.name].ranges)
        tested[law.name] = stability(fit, low, high)
        actuator[law.name] = stability(fit, *ACTUATOR_STRAIN)
    unfit = _unfit(fits, tested, actuator if for_actuator else {})
    choice = choose(fits, held, tested, unfit)
    return Analysis(scope, low, high, fits, held, drifts, tested, actuator, choice)


def _unfit(
    fits: dict[str, LawFit], tested: dict[str, Stability], wanted: dict[str, Stability]
) -> dict[str, str]:
    """Laws that must not be taken, and why; `wanted` are tangents over strains that may be untested."""
    found = {}
    for name, fit in fits.items():
        check, other = tested[name], wanted.get(name)
        if not fit.result.success:
            found[name] = "was not fitted to the end"
        elif not check.monotone:
            found[name] = f"falls from strain {check.falls_from:.2g} on"
        elif fit.at_bound:
            found[name] = f"has {next(iter(fit.at_bound))} at the bound of its search"
        elif other is not None and not other.monotone:
            found[name] = f"turns back at strain {other.falls_from:.2g}"
        elif other is not None and other.locks(check):
            found[name] = "stiffens steeply beyond the strains that were tested"
        elif other is not None and not fit.law.from_energy and not check.covers(other):
            found[name] = "is a polynomial, which says nothing beyond the strains that were tested"
    return found
