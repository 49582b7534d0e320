"""A figure whose panels have found their places is drawn as before, and looks for no places again."""

import numpy as np
import pytest
from matplotlib.layout_engine import ConstrainedLayoutEngine

from fitting.report.figures import laid_out, new, panel_grid, png, style, svg
from fitting.report.render import documents
from fitting.report.report import Picture, Report, Section


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


def test_a_figure_is_drawn_once_for_every_file(monkeypatch):
    with style():
        figure = laid_out(drawn())
    count, draw = [], new.Figure.draw
    monkeypatch.setattr(new.Figure, "draw", lambda *given: (count.append(1), draw(*given)))
    png(figure), svg(figure)
    assert len(count) == 2


def test_saving_leaves_the_way_in_which_a_figure_is_laid_out():
    with style():
        figure = drawn()
    first, engine = png(figure), figure.get_layout_engine()
    assert isinstance(engine, ConstrainedLayoutEngine)
    there = places(figure)
    figure.axes[0].set_ylabel("a label that takes\nthree\nlines")
    assert png(figure) != first and np.abs(places(figure) - there).max() > 0.01


def test_names_in_a_report_are_looked_for_once(monkeypatch):
    count, looked_for = [], new.Figure.findobj
    monkeypatch.setattr(new.Figure, "findobj", lambda *given: (count.append(1), looked_for(*given))[1])
    picture = Picture("one", "A figure.", drawn)
    report = Report("A report", "of a test", ["It holds."], [Section("A section", [picture])])
    assert {"one.png"} < set(documents(report)) and len(count) == 1
