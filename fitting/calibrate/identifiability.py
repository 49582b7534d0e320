"""Sentences about combinations of parameters that hardly change the misfit, so that a fit cannot separate
them."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

STRONG_CORRELATION = 0.95
LOOSE = 0.5
"""A combination known to worse than half its own size is called loose (sloppy)."""
SHARE = 0.3
"""Parameters with less than this share of the largest entry of a direction are left out of its sentence."""


def identifiability(
    names: Sequence[str],
    values: np.ndarray,
    covariance: np.ndarray,
    at_bound: Mapping[str, str] | None = None,
) -> list[dict[str, Any]]:
    """Sentences about the loose directions of a fit.

    Args:
        names: names of the free parameters.
        values: values found, shape (n,).
        covariance: covariance of their errors, shape (n, n), in the units of `values`.
        at_bound: sentence end for each parameter that stopped at a bound, such as `"its lower bound 0 kPa"`.

    Returns:
        One entry for each strongly correlated pair, loose direction and parameter at a bound. An entry has
        `kind` (`correlation`, `loose_direction` or `at_bound`), `parameters`, a number that says how bad, and
        `text`.
    """
    found: list[dict[str, Any]] = []
    for name, bound in (at_bound or {}).items():
        text = (
            f"{name} stopped at {bound}: the data pull it further than the law allows. It has no error. The "
            "errors of the other constants hold if its true value is this bound."
        )
        found.append({"kind": "at_bound", "parameters": [name], "text": text})
    spread = np.sqrt(np.diag(covariance))
    if not np.all(np.isfinite(spread)) or not np.all(spread > 0.0):
        return found
    correlation = covariance / np.outer(spread, spread)
    found += _pairs(names, correlation)
    found += _directions(names, values, covariance)
    return found


def _pairs(names: Sequence[str], correlation: np.ndarray) -> list[dict[str, Any]]:
    pairs = [
        (i, j) for i in range(len(names)) for j in range(i) if abs(correlation[i, j]) > STRONG_CORRELATION
    ]
    entries = []
    for i, j in sorted(pairs, key=lambda pair: -abs(correlation[pair])):
        sense = "rise together" if correlation[i, j] > 0.0 else "trade off: one rises as the other falls"
        entries.append({
            "kind": "correlation",
            "parameters": [names[j], names[i]],
            "correlation": float(correlation[i, j]),
            "text": f"{names[j]} and {names[i]} {sense} (correlation {correlation[i, j]:+.3f}); "
            "their values mean little one at a time, the curve they make together is what was measured.",
        })  # fmt: skip
    return entries


def _directions(names: Sequence[str], values: np.ndarray, covariance: np.ndarray) -> list[dict[str, Any]]:
    """Directions of relative change, from the covariance scaled by the values, that are loose."""
    size = np.where(values == 0.0, np.sqrt(np.diag(covariance)), np.abs(values))
    width, axes = np.linalg.eigh(covariance / np.outer(size, size))
    entries = []
    for k in np.argsort(-width):
        uncertainty = float(np.sqrt(max(width[k], 0.0)))
        if uncertainty <= LOOSE:
            break
        axis = axes[:, k] / axes[np.argmax(np.abs(axes[:, k])), k]
        main = [i for i in np.argsort(-np.abs(axis)) if abs(axis[i]) >= SHARE]
        if len(main) == 1:
            name = names[main[0]]
            text = f"{name} is known only to {_percent(uncertainty)} of its size."
            entries.append(_loose([name], uncertainty, text))
            continue
        recipe = ", ".join(f"{names[i]} by {10.0 * axis[i] * np.sign(values[i] or 1.0):+.0f} %" for i in main)
        text = (
            f"Changing {recipe} (or that in proportion) leaves the fit as good: this combination is "
            f"known only to {_percent(uncertainty)} of its size."
        )
        entries.append(_loose([names[i] for i in main], uncertainty, text))
    return entries


def _loose(names: list[str], uncertainty: float, text: str) -> dict[str, Any]:
    return {"kind": "loose_direction", "parameters": names, "relative_uncertainty": uncertainty, "text": text}


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.0f} %" if fraction < 10.0 else f"a factor {fraction:.0f}"
