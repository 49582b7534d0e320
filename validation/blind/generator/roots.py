"""The generator's own root finder: Newton with difference quotients, many small problems at once."""

import numpy as np


def _newton_step(jacobian, value):
    size = value.shape[-1]
    if size == 1:
        return value / jacobian[..., 0]
    if size == 2:
        a, b, c, d = (jacobian[..., i, j] for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)))
        det = a * d - b * c
        first = (d * value[..., 0] - b * value[..., 1]) / det
        second = (a * value[..., 1] - c * value[..., 0]) / det
        return np.stack([first, second], axis=-1)
    return np.linalg.solve(jacobian, value[..., None])[..., 0]


SHARES = np.array([1.0, 0.5, 0.25, 0.12, 0.05, 0.015, 0.004])


def _best_of(residual, x, step):
    """Share of a step with the smallest residual, problem by problem."""
    shares = SHARES.reshape((-1,) + (1,) * x.ndim)
    trials = x[None] - shares * step
    squares = np.sum(residual(trials) ** 2, axis=-1)
    chosen = np.argmin(squares, axis=0)
    return np.take_along_axis(trials, chosen[None, ..., None], axis=0)[0]


def solve(residual, guess, *, shift=1e-6, longest=0.15, tolerance=1e-9, rounds=60):
    """Roots x (..., n) of residual(x) -> (..., n), started at `guess`.

    The n displaced points are evaluated in one call: `residual` receives (n + 1, ..., n). After some rounds a
    step is searched along its length, because full steps may alternate for ever at a kink or a vertical
    tangent. Raises ArithmeticError when a problem is not solved.
    """
    x = np.array(guess, dtype=float)
    size = x.shape[-1]
    offsets = np.vstack([np.zeros((1, size)), shift * np.eye(size)]).reshape((size + 1,) + (1,) * (x.ndim - 1) + (size,))
    for count in range(rounds):
        wider = 1.0 if count < 20 else 300.0  # the slope across a kink, not on one side of it
        values = residual(x[None] + wider * offsets)
        jacobian = np.moveaxis((values[1:] - values[0]) / (wider * shift), 0, -1)
        step = _newton_step(jacobian, values[0])
        length = np.max(np.abs(step), axis=-1, keepdims=True)
        worst = np.max(length)
        if not np.isfinite(worst):
            raise ArithmeticError("the equilibrium has a singular or infinite step")
        step = step * np.minimum(1.0, longest / np.maximum(length, 1e-300))
        if worst < tolerance:
            return x - step
        x = x - step if count < 6 else _best_of(residual, x, step)
    if worst < 2e-5:  # alternating across a kink, closer than any instrument resolves
        return x
    raise ArithmeticError(f"no equilibrium after {rounds} rounds; the last step was {worst:.2e}")
