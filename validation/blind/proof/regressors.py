"""Regressions of residuals (in standard deviations of the noise) on drivers: a Gaussian process, a sparse
library."""

import itertools

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

MOST_POINTS = 180
"""Maximum number of training rows of a Gaussian process, evenly spread over the fitted ones."""
LONG = (0.1, 30.0)
"""Bounds of its length scales, in standard deviations of a driver."""


class GaussianProcess:
    """Squared-exponential kernel with a length scale for every driver and white noise, by maximum marginal
    likelihood.

    Args:
        x: drivers, shape (rows, drivers).
        y: residuals, shape (rows,).
        keep: mask of the training rows, shape (rows,).
    """

    def __init__(self, x, y, keep):
        rows = np.flatnonzero(keep)
        rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_POINTS)).astype(int)]
        self._x, self._y = x[rows], y[rows]
        self._squares = (self._x[:, None, :] - self._x[None, :, :]) ** 2
        count = x.shape[1]
        spread = max(float(np.var(self._y)), 1e-2)
        bounds = [(np.log(1e-4), np.log(1e2 * spread)), (np.log(0.1), np.log(1e2 * spread)), *[tuple(np.log(LONG))] * count]
        starts = [np.concatenate([[np.log(spread), np.log(0.5 * spread + 0.5)], np.full(count, np.log(s))]) for s in (1.0, 4.0)]
        options = {"maxiter": 30}
        tried = [minimize(self._cost, s, jac=True, bounds=bounds, method="L-BFGS-B", options=options) for s in starts]
        self._set(min(tried, key=lambda t: t.fun).x)

    def _kernel(self, theta, squares):
        return np.exp(theta[0] - 0.5 * squares @ np.exp(-2.0 * theta[2:]))

    def _cost(self, theta):
        """Negative log marginal likelihood and its gradient."""
        K = self._kernel(theta, self._squares)
        noise = np.exp(theta[1])
        factor = cho_factor(K + (noise + 1e-8 * np.exp(theta[0])) * np.eye(len(K)), lower=True)
        alpha = cho_solve(factor, self._y)
        inner = cho_solve(factor, np.eye(len(K))) - np.outer(alpha, alpha)
        slopes = np.einsum("ij,ijd->d", inner * K, self._squares) * np.exp(-2.0 * theta[2:])
        gradient = 0.5 * np.concatenate([[np.sum(inner * K)], [noise * np.trace(inner)], slopes])
        return 0.5 * self._y @ alpha + float(np.sum(np.log(np.diag(factor[0])))), gradient

    def _set(self, theta):
        self.theta = theta
        K = self._kernel(theta, self._squares)
        noise = np.exp(theta[1]) + 1e-8 * np.exp(theta[0])
        self._alpha = cho_solve(cho_factor(K + noise * np.eye(len(K)), lower=True), self._y)

    def __call__(self, x):
        """Expected residual at drivers (rows, drivers)."""
        return self._kernel(self.theta, (x[:, None, :] - self._x[None, :, :]) ** 2) @ self._alpha


class SparseRegression:
    """Least squares on products of drivers up to the third power. Small terms are dropped one by one, and BIC
    decides their number.

    Args:
        x: drivers, shape (rows, drivers).
        y: residuals, shape (rows,).
        keep: mask of the training rows, shape (rows,).
    """

    THRESHOLDS = np.geomspace(0.01, 1.0, 9)

    def __init__(self, x, y, keep):
        library, target = self._library(x)[keep], y[keep]
        self._scale = np.maximum(np.sqrt(np.mean(library**2, axis=0)), 1e-12)
        library = library / self._scale
        self._low, self._high = x[keep].min(axis=0), x[keep].max(axis=0)
        size = max(float(np.std(target)), 1e-12)
        tried = [self._thresholded(library, target, share * size) for share in self.THRESHOLDS]
        rows = len(target)
        self.weights = min(
            tried,
            key=lambda w: rows * np.log(np.mean((target - library @ w) ** 2) + 1e-300) + np.log(rows) * np.count_nonzero(w),
        )

    @staticmethod
    def _thresholded(library, target, threshold):
        active = np.ones(library.shape[1], bool)
        weights = np.zeros(library.shape[1])
        for _ in range(12):
            weights[:] = 0.0
            if active.any():
                weights[active] = np.linalg.lstsq(library[:, active], target, rcond=1e-9)[0]
            large = np.abs(weights) >= threshold
            if np.array_equal(large, active):
                break
            active = large
        return weights

    @staticmethod
    def _library(x):
        drivers = range(x.shape[1])
        terms = [np.ones(len(x))]
        for degree in (1, 2, 3):
            terms += [np.prod(x[:, list(some)], axis=1) for some in itertools.combinations_with_replacement(drivers, degree)]
        terms += [np.abs(x[:, k]) for k in drivers]
        return np.stack(terms, axis=1)

    def __call__(self, x):
        """Expected residual at drivers (rows, drivers), clipped to the training range."""
        return (self._library(np.clip(x, self._low, self._high)) / self._scale) @ self.weights
