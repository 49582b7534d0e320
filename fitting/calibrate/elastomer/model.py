"""Prediction of every sample by a law: stress of its specimen, by the zeros of its recording."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.parameters import Prior
from fitting.specimens.zeros import strain_from_taut

from .laws import CurveLaw
from .samples import Samples

FACTOR = "stiffness_"
"""Stem of the parameters that multiply the stress of each specimen."""


@dataclass(frozen=True)
class Zero:
    """A zero of one recording that a fit finds.

    Attributes:
        quantity: `strain` or `stress`.
        curve: number of the recording among the samples' curves.
        prior: prior of the zero, SI.
        begin: value that a fit starts from, SI.
    """

    quantity: str
    curve: int
    prior: Prior
    begin: float

    @property
    def name(self) -> str:
        """Name of the parameter."""
        return f"{self.quantity}_zero_{self.curve + 1}"

    @property
    def unit(self) -> str:
        """Unit in which it is shown."""
        return "1" if self.quantity == "strain" else "kPa"


def zeros_of_samples(samples: Samples) -> list[Zero]:
    """Zeros that recordings leave to the fit, those of strain first."""
    return [
        Zero(quantity, k, curve.zeros.prior(quantity), curve.zeros.begin(quantity))
        for quantity in ("strain", "stress")
        for k, curve in enumerate(samples.curves)
        if quantity in curve.zeros.sd
    ]


def arrays(samples: Samples, specimens: Sequence[str], zeros: Sequence[Zero]) -> dict[str, np.ndarray]:
    """Data of every sample for `stress_of`, each of shape (n,).

    Args:
        samples: all of them.
        specimens: names of specimens with a factor of their own; the factor of others is one.
        zeros: zeros of recordings.
    """
    count = range(len(samples.curves))
    index = {name: k + 1 for k, name in enumerate(specimens)}
    of_curve = {
        "specimen": [index.get(curve.specimen, 0) for curve in samples.curves],
    }
    for quantity in ("strain", "stress"):
        own = [zero.curve for zero in zeros if zero.quantity == quantity]
        of_curve[f"{quantity}_zero"] = [own.index(k) + 1 if k in own else 0 for k in count]
    places = {name: np.array(values)[samples.owner] for name, values in of_curve.items()}
    return {"strain": samples.strain, "stress": samples.stress, "flat": samples.flat, **places}


def stress_of(
    law: CurveLaw, specimens: int, zeros: Sequence[str]
) -> Callable[[Mapping[str, Array], Mapping[str, Array]], Float[Array, " n"]]:
    """Function of parameters and `arrays` that gives the stress of every sample as it is read [Pa].

    Args:
        law: the law of the stress.
        specimens: number of specimens with a factor of their own.
        zeros: names of the parameters, those of strain first.
    """

    def stress(values: Mapping[str, Array], data: Mapping[str, Array]) -> Array:
        constants = jnp.stack([values[name] for name in law.names])
        factors = jnp.stack([jnp.ones(()), *(values[f"{FACTOR}{k + 1}"] for k in range(specimens))])
        slack, offset = (
            jnp.stack([jnp.zeros(()), *(values[name] for name in zeros if name.startswith(quantity))])
            for quantity in ("strain", "stress")
        )
        strain = strain_from_taut(data["strain"], slack[data["strain_zero"]], data["flat"])
        return factors[data["specimen"]] * law.stress(strain, constants) + offset[data["stress_zero"]]

    return stress
