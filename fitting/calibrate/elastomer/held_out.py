"""Errors of a law on data that it was not fitted to: gaps in the curve, larger stretch, other recordings.

The range of a fit is its *reach* max(stretch, 1/stretch). This is the stretch in tension and counts
compression alike. A fit up to a reach is scored on the rest of the curve. A gap is a band of stretch taken
out of every recording.
"""

from dataclasses import dataclass, field

import numpy as np

from fitting.inference.metrics import relative_percent_difference

from .engine import Engine
from .fit import LawFit
from .samples import FEWEST_SAMPLES, Samples

REACHES = (1.25, 1.5, 2.0, 3.0, 5.0)
BANDS = 8  # of stretch; the inner ones are left out in turn
MARGIN = 1.05  # a fit range must end this factor before the data do, or there is nothing beyond to predict


@dataclass(frozen=True)
class Score:
    """Error of a prediction.

    Attributes:
        rmse: root mean square error [Pa].
        rpd: relative percent difference as a fraction (Eq. 2.52 with absolute errors).
        weighted: mean square error in units of the spread that the fit divides by.
        count: samples scored.
    """

    rmse: float
    rpd: float
    weighted: float
    count: int


@dataclass(frozen=True)
class Transfer:
    """Error on a whole recording that was not fitted.

    Attributes:
        score: score of the prediction as it is.
        factor: one factor on the stress that would serve this recording best (its specimen may be stiffer).
        rmse_scaled: root mean square error with that factor [Pa].
    """

    score: Score
    factor: float
    rmse_scaled: float


@dataclass(frozen=True)
class RangeFit:
    """A law refitted to part of the curve.

    Attributes:
        reach: largest stretch (or 1/stretch) that it was fitted to.
        fit: the refitted law.
        inside: its error where it was fitted.
        following: error from there to `following_reach`, the next range; None at the end of the data.
        beyond: error on everything past the range; None at the end of the data.
    """

    reach: float
    fit: LawFit
    inside: Score
    following: Score | None
    following_reach: float | None
    beyond: Score | None


@dataclass(frozen=True)
class HeldOut:
    """Everything a law was scored on without having seen it.

    Attributes:
        ranges: scores by increasing reach, the last one being all the data.
        bands: stretch limits and score of each gap.
        recordings: score on each recording with `role = fit`, fitted to the others; empty where there is one.
        validation: score on each recording with `role = validation`.
    """

    ranges: list[RangeFit]
    bands: list[tuple[float, float, Score]]
    recordings: dict[str, Transfer] = field(default_factory=dict)
    validation: dict[str, Transfer] = field(default_factory=dict)

    @property
    def interpolation(self) -> Score | None:
        """Error over all gaps together."""
        return pool([score for *_, score in self.bands])

    @property
    def extrapolation(self) -> float | None:
        """Error on the stretch that follows a fit's range, relative; geometric mean over the ranges."""
        parts = [r.following.rpd for r in self.ranges if r.following is not None]
        return float(np.exp(np.mean(np.log(np.maximum(parts, 1e-12))))) if parts else None


def score(samples: Samples, predicted: np.ndarray, mask: np.ndarray) -> Score | None:
    """Error of predicted stresses [Pa] on the masked samples; None if there are none."""
    if not mask.any():
        return None
    difference = (samples.stress - predicted)[mask]
    # Zeros outside the mask add nothing to either sum, and one shape compiles once.
    relative = relative_percent_difference(
        np.where(mask, samples.stress, 0.0), np.where(mask, predicted, 0.0)
    )
    weighted = float(np.mean((difference / samples.spread[mask]) ** 2))
    return Score(float(np.sqrt(np.mean(difference**2))), float(relative), weighted, int(mask.sum()))


def transfer(samples: Samples, predicted: np.ndarray, mask: np.ndarray) -> Transfer:
    """Error of predicted stresses [Pa] on a recording's samples, as they are and after one factor."""
    weight = samples.spread[mask] ** -2.0
    measured, model = samples.stress[mask], predicted[mask]
    factor = float(np.sum(weight * measured * model) / np.sum(weight * model**2))
    scaled = float(np.sqrt(np.mean((measured - factor * model) ** 2)))
    return Transfer(score(samples, predicted, mask), factor, scaled)


