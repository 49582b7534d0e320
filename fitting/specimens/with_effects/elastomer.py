"""Elastomer coupons with effects: strain in, engineering stress out."""

from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array

from fitting.specimens import elastomer, silicones
from fitting.specimens.rows import Rows, numbers
from pneusma_jax.pipeline import Effect
from pneusma_jax.simulate.coupon import simulate_coupon

OUTPUTS = ("stress",)
rows_for = elastomer.rows_for
parameters_for = elastomer.parameters_for


def predict(
    values: Mapping[str, Array], effects: tuple[Effect, ...], rows: Rows
) -> tuple[dict[str, Array], dict[str, Any]]:
    """See `specimens.with_effects.Kind`."""
    known = numbers(values, rows)
    law = silicones.law_with(rows.extra["law"], known)
    strain = elastomer.strain_of(known, rows)
    found = simulate_coupon(law, strain, time=rows.time, effects=effects)
    rate = jnp.gradient(strain) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
    seen = found.seen | {"stress": found.seen["stress"] + known["stress_zero"]}
    return seen, {"strain": strain, "strain_rate": rate, "max_strain": jnp.maximum.accumulate(strain)}
