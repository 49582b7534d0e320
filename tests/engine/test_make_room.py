"""Compiled programs are dropped where they take more memory than a process may have, and only there."""

import jax
import jax.numpy as jnp
import pytest

from fitting.engine.memory import make_room, resident_gib


@pytest.mark.parametrize("full", [False, True])
def test_programs_are_dropped_where_memory_is_full(full, monkeypatch):
    """Without doing so: the programs of all other tests in this process would go, too."""
    if not resident_gib():
        pytest.skip("the system does not tell the memory of a process")
    dropped = []
    monkeypatch.setattr(jax, "clear_caches", lambda: dropped.append(True))
    make_room(0.0 if full else 1e3)
    assert dropped == [True] * full


@pytest.mark.slow
@pytest.mark.parametrize("full", [False, True])
def test_programs_are_traced_again_where_memory_was_full(full):
    if not resident_gib():
        pytest.skip("the system does not tell the memory of a process")
    traced = []

    @jax.jit
    def twice(x: jax.Array) -> jax.Array:
        traced.append(x)
        return 2.0 * x

    twice(jnp.ones(3))
    make_room(0.0 if full else 1e3)
    assert float(twice(jnp.ones(3))[0]) == 2.0
    assert len(traced) == (2 if full else 1)
