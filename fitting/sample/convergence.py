"""Convergence of chains: autocorrelation time, effective samples, R-hat between independent ensembles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from emcee.autocorr import integrated_time
from jaxtyping import Float
from scipy.special import ndtri
from scipy.stats import rankdata

LENGTHS = 50.0
"""Minimum length of a chain in autocorrelation times (emcee's own recommendation)."""
R_HAT = 1.01
"""Maximum R-hat (A. Vehtari and others, Bayesian Analysis 16 (2021) 667)."""
EFFECTIVE = 1000.0
"""Minimum number of effective samples: the probability beyond a 5 % quantile is then known to 0.7 %."""
BURN_LENGTHS = 5.0
MOST_PER_HALF = 4000  # Maximum number of samples of half a chain that R-hat ranks


@dataclass(frozen=True)
class Convergence:
    """Convergence of several ensembles of one length.

    Attributes:
        steps: number of steps of each ensemble.
        burn_in: number of initial steps that are left out.
        tau: integrated autocorrelation time in steps, shape (ensembles, n); infinite for walkers that never
            moved.
        r_hat: split, rank-normalised R-hat, the larger of location and scale, shape (n,).
        effective: effective samples of all ensembles together, shape (n,).
    """

    steps: int
    burn_in: int
    tau: Float[np.ndarray, "ensembles n"]
    r_hat: Float[np.ndarray, " n"]
    effective: Float[np.ndarray, " n"]

    @property
    def kept(self) -> int:
        """Number of steps after burn-in."""
        return self.steps - self.burn_in

    @property
    def lengths(self) -> float:
        """Length of the worst chain in its autocorrelation times, without burn-in."""
        return float(self.kept / np.max(self.tau)) if np.all(np.isfinite(self.tau)) else 0.0

    @property
    def long_enough(self) -> bool:
        """True if every chain is longer than `LENGTHS` autocorrelation times."""
        return self.lengths > LENGTHS

    @property
    def agree(self) -> bool:
        """True if the ensembles agree on every parameter."""
        return bool(np.all(self.r_hat < R_HAT))

    @property
    def enough(self) -> bool:
        """True if there are enough effective samples to quote quantiles."""
        return bool(np.all(self.effective >= EFFECTIVE))

    @property
    def converged(self) -> bool:
        """True if all three criteria hold."""
        return self.long_enough and self.agree and self.enough

    @property
    def thin(self) -> int:
        """Number of steps between retained samples: half the shortest autocorrelation time."""
        shortest = float(np.min(self.tau))
        return max(int(0.5 * shortest), 1) if np.isfinite(shortest) else 1


def assess(chains: Sequence[Float[np.ndarray, "steps walkers n"]]) -> Convergence:
    """Judge ensembles that ran independently for the same number of steps.

    Burn-in is five autocorrelation times of the remainder, at most half of the chain.
    """
    steps, walkers, dimension = chains[0].shape
    burn_in, tau = 0, np.full((len(chains), dimension), np.inf)
    for _ in range(3):
        tau = np.stack([_autocorrelation_time(chain[burn_in:]) for chain in chains])
        longest = np.max(tau)
        wanted = steps // 2 if not np.isfinite(longest) else min(int(BURN_LENGTHS * longest), steps // 2)
        if wanted == burn_in:
            break
        burn_in = wanted
    effective = np.sum(walkers * (steps - burn_in) / tau, axis=0)
    return Convergence(steps, burn_in, tau, split_r_hat([chain[burn_in:] for chain in chains]), effective)


def _autocorrelation_time(chain: Float[np.ndarray, "steps walkers n"]) -> Float[np.ndarray, " n"]:
    """Sokal's estimate from the autocorrelation averaged over walkers; infinite where nothing moves."""
    moving = np.ptp(chain, axis=(0,)).max(axis=0) > 0.0
    tau = np.full(chain.shape[2], np.inf)
    if len(chain) < 4 or not moving.any():
        return tau
    with np.errstate(all="ignore"):
        found = integrated_time(chain[:, :, moving], tol=0, quiet=True)
    tau[moving] = np.where(np.isfinite(found) & (found > 0.0), np.maximum(found, 1.0), np.inf)
    return tau


def split_r_hat(chains: Sequence[Float[np.ndarray, "steps walkers n"]]) -> Float[np.ndarray, " n"]:
    """Potential scale reduction between the halves of all ensembles, on ranks, for location and for scale.

    Each half of an ensemble counts as one chain, with all its walkers. Walkers of one ensemble are not
    independent; ensembles are.
    """
    half = len(chains[0]) // 2
    if half < 2:
        return np.full(chains[0].shape[2], np.inf)
    parts = [part for chain in chains for part in (chain[:half], chain[len(chain) - half :])]
    stride = max(half * chains[0].shape[1] // MOST_PER_HALF, 1)  # of steps: every walker counts
    pooled = np.stack([part[::stride].reshape(-1, part.shape[2]) for part in parts])  # (halves, m, n)
    folded = np.abs(pooled - np.median(pooled, axis=(0, 1)))
    return np.maximum(_rank_r_hat(pooled), _rank_r_hat(folded))


def _rank_r_hat(pooled: Float[np.ndarray, "halves m n"]) -> Float[np.ndarray, " n"]:
    halves, count, dimension = pooled.shape
    ranks = rankdata(pooled.reshape(-1, dimension), axis=0)
    scores = ndtri((ranks - 0.375) / (halves * count + 0.25)).reshape(pooled.shape)
    within = np.mean(np.var(scores, axis=1, ddof=1), axis=0)
    between = np.var(np.mean(scores, axis=1), axis=0, ddof=1)
    return np.where(
        within > 0.0, np.sqrt((count - 1) / count + between / np.where(within > 0.0, within, 1.0)), np.inf
    )
