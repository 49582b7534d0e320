"""Scaled numbers of a diagnosis: shares of the way between the bounds of a parameter."""

import numpy as np
import pytest

from fitting.diagnose.evaluate.unknowns import Unknown


def shape(low, high, typical):
    """A shape that is scaled by its typical value and is 0 at its lower bound."""
    at = lambda x: (x - low) / typical  # noqa: E731
    return Unknown("tau", "e", low, typical, 0.0, at(high), at(typical), "s", "", True)


@pytest.mark.parametrize("typical", [0.9, 0.12, 0.11, 0.05, 1e-4])
@pytest.mark.parametrize("low", [0.0, 0.01, 0.05])
def test_a_share_of_the_way_lies_within_the_bounds_and_rises(low, typical):
    item = shape(low, 1.0, max(typical, low))
    values = [item.at_share(share) for share in np.linspace(0.0, 1.0, 21)]
    assert min(values) >= item.low - 1e-12 and max(values) <= item.high + 1e-12
    assert np.all(np.diff(values) >= 0.0) and values[-1] > values[0]


def test_from_zero_the_middle_of_the_way_is_the_typical_value_where_the_upper_bound_is_far():
    item = shape(0.0, 1.0, 0.05)
    assert item.at_share(0.5) == pytest.approx(item.start)
    assert float(item.value(item.at_share(0.25))) == pytest.approx(0.05 / np.sqrt(10.0))
