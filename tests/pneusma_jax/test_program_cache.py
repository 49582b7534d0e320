"""Traced programs that are kept on disk: the same answers, found again, and none that is out of date."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.specimens.specimen import OF_HISTORIES
from pneusma_jax.program_cache import (
    COMPILING,
    FOLDER,
    LOADING,
    TRACING,
    _known,
    cached_program,
    made_ready,
    of_package,
    stored_jit,
)

LEVEL = ("xla_backend_optimization_level", 1)


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


def test_listeners_are_told_what_a_first_use_does(cache: Path) -> None:
    arguments, said = ({"a": jnp.arange(3.0)}, jnp.ones(3)), []
    with made_ready(lambda number, name, step: said.append((name, step))):
        for _ in range(2):
            program = cached_program(_counted([]), "twice")
            program(*arguments)
            program(*arguments)  # which is ready
    cached_program(_counted([]), "other")(*arguments)  # nobody listens
    assert said == [("twice", TRACING), ("twice", COMPILING), ("twice", LOADING)]


def test_a_program_that_this_process_has_is_taken_by_others(cache: Path, compiled: list[str]) -> None:
    """A diagnosis of the same shapes makes another function, but the same program."""
    arguments, said = ({"a": jnp.arange(3.0)}, jnp.ones(3)), []
    first = cached_program(_counted([]), "twice")
    found, _ = first(*arguments), compiled.clear()
    with made_ready(lambda number, name, step: said.append(step)):
        again = cached_program(_counted([]), "twice")(*arguments)
    np.testing.assert_array_equal(again["sum"], found["sum"])
    assert said == [] and compiled == []
    other = cached_program(_counted([]), "twice", dict([LEVEL]))  # is compiled in another way
    other(*arguments)
    assert compiled != []


def test_a_number_of_weak_type_takes_the_same_program(cache: Path, compiled: list[str]) -> None:
    traces: list[int] = []
    program, x = cached_program(_counted(traces), "twice"), {"a": jnp.arange(3.0)}
    program(x, jnp.ones(()))
    weak = jax.jit(lambda: 2.0)()
    compiled.clear()
    assert weak.weak_type
    for number in (weak, 2.0, np.float64(2.0)):
        np.testing.assert_array_equal(program(x, number)["sum"], np.arange(3.0) + 4.0)
    assert len(traces) == 1 and not compiled and len(list(cache.glob("*.stablehlo"))) == 1


def test_a_program_of_single_precision_is_another(cache: Path) -> None:
    """Arrays that it makes inside have another type, whatever those of its arguments are."""
    made, argument = (lambda a: {"made": jnp.zeros(2), "a": a}), np.ones(2, np.float32)
    assert cached_program(made, "made")(argument)["made"].dtype == np.float64
    with jax.enable_x64(False):
        assert cached_program(made, "made")(argument)["made"].dtype == np.float32


def test_a_program_that_is_not_stored_is_told_as_compiled(cache: Path) -> None:
    said = []
    with made_ready(lambda number, name, step: said.append(step)):
        cached_program(_counted([]), "own", keep=False)({"a": jnp.arange(3.0)}, jnp.ones(3))
    assert said == [COMPILING]


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


def test_an_unknown_option_leaves_the_others() -> None:
    assert _known((("xla_cpu_no_such_option", True), LEVEL)) == dict([LEVEL])


def test_an_actuator_is_compiled_at_its_lower_level_by_every_version() -> None:
    assert set([LEVEL]) <= set(_known(tuple(OF_HISTORIES.items())).items())


class Pair(eqx.Module):
    left: jax.Array
    right: tuple
    side: tuple = eqx.field(static=True)


def _stored(traces: list[int], *returns: type, side: tuple = (1.0, ("up",))):
    @stored_jit(*returns)
    def pair(x: jax.Array, factor: float, names: tuple[str, ...] = ()) -> dict:
        traces.append(1)
        return {"found": Pair(factor * x, (None, x), side), "count": jnp.asarray(len(names))}

    return pair


def test_a_stored_program_returns_modules_and_traces_once(cache: Path) -> None:
    traces: list[int] = []
    for _ in range(2):  # what two processes would build
        found = _stored(traces, Pair)(np.arange(3.0), 2.0, names=("a", "b"))
        assert isinstance(found["found"], Pair) and found["found"].side == (1.0, ("up",))
        assert found["found"].right[0] is None and int(found["count"]) == 2
        np.testing.assert_array_equal(found["found"].left, [0.0, 2.0, 4.0])
    assert len(traces) == 1


def test_what_is_no_array_is_a_part_of_the_name(cache: Path) -> None:
    traces: list[int] = []
    pair = _stored(traces, Pair)
    for factor in (2.0, 3.0, 2, True):
        np.testing.assert_array_equal(pair(jnp.ones(1), factor)["found"].left, [float(factor)])
    assert len(traces) == 4


def test_a_stored_program_inside_a_transformation_is_plain(cache: Path) -> None:
    pair = _stored([], Pair)
    assert jax.grad(lambda x: jnp.sum(pair(x, 3.0)["found"].left))(jnp.ones(1))[0] == 3.0
    assert not cache.exists()


@pytest.mark.parametrize("returns, side", [((), (1.0,)), ((Pair,), (jnp.sin,)), ((Pair,), ([1.0],))])
def test_a_stored_program_refuses_to_return_what_it_cannot_tell(cache: Path, returns: tuple, side: tuple) -> None:
    with pytest.raises(TypeError):
        _stored([], *returns, side=side)(jnp.ones(1), 2.0)


def test_a_program_with_a_check_inside_is_not_stored_but_runs(cache: Path) -> None:
    checked = stored_jit()(lambda x: eqx.error_if(2.0 * x, jnp.any(x < 0.0), "negative"))
    for _ in range(2):
        np.testing.assert_array_equal(checked(jnp.ones(2)), [2.0, 2.0])


def test_an_array_that_the_name_does_not_tell_in_full_is_not_stored(cache: Path) -> None:
    cached_program(_counted([]), f"with {np.arange(5000)}")({"a": jnp.zeros(1)}, jnp.ones(1))
    assert not cache.exists()


class Doubling(eqx.Module):
    """A law of a user's own."""

    factor: jax.Array

    def __call__(self, x: jax.Array) -> jax.Array:
        return 2.0 * self.factor * x


