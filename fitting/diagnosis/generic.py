"""A correction without a name, raced against the named ones: a smooth function of one driver, added to one
output.

It is linear in its numbers, so that one derivative of the base model serves every driver, output and fold.
"""

from dataclasses import dataclass

import numpy as np

from .evaluation import Evaluation
from .folds import deciding
from .locate import drivers_of
from .program import Program
from .refit import Fit

KNOTS = 8
RIDGE = 1e-3
"""Weight that holds the correction near zero, of its own information."""


@dataclass(frozen=True)
class Generic:
    """How well a nameless correction predicts recordings that were left out.

    Attributes:
        quantity: output that it adds to.
        driver: what it is a function of; the pair is that which fits all of them best.
        left_out: reduced chi-square of fitted recordings left out in turn.
        without: the same without it.
    """

    quantity: str
    driver: str
    left_out: float
    without: float


def knots_of(values: np.ndarray) -> np.ndarray | None:
    """Where the correction of a driver bends; None where it hardly varies."""
    knots = np.unique(np.quantile(np.nan_to_num(values), np.linspace(0.0, 1.0, KNOTS)))
    return knots if len(knots) >= 3 else None


def hats(program: Program, k: int, j: int, driver: np.ndarray, knots: np.ndarray) -> np.ndarray:
    """Whitened hat functions of a driver in channel j of recording k, shape (knots, values)."""
    channel = program.channels[k][j]
    x = np.clip(np.nan_to_num(driver[k]), knots[0], knots[-1])
    columns = np.stack([np.interp(x, knots, row) for row in np.eye(len(knots))])
    return channel.whitened(np.where(np.isfinite(channel.sigma), columns, 0.0))


def race(program: Program, base: Fit) -> Generic | None:
    """The best nameless correction of a refitted base model; None where no driver varies.

    Args:
        program: of the campaign.
        base: the base model refitted.
    """
    here = program.evaluate(base.u, base.free, near=base.evaluation)
    ones = [np.ones(len(m)) for m in here.misfit]
    r, A = here.joined(ones)
    prior = np.ones(len(base.free))
    departure = base.u[base.free]
    columns = _columns(program, base, here)
    if not columns:
        return None
    sizes = [len(m) for m in here.misfit]
    fitted = np.concatenate([np.full(n, float(f)) for n, f in zip(sizes, program.fitted, strict=True)])

    def solved(B: np.ndarray, w: np.ndarray) -> tuple[float, np.ndarray]:
        J = np.concatenate([A, B], axis=1)
        own = B.T @ (w[:, None] * B)
        ridge = max(RIDGE * np.trace(own) / max(B.shape[1], 1), 1e-9)
        held = np.concatenate([prior, np.full(B.shape[1], ridge)])
        start = np.concatenate([prior * departure, np.zeros(B.shape[1])])
        step = -np.linalg.solve(J.T @ (w[:, None] * J) + np.diag(held), J.T @ (w * r) + start)
        rest = (r + J @ step) ** 2
        return float(w @ rest), rest

    total = without = 0.0
    nothing = np.zeros((len(r), 0))
    for out in deciding(program, sizes):
        test = np.concatenate(out)
        train = fitted * (1.0 - test)
        results = [solved(B, train) for B in columns.values()]
        total += float(test @ min(results, key=lambda found: found[0])[1])
        without += float(test @ solved(nothing, train)[1])
    best = min(columns, key=lambda name: solved(columns[name], fitted)[0])
    count = max(program.observations(program.fitted), 1)
    return Generic(*best, total / count, without / count)


def _columns(program: Program, base: Fit, here: Evaluation) -> dict[tuple[str, str], np.ndarray]:
    """Whitened hat functions over all values, less what hidden courses explain, shape (values, knots), by
    output and driver."""
    drivers = drivers_of(program, base)
    quantities = dict.fromkeys(channel.quantity for channels in program.channels for channel in channels)
    found = {}
    for name, values in drivers.items():
        knots = knots_of(values[program.fitted])
        if knots is None:
            continue
        for quantity in quantities:
            blocks = []
            for k, channels in enumerate(program.channels):
                parts = [
                    hats(program, k, j, values, knots)
                    if channel.quantity == quantity
                    else np.zeros((len(knots), len(channel.measured)))
                    for j, channel in enumerate(channels)
                ]
                blocks.append(here.seen(k, np.concatenate(parts, axis=1)).T)
            found[quantity, name] = np.concatenate(blocks)
    return found
