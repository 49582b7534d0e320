"""Rows in which the body bends so far that it may touch itself are counted and told."""

import dataclasses
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from study_texts import PLAIN

import fitting.report.results  # noqa: F401  results know how they look
from fitting.propagate import build_problem, propagate, read_study
from fitting.propagate.responses.body import body_of
from fitting.propagate.responses.touching import TOUCHING, overlapping, past
from fitting.propagate.statistics.touching import Touching
from fitting.report.results import save, text
from fitting.simulate.chain_state import chain_specimens
from fitting.specimens.model_objects import BASE
from pneusma_jax.serial_chain.designs import load_chain, make_chain
from pneusma_jax.serial_chain.shape import place_segments


def test_the_page_the_command_and_the_json_tell_rows_and_angles(write, tmp_path):
    """Actuators that bend by 330 to 880 degrees had gone without a word."""
    problem = build_problem(read_study(write(PLAIN + "[sampling]\nrows = 64\nseed = 6\n")))  # no other test's program
    plain = problem.response.answer

    def bent(values):
        outputs, status = plain(values)
        return outputs | {TOUCHING: past(jnp.asarray([0.0, -10.0 * values["a"]]), 270.0)}, status

    problem = dataclasses.replace(problem, response=dataclasses.replace(problem.response, answer=bent))
    result = propagate(problem, tmp_path / "out")
    drawn = problem.inputs.values(problem.design.rows(problem.sampler().points(0, 64), None)[0])
    angles = np.abs(np.rad2deg(10.0 * drawn[:, problem.inputs.value_names.index("a")]))
    angles = angles[angles > 270.0]
    assert 30 < angles.size < 64, "some rows touch, and some do not"
    save(result, tmp_path / "out", force=True)
    said = f"In {angles.size} of 64 rows the body bends by {angles.min():.0f} to {angles.max():.0f} degrees"
    told = json.loads((tmp_path / "out" / "report.json").read_text())
    assert told["touching"]["rows"] == angles.size
    assert told["touching"]["most_deg"] == pytest.approx(angles.max())
    assert any(note.startswith(said) for note in told["notices"])
    assert said in " ".join(text(result).split())
    assert said in " ".join((tmp_path / "out" / "report.html").read_text().split())


def test_counts_of_parts_add_up():
    parts = [np.array([0.0, 300.0]), np.zeros(3), np.array([450.0, 280.0])]
    whole = Touching.of()
    for part in parts:
        whole = whole.merge(Touching.of(part))
    assert (whole.rows, whole.least, whole.most) == (3, 280.0, 450.0)


@pytest.mark.parametrize("count", [1, 2])
def test_a_chain_in_one_plane_overlaps_where_its_ends_meet(count):
    """An arc of length L and angle a has ends L sin(a / 2) / (a / 2) apart, of any number of segments."""
    angles = np.deg2rad(np.linspace(100.0, 500.0, 81))
    each = np.stack([np.zeros_like(angles), angles], axis=-1)[:, None] / count
    size, radius = 0.056, 0.005
    ends = count * size * np.sin(angles / 2.0) / (angles / 2.0) - 2.0 * radius
    shape = lambda bends: place_segments(  # noqa: E731
        bends, jnp.full(count, size), jnp.zeros(count), jnp.zeros(count), jnp.full(count, radius)
    )
    found = np.asarray(jax.vmap(lambda bends: overlapping(shape(bends)))(jnp.repeat(each, count, axis=1)))
    assert np.all(found[(ends < -0.0003) | (angles >= 2.0 * np.pi)] > 0.0)
    assert np.all(found[(ends > 0.0) & (angles < 2.0 * np.pi)] == 0.0)
    assert np.allclose(found[found > 0.0], np.rad2deg(angles[found > 0.0]))


def test_a_chain_under_its_weight_can_be_propagated_and_feels_its_density():
    """It had ended in an error of the tracer, and the density of the silicone had moved nothing."""
    design = load_chain("loaded_chain")
    bodies = {name: body_of(one, BASE)[0] for name, one in chain_specimens(design, {}).items()}

    def mass(density):
        values = {"silicone.density": density, "wall_thickness": 1e-3 * density / 1070.0}
        silicone = lambda name: bodies[name].silicone(values).values()["density"]  # noqa: E731
        chain = make_chain(design, lambda name: bodies[name].build(values), silicone)
        return jnp.sum(next(load.masses for load in chain.loads if hasattr(load, "masses")))

    found, slope = jax.jit(jax.value_and_grad(mass))(1070.0)
    assert found > 0.0 and slope * 1070.0 / found > 0.9, "twice as dense is about twice as heavy"
