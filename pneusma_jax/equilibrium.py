"""Configurations in which force and moment balance, one row or many: Section 3.5.

The balance is in `balance`, the root-find in `root_find`, what a solved row is in `result`.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .actuator import Actuator
from .balance import Problem, configuration, imbalance, residual, spring_responses, start
from .nitinol import SpringState
from .nitinol.spring import Activation, MartensiteFraction
from .precision import require_float64
from .result import Equilibrium, Status, equilibrium_of, raise_unless_converged
from .root_find import BALANCED, find_root

__all__ = [
    "BALANCED", "Equilibrium", "Problem", "Status", "configuration", "imbalance", "residual", "solve",
    "solve_batch", "spring_responses", "start",
]  # fmt: skip


def solve(
    actuator: Actuator,
    pressure: Array,
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
    *,
    guess: Array | None = None,
    throw: bool = True,
) -> Equilibrium:
    """Configuration in which force and moment balance.

    Newton's method first; what it leaves unsolved is tried again from rest with pressure, heat and loads
    brought on in steps, or, where a resistance was measured, with the phase as an unknown of its own.
    Derivatives come from the implicit function theorem, not from the iterations.

    Args:
        actuator: what is loaded.
        pressure: gauge [Pa], scalar (use `jax.vmap` or `solve_batch` for many).
        activations: one per spring, in the order of `actuator.spring_numbers`; cold where empty.
        states: what each spring remembers; fresh with the source's pre-strain 0.1924 where None.
        guess: scaled unknowns to start from, such as a neighbouring solution's.
        throw: raise where there is no solution; otherwise return NaN with a `status`.

    Raises:
        RuntimeError: if float64 is off, or, with `throw`, the sentence of the status.
        ValueError: if the number of activations or states is not the number of springs.
    """
    require_float64()
    count = len(actuator.springs)
    activations = tuple(activations) or tuple(MartensiteFraction(1.0) for _ in range(count))
    states = states if states is not None else tuple(SpringState.fresh(0.1924) for _ in range(count))
    for what, given in (("activations", activations), ("states", states)):
        if len(given) != count:
            raise ValueError(
                f"Argument `{what}` must have one entry per spring, {count} here, but it has {len(given)}."
            )
    problem = Problem(actuator, jnp.asarray(pressure, dtype=float), activations, tuple(states))
    result = _solve(problem, guess)
    return raise_unless_converged(result) if throw else result


@eqx.filter_jit
def _solve(problem: Problem, guess: Array | None) -> Equilibrium:
    """`solve` after its arguments are checked: one compiled program per design."""
    guess = start(problem.actuator) if guess is None else guess
    unknowns, steps = find_root(problem, guess)
    return equilibrium_of(problem, unknowns, steps)


@eqx.filter_jit
def solve_batch(
    actuator: Actuator,
    pressure: Float[Array, "rows"],
    activations: tuple[Activation, ...] = (),
    states: tuple[SpringState, ...] | None = None,
) -> Equilibrium:
    """`solve` for many rows at once; a row without solution reports its `status` and stops no other.

    Args:
        actuator: the same for every row.
        pressure: gauge [Pa], shape (rows,).
        activations: one per spring, their arrays of shape (rows,).
        states: one per spring, their arrays of shape (rows,) or (); fresh where None.

    Returns:
        An `Equilibrium` whose arrays have a leading axis of rows.
    """
    rows = jnp.shape(pressure)[0]
    spread = lambda tree: jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *jnp.shape(x)[1:])), tree)  # noqa: E731
    return jax.vmap(lambda p, a, s: solve(actuator, p, a, s, throw=False))(
        jnp.asarray(pressure), spread(activations), None if states is None else spread(states)
    )
