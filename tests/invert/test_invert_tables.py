"""Tables of a segment's shape, and work in lots."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.invert.forward import in_parallel, padded
from fitting.invert.tables import Table, looked_up


def cubic(pressure, first, second):
    """Values that a table of cubics has to give exactly."""
    p, a, b = pressure / 1e4, first, second
    return jnp.stack([a**3 - 2.0 * b * p**2, a * b**2 + p**3, 1.0 + a * b * p, a - b])


@pytest.fixture
def table():
    pressures = jnp.linspace(0.0, 5e4, 7)
    fractions = jnp.asarray(1.0 - 0.9 * np.linspace(1.0, 0.0, 9) ** 1.5)
    grid = jnp.meshgrid(pressures, fractions, fractions, indexing="ij")
    return Table(pressures, fractions, cubic(*grid))


@pytest.mark.parametrize("at", [(0.0, 1.0, 1.0), (5e4, 0.1, 0.1), (1.7e4, 0.55, 0.93), (4.9e4, 0.11, 0.999)])
def test_a_table_gives_cubics_and_their_derivatives_exactly(table, at):
    place = jnp.asarray(at)
    with_slope = lambda f: jax.jit(lambda x: (f(x), jax.jacfwd(f)(x)))(place)  # noqa: E731
    (found, slope), (exact, exact_slope) = (
        with_slope(f) for f in (lambda x: table.at(x[0], x[1:]), lambda x: cubic(*x))
    )
    np.testing.assert_allclose(found, exact, rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(slope, exact_slope, rtol=1e-7, atol=1e-9)


def test_every_segment_is_looked_up_by_its_own_springs(table):
    drives = jnp.asarray([2e4, 0.3, 0.8, 0.9, 0.4])
    found = looked_up((table, table), drives)
    np.testing.assert_allclose(found[0], cubic(2e4, 0.3, 0.8), rtol=1e-10)
    np.testing.assert_allclose(found[1], cubic(2e4, 0.9, 0.4), rtol=1e-10)


@pytest.mark.parametrize("count", [1, 3, 4, 5, 16, 17, 31])
def test_work_in_lots_keeps_every_row_in_its_place(count):
    rows = np.arange(count), np.arange(2.0 * count).reshape(count, 2)
    sizes = []

    def work(lot):
        sizes.append(len(lot[0]))
        return 2 * lot[0], lot[1] + 1.0

    twice = in_parallel(work, rows, 4, 8)
    assert set(sizes) == {4 if count <= 4 else 8}
    np.testing.assert_array_equal(twice[0], 2 * rows[0])
    np.testing.assert_array_equal(twice[1], rows[1] + 1.0)


@pytest.mark.parametrize(("count", "filled"), [(1, 16), (16, 16), (17, 32), (100, 128)])
def test_rows_are_filled_up_to_a_power_of_two(count, filled):
    (first, second), size = padded((np.arange(count), np.ones((count, 3))))
    assert size == count and first.shape == (filled,) and second.shape == (filled, 3)
    assert first[-1] == count - 1
