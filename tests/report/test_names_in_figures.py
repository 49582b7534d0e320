"""Names of users appear in figures as they are written; labels of ticks stay formulas where they are."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from fitting.report.figures import as_written, legend_over, literal, only_first, png, svg, thinned
from fitting.report.report import Picture

NAME = "pull $_$ and $x^2$"
"""Matplotlib cannot read the first formula in it; it would draw the second one as a formula."""


def drawing():
    figure = Figure(layout="constrained")
    axes = figure.subplots()
    (line,) = axes.plot([1.0, 1e3], [1.0, 2.0], label=NAME)
    axes.set(title=NAME, xlabel=NAME, xscale="log")
    axes.set_yticks([1.0], [literal(NAME)])
    legend_over(figure, [line])
    return figure


@pytest.mark.parametrize("written", [png, svg])
def test_a_name_with_dollar_signs_is_drawn(written):
    assert len(written(drawing())) > 1000


def test_a_name_is_escaped_once_however_often_it_is_written():
    figure = Picture("one", "A figure.", drawing).figure
    for _ in range(2):
        axes = as_written(figure).axes[0]
        assert axes.get_title() == axes.get_xlabel() == axes.get_yticklabels()[0].get_text() == literal(NAME)
        assert figure.legends[0].get_texts()[0].get_text() == literal(NAME)
        png(figure)
        assert "mathdefault" in axes.get_xticklabels()[2].get_text()
    assert literal(literal(NAME)) == literal(NAME) != NAME


@pytest.mark.parametrize(("count", "most"), [(0, 90), (1, 90), (90, 90), (91, 90), (179, 90), (1000, 7), (5, 1)])
def test_thinned_values_are_no_more_than_the_maximum(count, most):
    found = thinned(np.arange(count), most)
    assert min(count, most) >= len(found) >= min(count, (most + 1) // 2)
    assert list(found[:1]) == list(range(count))[:1]


@pytest.mark.parametrize(("count", "said"), [(0, ""), (12, ""), (13, " Only the first 12 of 13 curves are drawn.")])
def test_a_caption_says_how_many_are_not_drawn(count, said):
    assert only_first(12, count, "curves") == said
