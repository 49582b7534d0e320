"""Known numbers are handled without a program of their own, and without libraries that a command does without."""

import subprocess
import sys

import jax
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.invert.goals import GOALS, sizes
from pneusma_jax.numerics.lengths import shortened


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Events of programs that JAX compiles or loads from now on."""
    found: list[str] = []
    listen = lambda event, seconds, **_: found.append(event) if "backend_compile" in event else None  # noqa: E731
    jax.monitoring.register_event_duration_secs_listener(listen)
    jax.clear_caches()
    yield found
    jax.monitoring.unregister_event_duration_listener(listen)


def test_the_listener_hears_of_a_program(compiled: list[str]) -> None:
    jax.numpy.asarray(1.0) + 2.0
    assert compiled


def test_known_numbers_need_no_program(compiled: list[str]) -> None:
    shortened({"a": np.arange(7.0)}, 5)
    sizes(tuple(GOALS))
    zeros = [0.0] * 12
    found = pj.Equilibrium(*zeros[:6], (), *zeros[7:11])
    assert int(found.equilibria) == 1 and bool(found.stable)
    bent = np.array([[0.0, 1.0], [1.0, 0.0]])
    turned = pj.Equilibrium(0.0, bent, *zeros[2:6], (), *zeros[7:11])
    np.testing.assert_allclose(turned.bend_direction, [np.pi / 2, 0.0])
    assert not compiled


def test_walks_are_loaded_without_scipy() -> None:
    code = "import sys, fitting.simulate.walks; sys.exit('scipy.linalg' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_a_batch_by_resistance_needs_two_programs(compiled: list[str]) -> None:
    body, size = pj.make_actuator("pneusma2"), 40
    ohms = [np.linspace(2.8, 3.4, size), np.full(size, 3.4)]
    found = pj.solve_batch(body, np.full(size, 20e3), tuple(pj.Resistance(x) for x in ohms))
    assert len(compiled) <= 2  # rows, and contrasts of the springs
    assert np.all(np.isfinite(found.bend))