@dataclass(frozen=True)
class Named:
    """A function of a user's own with a lasting name."""

    name: str

    def __call__(self, x: jax.Array) -> jax.Array:
        return 2.0 * x


@pytest.mark.parametrize("law", [Doubling(jnp.asarray(1.0)), Named("twice"), {"inside": (Named("twice"),)}])
def test_a_program_of_a_users_own_class_is_not_stored(cache: Path, law: object) -> None:
    run = lambda law, x: (law["inside"][0] if isinstance(law, dict) else law)(x)  # noqa: E731
    np.testing.assert_array_equal(stored_jit()(run)(law, jnp.ones(2)), [2.0, 2.0])
    assert not cache.exists()


def test_a_program_of_an_actuator_is_stored(cache: Path) -> None:
    bent = pj.solve_batch(pj.make_actuator("pneuflex_s"), jnp.asarray([1e4, 2e4]))
    again = pj.solve_batch(pj.make_actuator("pneuflex_s"), jnp.asarray([1e4, 2e4]))
    np.testing.assert_array_equal(bent.bend, again.bend)
    assert list(cache.glob("*.stablehlo"))


def test_with_another_default_device_nothing_is_stored(cache: Path) -> None:
    with jax.default_device(jax.devices("cpu")[0]):
        cached_program(_counted([]), "twice")({"a": jnp.zeros(1)}, jnp.ones(1))
    assert not cache.exists()


def test_threads_that_begin_at_once_trace_once(cache: Path) -> None:
    traces: list[int] = []
    program = cached_program(_counted(traces), "by threads")
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda k: program({"a": jnp.full(3, float(k))}, jnp.ones(3)), range(8)))
    assert len(traces) == 1
    assert [float(one["sum"][0]) for one in found] == [k + 2.0 for k in range(8)]


def test_what_closes_over_laws_from_elsewhere_is_not_stored(cache: Path) -> None:
    class Own(pj.effects.Effect):
        """A law of one's own, which may change."""

    assert of_package(pj.effects.CATALOGUE["thick_wall"]) and not of_package(Own)
    program = cached_program(_counted([]), "own law", keep=False)
    program({"a": jnp.zeros(3)}, jnp.ones(3))
    assert not list(cache.glob("*.stablehlo"))


def test_keys_of_random_numbers_are_arguments(cache: Path) -> None:
    program = cached_program(lambda key: {"x": jax.random.normal(key, (2,))}, "random")
    assert not np.array_equal(program(jax.random.key(0))["x"], program(jax.random.key(1))["x"])
