"""An ordered set of parameters, and its vector for a fit."""

import copy
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from pneusma_jax.errors import InputError, nearest
from pneusma_jax.numerics.safe import as_array

from .parameter import Parameter
from .table import render
from .ties import evaluate, evaluation_order
from .transforms import to_bounded, to_unconstrained


@dataclass(frozen=True)
class Layout:
    """Conversion of a flat vector of free parameters to all values.

    It is the part of `Parameters` that no fit changes. It is hashable, so that a compiled function may depend
    on it.

    Attributes:
        names: names of all parameters.
        free: names of those in the vector, in its order.
        logarithmic: true for each free one whose logarithm is in the vector.
        ties: pairs (name, expression) in evaluation order.
    """

    names: tuple[str, ...]
    free: tuple[str, ...]
    logarithmic: tuple[bool, ...]
    ties: tuple[tuple[str, str], ...]

    def values(self, vector: Float[Array, " n"], stored: Float[Array, " all"]) -> dict[str, Array]:
        """All values by name [SI].

        Args:
            vector: free parameters in fitting coordinates, shape (n,).
            stored: values of all parameters in the order of `names`, of which those of fixed ones are used.
        """
        tied = {name for name, _ in self.ties}
        values = {name: stored[i] for i, name in enumerate(self.names) if name not in tied}
        for i, name in enumerate(self.free):
            values[name] = jnp.exp(vector[i]) if self.logarithmic[i] else vector[i]
        values = evaluate(self.ties, values, jnp)
        return {name: jnp.asarray(values[name], vector.dtype) for name in self.names}


class Parameters(Mapping[str, Parameter]):
    """An ordered set of parameters, by name. Iterating and `len` are those of a dictionary."""

    def __init__(self, *parameters: Parameter):
        self._entries: dict[str, Parameter] = {}
        for parameter in parameters:
            self.add(parameter)

    def add(self, parameter: Parameter | str, value: float | None = None, **options: Any) -> Parameter:
        """Append a parameter, and return it.

        Args:
            parameter: the parameter, or its name.
            value: its value, beside a name.
            **options: further fields of `Parameter`, beside a name.

        Raises:
            InputError: if the name is taken, or the parameter cannot be made.
        """
        if not isinstance(parameter, Parameter):
            parameter = Parameter(parameter, value, **options)
        if parameter.name in self._entries:
            raise InputError(
                f"parameter {parameter.name!r} is defined twice; change the first, or choose another name"
            )
        self._entries[parameter.name] = parameter
        return parameter

    def update(self, other: "Parameters") -> None:
        """Merge another set: known names are replaced in place, new ones appended."""
        self._entries.update(copy.deepcopy(other._entries))

    def copy(self) -> "Parameters":
        """An independent copy."""
        return copy.deepcopy(self)

    def at(self, values: Mapping[str, float]) -> "Parameters":
        """A copy with other values, clipped to the bounds.

        Args:
            values: new values by name; the others stay.

        Raises:
            InputError: for a name that it does not have.
        """
        result = self.copy()
        for name, value in values.items():
            entry = result[name]
            entry.set(value=float(np.clip(value, entry.min, entry.max)))
        return result

    def __getitem__(self, name: str) -> Parameter:
        if name not in self._entries:
            raise InputError(f"there is no parameter {name!r}; {nearest(name, self._entries)}")
        parameter = self._entries[name]
        if parameter.tie is not None:  # its value is computed when it is read
            parameter.__dict__["value"] = self.valuesdict()[name]
        return parameter

    def get(self, name: str, default: Any = None) -> Any:
        """The parameter, or `default` if there is none of that name."""
        return self[name] if name in self else default

    def __contains__(self, name: object) -> bool:
        return name in self._entries

    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    def __len__(self) -> int:
        return len(self._entries)

    def valuesdict(self) -> dict[str, float]:
        """All values by name, ties computed (lmfit's name).

        Raises:
            InputError: if a tie names no parameter, runs in a circle or has no finite value.
        """
        untied = {name: p.value for name, p in self._entries.items() if p.tie is None}
        values = evaluate(self.layout().ties, untied)
        for name, number in values.items():
            if not np.ndim(number) == 0 or not math.isfinite(number):
                tie = self._entries[name].tie
                raise InputError(
                    f"parameter {name!r}: tie {tie!r} gives {number}, which is not a finite number"
                )
        return {name: float(values[name]) for name in self._entries}

    def layout(self) -> Layout:
        """The conversion of a vector to values, as these parameters are free, tied and scaled now."""
        ties = {name: p.tie for name, p in self._entries.items() if p.tie is not None}
        free = tuple(name for name, p in self._entries.items() if p.free)
        return Layout(
            names=tuple(self._entries),
            free=free,
            logarithmic=tuple(self._entries[name].scale == "log" for name in free),
            ties=tuple((name, ties[name]) for name in evaluation_order(ties, self._entries)),
        )

    def box(self) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
        """Lower and upper bounds of the free parameters in fitting coordinates, infinite for none.

        The fitting coordinate of a parameter is its value, or the logarithm if its scale is `log`.
        """
        free = [p for p in self._entries.values() if p.free]
        lower = [
            p.min if p.scale == "linear" else (math.log(p.min) if p.min > 0 else -math.inf) for p in free
        ]
        upper = [p.max if p.scale == "linear" else math.log(p.max) for p in free]
        return np.asarray(lower, float), np.asarray(upper, float)

    def pack(self, unconstrained: bool = False) -> Float[Array, " n"]:
        """Values of the free parameters as a vector.

        Args:
            unconstrained: false for fitting coordinates, which lie in `box()`; true for coordinates in which
                every real vector is within the bounds (see `fitting.inference.parameters.transforms`).
        """
        free = [p for p in self._entries.values() if p.free]
        vector = as_array(np.array([math.log(p.value) if p.scale == "log" else p.value for p in free], float))
        return to_unconstrained(vector, *self.box(), self._softness()) if unconstrained else vector

    def unpack(self, vector: Float[Array, " n"], unconstrained: bool = False) -> dict[str, Array]:
        """All values by name, from a vector in the coordinates of `pack`; may be traced and differentiated.
        """
        if unconstrained:
            vector = to_bounded(vector, *self.box(), self._softness())
        return self.layout().values(vector, self.stored())

    def stored(self) -> Float[np.ndarray, " all"]:
        """Present values of all parameters in order; zero for tied ones, which are computed."""
        return np.asarray([0.0 if p.tie is not None else p.value for p in self._entries.values()], float)

    def _softness(self) -> Array:
        """Scale of the softplus map of each free parameter, see `to_unconstrained`; shape (n,).

        It is the distance from the bound, so that the map begins nearly as the identity. It is 1 where there
        is no such distance: without a bound, on it, and for a logarithm. Between two bounds it is not used.
        """
        lower, upper = (np.asarray(side) for side in self.box())
        point = np.asarray(self.pack())
        edge = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, point))
        logarithmic = np.asarray(self.layout().logarithmic, bool)
        return jnp.asarray(np.where((point == edge) | logarithmic, 1.0, np.abs(point - edge)))

    def table(self, correlations_above: float = 0.1) -> str:
        """Text table like lmfit's `fit_report`, with pairs that are correlated by at least this much [1]."""
        return render(self.values(), correlations_above)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"Parameters({', '.join(self._entries)})"
