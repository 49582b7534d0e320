"""Self-check of the installed model against values derived by hand, and of its derivatives against finite
differences.

Every expected value follows from physics or mathematics written down beside it, with the constants of the
shipped tables. None was produced by a model.
"""

import math
from collections.abc import Callable, Iterator
from types import ModuleType

from . import actuators, gradients, silicone, springs
from .claims import Claim, Outcome

__all__ = ["Claim", "Outcome", "all_claims", "run"]


def all_claims() -> list[Claim]:
    """All claims, in the order of the model's packages."""
    return [claim for module in (springs, silicone, actuators, gradients) for claim in claims_of(module)]


def claims_of(module: ModuleType) -> list[Claim]:
    """Claims of one module. If they cannot even be set up, one failing claim replaces them."""
    found: list[Claim] = []
    try:
        found.extend(module.claims())
    except Exception as error:  # a broken model must end in a table with FAIL, not in a traceback
        found.append(Claim(module.__name__.rpartition(".")[2], "its claims can be set up", _raising(error)))
    return found


def _raising(error: Exception) -> Callable[[], tuple[float, float]]:
    def evaluate() -> tuple[float, float]:
        raise error

    return evaluate


def run(claims: list[Claim] | None = None) -> Iterator[Outcome]:
    """Check claims one after the other. One that cannot be computed fails and stops no other."""
    for claim in all_claims() if claims is None else claims:
        try:
            value, expected = (float(number) for number in claim.evaluate())
            yield Outcome(claim, value, expected)
        except Exception as error:  # a broken law may raise anything, and the table must still be printed
            yield Outcome(claim, math.nan, math.nan, f"{type(error).__name__}: {error}")
