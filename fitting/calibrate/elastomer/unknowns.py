"""Unknowns of a simulation of an actuator about its silicone, as one set of Gaussian variables."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from .fit import LawFit
from .samples import Samples

RATE_PER_DECADE = 0.05
"""Assumed relative 1-sigma change of stress per decade of strain rate: silicones depend on it weakly."""
LEAST_DOUBT = 1e-6
"""Least variance of a rival's share: a law with no probability stays out."""
EDGE = 0.1
"""Strain past the tested range over which the extrapolation error grows to its size."""


@dataclass(frozen=True)
class Unknowns:
    """The order is: the law's constants, a share of each rival law, the law's errors below and above the
    tested strains, the batch, the rate.

    Attributes:
        covariance: covariance of all of them, shape (unknowns, unknowns).
        slices: entries that are `constants`, `law` (shares of rivals and the two extrapolation errors),
            `specimen` (the batch) and `rate`.
        fit: the law that a simulation uses.
        rivals: laws that may be right instead.
        tested: least and largest strain that was fitted.
    """

    covariance: np.ndarray
    slices: dict[str, slice]
    fit: LawFit
    rivals: tuple[LawFit, ...]
    tested: tuple[float, float]

    def sensitivities(self, strain: np.ndarray, batch: float, rate: float) -> np.ndarray:
        """Change of the stress per unit of each unknown [Pa], shape (strains, unknowns)."""
        curve = self.fit.stress(strain)
        rivals = [rival.stress(strain) - curve for rival in self.rivals]
        outside = [ramp * curve for ramp in self.untested(strain)]
        columns = [
            *self.fit.gradient(strain)[:, self.fit.free].T,
            *rivals,
            *outside,
            batch * curve,
            rate * curve,
        ]
        return np.stack(columns, axis=1)

    def untested(self, strain: np.ndarray) -> list[np.ndarray]:
        """Distance of each strain from the tested range, from 0 inside to 1."""
        ends = self.tested
        return [np.clip((ends[0] - strain) / EDGE, 0.0, 1.0), np.clip((strain - ends[1]) / EDGE, 0.0, 1.0)]

    def error(self, covariance: np.ndarray, design: np.ndarray) -> dict[str, float]:
        """Root mean square error over the rows of a design, in all and by cause."""
        errors = {"all": float(np.sqrt(np.mean(np.einsum("ij,jk,ik->i", design, covariance, design))))}
        for cause, part in self.slices.items():
            own = design[:, part]
            squares = np.einsum("ij,jk,ik->i", own, covariance[part, part], own)
            errors[cause] = float(np.sqrt(np.mean(np.maximum(squares, 0.0))))
        return errors


def unknowns_of(
    samples: Samples,
    fits: Mapping[str, LawFit],
    weights: Mapping[str, float],
    chosen: str,
    extrapolation: float,
) -> Unknowns:
    """Unknowns after the samples that were fitted; arguments as for `next_test.next_test`."""
    fit = fits[chosen]
    rivals = [name for name in fits if name != chosen]
    total = sum(weights[name] for name in (chosen, *rivals))
    doubt = [weights[name] / total for name in rivals] if total > 0.0 else [0.0] * len(rivals)
    specimens = max(len(samples.specimens()), 1)
    size, others = len(fit.free), len(rivals)
    covariance = np.zeros((size + others + 4,) * 2)
    covariance[:-4, :-4] = _given_the_tests(samples, fit, [fits[name] for name in rivals], doubt)
    tail = [extrapolation**2, extrapolation**2, samples.batch**2 / specimens, RATE_PER_DECADE**2]
    covariance[-4:, -4:] = np.diag(tail)
    slices = {
        "constants": slice(0, size),
        "law": slice(size, size + others + 2),
        "specimen": slice(size + others + 2, size + others + 3),
        "rate": slice(size + others + 3, size + others + 4),
    }
    strain = fit.rested(samples)[0][fit.mask]
    ends = (float(strain.min()), float(strain.max()))
    return Unknowns(covariance, slices, fit, tuple(fits[name] for name in rivals), ends)


def _given_the_tests(samples: Samples, fit: LawFit, rivals: list[LawFit], doubt: list[float]) -> np.ndarray:
    """Covariance of the constants and of each rival's share, after the samples that were fitted.

    Where the tests were made, they have already settled which law is right; a rival stays possible only as
    far as it agrees with them. Constants start out unknown; the variance of a rival's share is its
    probability.
    """
    mask = fit.mask
    strain, spread = fit.rested(samples)[0][mask], (samples.spread * fit.inflation)[mask, None]
    curve = fit.stress(strain)
    constants = fit.gradient(strain)[:, fit.free]
    shares = np.array([rival.stress(strain) - curve for rival in rivals]).reshape(len(rivals), len(curve)).T
    design = np.concatenate([constants, shares], axis=1) / spread
    prior = np.concatenate([np.zeros(constants.shape[1]), 1.0 / np.sqrt(np.maximum(doubt, LEAST_DOUBT))])
    length = np.sqrt(np.sum(design**2, axis=0) + prior**2)
    rows = np.concatenate([design, np.diag(prior)]) / length
    return np.linalg.pinv(rows.T @ rows, rcond=1e-13, hermitian=True) / np.outer(length, length)


def updated(
    covariance: np.ndarray, design: np.ndarray, noise: float, common: np.ndarray | None
) -> tuple[np.ndarray, float]:
    """Covariance after a test, and the information it is expected to give [nats].

    Args:
        covariance: covariance of the unknowns before the test.
        design: change of each observation per unit of each unknown, shape (observations, unknowns).
        noise: 1-sigma of an observation.
        common: 1-sigma of an error that all observations share, shape (observations,), or None.
    """
    errors = noise**2 * np.eye(len(design))
    if common is not None:
        errors += np.outer(common, common)
    signal = design @ covariance @ design.T
    gain = np.linalg.solve(errors + signal, design @ covariance)
    information = 0.5 * np.linalg.slogdet(np.eye(len(design)) + np.linalg.solve(errors, signal))[1]
    return covariance - covariance @ design.T @ gain, float(information)