def pool(scores: list[Score]) -> Score | None:
    """Scores of disjoint samples as one; the relative error is averaged with the counts as weights."""
    if not scores:
        return None
    count = np.array([s.count for s in scores])
    mean = lambda values: float(np.average(values, weights=count))  # noqa: E731
    return Score(
        rmse=mean([s.rmse**2 for s in scores]) ** 0.5,
        rpd=mean([s.rpd for s in scores]),
        weighted=mean([s.weighted for s in scores]),
        count=int(count.sum()),
    )


def reach_of(samples: Samples) -> np.ndarray:
    """`max(stretch, 1/stretch)` of each sample, shape (n,)."""
    return np.maximum(samples.stretch, 1.0 / samples.stretch)


def reaches(samples: Samples, scope: np.ndarray) -> tuple[float, ...]:
    """Ranges to fit, the last one being the end of the samples in scope."""
    reach = reach_of(samples)[scope]
    end = float(reach.max())
    return (*(r for r in REACHES if r * MARGIN < end and (reach <= r).sum() >= FEWEST_SAMPLES), end)


def held_out(engine: Engine, full: LawFit, scope: np.ndarray) -> HeldOut:
    """Score a law on everything it can be kept from seeing.

    Args:
        engine: fits the law to any part of its samples.
        full: the law fitted to all samples in scope.
        scope: samples that may be fitted, shape (n,); errors are scored within their range of strain.
    """
    samples = engine.samples
    within = (samples.strain >= samples.strain[scope].min()) & (samples.strain <= samples.strain[scope].max())
    validation = {
        curve.name: transfer(samples, full.predict(samples), samples.of(k) & within)
        for k, curve in enumerate(samples.curves)
        if curve.role == "validation" and (samples.of(k) & within).any()
    }
    refits = (engine, full, scope)
    return HeldOut(_ranges(*refits), _bands(*refits), _recordings(*refits), validation)


def _ranges(engine: Engine, full: LawFit, scope: np.ndarray) -> list[RangeFit]:
    samples, found = engine.samples, []
    reach, ends = reach_of(samples), reaches(samples, scope)
    for k, end in enumerate(ends):
        last = k == len(ends) - 1
        inside = scope & (reach <= end)
        fit = full if last else engine.fit(full.law, inside, errors=True)
        predicted = fit.predict(samples)
        beyond = scope & (reach > end)
        following = beyond & (reach <= ends[min(k + 1, len(ends) - 1)])
        found.append(
            RangeFit(
                end,
                fit,
                score(samples, predicted, inside),
                score(samples, predicted, following),
                None if last else ends[k + 1],
                score(samples, predicted, beyond),
            )
        )
    return found


def _bands(engine: Engine, full: LawFit, scope: np.ndarray) -> list[tuple[float, float, Score]]:
    samples, found = engine.samples, []
    stretch = samples.stretch
    edges = np.linspace(stretch[scope].min(), stretch[scope].max(), BANDS + 1)
    for low, high in zip(edges[1:-2], edges[2:-1], strict=True):
        band = scope & (stretch >= low) & (stretch < high)
        if band.any() and (scope & ~band).sum() >= FEWEST_SAMPLES:
            fit = engine.fit(full.law, scope & ~band, near=full)
            found.append((float(low), float(high), score(samples, fit.predict(samples), band)))
    return found


def _recordings(engine: Engine, full: LawFit, scope: np.ndarray) -> dict[str, Transfer]:
    samples = engine.samples
    members = [k for k in range(len(samples.curves)) if (samples.of(k) & scope).any()]
    if len(members) < 2:
        return {}
    found = {}
    for k in members:
        fit = engine.fit(full.law, scope & ~samples.of(k), near=full)
        found[samples.curves[k].name] = transfer(samples, fit.predict(samples), samples.of(k) & scope)
    return found
