"""The mixture of Gaussians over the sizes of all outputs' zeros, weighted by their probability."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .evidence import log_evidence, probabilities, with_prior
from .sizes import STEADY, Sizes, in_favour

MEMBERS = 4000
"""Maximum number of members of a mixture over several instruments. More are drawn from those of each. The end
of a 90 % interval is then known to 3 % beside drifts of up to ten times the noise's width, and to 4 % at
twenty."""


@dataclass(frozen=True)
class Members:
    """Members of the mixture over all outputs.

    Attributes:
        size: drift, offset and scale of each output, shape (members, outputs, 3).
        normal: information about the parameters, priors included, shape (members, parameters, parameters).
        slope: derivative of half the loss, priors included, at the fit, shape (members, parameters).
    """

    size: np.ndarray
    normal: np.ndarray
    slope: np.ndarray


def joint(
    each: Sequence[Sizes], precision: np.ndarray, pull: np.ndarray, rest: np.ndarray
) -> tuple[Members, np.ndarray]:
    """Members of the mixture over all outputs, and their probability given all recordings.

    Args:
        each: probable sizes of each output, or group of outputs.
        precision, pull: as of `lasting`.
        rest: squares of rows that tell nothing of zeros, shape (parameters + 1, parameters + 1).
    """
    places = [np.flatnonzero(one.weight) for one in each]
    if math.prod(map(len, places)) <= MEMBERS:
        chosen = np.stack([x.ravel() for x in np.meshgrid(*places, indexing="ij")], axis=1)
        ahead = np.zeros(len(chosen))
    else:
        random = np.random.default_rng(0)
        chosen = np.stack([random.choice(len(one.weight), MEMBERS, p=one.weight) for one in each], axis=1)
        ahead = sum(np.log(one.weight[k]) for one, k in zip(each, chosen.T, strict=True))
    pairs = list(zip(each, chosen.T, strict=True))
    information, slope, loss, before = (
        sum(getattr(one, name)[k] for one, k in pairs) for name in ("information", "slope", "loss", "before")
    )
    information, slope = information + rest[:-1, :-1], slope + rest[:-1, -1]
    weight = probabilities(before - ahead + log_evidence(information, slope, loss, precision, pull))
    size = np.concatenate([one.size[k] for one, k in pairs], axis=1)
    kept = weight > 0.0
    normal = with_prior(information[kept], precision)
    return Members(size[kept], normal, slope[kept] + precision * pull), weight[kept]


def steady_of(
    each: Sequence[Sizes], precision: np.ndarray, pull: np.ndarray, rest: np.ndarray
) -> tuple[float, np.ndarray]:
    """Probability that no zero is off or drifts, and that of each output; beforehand each is one half.

    If every output had its own chance, a clean campaign of many outputs would have some zero beforehand.

    Returns:
        The probability of all outputs together, and those of single ones, shape (outputs,).
    """
    members, weight = joint(each, precision, pull, rest)
    still = np.all(members.size[:, :, :2] == 0.0, axis=2)
    none = 1.0 / (1.0 + in_favour(float(weight @ still.all(axis=1)), STEADY ** (2 * still.shape[1])))
    alone = [1.0 / (1.0 + in_favour(float(weight @ one), STEADY**2)) for one in still.T]
    return none, np.array(alone)
