"""Traced programs that are kept on disk: the same answers, found again, and none that is out of date."""

from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.inference.program_cache import FOLDER, _known, cached_program
from fitting.specimens.actuator_history import COMPILER_OPTIONS


@pytest.fixture
def cache(tmp_path):
    """A compilation cache of its own."""
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path / FOLDER
    jax.config.update("jax_compilation_cache_dir", before)


def _counted(traces: list[int]):
    def twice(x: dict, y: jax.Array) -> dict:
        traces.append(1)
        return {"sum": x["a"] + 2.0 * y, "pair": (y, x["a"])}

    return twice


def test_a_second_process_does_not_trace(cache: Path) -> None:
    traces: list[int] = []
    x, y = {"a": jnp.arange(3.0)}, jnp.ones(3)
    first = cached_program(_counted(traces), "twice")(x, y)
    again = cached_program(_counted(traces), "twice")(x, y)  # what another process would build
    assert len(traces) == 1
    np.testing.assert_array_equal(first["sum"], again["sum"])
    np.testing.assert_array_equal(again["pair"][1], np.arange(3.0))
    assert len(list(cache.glob("*.stablehlo"))) == 1


def test_other_names_and_shapes_are_other_programs(cache: Path) -> None:
    traces: list[int] = []
    for name, size in (("one", 3), ("two", 3), ("one", 4)):
        cached_program(_counted(traces), name)({"a": jnp.zeros(size)}, jnp.ones(size))
    assert len(traces) == 3


def test_a_damaged_file_is_replaced(cache: Path) -> None:
    traces: list[int] = []
    arguments = {"a": jnp.arange(2.0)}, jnp.ones(2)
    cached_program(_counted(traces), "twice")(*arguments)
    (file,) = cache.glob("*.stablehlo")
    file.write_bytes(b"half")
    found = cached_program(_counted(traces), "twice")(*arguments)
    np.testing.assert_array_equal(found["sum"], [2.0, 3.0])
    assert len(traces) == 2 and file.stat().st_size > 4


def test_without_a_cache_it_is_plain_jit(cache: Path) -> None:
    jax.config.update("jax_compilation_cache_dir", None)
    traces: list[int] = []
    cached_program(_counted(traces), "twice")({"a": jnp.arange(2.0)}, jnp.ones(2))
    assert not cache.exists()


def test_options_that_the_compiler_does_not_know_are_left_out(cache: Path) -> None:
    options = {"xla_cpu_no_such_option": True}
    found = cached_program(_counted([]), "twice", options)({"a": jnp.arange(2.0)}, jnp.ones(2))
    np.testing.assert_array_equal(found["sum"], [2.0, 3.0])


def test_an_actuators_options_are_those_of_this_compiler() -> None:
    assert _known(tuple(COMPILER_OPTIONS.items())) == COMPILER_OPTIONS
