"""Free parameters as independent boxes: every number between 0 and 1 is a design.

A bound may depend on another parameter, as the wall of a tube on its diameter. The box is mapped to the
parameters in an order in which each bound is known when it is needed.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Array

from pneusma_jax.errors import InputError

from .study import Bound, Free


class Space:
    """The box of a study's free parameters.

    Args:
        free: parameters.

    Raises:
        InputError: if bounds depend on each other in a circle.
    """

    def __init__(self, free: Sequence[Free]):
        self.free = tuple(free)
        self.names = tuple(one.name for one in free)
        self.order = _ordered(self.free)

    def __len__(self) -> int:
        """Number of parameters."""
        return len(self.free)

    def parameters(self, place: Array) -> dict[str, Array]:
        """Values of all parameters [SI] at a place in the box [1], shape (parameters,); differentiable."""
        found: dict[str, Array] = {}
        for k in self.order:
            one = self.free[k]
            low, high = (_end(bound, found) for bound in (one.low, one.high))
            found[one.name] = low + place[k] * (high - low)
        return {name: found[name] for name in self.names}

    def place(self, values: dict[str, float]) -> np.ndarray:
        """Place in the box [1] of parameter values [SI]; the inverse of `parameters`, not held to the box."""
        place = np.zeros(len(self))
        for k, one in enumerate(self.free):
            low, high = (float(_end(bound, values)) for bound in (one.low, one.high))
            place[k] = (values[one.name] - low) / (high - low) if high > low else 0.5
        return place

    def slopes(self, place: np.ndarray) -> np.ndarray:
        """Derivatives of all parameters [SI] by the place, shape (parameters, parameters).

        A parameter whose bound depends on another one moves with that one's place, too.
        """
        found = {name: float(value) for name, value in self.parameters(place).items()}
        index, slopes = {name: k for k, name in enumerate(self.names)}, np.zeros((len(self), len(self)))
        for k in self.order:
            one = self.free[k]
            low, high = (float(_end(bound, found)) for bound in (one.low, one.high))
            for bound, share in ((one.low, 1.0 - place[k]), (one.high, place[k])):
                if bound.parameter is not None:
                    slopes[k] += share * bound.times * slopes[index[bound.parameter]]
            slopes[k, k] += high - low
        return slopes


def _end(bound: Bound, found: dict[str, Array]) -> Array:
    if bound.parameter is None:
        return bound.value
    return bound.times * found[bound.parameter] + bound.value


def _ordered(free: tuple[Free, ...]) -> tuple[int, ...]:
    """Indices of the parameters, each after those that its bounds need."""
    needs = {f.name: {b.parameter for b in (f.low, f.high) if b.parameter is not None} for f in free}
    index = {f.name: k for k, f in enumerate(free)}
    done: list[int] = []
    while len(done) < len(free):
        ready = [
            k for k, f in enumerate(free) if k not in done and all(index[n] in done for n in needs[f.name])
        ]
        if not ready:
            circle = [f.name for k, f in enumerate(free) if k not in done]
            raise InputError(f"the bounds of {', '.join(circle)} depend on each other in a circle")
        done += ready
    return tuple(done)
