"""An elastomer coupon along a history of strain, the memories of effects carried by one scan."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..numerics.safe import begun_as
from ..pipeline import Effect, Known, Pipeline, as_recorded
from ..program_cache import stored_jit
from ..silicone import SiliconeLaw
from .load_train import strain_in_train

# of a die-C dumbbell (ASTM D412), where a recording does not state its coupon's: 6 mm by 3 mm over 33 mm
AREA = 18e-6  # Cross-section [m2]
GAUGE_LENGTH = 33e-3  # Gauge length [m]


class CouponRow(eqx.Module):
    """State of the coupon itself in a row.

    Attributes:
        strain: engineering strain [1]; the recorded one for a rigid load train.
        stress: engineering stress [Pa].
    """

    strain: Array
    stress: Array


class CouponHistory(eqx.Module):
    """A simulated test of an elastomer coupon.

    Attributes:
        rows: states of the coupon in every row; arrays of shape (rows,).
        seen: instrument reading of `stress` [Pa], shape (rows,).
    """

    rows: CouponRow
    seen: dict[str, Array]


@stored_jit(CouponHistory, CouponRow)
def simulate_coupon(
    law: SiliconeLaw,
    strain: Float[Array, "rows"],
    *,
    time: Float[Array, "rows"] | None = None,
    cycle: Float[Array, "rows"] | None = None,
    effects: tuple[Effect, ...] = (),
    area: Array = AREA,
    gauge_length: Array = GAUGE_LENGTH,
) -> CouponHistory:
    """One coupon stretched along a history of engineering strain.

    Args:
        law: engineering stress [Pa] over engineering strain [1].
        strain: recorded strain [1], shape (rows,).
        time: time [s], shape (rows,), for effects that depend on rate or duration.
        cycle: number of the load cycle [1], shape (rows,).
        effects: effects beyond the base law; their memories start at rest.
        area, gauge_length: dimensions of the coupon [m2, m], for effects that are forces or lengths.
    """
    strain = jnp.asarray(strain, dtype=float)
    clock = jnp.zeros(strain.shape) if time is None else jnp.asarray(time, dtype=float)
    count = jnp.zeros(strain.shape) if cycle is None else jnp.asarray(cycle, dtype=float)

    def step(memories: tuple, row: tuple) -> tuple:
        strain, time, interval, cycle = row
        inputs = dict(time=time, interval=interval, cycle=cycle, silicone=law, area=area)
        inputs["recorded_strain"] = strain
        pipeline = Pipeline(effects, memories, Known(inputs))

        def stress_at(given: tuple, strain: Array) -> Array:
            law, pipeline = given
            fibre = jnp.atleast_1d(strain)
            base = law(fibre)
            return pipeline.wall_stress(base, fibre)[0]

        given = law, pipeline
        if pipeline.acts_at("compliance"):
            give, stiffening = pipeline.apply("compliance", jnp.zeros(2)) * area
            train = give / gauge_length, stiffening
            in_train = lambda strain: strain_in_train(stress_at, given, strain, *train)  # noqa: E731
            strain = pipeline.where_acting("compliance", in_train, lambda strain: strain, strain)
        found = CouponRow(strain, stress_at(given, strain))
        true = dict(stress=found.stress)
        seen = pipeline.apply("outputs", true, solved=found)
        later = pipeline.remembered(solved=found, seen=true, strain=strain) if effects else ()
        return later, (found, seen)

    memories = Pipeline.begin(effects, silicone=law).memories
    history = (strain, clock, jnp.diff(clock, prepend=clock[:1]), count)
    first = begun_as(memories, (law, effects, history))
    _, (rows, seen) = jax.lax.scan(step, first, history)  # type: ignore[var-annotated]
    return CouponHistory(rows, as_recorded(effects, seen, clock))
