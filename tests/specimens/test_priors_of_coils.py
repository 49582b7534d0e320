"""Bounds of a spring's wire and pitch: no fit may try coils that overlap."""

import pytest

from fitting.inference.parameters import Parameters
from fitting.specimens.priors import _keep_coils_apart, toleranced
from pneusma_jax.nitinol import SpringGeometry

WIRE, PITCH = 0.25e-3, 0.27e-3


def bounded(free, pitch=PITCH, end=""):
    known = {"wire_diameter": WIRE, "initial_pitch": pitch}
    parameters = Parameters(*(toleranced(f"{name}{end}", known[name], 0.02, "mm") for name in free))
    _keep_coils_apart(parameters, known, end)
    return parameters


@pytest.mark.parametrize("pitch", [PITCH, WIRE])
@pytest.mark.parametrize("free", [("wire_diameter", "initial_pitch"), ("wire_diameter",), ("initial_pitch",)])
def test_every_corner_of_the_bounds_is_a_spring(free, pitch):
    found = bounded(free, pitch)
    thickest = found["wire_diameter"].max if "wire_diameter" in free else WIRE
    shortest = found["initial_pitch"].min if "initial_pitch" in free else pitch
    SpringGeometry(thickest * (1.0 - 1e-12), 0.9e-3, shortest, 52.0, 14e-3)
    assert thickest >= WIRE and shortest <= pitch


def test_both_may_go_as_far_in_standard_deviations():
    found = bounded(("wire_diameter", "initial_pitch"), end="__2")
    wire, pitch = (found[f"{name}__2"] for name in ("wire_diameter", "initial_pitch"))
    away = (wire.max - WIRE) / wire.prior.sd
    assert 3.0 < away < 4.0 and (PITCH - pitch.min) / pitch.prior.sd == pytest.approx(away)


def test_coils_that_are_far_apart_keep_their_bounds():
    found = bounded(("wire_diameter", "initial_pitch"), 0.4e-3)
    assert found["wire_diameter"].max == pytest.approx(1.08 * WIRE)
    assert found["initial_pitch"].min == pytest.approx(0.92 * 0.4e-3)
