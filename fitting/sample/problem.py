"""The problem of sampling a campaign: the density, and the measured curves that its draws predict."""

from collections.abc import Callable
from dataclasses import dataclass

import jax
import numpy as np
from jaxtyping import Array, Float, PyTree

from fitting.calibrate.result import Characterisation
from fitting.inference.parameters import Parameters
from pneusma_jax.units import from_si, is_difference

from .target import Target


@dataclass(frozen=True)
class Curve:
    """One measured output of one recording, in the units of files.

    Attributes:
        recording: name of the recording.
        role: `fit` or `validation`.
        x_column, y_column: canonical columns, `strain` and `stress_kPa`.
        x, measured: values, shape (rows,); NaN where missing.
        sigma: standard deviation of a measured value around the model's, shape (rows,): noise, and further
            variation.
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
    """A density to sample and its predictions.

    Attributes:
        title: title of the campaign.
        kind: kind of its recordings.
        real: true if measured, false if simulated, None if unstated.
        target: density; SI inside.
        parameters: parameters of the target, `unit` being the one of files.
        predict: function `predict(values, data)` to the curves' values one after the other, in their units;
            may be mapped.
        data: data for `predict`.
        curves: measured curves in the order of `predict`.
        notes: sentences about noise and priors.
        notices: further sentences for the reader.
        fit: characterisation whose noise the density takes; None without one.
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
    fit: Characterisation | None = None

    def unit(self, name: str) -> str:
        """Unit of a parameter in files."""
        return self.parameters[name].unit

    def shown(self, name: str, value: Float[np.ndarray, "..."] | float, spread: bool = False) -> np.ndarray:
        """Values of a parameter in the unit of files, or a standard deviation with `spread`."""
        unit = self.unit(name)
        return np.asarray(from_si(value, unit, difference=spread or is_difference(unit)))

    def predictions(self, coordinates: Float[np.ndarray, "draws n"]) -> list[Float[np.ndarray, "draws rows"]]:
        """Predicted curves of many draws, one array for each curve."""
        program = jax.jit(
            jax.vmap(lambda point, data: self.predict(self.target.values(point), data), (0, None))
        )
        flat = np.asarray(program(coordinates, self.data))
        edges = np.cumsum([len(curve.x) for curve in self.curves])[:-1]
        return np.split(flat, edges, axis=1)
