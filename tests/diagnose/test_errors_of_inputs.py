"""Errors of an output that drift, beside errors of an input that are new in every row."""

import numpy as np
import pytest

from fitting.diagnose.evaluate.inputs import with_input_noise
from fitting.inference.channels import Channel


@pytest.mark.parametrize("rho", [0.5, 0.8])
def test_whitened_errors_are_white_where_an_input_matters_and_where_not(rho):
    rng = np.random.default_rng(3)
    rows, repeats, own = 160, 4000, 0.1
    felt = np.where((np.arange(rows) // 40) % 2, 0.3, 0.0)  # what the input's noise does to the output, by row
    kicks, error = rng.standard_normal((repeats, rows)), np.zeros((repeats, rows))
    error[:, 0] = kicks[:, 0]
    for k in range(1, rows):
        error[:, k] = rho * error[:, k - 1] + np.sqrt(1.0 - rho**2) * kicks[:, k]
    total = own * error + felt * rng.standard_normal((repeats, rows))
    bare = Channel("strain", np.zeros(rows), np.full(rows, own), rho)
    ((channel,),) = with_input_noise([[bare]], {"temperature": [[[felt]], [[-felt]]]})
    white = channel.whitened(total)
    assert np.std(white, axis=0) == pytest.approx(np.ones(rows), abs=0.06)
    neighbours = np.mean(white[:, 1:] * white[:, :-1], axis=0)
    assert np.max(np.abs(neighbours)) < 0.25  # at an edge; elsewhere
    assert abs(np.mean(neighbours)) < 0.05
    assert np.mean(white[:, :40].sum(axis=1) ** 2) == pytest.approx(40.0, rel=0.15)
    # where the input matters only neighbours are white: what lasts is left, and is counted as it shows
    assert 40.0 < np.mean(white[:, 40:80].sum(axis=1) ** 2) < 1.7 * 40.0


def test_missing_rows_are_still_missing():
    sigma = np.array([0.1, 0.1, np.inf, 0.1])
    bare = Channel("strain", np.zeros(4), sigma, 0.5)
    ((channel,),) = with_input_noise([[bare]], {"temperature": [[[np.full(4, 0.1)]], [[np.full(4, 0.1)]]]})
    white = channel.whitened(np.ones(4))
    assert np.all(np.isfinite(white)) and white[2] == 0.0
    assert channel.count == 3
