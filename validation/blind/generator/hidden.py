"""Martensite fractions as latent trajectories: one free number in [0, 1] per row.

It has to explain the measured resistance and the other scored columns together (errors in variables by
maximum likelihood).

A trajectory is (K, N). In each Gauss-Newton round the rows' fractions are eliminated recording by recording.
The remaining system is solved for the base parameters z (P,). Fractions that would leave [0, 1] are held at
its ends.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, solve_triangular

from . import stand

STEP = 1e-3
SHIFTS = (-1e-4, 3e-3)
"""Steps of the difference quotients, in z and in the fractions. Where one fails at a kink of the metal's
memory, the next is tried."""
SHARES = (1.0, 0.4, 0.1, 0.03, 0.01)
"""Candidate shares of a step; the metal's memory has kinks that a full step jumps over."""
FLOOR = 1e-2
"""Added curvature where no column depends on a fraction."""


class Slopes:
    """Derivatives of the whitened residuals by z and by the fractions.

    `z` is (M, P). For recording k, `at[k]` (M_k,) holds the indices of its residuals, and `x[k]` (M_k, N_k)
    the derivative by its fractions at `rows[k]`.
    """

    def __init__(self, whiten, by_z, by_fraction, by_memory, source):
        self.z, self.at, self.rows, self.x = by_z, {}, {}, {}
        place = 0
        for column, k, rows, factor in whiten.blocks:
            n = np.arange(len(rows))
            matrix = np.diag(by_fraction[column][k, rows])
            earlier = source[k, rows] >= 0
            matrix[n[earlier], source[k, rows][earlier]] += by_memory[column][k, rows][earlier]
            part = -solve_triangular(factor, matrix, lower=True)
            index = place + n
            place += len(rows)
            self.rows[k] = rows
            self.at[k] = np.concatenate([self.at[k], index]) if k in self.at else index
            self.x[k] = np.concatenate([self.x[k], part]) if k in self.x else part
        self.square = {k: x.T @ x + FLOOR * np.eye(x.shape[1]) for k, x in self.x.items()}
        self.mixed = {k: x.T @ by_z[self.at[k]] for k, x in self.x.items()}

    def step(self, r, z, course, move_z=True, passes=12):
        """Best linear step from residual r (M,): (dz (P,), change of the trajectory (K, N), residual after it
        (M,))."""
        gradient = {k: x.T @ r[self.at[k]] for k, x in self.x.items()}
        held = {k: np.full(len(rows), np.nan) for k, rows in self.rows.items()}
        for _ in range(passes):
            dz = self._base_step(r, z, gradient, held) if move_z else np.zeros(0)
            steps = {k: self._course_step(k, gradient[k], held[k], dz) for k in self.x}
            changes = [self._hold(k, gradient[k], held[k], steps[k], dz, course) for k in self.x]
            if not any(changes):
                break
        change, rest = np.zeros_like(course), r + self.z @ dz
        for k, rows in self.rows.items():
            change[k, rows] = np.clip(steps[k], -course[k, rows], 1.0 - course[k, rows])
            rest[self.at[k]] += self.x[k] @ change[k, rows]
        return dz if move_z else np.zeros_like(z), change, rest

    def _split(self, k, gradient, held):
        """Free rows, their factor, and their gradient with the held rows at their limits."""
        free = np.isnan(held)
        pull = gradient[free] + self.square[k][np.ix_(free, ~free)] @ held[~free]
        return free, cho_factor(self.square[k][np.ix_(free, free)]), pull

    def _base_step(self, r, z, gradient, held):
        curvature, slope = self.z.T @ self.z + np.eye(len(z)), self.z.T @ r + z
        for k in self.x:
            free, factor, pull = self._split(k, gradient[k], held[k])
            mixed = self.mixed[k]
            curvature = curvature - mixed[free].T @ cho_solve(factor, mixed[free])
            slope = slope + mixed[~free].T @ held[k][~free] - mixed[free].T @ cho_solve(factor, pull)
        return -np.linalg.solve(curvature, slope)

    def _course_step(self, k, gradient, held, dz):
        free, factor, pull = self._split(k, gradient, held)
        step = held.copy()
        step[free] = -cho_solve(factor, pull + self.mixed[k][free] @ dz)
        return step

    def _hold(self, k, gradient, held, step, dz, course):
        """Hold rows that would leave [0, 1], and release those that the gradient moves inwards. The result is
        true if any changed."""
        low, high = -course[k, self.rows[k]], 1.0 - course[k, self.rows[k]]
        slope = gradient + self.square[k] @ step + self.mixed[k] @ dz
        inwards = ((held == low) & (slope < -1e-6)) | ((held == high) & (slope > 1e-6))
        free = np.isnan(held)
        under, over = free & (step < low - 1e-9), free & (step > high + 1e-9)
        held[inwards], held[under], held[over] = np.nan, low[under], high[over]
        return np.any(inwards | under | over)


