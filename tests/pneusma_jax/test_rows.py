"""Rows in lots of one size come out as they went in."""

import numpy as np
import pytest

from pneusma_jax.numerics.rows import filled, first_rows, joined, lots


def test_a_lot_is_filled_up_with_its_last_row():
    tree = {"a": np.arange(3), "b": np.arange(6.0).reshape(3, 2)}
    found = filled(tree, 5)
    np.testing.assert_array_equal(found["a"], [0, 1, 2, 2, 2])
    np.testing.assert_array_equal(found["b"][3:], [[4.0, 5.0]] * 2)
    np.testing.assert_array_equal(first_rows(found, 3)["b"], tree["b"])


@pytest.mark.parametrize(("rows", "size", "count"), [(1, 4, 1), (4, 4, 1), (5, 4, 2), (9, 4, 3)])
def test_lots_have_one_size_and_are_joined_again(rows, size, count):
    tree = np.arange(rows), np.arange(2.0 * rows).reshape(rows, 2)
    cut = lots(tree, size)
    assert len(cut) == count and {len(x) for part in cut for x in part} == {size}
    for before, after in zip(tree, joined(cut, rows), strict=True):
        np.testing.assert_array_equal(before, after)
