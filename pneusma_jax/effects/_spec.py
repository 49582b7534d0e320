"""Prior knowledge of an effect's parameters."""

from typing import Any, NamedTuple


class Spec(NamedTuple):
    """One parameter of an effect.

    Attributes:
        neutral: value at which the effect is absent; for a shape parameter, a typical one.
        low, high: physical bounds; a fit that ends on one is a warning that the explanation is wrong.
        typical: value of a present effect, where a fit starts.
        unit: unit, SI or degC.
        text: description for a report.
        shape: true if the parameter is meaningless while the effect is absent (a lag, a threshold). It is
            then scanned rather than screened by its derivative.
        natural_ends: true if both ends of the range are forms of their own, such as counting in strain or in
            energy. A fit that ends on one is then no warning.
        kinds: recordings in which the parameter acts, where these are fewer than the effect's; empty for all.
    """

    neutral: float
    low: float
    high: float
    typical: float
    unit: str
    text: str
    shape: bool = False
    kinds: str = ""
    natural_ends: bool = False


def specs_of(effect: Any, kind: str) -> dict[str, Spec]:
    """Parameters of an effect that act in recordings of a kind, a letter of `Effect.kinds`.

    Specs in an effect's `within` for a kind replace its fields there. A stress along a wire has other bounds
    than one of shear.
    """
    own = getattr(effect, "within", {}).get(kind, {})
    return {
        name: spec._replace(**own.get(name, {}))
        for name, spec in effect.specs.items()
        if kind in (spec.kinds or effect.kinds)
    }
