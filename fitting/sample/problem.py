"""A campaign's question to the sampler: the density, and what its draws are to be compared with."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, Float, PyTree

from fitting.inference.parameters import Parameters
from pneusma_jax.units import from_si

from .target import Target

KELVIN = "K"


@dataclass(frozen=True)
class Curve:
    """One measured output of one recording, in the units of files.

    Attributes:
        recording: its name.
        role: `fit` or `validation`.
        x_column, y_column: canonical columns, `strain` and `stress_kPa`.
        x, measured: values, shape (rows,); NaN where missing.
        sigma: 1-sigma of a measured value around the model's, shape (rows,): noise, and what else varies.
    """

    recording: str
    role: str
    x_column: str
    y_column: str
    x: Float[np.ndarray, " rows"]
    measured: Float[np.ndarray, " rows"]
    sigma: Float[np.ndarray, " rows"]


@dataclass(frozen=True)
class Problem:
    """What is sampled and what it predicts.

    Attributes:
        title: of the campaign.
        kind: of its recordings.
        real: measured (True), simulated (False) or not said (None).
        target: the density; SI inside.
        parameters: those of the target, `unit` being the one of files.
        predict: `predict(values, data)` to the curves' values one after the other, in their units; may be
            mapped.
        data: for `predict`.
        curves: in the order of `predict`.
        notes: how noise and priors enter, in sentences.
        notices: what else a reader should know.
    """

    title: str
    kind: str
    real: bool | None
    target: Target
    parameters: Parameters
    predict: Callable[[dict[str, Array], PyTree], Array]
    data: PyTree
    curves: tuple[Curve, ...]
    notes: tuple[str, ...]
    notices: tuple[str, ...] = ()

    def unit(self, name: str) -> str:
        """Unit of a parameter in files."""
        return self.parameters[name].unit

    def shown(self, name: str, value: Float[np.ndarray, "..."] | float, spread: bool = False) -> np.ndarray:
        """Values of a parameter in the unit of files; of a standard deviation, with `spread`."""
        unit = self.unit(name)  # kelvin are widths and gaps, whose zero stays zero
        return np.asarray(from_si(value, unit, difference=spread or unit == KELVIN))

    def predictions(self, coordinates: Float[np.ndarray, "draws n"]) -> list[Float[np.ndarray, "draws rows"]]:
        """Predicted curves of many draws, one array for each curve."""
        program = jax.jit(
            jax.vmap(lambda point, data: self.predict(self.target.values(point), data), (0, None))
        )
        flat = np.asarray(program(coordinates, self.data))
        edges = np.cumsum([len(curve.x) for curve in self.curves])[:-1]
        return np.split(flat, edges, axis=1)