def numbers_at(bench, z):
    """Constants at standardised parameters z (B, P)."""
    out = {name: np.full(len(z), value) for name, value in bench.nominal.items()}
    for column, name in enumerate(sorted(bench.tolerance)):
        out[name] = out[name] * (1.0 + bench.tolerance[name] * z[:, column])
    return out


class HiddenJudge:
    """Refits base and latent trajectory to noise-free recorded columns (1, K, N) with one draw of noise
    added."""

    def __init__(self, bench, whiten, recorded, noise, true_z, felt, rest=None):
        self.rest, self.bench, self.whiten, self.true_z = rest, bench, whiten, true_z
        self.recorded = {c: np.asarray(v)[:1] for c, v in recorded.items()}
        self.true_course = bench.stack(bench.hidden[1])
        self.noise = {c: noise[c] + felt[1][c] for c in bench.scored}

    def _residuals(self, predicted):
        return self.whiten({c: self.recorded[c] + self.noise[c] - predicted[c] for c in self.bench.scored})

    def linearise(self, z, course, move_z=True, shift=SHIFTS[0]):
        """Residual (M,) and its Slopes at z (P,) and a trajectory (K, N), all in one march."""
        size = len(z) if move_z else 0
        points = np.tile(z, (size + 3, 1))
        points[1 : size + 1] += STEP * np.eye(len(z))[:size]
        courses = np.repeat(course[None], size + 3, axis=0)
        courses[-2:] += shift
        predicted, source = stand.forward(self.bench, numbers_at(self.bench, points), self.recorded, courses, True)
        values = self._residuals({c: v[:-2] for c, v in predicted.items() if c in self.bench.scored})
        by_fraction = {c: (predicted[c][-2] - predicted[c][0]) / shift for c in self.bench.scored}
        by_memory = {c: (predicted[c][-1] - predicted[c][-2]) / shift for c in self.bench.scored}
        return values[0], Slopes(self.whiten, (values[1:] - values[0]).T / STEP, by_fraction, by_memory, source)

    def _trial(self, z, course, dz, change, at):
        """The best share of a step: its cost, z and trajectory; the cost is infinite where none has an
        equilibrium.

        Every recording takes the best share of its fractions' step, up to that of dz.
        """
        best = np.inf, z, course
        for shares in (SHARES[:3], SHARES[3:]):
            pairs = [(whole, part) for whole in shares for part in (*shares, 0.0) if part <= whole]
            points = np.clip(z + np.outer([whole for whole, _ in pairs], dz), -4.0, 4.0)
            courses = np.clip(course + np.multiply.outer([part for _, part in pairs], change), 0.0, 1.0)
            try:
                predicted, _ = stand.forward(self.bench, numbers_at(self.bench, points), self.recorded, courses)
            except ArithmeticError:  # too far off
                continue
            squares = np.nan_to_num(self._residuals(predicted) ** 2, nan=np.inf)
            costs_of = {k: np.sum(squares[:, places], axis=1) for k, places in at.items()}
            for share in shares:
                tried = [n for n, (whole, _) in enumerate(pairs) if whole == share]
                choice = {k: tried[np.argmin(costs[tried])] for k, costs in costs_of.items()}
                point, joined = points[tried[0]], course.copy()
                for k, n in choice.items():
                    joined[k] = courses[n, k]
                cost = point @ point + sum(costs_of[k][n] for k, n in choice.items())
                best = min(best, (cost, point, joined), key=lambda found: found[0])
            if np.isfinite(best[0]):
                break
        return best

    def refit(self, start, move_z=True, rounds=12, enough=0.3):
        """Gauss-Newton from a start, z or (z, trajectory): end, its cost (chi-square plus prior),
        chi-square."""
        z, course = start if isinstance(start, tuple) else (start, self.rest.end[1])
        z, cost, idle, side = np.array(z, float), np.inf, 0, 0
        for _ in range(rounds):
            r, slopes = self.linearise(z, course, move_z, SHIFTS[side])
            cost = min(cost, r @ r + z @ z)
            new, *end = self._trial(z, course, *slopes.step(r, z, course, move_z)[:2], slopes.at)
            gained = cost - new
            if gained > 0.0:
                cost, (z, course) = new, end
            idle = 0 if gained > enough else idle + 1
            if idle == len(SHIFTS):
                break
            side = (side + (gained <= enough)) % len(SHIFTS)
        return (z, course), cost, cost - z @ z

    def truth_cost(self):
        """Cost of the true form after its own refit."""
        return self.rest.cost

    def held_out(self, end):
        """Chi-square of the held-out recordings, with fractions fitted at z, that of the truth, and the
        number of residuals."""
        end, _, left = self.refit(end[0], move_z=False)
        return left, self.rest.held, self.freedom(end)

    def freedom(self, end):
        """Residuals less the free fractions: those inside [0, 1]."""
        course = end[1]
        inside = (course > 0.0) & (course < 1.0) & self.bench.kept()
        return max(self.whiten.size - int(np.sum(inside[self.whiten.chosen])), 1)

    def gains(self, columns):
        """Half the noise-free chi-square (B,) of columns after a refit of base and trajectory, to first
        order."""
        slopes = self.linearise(self.true_z, self.true_course)[1]
        size, still = len(next(iter(columns.values()))), np.zeros_like(self.true_z)
        numbers = numbers_at(self.bench, np.tile(self.true_z, (size, 1)))
        courses = np.repeat(self.true_course[None], size, axis=0)
        predicted, _ = stand.forward(self.bench, numbers, columns, courses)
        steps = [slopes.step(r, still, self.true_course) for r in
                 self.whiten({c: columns[c] - predicted[c] for c in self.bench.scored})]  # fmt: skip
        return np.array([0.5 * (rest @ rest + dz @ dz) for dz, _, rest in steps])


class Rest:
    """Refit of the true form to data without any effect; an effect of known amplitude does not change it.

    `end` is (z, trajectory (K, N)), `cost` its cost, and `held` the chi-square of the held-out recordings
    with fitted fractions. Every refit of the base begins here. Where the metal's memory switches, both have
    then taken the same branch.
    """

    def __init__(self, bench, whiten, clean, noise, true_z, felt):
        fitted, held = (HiddenJudge(bench, w, {c: v[None] for c, v in clean.items()}, noise, true_z, felt) for w in whiten)
        end, self.cost, _ = fitted.refit((true_z, fitted.true_course), rounds=20, enough=0.05)
        last, _, self.held = held.refit(end, move_z=False)
        chosen = np.isin(np.arange(len(last[1])), whiten[1].chosen)
        self.end = end[0], np.where(chosen[:, None], last[1], end[1])
