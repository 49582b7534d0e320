"""Coordinates in which a law between two plateaus is told by its ends.

A law `mean + span / 2 s(slope x + offset)`, s a sigmoid from -1 to 1, has its plateaus outside the data.
Recordings tell its values where x was. The mean, the span and the sigmoid's three constants then trade
along a curved valley. Of one open alloy, the martensite's resistivity at rest is known to 0.0004 ohm/m, its
mean to 0.6.

Walkers therefore move the law at x = 0 in place of the mean. In place of the logarithm of the span they
move the logarithm of the law's change between two ends. Given the sigmoid both are linear. So this change
of coordinates keeps volumes, and the density needs no Jacobian.
"""

import json
from dataclasses import asdict, dataclass

import h5py
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.parameters import Layout
from fitting.specimens.specimen import SigmoidLaw
from pneusma_jax.nitinol.detwinning import signed_algebraic_sigmoid
from pneusma_jax.numerics.safe import namespace_of

STORED = "law_by_its_ends"
"""Attribute of a chain file with the change of coordinates in which its walkers move, as JSON."""
ENDS = (1.0, 0.7, 0.4)
"""Ends that are tried, as a part of the way between the law's two ends: tests need not reach the plateau."""


@dataclass(frozen=True)
class Plateaus:
    """Change of coordinates of one law.

    Attributes:
        mean, span: positions of the law's mean, and of the logarithm of its span.
        shape: positions of slope, offset and sharpness; -1 for one that is no coordinate.
        logarithmic: true for those that are coordinates by their logarithm.
        held: values of those that are no coordinates.
        end: the far end x; the near one is 0.
    """

    mean: int
    span: int
    shape: tuple[int, int, int]
    logarithmic: tuple[bool, bool, bool]
    held: tuple[float, float, float]
    end: float

    def straight(self, vector: Float[Array, "... n"]) -> Float[Array, "... n"]:
        """Coordinates with the law at its ends, from those with mean and span."""
        xp = namespace_of(vector)
        near, change = self._sigmoid(vector)
        log_span = vector[..., self.span]
        return self._with(vector, vector[..., self.mean] + near * xp.exp(log_span), log_span + xp.log(change))

    def plain(self, vector: Float[Array, "... n"]) -> Float[Array, "... n"]:
        """Coordinates with mean and span, from those with the law at its ends."""
        xp = namespace_of(vector)
        near, change = self._sigmoid(vector)
        log_span = vector[..., self.span] - xp.log(change)
        return self._with(vector, vector[..., self.mean] - near * xp.exp(log_span), log_span)

    def _sigmoid(self, vector: Array) -> tuple[Array, Array]:
        """Half the sigmoid at x = 0, and half the size of its change to the far end."""
        xp = namespace_of(vector)
        parts = zip(self.shape, self.logarithmic, self.held, strict=True)
        found = [
            held if at < 0 else xp.exp(vector[..., at]) if logarithmic else vector[..., at]
            for at, logarithmic, held in parts
        ]
        slope, offset, sharpness = (xp.asarray(part) for part in found)
        near = signed_algebraic_sigmoid(offset, sharpness)
        return 0.5 * near, 0.5 * xp.abs(signed_algebraic_sigmoid(self.end * slope + offset, sharpness) - near)

    def _with(self, vector: Array, mean: Array, log_span: Array) -> Array:
        """A point with other coordinates of mean and span."""
        xp, place = namespace_of(vector), np.arange(vector.shape[-1])
        other = xp.where(place == self.span, log_span[..., None], vector)
        return xp.where(place == self.mean, mean[..., None], other)


def plateaus_of(law: SigmoidLaw, layout: Layout, stored: Float[np.ndarray, " all"]) -> list[Plateaus]:
    """Changes of coordinates to choose from, one for each end.

    There are none unless mean and span are sampled, the span alone by its logarithm.

    Args:
        law: names of the law's constants.
        layout: coordinates, their names and which are logarithms.
        stored: values of all parameters in the order of the layout's names.
    """
    at = {name: k for k, name in enumerate(layout.free)}
    mean, span = at.get(law.mean, -1), at.get(law.span, -1)
    shape = law.slope, law.offset, law.sharpness
    told = {name for name, _ in layout.ties}
    if min(mean, span) < 0 or layout.logarithmic[mean] or not layout.logarithmic[span]:
        return []
    if not all(name in layout.names and name not in told for name in shape):
        return []
    positions = tuple(at.get(name, -1) for name in shape)
    logarithmic = tuple(k >= 0 and layout.logarithmic[k] for k in positions)
    held = tuple(float(stored[layout.names.index(name)]) for name in shape)
    return [Plateaus(mean, span, positions, logarithmic, held, end) for end in ENDS]


def store_plateaus(file: h5py.File, plateaus: Plateaus | None) -> None:
    """Write a change of coordinates into an open chain file; nothing for none."""
    if plateaus is not None:
        file.attrs[STORED] = json.dumps(asdict(plateaus))


def stored_plateaus(file: h5py.File) -> Plateaus | None:
    """The change of coordinates of an open chain file; None without."""
    if STORED not in file.attrs:
        return None
    parts = json.loads(file.attrs[STORED])
    return Plateaus(**{name: tuple(part) if isinstance(part, list) else part for name, part in parts.items()})
