"""Fronts of two or three objectives by the epsilon-constraint method, and the volume that they dominate."""

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np

from .discrete import all_made, held_at
from .log import LoggedModel
from .optimise import ON_FRONTS, Outcome, Problem, best_of, better_seen, optimise

POINTS_OF_THREE = 5
"""Maximum of values of each of the two limited objectives of three: every pair of them is a problem."""
BEYOND = 0.1
"""Part of an objective's range by which the reference of the hypervolume lies beyond its worst value [1]."""


def front_of(
    anchors: Sequence[Outcome], problem: Problem, evaluate: LoggedModel, points: int, method: str
) -> list[tuple[Outcome, Problem]]:
    """Designs along the front: the first objective is minimised while the others are limited.

    All points are solved side by side, from each anchor; then once more from what their neighbours found.

    Args:
        anchors: the best design of each objective alone.
        problem: problem of the first objective.
        evaluate: evaluator of the model.
        points: along each limited objective.
        method: method of the optimiser.

    Returns:
        Designs of which none dominates another, with the problem of each.
    """
    count = len(anchors)
    values = np.array([a.evaluation.values[:count] for a in anchors])
    best, worst = np.diag(values), values.max(axis=0)
    span = np.where(worst > best, worst - best, 1.0)
    points = points if count == 2 else min(points, POINTS_OF_THREE)
    axes = [np.linspace(best[j], worst[j], points) for j in range(1, count)]
    grid = list(itertools.product(range(points), repeat=count - 1))
    problems = []
    for at in grid:
        limits = [axes[j][i] for j, i in enumerate(at)]
        problems.append(
            dataclasses.replace(
                problem,
                rows=np.append(problem.rows, np.arange(1, count)),
                limits=np.append(problem.limits, limits),
                scales=np.append(problem.scales, span[1:]),
            )
        )
    share = lambda at: np.array(at) / (points - 1)  # noqa: E731
    between = [_between(anchors, share(at)) for at in grid]
    starts = [[a.evaluation.place for a in anchors] + [middle] for middle in between]
    found = _solved(problems, starts, evaluate, method)
    near = [[j for j, b in enumerate(grid) if np.abs(np.subtract(at, b)).sum() == 1] for at in grid]
    again = [[found[j].evaluation.place for j in js if found[j].kept] for js in near]
    better = _solved(problems, again, evaluate, method)
    pairs = [(best_of([a, *([b] if b else [])]), p) for a, b, p in zip(found, better, problems, strict=True)]
    return best_pairs([pair for pair in pairs if pair[0].kept], count)


def as_point(pair: tuple[Outcome, Problem], problem: Problem, count: int) -> tuple[Outcome, Problem]:
    """A design that was found for one objective alone, as a point of the front.

    Args:
        pair: the design, and the problem that it solves.
        problem: problem of the first objective, without limits on the others.
        count: number of objectives.
    """
    one, own = pair
    values = one.evaluation.values[1:count]
    limited = dataclasses.replace(
        problem,
        rows=np.append(problem.rows, np.arange(1, count)),
        limits=np.append(problem.limits, values),
        scales=np.append(problem.scales, np.maximum(np.abs(values), 1e-12)),
        held=own.held,
    )
    return dataclasses.replace(one, objective=limited.objective(one.evaluation)), limited


def none_better(
    pairs: Sequence[tuple[Outcome, Problem]], evaluate: LoggedModel, count: int
) -> list[tuple[Outcome, Problem]]:
    """The front, with better designs in place of those that a search of another point has beaten.

    Where parameters are discrete, only designs that can be made take a place.
    """
    space = evaluate.model.space
    found = []
    for old, problem in pairs:
        seen = better_seen(old, problem, evaluate, lambda place: all_made(space, place), count)
        held = problem.held if seen is None else held_at(space, seen.evaluation.place)
        found.append((seen or old, dataclasses.replace(problem, held=held)))
    return best_pairs(found, count)


def best_pairs(pairs: Sequence[tuple[Outcome, Problem]], count: int) -> list[tuple[Outcome, Problem]]:
    """Those of which none dominates another in `count` objectives."""
    if not pairs:
        return []
    keep = not_dominated(np.array([o.evaluation.values[:count] for o, _ in pairs]))
    return [pairs[k] for k in keep]


def _between(anchors: Sequence[Outcome], share: np.ndarray) -> np.ndarray:
    """A place between the anchors, nearer to those of the objectives whose limits are tight."""
    weights = np.append(np.mean(share), 1.0 - share)
    weights = weights / weights.sum()
    return np.tensordot(weights, np.stack([a.evaluation.place for a in anchors]), 1)


def _solved(
    problems: Sequence[Problem], starts: Sequence[Sequence[np.ndarray]], evaluate: LoggedModel, method: str
) -> list[Outcome | None]:
    """The best outcome of every problem over its starts."""
    flat = [(p, x) for p, xs in zip(problems, starts, strict=True) for x in xs]
    outcomes = iter(optimise([p for p, _ in flat], [x for _, x in flat], evaluate, method, ON_FRONTS))
    found = [[next(outcomes) for _ in xs] for xs in starts]
    return [best_of(many) if many else None for many in found]


def not_dominated(values: np.ndarray) -> list[int]:
    """Indices of points that no other point beats, in the order of the first objective; twins count once.

    Args:
        values: values to be minimised, shape (points, objectives).
    """
    span = np.ptp(values, axis=0)
    close = 1e-6 * np.where(span > 0.0, span, 1.0)
    keep: list[int] = []
    for k in np.lexsort(values.T[::-1]):
        beaten = any(np.all(values[j] <= values[k] + close) for j in keep)
        if not beaten:
            keep.append(int(k))
    return keep


def hypervolume(values: np.ndarray, reference: np.ndarray) -> float:
    """Volume between points and a reference that at least one of them dominates.

    Args:
        values: values to be minimised, shape (points, objectives), one to three objectives.
        reference: the worst that counts, shape (objectives,).
    """
    inside = values[np.all(values < reference, axis=1)]
    if not len(inside):
        return 0.0
    if values.shape[1] == 1:
        return float(reference[0] - inside.min())
    order = inside[np.argsort(inside[:, -1])]
    ends = np.append(order[1:, -1], reference[-1])
    slices = zip(range(1, len(order) + 1), order[:, -1], ends, strict=True)
    return float(sum((b - a) * hypervolume(order[:k, :-1], reference[:-1]) for k, a, b in slices if b > a))


def share_of_box(values: np.ndarray) -> tuple[float, np.ndarray]:
    """Hypervolume as a share of the box between the best of each objective and the reference, and the
    latter."""
    best, worst = values.min(axis=0), values.max(axis=0)
    reference = worst + BEYOND * np.where(worst > best, worst - best, np.maximum(np.abs(worst), 1e-12))
    return hypervolume(values, reference) / float(np.prod(reference - best)), reference
