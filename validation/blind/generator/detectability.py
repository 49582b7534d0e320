"""Evidence of the data against the base model after a refit of its parameters within their tolerances.

The strength of a case is the log Bayes factor of the true form. It is half the excess of the refitted base's
chi-square over the truth's, less an Occam term. The term is for an amplitude whose prior is as wide as the
amplitude itself. Where a resistance is measured, base and truth are refitted with a latent trajectory of the
martensite fraction (hidden.py).
"""

import numpy as np

from . import stand
from .hidden import HiddenJudge, Rest, numbers_at
from .noise import Whitener

STEP = 1e-3


def _first(columns):
    return {name: np.asarray(value)[:1] for name, value in columns.items()}


def felt_inputs(bench, clean, noise, true_z):
    """Effect of the measured inputs' noise on the base's predictions: variance and draw (K, N) by scored
    column.

    It is computed once for a specimen, from its columns without any effect (K, N), since the effects hardly
    change it.
    """
    noisy = [c for c in bench.inputs if c in bench.noise and c not in bench.scored]
    columns = {c: np.repeat(v[None], 2 * len(noisy) + 1, axis=0) for c, v in clean.items()}
    for number, channel in enumerate(noisy):
        columns[channel][2 * number + 1] += bench.noise[channel]
        columns[channel][2 * number + 2] -= bench.noise[channel]
    predicted = _predict(bench, np.tile(true_z, (2 * len(noisy) + 1, 1)), columns)
    variance, felt = {}, {}
    for c in bench.scored:
        up, down = (predicted[c][k::2] - predicted[c][:1] for k in (1, 2))
        draws = np.stack([noise[x] / bench.noise[x] for x in noisy]) if noisy else up
        variance[c] = np.sum(np.maximum(np.abs(up), np.abs(down)) ** 2, axis=0)
        felt[c] = -np.sum(np.where(draws > 0, up, -down) * draws, axis=0)
    return variance, felt


def _predict(bench, z, columns):
    """Prediction of the base at z (B, P) from noise-free columns, with the true latent fraction."""
    if not bench.hidden:
        return stand.base(bench, numbers_at(bench, z), columns)
    course = np.repeat(bench.stack(bench.hidden[1])[None], len(z), axis=0)
    return stand.forward(bench, numbers_at(bench, z), columns, course)[0]


class Judge:
    """Refits the base to one set of noise-free recorded columns (1, K, N) with one draw of noise added."""

    def __init__(self, bench, whiten, recorded, noise, true_z, felt):
        self.bench, self.recorded, self.true_z = bench, _first(recorded), true_z
        self.noise = {c: noise[c][None] if c in noise else 0.0 for c in bench.scored}
        self.whiten = whiten
        self.noise = {c: self.noise[c] + felt[1][c] for c in bench.scored}
        clean = {c: np.broadcast_to(self.noise[c], self.recorded[c].shape) for c in bench.scored}
        self.whitened_noise = self.whiten(clean)[0]

    def residuals(self, z):
        """Whitened residuals (B, M) of the base at z (B, P)."""
        predicted = stand.base(self.bench, numbers_at(self.bench, z), self.recorded)
        return self.whiten({c: self.recorded[c] + self.noise[c] - predicted[c] for c in self.bench.scored})

    def linearise(self, z):
        """Residual (M,) and its derivative (M, P) at z (P,)."""
        values = self.residuals(np.vstack([z, z + STEP * np.eye(len(z))]))
        return values[0], (values[1:] - values[0]).T / STEP

    def refit(self, start=None, rounds=6):
        """Gauss-Newton from a start: best z, its cost (chi-square plus prior) and chi-square, its
        derivative."""
        z = np.array(self.true_z if start is None else start, float)
        r, j = self.linearise(z)
        cost = r @ r + z @ z
        for _ in range(rounds):
            step = np.linalg.solve(j.T @ j + np.eye(len(z)), -(j.T @ r + z))
            for share in (1.0, 0.4, 0.1):
                trial = np.clip(z + share * step, -4.0, 4.0)
                try:
                    r_new, j_new = self.linearise(trial)
                except ArithmeticError:  # too far away for an equilibrium
                    continue
                cost_new = r_new @ r_new + trial @ trial
                if cost_new < cost:
                    break
            else:
                break
            gained, z, r, j, cost = cost - cost_new, trial, r_new, j_new, cost_new
            if gained < 0.05:
                break
        return z, cost, r @ r, j

    def truth_cost(self, j):
        """Cost of the true form after its own refit, linear in the base parameters."""
        n, z = self.whitened_noise, self.true_z
        step = np.linalg.solve(j.T @ j + np.eye(len(z)), -(j.T @ n + z))
        rest = n + j @ step
        return rest @ rest + (z + step) @ (z + step)

    def held_out(self, z):
        """Chi-square of the held-out recordings at z (P,), that of the truth, and the number of residuals."""
        residual = self.residuals(z[None])[0]
        return residual @ residual, self.whitened_noise @ self.whitened_noise, max(self.whiten.size, 1)

    def freedom(self, z):
        """Degrees of freedom of a fit."""
        return self.whiten.size

    def gains(self, columns):
        """Half the noise-free chi-square (B,) of columns after a refit of the base, to first order."""
        _, j = self.linearise(self.true_z)
        size = len(next(iter(columns.values())))
        predicted = stand.base(self.bench, numbers_at(self.bench, np.tile(self.true_z, (size, 1))), columns)
        whitened = self.whiten({c: columns[c] - predicted[c] for c in self.bench.scored})
        inner = np.linalg.solve(j.T @ j + np.eye(len(self.true_z)), j.T @ whitened.T)
        return 0.5 * (np.sum(whitened**2, axis=1) - np.sum((whitened @ j) * inner.T, axis=1))


