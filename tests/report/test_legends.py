"""A legend above the panels is no wider than its figure."""

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.lines import Line2D

from fitting.report.figures import legend_over, panel_grid, style

TEXTS = ("posterior", "prior", "Laplace approximation")


@pytest.mark.parametrize(("panels", "lines"), [(1, 2), (2, 1)])
def test_a_legend_breaks_its_line_where_the_figure_is_narrow(panels, lines):
    with style():
        figure, axes = panel_grid(panels, 2.7, 2.2, (0.8, 0.8))
        axes[0].plot([0.0, 1.0])
        legend_over(figure, [Line2D([], [], label=text) for text in TEXTS])
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        (legend,) = figure.legends
        frame, box = figure.bbox, legend.get_window_extent(canvas.get_renderer())
    assert frame.x0 < box.x0 and box.x1 < frame.x1 and box.y1 < frame.y1
    heights = {round(text.get_window_extent(canvas.get_renderer()).y0) for text in legend.get_texts()}
    assert len({height // 8 for height in heights}) == lines
