"""Programs of a diagnosis run side by side: none may wait for threads of the runtime that the others hold."""

from pathlib import Path

import jax
import numpy as np
import pytest

from fitting.inference.latent_trajectory.gauss_newton import banded_side_by_side
from fitting.inference.parallel import THREADS, Tally, run_parallel

ROOT = Path(__file__).parents[2]
PACKAGES = ("pneusma_jax", "fitting/specimens")


@pytest.mark.parametrize("package", PACKAGES)
def test_no_program_calls_linear_algebra_that_waits_for_threads(package):
    """Batches of LAPACK's are split over the runtime's threads and wait for them: with as many programs side
    by side as threads they wait for ever."""
    # chains of segments take no part in a diagnosis
    files = sorted(path for path in (ROOT / package).rglob("*.py") if "serial_chain" not in path.parts)
    assert files
    for path in files:
        text = path.read_text(encoding="utf-8")
        for word in ("jnp.linalg", "lax.linalg", "jax.scipy.linalg"):
            assert word not in text, f"{path.relative_to(ROOT)}: {word}"


@pytest.mark.parametrize("rows", [1, 2, 7, 64, 101])
def test_the_solver_of_bands_is_that_of_the_whole_matrix(rows):
    rng = np.random.default_rng(rows)
    upper = np.append(rng.uniform(-1.0, 0.2, rows - 1), 0.0)
    diagonal = 1e-3 + np.abs(upper) + np.abs(np.roll(upper, 1)) + (rng.uniform(size=rows) < 0.3)
    matrix = np.diag(diagonal) + np.diag(upper[:-1], 1) + np.diag(upper[:-1], -1)
    right = rng.standard_normal(rows)
    exact = np.linalg.solve(matrix, right)
    found = jax.jit(lambda d, u, r: banded_side_by_side(d, u)(r))(diagonal, upper, right)
    np.testing.assert_allclose(found, exact, rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("threads", ["1", "3"])
def test_jobs_side_by_side_keep_their_order_and_are_all_counted(monkeypatch, threads):
    monkeypatch.setenv(THREADS, threads)
    tally = Tally()

    def job(k):
        for _ in range(200):
            tally.count("runs")
        return k * k

    assert run_parallel(job, range(20)) == [k * k for k in range(20)]
    assert tally["runs"] == 4000
    with pytest.raises(ZeroDivisionError):
        run_parallel(lambda k: 1 // k, range(3))
