"""Many series of a figure that are alike can all be told apart."""

import numpy as np
import pytest

from fitting.invert.result import Inversion
from fitting.report.figures import series
from fitting.report.invert.figures import targets_figure
from fitting.report.wiring.figures import wiring_figure
from fitting.wiring import Bounds, Springs
from fitting.wiring.choose import circuit_of


def looks(lines):
    return [(line.get_color(), line.get_linestyle(), line.get_marker()) for line in lines]


def test_the_first_28_series_differ():
    for points in (False, True):
        assert len({tuple(series(k, points).items()) for k in range(28)}) == 28


@pytest.mark.parametrize("count", [8, 12])
def test_every_spring_on_a_pair_of_wires_has_its_own_look_and_name(count):
    spots = np.geomspace(10e3, 100e3, count)
    figure = wiring_figure(circuit_of(Springs(3.6, 6e-8), Bounds(10e3, 100e3), spots, np.full(count, 1e-3)))
    assert len(set(looks(figure.axes[0].get_lines()))) == count
    assert [t.get_text() for t in figure.legends[0].get_texts()] == [f"spring {k + 1}" for k in range(count)]


@pytest.mark.parametrize("time", [None, np.arange(3.0)])
def test_the_eight_springs_of_a_chain_differ(time):
    springs = tuple((segment, number) for segment in range(1, 5) for number in (1, 2))
    blank, rows = np.zeros((3, 8)), (np.zeros((0, 9)),) * 3
    result = Inversion(
        "chain", ("length",), np.zeros((3, 1)), springs, np.zeros(3), blank + 0.5, blank, blank, np.zeros((3, 1)),
        {"length": np.zeros(3)}, np.ones(3, bool), ("",) * 3, rows, np.ones(8), np.ones(8), (np.zeros(0),) * 3,
    )  # fmt: skip
    lines = targets_figure(result, time).axes[-1].get_lines()
    assert len(set(looks(lines))) == 8
