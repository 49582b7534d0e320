"""Recordings that a program runs one by one give what they give together, and only those that are asked for run."""

from dataclasses import replace
from pathlib import Path

import jax
import numpy as np
import pytest
from diagnosis_coupons import curve, write

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.packed import Grouped, Named, Packed
from fitting.diagnose.evaluate.program import Program


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Five coupons, which a stack pads to six, with effects of the law, of memory, of time and of the stand."""
    courses = [0.5, 0.5, 0.8], [0.3, 0.6], [0.8, 0.8], [0.4, 0.7, 0.7], [0.6, 0.2]
    folder = tmp_path_factory.mktemp("coupons") / "campaign"
    few = ["strain_stiffening", "mullins_softening", "viscoelastic_relaxation", "force_calibration"]  # all compile longer
    return Program.of(read_campaign(write(folder, curve, courses=courses)), "elastomer", few)


def both(program, columns, chosen=None):
    """The same run of a whole stack, and of its recordings by themselves."""
    compiled, u = program._compiled, program.unknowns.neutral
    whole = compiled.run(u, columns, program.stacked)
    compiled.one_by_one = True
    try:
        return whole, compiled.run(u, columns, program.stacked, chosen)
    finally:
        compiled.one_by_one = False


def test_recordings_by_themselves_are_those_of_a_stack(program):
    columns = np.array([program.unknowns.base[0], *program.unknowns.of(["strain_stiffening"])])
    together, alone = both(program, columns)
    for mine, theirs in zip(parts(together), parts(alone), strict=True):
        assert mine.keys() == theirs.keys()
        for name, values in mine.items():
            k = values.ndim - 2  # axis of the recordings
            real = np.arange(5)
            np.testing.assert_allclose(theirs[name].take(real, k), values.take(real, k), rtol=1e-12, atol=1e-12)
    assert np.any(alone.slopes["stress"][1] != 0.0)


def test_only_what_is_asked_for_runs(program):
    chosen = np.zeros(len(program.stacked.mask), bool)
    chosen[[1, 3]] = True
    together, alone = both(program, program.unknowns.base[:1], chosen)
    for k in (1, 3):
        np.testing.assert_allclose(alone.found["stress"][k], together.found["stress"][k], rtol=1e-12)
    # the others repeat one of the two, so nothing was computed for them
    np.testing.assert_array_equal(alone.found["stress"][0], alone.found["stress"][1])
    assert not np.allclose(together.found["stress"][0], together.found["stress"][1])


def test_a_tree_is_packed_and_unpacked():
    tree = {"a": np.arange(6.0).reshape(2, 3), "b": (np.array(True), np.array([3, 4])), "c": np.array(2.5)}
    again = jax.jit(lambda packed: packed.tree)(Packed.of(tree))
    jax.tree.map(np.testing.assert_array_equal, again, tree)
    assert jax.tree.map(lambda x: x.dtype.name, again) == jax.tree.map(lambda x: x.dtype.name, tree)
    columns = Named(np.arange(6.0).reshape(2, 3), ("x", "y", "z")).columns
    np.testing.assert_array_equal(columns["y"], [1.0, 4.0])


def parts(run):
    """Outputs, derivatives and drivers of a run."""
    return run.found, run.slopes, run.drivers


@pytest.mark.slow
def test_an_actuator_one_by_one_is_that_of_a_stack():
    """With latent trajectories, whose search runs fewer recordings from round to round."""
    folder = Path(__file__).resolve().parents[2] / "calibration_data" / "examples" / "actuator"
    program = Program.of(read_campaign(folder), "actuator")
    u = program.unknowns.neutral.copy()
    u[program.unknowns.base] = 0.3
    columns = program.unknowns.base[:3]
    alone = program.evaluate(u, columns)
    program._compiled.one_by_one = False
    together = program.evaluate(u, columns)
    for k in range(len(program.channels)):
        np.testing.assert_allclose(alone.misfit[k], together.misfit[k], rtol=1e-5, atol=1e-5)
        np.testing.assert_allclose(alone.jacobian[k], together.jacobian[k], rtol=1e-3, atol=1e-3)
    count = len(program.channels)
    np.testing.assert_allclose(alone.trajectories[:count], together.trajectories[:count], atol=1e-6)


def test_arrays_of_one_shape_are_read_as_one_and_keep_their_names():
    arrays = {"a": np.arange(3.0), "b_2": np.ones((2, 2)), "c": np.arange(3.0) + 5.0, "d": np.arange(3)}
    groups = jax.device_get(jax.jit(Grouped.of)(arrays))
    assert len(groups) == 3
    found = Grouped.apart(groups)
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)


def test_derivatives_are_by_the_constants_that_are_free(program):
    """Those by the others are not compiled; outputs still depend on them."""
    compiled, unknowns = program._compiled, program.unknowns
    (k,) = unknowns.base
    u, step = unknowns.neutral, 1e-4
    moved = [compiled.run(u + sign * step * (np.arange(len(u)) == k), unknowns.base, program.stacked) for sign in (1, -1)]
    slope = (moved[0].found["stress"] - moved[1].found["stress"]) / (2.0 * step)
    np.testing.assert_allclose(moved[0].slopes["stress"][0], slope, rtol=1e-4, atol=1e-9 * np.abs(slope).max())
    names = [item.name for item in unknowns.items]
    (held,) = (name for name in program.stacked.base if name == "stress_zero" and name not in names)
    shifted = {held: np.asarray(program.stacked.base[held]) + 1e3}
    other = replace(program.stacked, base=program.stacked.base | shifted)
    change = compiled.run(u, unknowns.base, other).found["stress"] - compiled.run(u, unknowns.base, program.stacked).found["stress"]
    np.testing.assert_allclose(change, 1e3)
