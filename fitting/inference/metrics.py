"""Measures of misfit between a model and data: the source's, Eqs. 2.51-2.52, and the root mean square.

Equation 2.52 as printed sums signed differences, so that too high and too low cancel and a wrong model may
score zero. It is kept as `rpd_signed` for comparison with published numbers. `rpd` takes absolute differences
(correction 11 of the model's list). All are pure functions of arrays of one shape and return a scalar. They
are differentiable where the differences are not zero.
"""

from collections.abc import Iterable
from types import ModuleType

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from pneusma_jax.numerics.safe import is_concrete


def mean_absolute_error(data: Float[Array, "..."], model: Float[Array, "..."]) -> Float[Array, ""]:
    """MAE, Eq. 2.51: mean of |data - model|, in the unit of both.

    Args:
        data: measured values, of any shape.
        model: predictions, of the same shape.

    Raises:
        ValueError: if the shapes differ or there are no values.
    """
    xp, data, model = _checked(data, model)
    return xp.mean(xp.abs(data - model))


def root_mean_square_error(data: Float[Array, "..."], model: Float[Array, "..."]) -> Float[Array, ""]:
    """RMSE: root of the mean of (data - model)^2, in the unit of both; arguments as for
    `mean_absolute_error`."""
    xp, data, model = _checked(data, model)
    return xp.sqrt(xp.mean((data - model) ** 2))


def relative_percent_difference(data: Float[Array, "..."], model: Float[Array, "..."]) -> Float[Array, ""]:
    """RPD with absolute differences: sum |data - model| over sum (|data| + |model|)/2.

    A fraction between 0 and 2 (0.096 is 9.6 %); zero if data and model vanish everywhere. Arguments as for
    `mean_absolute_error`.
    """
    xp, data, model = _checked(data, model)
    return _over_magnitude(xp, xp.sum(xp.abs(data - model)), data, model)


def relative_percent_difference_signed(
    data: Float[Array, "..."], model: Float[Array, "..."]
) -> Float[Array, ""]:
    """RPD as printed, Eq. 2.52: sum (data - model) over sum (|data| + |model|)/2.

    A fraction between -2 and 2, positive where the model is low on the whole. Arguments as for
    `mean_absolute_error`.
    """
    xp, data, model = _checked(data, model)
    return _over_magnitude(xp, xp.sum(data - model), data, model)


def metrics(data: Float[Array, "..."], model: Float[Array, "..."]) -> dict[str, Float[Array, ""]]:
    """All four by their names in reports: `mae`, `rmse` in the data's unit, `rpd`, `rpd_signed` fractions."""
    return {
        "mae": mean_absolute_error(data, model),
        "rmse": root_mean_square_error(data, model),
        "rpd": relative_percent_difference(data, model),
        "rpd_signed": relative_percent_difference_signed(data, model),
    }


def metrics_over_all(
    pairs: Iterable[tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]],
) -> dict[str, float]:
    """`metrics` over the values of several recordings together.

    Args:
        pairs: measured values and predictions of each recording; at least one.
    """
    data, model = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return {name: float(value) for name, value in metrics(data, model).items()}


def _over_magnitude(xp: ModuleType, total: Array, data: Array, model: Array) -> Array:
    magnitude = xp.sum(0.5 * (xp.abs(data) + xp.abs(model)))
    # Without any magnitude there is no difference either.
    return xp.where(magnitude > 0, total / xp.where(magnitude > 0, magnitude, 1.0), 0.0)


def _checked(data: Array, model: Array) -> tuple[ModuleType, Array, Array]:
    """The namespace to compute in, NumPy for known numbers since it compiles nothing, and both as arrays."""
    xp = np if is_concrete(data, model) else jnp
    data, model = xp.asarray(data), xp.asarray(model)
    if data.shape != model.shape or data.size == 0:
        raise ValueError(
            f"Arguments `data` and `model` must have one shape and at least one value, "
            f"but have shapes {data.shape} and {model.shape}."
        )
    return xp, data, model
