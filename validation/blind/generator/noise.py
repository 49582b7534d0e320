"""Instruments: time structure of their noise, its draw, and whitening by it."""

import numpy as np
from scipy.linalg import solve_triangular, toeplitz


class Instruments:
    """Noise of a campaign: by channel the shares of (variance, correlation between rows), and the spread over
    rows."""

    def __init__(self, bench, rng):
        self.bench = bench
        self.shares = {}
        for channel in bench.noise:
            self.shares[channel] = [(1.0, 0.0)]
            if channel not in bench.outputs:
                continue
            if bench.flavour == "ar1":
                self.shares[channel] = [(1.0, float(rng.uniform(0.5, 0.85)))]
            elif bench.flavour == "drift":
                slow = float(rng.uniform(0.15, 0.35))
                self.shares[channel] = [(1.0 - slow, 0.0), (slow, float(rng.uniform(0.95, 0.985)))]
        self.uneven = float(rng.uniform(0.5, 0.9)) if bench.flavour == "heteroscedastic" else 0.0

    def spread(self, channel, series):
        """Standard deviation (K, N) of a channel whose noise-free series is given; its mean square is that of
        the stated noise."""
        sigma = self.bench.noise[channel]
        shape = np.ones_like(series)
        if self.uneven and channel in self.bench.outputs:
            size = np.abs(series) / np.max(np.abs(series))
            shape = 1.0 - self.uneven + 2.0 * self.uneven * size
            shape = shape / np.sqrt(np.mean(shape[self.bench.kept()] ** 2))
        return sigma * shape

    def draw(self, channel, series, rng):
        """Noise (K, N) for a noise-free series (K, N)."""
        total = np.zeros_like(series)
        for variance, phi in self.shares[channel]:
            kicks = rng.standard_normal(series.shape)
            value = kicks[:, 0]
            total[:, 0] += np.sqrt(variance) * value
            for n in range(1, series.shape[1]):
                value = phi * value + np.sqrt(1.0 - phi**2) * kicks[:, n]
                total[:, n] += np.sqrt(variance) * value
        return total * self.spread(channel, series)


class Whitener:
    """Converts series (B, K, N) of the scored columns to independent unit residuals of chosen recordings.

    `reference` are noise-free columns (K, N). `indirect` is the variance (K, N) by scored column from the
    noise of measured inputs.
    """

    def __init__(self, instruments, reference, indirect, chosen):
        bench = instruments.bench
        self.chosen = np.flatnonzero(chosen)
        self.columns = bench.scored
        mask = bench.kept()
        self.blocks = []
        for column in self.columns:
            spread = instruments.spread(column, reference[column])
            for k in self.chosen:
                rows = np.flatnonzero(mask[k])
                correlated = sum(v * p ** np.arange(len(rows)) for v, p in instruments.shares[column])
                covariance = toeplitz(correlated) * np.outer(spread[k, rows], spread[k, rows])
                covariance[np.diag_indices(len(rows))] += indirect[column][k, rows]
                self.blocks.append((column, k, rows, np.linalg.cholesky(covariance)))
        self.size = sum(len(rows) for _, _, rows, _ in self.blocks)

    def __call__(self, series):
        """Whitened residuals (B, M) of a difference of series."""
        parts = [
            solve_triangular(factor, series[column][:, k, rows].T, lower=True).T
            for column, k, rows, factor in self.blocks
        ]
        return np.concatenate(parts, axis=1)
