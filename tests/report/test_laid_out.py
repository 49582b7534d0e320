"""A figure whose panels have found their places is drawn as before, and looks for no places again."""

import numpy as np
import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from fitting.report.figures import laid_out, new, panel_grid, png, style, svg


def drawn():
    """A figure whose long labels move its panels."""
    figure, panels = panel_grid(2, 2.7, 2.2)
    for panel in panels:
        panel.plot([0.0, 1e5], [0.0, 1e6])
        panel.set_ylabel("a label that takes\ntwo lines")
    return figure


def places(figure):
    return np.array([panel.get_position().bounds for panel in figure.axes])


def test_a_figure_that_is_laid_out_is_the_same_picture():
    with style():
        plain, made = drawn(), laid_out(drawn())
    assert np.abs(places(made) - places(plain)).max() > 0.02  # the labels did move the panels
    assert png(made) == png(plain)


def test_its_panels_keep_their_places_and_look_for_no_others(monkeypatch):
    with style():
        figure = drawn()
        assert laid_out(figure) is figure
    there = places(figure)

    def looked_for(*given):
        pytest.fail("places were looked for again")

    monkeypatch.setattr(ConstrainedLayoutEngine, "execute", looked_for)
    figure.axes[0].set_ylabel("a label that takes\nthree\nlines")
    png(figure), svg(figure)
    np.testing.assert_array_equal(places(figure), there)


def test_a_figure_without_a_layout_stays_as_it_is():
    figure = new.Figure()
    figure.subplots(1, 2)
    there = places(figure)
    assert laid_out(figure).get_layout_engine() is None
    np.testing.assert_array_equal(places(figure), there)