def occam(gain, effects=1):
    """Occam term of an amplitude with a prior as wide as itself, which the data determine to 1 / sqrt(2
    gain)."""
    return 0.5 * effects * np.log1p(2.0 * max(gain, 0.0))


def whiteners(bench, instruments, clean, felt):
    """Whitening of the fitted and of the held-out recordings, by the noise of the columns without any effect
    (K, N)."""
    fitted = bench.fitted()
    return tuple(Whitener(instruments, clean, felt[0], chosen) for chosen in (fitted, ~fitted))


def rest_of(bench, whiten, clean, noise, true_z, felt):
    """Residual of the true form where a latent trajectory is fitted, or None."""
    return Rest(bench, whiten, clean, noise, true_z, felt) if bench.hidden else None


def _judge(bench, *data, rest):
    return HiddenJudge(bench, *data, rest) if bench.hidden else Judge(bench, *data)


def verdict(bench, whiten, recorded, noise, true_z, felt, rest, effects=1, starts=None, held=True):
    """Post-refit log Bayes factor and reduced chi-squares of the refitted base, as a dictionary. `end` starts
    another refit; `held` requests the held-out recordings.

    With a latent trajectory, z ends alike from every start, with the cost within some per cent, because the
    metal's memory has kinks. So one start suffices. A refit that stops at a kink counts no more excess than
    remains to first order.
    """
    judge = _judge(bench, whiten[0], recorded, noise, true_z, felt, rest=rest)
    if starts is None:
        starts = [rest.end] if bench.hidden else [true_z, np.zeros_like(true_z)]
    fits = [judge.refit(start) for start in starts]
    end, cost, chi2, *j = min(fits, key=lambda fit: fit[1])
    z = end[0] if bench.hidden else end
    gain = 0.5 * (cost - judge.truth_cost(*j))
    if bench.hidden:
        gain = min(gain, float(judge.gains(recorded)[0]))
    beyond = {}
    if held:
        excess, least, size = _judge(bench, whiten[1], recorded, noise, true_z, felt, rest=rest).held_out(end)
        beyond = {"validation_chi2": float(excess / size), "validation_gain": float(0.5 * (excess - least))}
    return {
        "log_bayes": float(gain - occam(gain, effects)),
        "fit_chi2": float(chi2 / judge.freedom(end)),
        **beyond,
        "absorbed_sd": [round(float(v), 3) for v in z - true_z],
        "end": end,
    }


def linear_gains(bench, whiten, clean, noise, true_z, felt, columns):
    """Half the noise-free chi-square (B,) of columns (B, K, N) after a refit of the base, to first order."""
    clean = {c: v[None] for c, v in clean.items()}
    return _judge(bench, whiten[0], clean, noise, true_z, felt, rest=None).gains(columns)
