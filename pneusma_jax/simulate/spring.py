"""A spring on a test stand, its memory carried along a history of elongation by one scan."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from ..nitinol import Decided, Spring, SpringResponse, SpringState
from ..nitinol.spring import Activation, check_fractions
from ..numerics.safe import begun_as
from ..pipeline import Effect, Known, Pipeline, as_recorded
from ..program_cache import stored_jit
from .load_train import strain_in_train


class SpringHistory(eqx.Module):
    """A simulated test of one spring on a stand.

    Attributes:
        rows: response of the spring in every row.
        states: memory of the spring after every row.
        kept: mask of the rows whose martensite fraction the memory keeps from then on, shape (rows,). They
            are as hot as any before, or renew the memory.
        seen: instrument readings `force` [N] and `resistance` [ohm], shape (rows,).
    """

    rows: SpringResponse
    states: SpringState
    kept: Bool[Array, "rows"]
    seen: dict[str, Array]


def simulate_spring(
    spring: Spring,
    elongation: Float[Array, "rows"],
    activation: Activation,
    state: SpringState | None = None,
    *,
    time: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
    temperature: Float[Array, "rows"] | None = None,
    decided_by: Float[Array, "rows"] | None = None,
    margin: Array | float = 0.0,
) -> SpringHistory:
    """One spring on a test stand, stretched along a history of elongation.

    Args:
        spring: spring with `attached_length` equal to its free length, as on a stand.
        elongation: elongation from the attached length [m], shape (rows,).
        activation: activation with arrays of shape (rows,) or (): `MartensiteFraction` for an isothermal
            test, `Resistance` for an isoresistive one, `Temperature` for one that temperature drives.
        state: memory before the first row; fresh and never stretched where None.
        time: time [s], shape (rows,), for effects that depend on rate or duration.
        effects: effects beyond the base model; their memories start at rest.
        temperature: temperature of the spring [degC], shape (rows,), for effects that depend on it.
        decided_by: martensite fractions that decide which rows the memory keeps, shape (rows,); those of the
            activation where None. Noise of a single row then renews no memory.
        margin: excess over the residual strain that a row of `decided_by` needs to renew the memory, as part
            of it [1]. Where a renewal is all but one by the rule, either margin can be the right one.

    Raises:
        ValueError: if a known fraction is not between 0 and 1, or a known resistance is not positive.
    """
    check_fractions((1,), (activation,))
    return _simulate(
        spring, elongation, activation, state, time, effects, temperature, decided_by, margin
    )


@stored_jit(SpringHistory, SpringResponse, SpringState)
def _simulate(
    spring: Spring,
    elongation: Array,
    activation: Activation,
    state: SpringState | None,
    time: Array | None,
    effects: tuple[Effect, ...],
    temperature: Array | None,
    decided_by: Array | None,
    margin: Array | float,
) -> SpringHistory:
    """`simulate_spring`; one compiled program for each kind of arguments."""
    rows = jnp.shape(elongation)[0]
    state = SpringState.fresh(0.0) if state is None else state
    state = jax.tree.map(lambda x: jnp.asarray(x, dtype=float), state)
    spread = jax.tree.map(lambda x: jnp.broadcast_to(x, (rows, *x.shape[1:])), activation)
    clock = jnp.zeros(rows) if time is None else jnp.asarray(time, dtype=float)
    elongation = jnp.asarray(elongation, dtype=float)
    recorded = {} if temperature is None else {"temperature": jnp.broadcast_to(temperature, (rows,))}
    span = jnp.max(jnp.abs(elongation))

    def step(carry: tuple, row: tuple) -> tuple:
        """One row. A second memory follows `decided_by` and makes the decisions of both; None without it."""
        state, memories, deciding = carry
        elongation, activation, time, interval, recorded, fraction = row
        decided = None if fraction is None else Decided(fraction <= deciding.xi_min, jnp.asarray(False))
        state = SpringState(state.prestrain, state.xi_min, decided)
        known = Known(dict(time=time, interval=interval, number=1, span=span) | recorded)
        pipeline = Pipeline(effects, memories, known)
        elongation = _of_the_spring(elongation, spring, activation, state, pipeline)
        response = spring.respond(elongation, activation, state, pipeline)
        if decided is not None:  # the strain of the row is known now, and decides about a renewal
            decided = Decided(decided.hotter, spring.alloy.renews(deciding, response.gamma, fraction, margin))
            deciding, state = (SpringState(s.prestrain, s.xi_min, decided) for s in (deciding, state))
            deciding = spring.alloy.remember(deciding, response.gamma, fraction)
        after = spring.remember(state, response)
        kept = after.xi_min == response.xi0 if decided is None else decided.hotter | decided.renews
        true = dict(force=response.force, resistance=response.resistance)
        more = dict(spring=spring, solved=response, elongation=elongation)
        seen = pipeline.apply("outputs", true, **more)
        later = pipeline.remembered(**more, seen=true) if effects else ()
        return (after, later, deciding), (response, after, kept, seen)

    begun = jax.tree.map(lambda x: x[0], recorded)
    at_rest = Pipeline.begin(effects, spring=spring, number=1, states=(state,), **begun)
    history = (elongation, spread, clock, jnp.diff(clock, prepend=clock[:1]), recorded, decided_by)
    deciding = None if decided_by is None else state
    first = begun_as((state, at_rest.memories, deciding), (spring, effects, history))
    _, (responses, memories, kept, seen) = jax.lax.scan(step, first, history)  # type: ignore[var-annotated]
    return SpringHistory(responses, memories, kept, as_recorded(effects, seen, clock))


def _of_the_spring(
    recorded: Array, spring: Spring, activation: Activation, state: SpringState, pipeline: Pipeline
) -> Array:
    """Elongation of the spring alone [m] from the recorded one, which includes that of a compliant train."""
    if not pipeline.acts_at("compliance"):
        return recorded
    train = pipeline.apply("compliance", jnp.zeros(2))

    def pull(given: tuple, elongation: Array) -> Array:
        spring, activation, state, pipeline = given
        return spring.pull(elongation, activation, state, pipeline)

    given = spring, activation, state, pipeline
    in_train = lambda elongation: strain_in_train(pull, given, elongation, *train)  # noqa: E731
    return pipeline.where_acting("compliance", in_train, lambda elongation: elongation, recorded)
