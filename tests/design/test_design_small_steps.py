"""Steps for which a report says what they change, of parameters whose range is short."""

import numpy as np
import pytest

from fitting.design.study import Bound, Free
from fitting.report.design.words import step_of


def free(low, high, unit="mm", made="continuous", name="wire_diameter"):
    """A parameter without values, its ends in SI."""
    return Free(name, made, Bound(low), Bound(high), (), unit)


@pytest.mark.parametrize(
    ("parameter", "size", "words"),
    [
        (free(0.6e-3, 1.8e-3), 1e-4, "0.1 mm"),
        (free(0.6e-3, 0.8e-3), 1e-4, "0.1 mm"),
        (free(0.16e-3, 0.22e-3), 1e-5, "0.01 mm"),
        (free(0.16e-3, 0.164e-3), 1e-6, "0.001 mm"),
        (free(0.0, 50e3, "kPa", name="hot.pressure"), 1e3, "1 kPa"),
        (free(0.0, 1e3, "kPa", name="hot.pressure"), 100.0, "0.1 kPa"),
        (free(0.4, 0.41, "1", name="hot.xi0_2"), 1e-3, "0.001"),
        (free(40.0, 41.0, "1", "integer", "active_coils"), 1.0, "1"),
    ],
)
def test_a_step_is_at_most_half_of_the_range(parameter, size, words):
    assert step_of(parameter) == (pytest.approx(size), words)


@pytest.mark.parametrize(("step", "words"), [(0.05e-3, "0.05 mm"), (0.1e-3, "0.1 mm"), (0.25e-3, "0.25 mm")])
def test_a_parameter_that_is_made_in_steps_is_changed_by_one_of_them(step, words):
    """A wall in steps of 0.05 mm was changed by 0.1 mm."""
    values = tuple(0.8e-3 + step * np.arange(5))
    parameter = Free("wall_thickness", "steps", Bound(values[0]), Bound(values[-1]), values, "mm")
    assert step_of(parameter) == (pytest.approx(step), words)


def test_an_end_that_depends_on_another_parameter_leaves_the_usual_step():
    low, high = Bound(0.1e-3), Bound(0.0, "wall_thickness", 0.2)
    assert step_of(Free("wire_diameter", "continuous", low, high, (), "mm")) == (pytest.approx(1e-4), "0.1 mm")
