"""Figures of closed loops for every number of cases: nothing cut, an axis below every column."""

from types import SimpleNamespace

import numpy as np
import pytest
from borders import faults

from fitting.report.control.figures import course_figure


@pytest.mark.parametrize("count", [1, 2, 3, 4])
def test_courses_of_any_number_of_cases_are_whole(count):
    time = np.linspace(0.0, 60.0, 30)
    run = SimpleNamespace(time=time, wanted=time, curvature=time + 0.5)
    figure = course_figure(SimpleNamespace(cases=[SimpleNamespace(name="no_mismatch", without=run, known=run)] * count))
    assert faults(figure) == []
    lowest = [axes for axes in figure.axes if axes.get_xlabel() and axes.xaxis.label.get_visible()]
    assert len(figure.axes) == count and len(lowest) == min(count, 2)
    assert max(axes.get_position().x1 for axes in figure.axes) > 0.9  # no half of it is blank
