"""Does a constant stay constant when the range it is fitted to grows? If not, the law has the wrong shape."""

from dataclasses import dataclass

import numpy as np

from .held_out import HeldOut, RangeFit
from .laws import CurveLaw

DRIFT_IN_ERRORS = 3.0
"""A change of more standard errors than this is a drift ..."""
DRIFT_IN_SIZE = 0.1
"""... if it is also more than this fraction: a lab would not mind less."""
KNOWN = 0.5
"""Maximum relative error of a constant. With a larger one, a curved law slid along a valley, and its errors
mean nothing."""


@dataclass(frozen=True)
class Drift:
    """Changes of one constant as the fitted range grows.

    Attributes:
        law: its law.
        constant: its name.
        unit: unit of the values, as in files.
        reaches: largest stretch of each fit, increasing.
        values, sds: the constant and its standard error there, between ranges of the same specimens [SI].
        errors: largest change between two ranges, in standard errors of that change.
        ratio: largest over smallest magnitude; infinite if the sign changes.
        drifts: the change is both significant and large.
    """

    law: CurveLaw
    constant: str
    unit: str
    reaches: tuple[float, ...]
    values: np.ndarray
    sds: np.ndarray
    errors: float
    ratio: float
    drifts: bool


def drift(law: CurveLaw, ranges: list[RangeFit]) -> list[Drift]:
    """Compare each constant of a law between the ranges it was fitted to.

    The standard error of a change is that of two independent fits. Fits to nested ranges share samples, so
    this is too large, never too small, and a drift that is found is one. Ranges that do not determine the
    constant, or where a constant stopped at a bound, are not compared.
    """
    found = []
    for k, constant in enumerate(law.constants):
        values = np.array([r.fit.values[k] for r in ranges])
        sds = np.array([r.fit.sd_within[k] for r in ranges])
        known = np.array([_determined(r) for r in ranges])
        errors, size = _largest_change(values[known], sds[known])
        small, large = (
            (np.abs(values[known]).min(), np.abs(values[known]).max()) if known.any() else (1.0, 1.0)
        )
        signs = np.unique(np.sign(values[known]))
        ratio = np.inf if small == 0.0 or len(signs) > 1 else float(large / small)
        found.append(
            Drift(
                law, constant.name, constant.unit, tuple(r.reach for r in ranges), values, sds, errors, ratio,
                bool(errors > DRIFT_IN_ERRORS and size > DRIFT_IN_SIZE),
            )
        )  # fmt: skip
    return found


def _determined(part: RangeFit) -> bool:
    """True if the standard errors of a range's constants are meaningful."""
    fit = part.fit
    if fit.at_bound or not np.all(np.isfinite(fit.sd_within)):
        return False
    return fit.law.linear or bool(np.all(fit.sd_within < KNOWN * np.abs(fit.values)))


def _largest_change(values: np.ndarray, sds: np.ndarray) -> tuple[float, float]:
    """Largest change in standard errors, and that same change relative to the larger of the two values."""
    worst, size = 0.0, 0.0
    for i in range(len(values)):
        for j in range(i):
            change = abs(values[i] - values[j])
            noise = float(np.hypot(sds[i], sds[j]))
            errors = change / noise if noise > 0.0 else np.inf * np.sign(change) if change else 0.0
            if errors > worst:
                worst, size = float(errors), float(change / max(abs(values[i]), abs(values[j])))
    return worst, size


def verdict(held: dict[str, HeldOut], drifts: dict[str, list[Drift]]) -> list[str]:
    """Sentences about the laws whose constants move with the range, those of one constant first."""
    sentences = []
    for entries in sorted(drifts.values(), key=len):
        moving = [entry for entry in entries if entry.drifts]
        if not moving:
            continue
        sentences.append(_one_constant(moving[0], held) if len(entries) == 1 else _several(moving))
    return sentences


def _one_constant(entry: Drift, held: dict[str, HeldOut]) -> str:
    ranges = held[entry.law.name].ranges
    growing = "grows" if entry.values[-1] > entry.values[0] else "falls"
    failed = [r for r in ranges if r.beyond is not None]
    worst = max(failed, key=lambda r: r.beyond.rpd, default=None)
    miss = (
        f" Fitted to stretch {worst.reach:.3g} it misses the rest of the curve by "
        f"{100.0 * worst.beyond.rpd:.0f} %, "
        f"while it misses what it was fitted to by {100.0 * worst.inside.rpd:.0f} %."
        if worst
        else ""
    )
    steps = ", ".join(
        f"{value:.3g} kPa to stretch {reach:.3g}"
        for value, reach in zip(entry.values / 1e3, entry.reaches, strict=True)
    )
    return (
        f"One constant cannot describe this material: the {entry.law.label} modulus {growing} with the "
        f"range it is fitted to ({steps}), a change of {entry.errors:.0f} standard errors.{miss}"
    )


def _several(moving: list[Drift]) -> str:
    names = ", ".join(entry.constant for entry in moving)
    most = max(moving, key=lambda entry: entry.errors)
    times = "changing sign" if np.isinf(most.ratio) else f"by a factor {most.ratio:.2g}"
    verb = "depend" if len(moving) > 1 else "depends"
    return (
        f"{most.law.label}: {names} {verb} on the range fitted ({most.constant} {times}, {most.errors:.0f} "
        "standard errors). Quote the range with the constants, and do not use them past it."
    )
