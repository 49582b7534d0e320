"""Figure and animation of a chain: what is drawn lies where the model says, on equal scales, and files are whole."""

import io

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image

import pneusma_jax as pj
from fitting.report.figures import png
from fitting.report.figures.shape import HEAT, animation, chain_figure, section_outline
from pneusma_jax.section.kinds import rectangle
from pneusma_jax.serial_chain.segments import chain_of
from pneusma_jax.serial_chain.solve import simulate_chain_history, solve_chain


def phases(*xi0):
    return tuple(pj.MartensiteFraction(jnp.asarray(x)) for x in xi0)


@pytest.fixture(scope="module")
def chain():
    return chain_of(pj.make_actuator("pneusma1"), 2, angles=(0.0, np.pi / 2), connectors=5e-3)


@pytest.fixture(scope="module")
def tubes():
    """Two segments without springs, whose program compiles sooner."""
    return chain_of(pj.make_actuator("pneuflex_s"), 2, angles=(0.0, np.pi / 2), connectors=5e-3)


@pytest.fixture(scope="module", params=["tubes", pytest.param("springs", marks=pytest.mark.slow)])
def course(request, chain, tubes):
    """A chain and its history."""
    if request.param == "tubes":
        return tubes, simulate_chain_history(tubes, jnp.linspace(5e3, 15e3, 6))
    xi0 = np.array([1.0, 0.8, 0.6, 0.5, 0.6, 0.8])
    return chain, simulate_chain_history(chain, jnp.full(6, 15e3), (phases(xi0), phases(xi0[::-1])))


def test_springs_are_drawn_where_they_are_in_the_colour_of_their_phase(chain):
    found = solve_chain(chain, 5e3, (phases(0.8), phases(0.95)))
    figure = chain_figure(chain, found, "two segments")
    axes = figure.axes[0]
    lines = {tuple(np.round(line.get_color(), 6)): line for line in axes.lines if not isinstance(line.get_color(), str)}
    hot = np.stack(lines[tuple(np.round(HEAT(0.8), 6))].get_data_3d(), axis=-1)
    body = chain.segments[0]
    np.testing.assert_allclose(hot, 1e3 * found.shape.line(0, body.spring_places[0], len(hot)), atol=1e-9)
    run = np.linalg.norm(np.diff(hot, axis=0), axis=1).sum()
    assert run == pytest.approx(1e3 * (56e-3 + float(found.segments[0].delta_2)), rel=1e-3)
    spans = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim()), np.ptp(axes.get_zlim())])
    np.testing.assert_allclose(axes.get_box_aspect() / spans, (axes.get_box_aspect() / spans)[0], rtol=1e-9)
    assert [axes.get_xlabel(), axes.get_zlabel()] == ["x [mm]", "z [mm]"]
    assert figure.axes[1].get_ylabel() == "martensite fraction of the spring [1]"
    assert Image.open(io.BytesIO(png(figure))).size[0] > 800


def test_a_tube_without_springs_is_drawn_too():
    chain = chain_of(pj.make_actuator("pneuflex_s"))
    assert len(chain_figure(chain, solve_chain(chain, 10e3)).axes) == 1


def test_outline_of_a_rectangle_is_the_rectangle():
    outline = section_outline(rectangle(12e-3, 8e-3, 1e-3))
    norm = np.max(np.abs(outline) / [6e-3, 4e-3], axis=1)
    np.testing.assert_allclose(norm, 1.0, rtol=1e-9)


def test_animation_is_a_small_gif_of_as_many_frames(course):
    content = animation(*course, np.full(6, 15e3), np.arange(6.0), frames=4)
    with Image.open(io.BytesIO(content)) as picture:
        assert picture.format == "GIF" and picture.n_frames == 4
    assert len(content) < 1_500_000 / 10


def test_what_was_not_solved_is_refused(chain, tubes):
    drives = (phases(jnp.nan), phases(1.0))
    with pytest.raises(pj.InputError, match="found no equilibrium"):
        chain_figure(chain, solve_chain(chain, 15e3, drives, throw=False))
    lost = simulate_chain_history(tubes, jnp.full(6, jnp.nan))
    with pytest.raises(pj.InputError, match="no row of the history"):
        animation(tubes, lost, np.full(6, 15e3))
