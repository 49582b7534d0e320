"""Error measures against values worked out by hand."""

import jax
import numpy as np
import pytest

from fitting.inference.metrics import (
    mean_absolute_error,
    metrics,
    metrics_over_all,
    relative_percent_difference,
    relative_percent_difference_signed,
    root_mean_square_error,
)

DATA = np.array([1.0, 2.0, -3.0, 4.0])
MODEL = np.array([1.5, 1.0, -3.0, 2.0])
# differences -0.5, 1, 0, 2; magnitudes 1.25, 1.5, 3, 3


def test_hand_values():
    assert float(mean_absolute_error(DATA, MODEL)) == pytest.approx(3.5 / 4, rel=1e-15)
    assert float(root_mean_square_error(DATA, MODEL)) == pytest.approx(np.sqrt(5.25 / 4), rel=1e-15)
    assert float(relative_percent_difference(DATA, MODEL)) == pytest.approx(3.5 / 8.75, rel=1e-15)
    assert float(relative_percent_difference_signed(DATA, MODEL)) == pytest.approx(2.5 / 8.75, rel=1e-15)


def test_the_printed_form_lets_errors_cancel_and_ours_does_not():
    data, model = np.array([1.0, 1.0]), np.array([0.5, 1.5])
    assert float(relative_percent_difference_signed(data, model)) == 0.0
    assert float(relative_percent_difference(data, model)) == pytest.approx(0.5, rel=1e-15)


def test_sign_and_symmetry():
    forward, back = metrics(DATA, MODEL), metrics(MODEL, DATA)
    assert float(forward["rpd_signed"]) == -float(back["rpd_signed"])
    for name in ("mae", "rmse", "rpd"):
        assert float(forward[name]) == float(back[name])


def test_opposite_signs_reach_the_largest_value():
    assert float(relative_percent_difference(np.array([2.0]), np.array([-2.0]))) == 2.0


def test_zero_everywhere_is_no_difference():
    zeros = np.zeros(3)
    assert {name: float(value) for name, value in metrics(zeros, zeros).items()} == dict.fromkeys(
        metrics(zeros, zeros), 0.0
    )


def test_pure_and_differentiable():
    gradient = jax.jit(jax.grad(lambda model: mean_absolute_error(DATA[:2], model)))(MODEL[:2])
    np.testing.assert_allclose(gradient, [0.5, -0.5])


@pytest.mark.parametrize("model", [MODEL[:3], MODEL[None], np.zeros(0)])
def test_shapes_must_agree(model):
    with pytest.raises(ValueError, match="must have one shape"):
        mean_absolute_error(DATA if model.size else model, model)


def test_several_recordings_are_pooled_value_by_value():
    pooled = metrics_over_all([(DATA[:1], MODEL[:1]), (DATA[1:], MODEL[1:])])
    assert pooled == {name: float(value) for name, value in metrics(DATA, MODEL).items()}
    assert pooled["mae"] == pytest.approx(3.5 / 4, rel=1e-15)
