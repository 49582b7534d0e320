"""Choice of the law: held-out error first, information criteria beside it, and no law that turns back."""

from dataclasses import dataclass

import numpy as np

from .fit import LawFit
from .held_out import HeldOut
from .stability import Stability


@dataclass(frozen=True)
class Ranked:
    """One law's place.

    Attributes:
        name: name of the law.
        constants: number of its constants.
        aicc, bic: differences to the best law; None where fewer independent samples than constants remain.
        weight: probability among the laws, from the error in the gaps; sums to 1.
        usable: it is monotone where it was tested.
    """

    name: str
    constants: int
    aicc: float | None
    bic: float | None
    weight: float
    usable: bool


@dataclass(frozen=True)
class Choice:
    """The ranking and the law taken from it.

    Attributes:
        ranked: best first, by error in the gaps.
        best_extrapolation: name of the law with the least relative error past its range, or None.
        chosen: name of the law taken.
        reason: why, in a sentence.
        unfit: laws that were passed over, and why.
    """

    ranked: list[Ranked]
    best_extrapolation: str | None
    chosen: str
    reason: str
    unfit: dict[str, str]


def choose(
    fits: dict[str, LawFit], held: dict[str, HeldOut], checks: dict[str, Stability], unfit: dict[str, str]
) -> Choice:
    """Rank the laws and take the simplest that predicts the gaps as well as the best one does.

    "As well" is the one-standard-error rule, on the differences gap by gap. It prefers a law with fewer
    constants. The law's mean square error may exceed the best law's by at most the standard error of that
    difference. Source: L. Breiman and others, Classification and Regression Trees, 1984.

    Args:
        fits: laws fitted to all the data.
        held: their held-out scores.
        checks: their tangents over the tested range.
        unfit: laws not to be taken, with the reason in a few words.
    """
    errors = {name: _errors(held[name]) for name in fits}
    order = sorted(fits, key=lambda name: float(np.mean(errors[name])))
    aicc, bic = criteria(fits)
    weights = _weights(errors)
    ranked = [
        Ranked(name, len(fits[name].values), aicc[name], bic[name], weights[name], checks[name].monotone)
        for name in order
    ]
    candidates = [name for name in order if name not in unfit] or order
    chosen = _simplest(candidates, errors, fits)
    past = {name: held[name].extrapolation for name in fits if held[name].extrapolation is not None}
    least = min(past, key=lambda name: (float(f"{past[name]:.3g}"), len(fits[name].values)), default=None)
    return Choice(ranked, least, chosen, _reason(chosen, candidates[0], order, fits, unfit), unfit)


def _errors(held: HeldOut) -> np.ndarray:
    """Mean square error of each gap; the fit's own where the data leave no gap to test."""
    bands = np.array([score.weighted for *_, score in held.bands])
    return bands if len(bands) else np.array([held.ranges[-1].inside.weighted])


def _simplest(candidates: list[str], errors: dict[str, np.ndarray], fits: dict[str, LawFit]) -> str:
    best = candidates[0]

    def as_good(name: str) -> bool:
        excess = errors[name] - errors[best]
        spread = excess.std(ddof=1) / np.sqrt(len(excess)) if len(excess) > 1 else 0.0
        return bool(excess.mean() <= spread)

    good = [name for name in candidates if name == best or as_good(name)]
    return min(good, key=lambda name: (len(fits[name].values), float(np.mean(errors[name]))))


def _reason(
    chosen: str, best: str, order: list[str], fits: dict[str, LawFit], unfit: dict[str, str]
) -> str:
    """Sentence about the choice. It names every law that was passed over though it predicts gaps better."""
    label = lambda name: fits[name].law.label  # noqa: E731
    if chosen in unfit:
        fault = f"{label(chosen)} {unfit[chosen]}"
        return f"No law that was tried is without fault here ({fault}); it predicts gaps best."
    if len(fits) == 1:
        return ""
    better = order[: order.index(best)]
    of = " of the laws without fault" if better else ""
    text = f"{label(chosen)} predicts gaps in the curve best{of}"
    if chosen != best:
        text = (
            f"{label(chosen)} has fewer constants than {label(best)} and predicts gaps in the curve as well "
            "within one standard error"
        )
    text = f"{text[0].upper()}{text[1:]}."
    if better:
        passed = "; ".join(f"{label(name)}, which {unfit[name]}" for name in better)
        text += f" A law that predicts gaps better was not taken: {passed}."
    return text


def criteria(fits: dict[str, LawFit]) -> tuple[dict[str, float | None], dict[str, float | None]]:
    """AICc and BIC of each law, less the best one's.

    Both count samples. Neighbouring residuals repeat each other, so the count is an effective one. It is that
    of the law whose residuals are least correlated, and the same for all laws. For the smooth misfit of a
    poor law is misfit, not noise. Variance is a fitted constant too.

    Returns:
        `aicc`, `bic` by law; None for a law with too many constants for the count.
    """
    count = max(fit.independent for fit in fits.values())
    aicc: dict[str, float | None] = {}
    bic: dict[str, float | None] = {}
    for name, fit in fits.items():
        free = len(fit.values) + 1
        likelihood = count * np.log(max(fit.mean_square, np.finfo(float).tiny))
        room = count - free - 1.0
        aicc[name] = likelihood + 2.0 * free + 2.0 * free * (free + 1.0) / room if room > 0.0 else None
        bic[name] = likelihood + free * np.log(count) if room > 0.0 else None
    return _less_best(aicc), _less_best(bic)


def _less_best(values: dict[str, float | None]) -> dict[str, float | None]:
    known = [value for value in values.values() if value is not None]
    return {name: None if value is None else float(value - min(known)) for name, value in values.items()}


def _weights(errors: dict[str, np.ndarray]) -> dict[str, float]:
    """Probability of each law: Gaussian errors of unknown variance, one independent error for each gap."""
    exponent = {name: -0.5 * len(e) * np.log(max(float(np.mean(e)), 1e-300)) for name, e in errors.items()}
    top = max(exponent.values())
    raw = {name: float(np.exp(value - top)) for name, value in exponent.items()}
    return {name: value / sum(raw.values()) for name, value in raw.items()}
