"""Compiled programs are dropped where they take more memory than a process may have, and only there."""

import jax
import jax.numpy as jnp
import pytest

from fitting.engine.memory import make_room, resident_gib


@pytest.mark.parametrize("full", [False, True])
def test_programs_are_dropped_where_memory_is_full(full, monkeypatch):
    if not resident_gib():
        pytest.skip("the system does not tell the memory of a process")
    traced = []

    @jax.jit
    def twice(x: jax.Array) -> jax.Array:
        traced.append(x)
        return 2.0 * x

    monkeypatch.setattr(jax, "clear_caches", twice.clear_cache)  # or the programs of all other tests would go, too
    twice(jnp.ones(3))
    make_room(0.0 if full else 1e3)
    assert float(twice(jnp.ones(3))[0]) == 2.0
    assert len(traced) == (2 if full else 1)
