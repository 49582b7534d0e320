"""Shared parts of effects on springs and wires: one memory per spring, and the element's law."""

from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from ..pipeline import Known

AMBIENT = 22.0  # Assumed temperature where none was recorded [degC]
FARTHEST = 6.0
"""Maximum distance from the reversible curve's middle, in widths, at which a fraction implies a
temperature."""


def each(at: Known, make: Callable[[], Any]) -> dict[int, Any]:
    """A memory for every spring, by its number; a spring on a stand and a wire are number 1."""
    numbers = at["actuator"].spring_numbers if "actuator" in at else (1,)
    return {number: make() for number in numbers}


def zeros(count: int) -> Callable[[], tuple]:
    """Function that makes this number of zeros."""
    return lambda: tuple(jnp.asarray(0.0) for _ in range(count))


def solved_springs(at: Known, memory: dict[int, Any]) -> list[tuple[int, Any, Any, Any]]:
    """Number, element, memory and response of every spring in a solved row."""
    solved = at["solved"]
    if "actuator" in at:
        elements, responses = at["actuator"].springs, solved.springs
    else:
        elements, responses = (at["spring"] if "spring" in at else at["wire"],), (solved,)
    return [
        (number, element, state, response)
        for (number, state), element, response in zip(memory.items(), elements, responses, strict=True)
    ]


def law_of(at: Known) -> Any:
    """Constants of the element: a spring's alloy, or the wire itself."""
    return at["spring"].alloy if "spring" in at else at["wire"]


def law_stress(at: Known, gamma: Array) -> Array:
    """Stress of the base law at another strain than the row's, with everything else unchanged [Pa]."""
    law = law_of(at)
    stress = law.shear_stress if "spring" in at else law.axial_stress
    return stress(gamma, at["xi0"], at["gamma_R"])


def temperature_of(law: Any, xi0: Array) -> Array:
    """Temperature at which the reversible curve has a fraction [degC], clipped at `FARTHEST` widths."""
    least = jnp.exp(-FARTHEST)
    x = jnp.clip(xi0, least, 1.0 - least)
    return law.T_mid + law.T_width * jnp.log((1.0 - x) / x)


def arrived(interval: Array, tau: Array) -> Array:
    """Share of a step that a first-order lag has followed after an interval; all of it without a lag."""
    lagged = tau > 0.0
    return jnp.where(lagged, -jnp.expm1(-interval / jnp.where(lagged, tau, 1.0)), 1.0)


def branch(position: Array, last: tuple[Array, Array, Array], width: Array) -> Array:
    """Position of a play operator: 0 after a rise of the input by `width`, 1 after a fall by as much.

    Args:
        position: present input.
        last: flag of a previous row, its input, and the operator's position in it.
        width: change of the input from one end to the other.
    """
    started, before, state = last
    return jnp.clip(state - started * (position - before) / width, 0.0, 1.0)
