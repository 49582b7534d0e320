"""Marginal likelihood of a linearised fit, with its parameters integrated out, and its covariance."""

import numpy as np

LEAST = 1e-4
"""Minimum weight of a grid point that is kept."""
RIDGE = 1e-12
"""Least precision of a constant without a prior, and part of the scaled information that is added to it."""


def log_evidence(
    information: np.ndarray, slope: np.ndarray, loss: np.ndarray, precision: np.ndarray, pull: np.ndarray
) -> np.ndarray:
    """Marginal log-likelihood of a fit's residuals, its parameters integrated out with their priors.

    Args:
        information, slope, loss: as of `Sizes`, one for each place.
        precision, pull: as of `lasting`.
    """
    normal, target = with_prior(information, precision), slope + precision * pull
    least = np.einsum("mi,mij,mj->m", target, inverse(normal), target)
    size = np.sqrt(np.einsum("mii->mi", normal))
    scaled = normal / (size[:, :, None] * size[:, None, :]) + RIDGE * np.eye(len(precision))
    determinant = np.linalg.slogdet(scaled)[1] + 2.0 * np.log(size).sum(axis=1)
    return -0.5 * (loss + determinant - least)


def with_prior(information: np.ndarray, precision: np.ndarray) -> np.ndarray:
    """Information with that of the priors."""
    return information + np.diag(np.where(precision > 0.0, precision, RIDGE))


def inverse(normal: np.ndarray) -> np.ndarray:
    """Covariances of informations in any units, shape (..., parameters, parameters)."""
    size = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    units = size[..., :, None] * size[..., None, :]
    return np.linalg.inv(normal / units + RIDGE * np.eye(normal.shape[-1])) / units


def probabilities(logs: np.ndarray) -> np.ndarray:
    """Probabilities from their logarithms; those below `LEAST` of the largest are zero."""
    weight = np.exp(logs - logs.max())
    weight = np.where(weight < LEAST, 0.0, weight)
    return weight / weight.sum()
