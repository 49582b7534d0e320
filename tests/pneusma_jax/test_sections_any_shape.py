"""Sections of any outline: against closed forms and adaptive integration, order of convergence, gradients, refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad

import pneusma_jax as pj
from pneusma_jax.section import NODES, Disc, Section
from pneusma_jax.section.kinds import STRAIGHT_NODES, hollow
from pneusma_jax.section.outline import Outline
from pneusma_jax.silicone import SiliconeLaw

MODULUS = 2e5
SIZE = 1e5 * 3e-5  # N, stress of the order of the modulus over a wall of 30 mm2
STAR = 1e-3 * np.array([[6, 0], [2, 2], [0, 6], [-2, 2], [-6, 1], [-2, -2], [1, -6], [2, -1.5]])  # not convex
HEXAGON = pj.load_calibration("triangular").lines["outer_line"].points
SECTIONS = {
    "rectangle": lambda: pj.rectangle(12e-3, 8e-3, 1e-3),
    "semicircle": lambda: pj.semicircle(14e-3, 1e-3),
    "star": lambda: pj.polygon(STAR, 0.4e-3),
    "hexagon": lambda: pj.polygon(HEXAGON, 1e-3),
}


class Linear(SiliconeLaw):
    """sigma = E eps, for which every integral is a moment of the area."""

    def __call__(self, strain):
        return MODULUS * strain


def turn(angle):
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def flat(load):
    return jnp.concatenate([jnp.atleast_1d(part) for part in load])


_in_space = jax.jit(lambda section, law, x: flat(section.integrate(law, x[0], x[1:])))
_moments = jax.jit(lambda figure: figure.moments())
_in_plane = jax.jit(lambda section, law, x: flat(section.integrate_in_plane(law, x[0], x[1])))


def test_rectangle_has_the_textbook_moments():
    b, h, t = 12e-3, 8e-3, 1e-3
    area, first, second = _moments(pj.rectangle(b, h, t))
    bi, hi = b - 2 * t, h - 2 * t
    np.testing.assert_allclose(area, b * h - bi * hi, rtol=1e-14)
    np.testing.assert_allclose(first, 0.0, atol=1e-22)
    np.testing.assert_allclose(second, np.diag([h * b**3 - hi * bi**3, b * h**3 - bi * hi**3]) / 12, rtol=1e-13, atol=1e-26)


def test_half_disc_has_the_textbook_moments():
    r = 7e-3
    half = Outline([[-r, 0.0], [r, 0.0]], [1.0], (1,))
    area, first, second = _moments(half)
    np.testing.assert_allclose(area, np.pi * r**2 / 2, rtol=1e-14)
    np.testing.assert_allclose(first, [0.0, 2 * r**3 / 3], rtol=1e-14, atol=1e-22)
    np.testing.assert_allclose(second, np.eye(2) * np.pi * r**4 / 8, rtol=1e-13, atol=1e-26)


def test_semicircular_tube_has_an_even_wall():
    r, t = 7e-3, 1e-3
    section = pj.semicircle(2 * r, t)
    ri = r - t
    angle = np.arccos(t / ri)  # of the bore's arc from its axis
    np.testing.assert_allclose(section.enclosed_area, ri**2 * (angle - np.sin(angle) * np.cos(angle)), rtol=1e-13)
    arc_centre = 2.0 / 3.0 * (ri * np.sin(angle)) ** 3 / float(section.enclosed_area)
    np.testing.assert_allclose(section.enclosed_centroid, [0.0, arc_centre - r / 2], rtol=1e-12, atol=1e-18)
    side_1, side_2 = section.sides(np.array([0.0, 1.0]))
    np.testing.assert_allclose([side_1, side_2], [r / 2, -r / 2], rtol=1e-14)


def test_two_half_circles_are_a_disc():
    radius, law = 5e-3, pj.load_silicone()
    ring = Outline([[-radius, 0.0], [radius, 0.0]], [1.0, 1.0], (0, 1))
    x = jnp.asarray([0.02, 31.0, -17.0])
    round_one = _in_space(hollow(Disc(radius), Disc(4e-3)), law, x)
    np.testing.assert_allclose(_in_space(hollow(ring, Disc(4e-3)), law, x), round_one, rtol=1e-9, atol=1e-12)


def test_a_bulge_inwards_is_a_bite_out_of_the_figure():
    square, r = 1e-3 * np.array([[-3, -3], [3, -3], [3, 3], [-3, 3]]), 3e-3
    bitten = Outline(square, [-1.0], (0,))
    full, bite = Outline(square), Outline([[-r, -r], [r, -r]], [1.0], (1,))
    for whole, part, left in zip(*map(_moments, (full, bite, bitten)), strict=True):
        np.testing.assert_allclose(left, whole - part, rtol=1e-12, atol=1e-20)
    assert float(bitten.reach(jnp.asarray([0.0, -1.0]))) == pytest.approx(3e-3)
    assert float(bitten.exit(jnp.asarray([0.0, 1.0]))) == pytest.approx(3e-3)


def chord_by_crossings(line, y):
    """Length and first moment of a horizontal cut through a polygon, by sorting where its edges cross."""
    start, end = line, np.roll(line, -1, axis=0)
    hit = (start[:, 1] > y) != (end[:, 1] > y)
    s, e = start[hit], end[hit]
    x = np.sort(s[:, 0] + (y - s[:, 1]) / (e[:, 1] - s[:, 1]) * (e[:, 0] - s[:, 0]))
    return np.sum(x[1::2] - x[::2]), 0.5 * np.sum(x[1::2] ** 2 - x[::2] ** 2)


@pytest.mark.parametrize("name", ["star", *(pytest.param(name, marks=pytest.mark.slow) for name in ("hexagon", "rectangle"))])
def test_force_and_moment_against_adaptive_integration(name):
    """Even-odd chords integrated by SciPy between every vertex and every cut, in a turned figure."""
    section, law = SECTIONS[name](), pj.load_silicone()
    strain, slope, angle = 0.03, 41.0, 0.7
    stress = jax.jit(lambda strain: law(strain))
    towards = np.array([np.cos(angle), np.sin(angle)])
    places = (np.asarray(law.cuts) - strain) / slope
    wanted = np.zeros(3)
    for shape, sign in zip(section.shapes, section.signs, strict=True):
        line = np.asarray(shape.vertices) @ turn(np.pi / 2 - angle).T  # the direction of bending is now +y
        low, high = line[:, 1].min(), line[:, 1].max()
        knots = np.unique(np.clip([*line[:, 1], *places], low, high))
        for weight, k in ((lambda y: 1.0, 0), (lambda y: y, 0), (lambda y: 1.0, 1)):
            f = lambda y, w=weight, k=k, line=line: float(stress(strain + slope * y)) * w(y) * chord_by_crossings(line, y)[k]  # noqa: E731
            index = 0 if weight(2.0) == 1.0 and k == 0 else (1 if k == 0 else 2)
            wanted[index] += sign * sum(quad(f, a, b, epsrel=1e-10)[0] for a, b in zip(knots[:-1], knots[1:], strict=True))
    force, *moment = _in_space(section, law, jnp.asarray([strain, *(slope * towards)]))
    aside = np.array([towards[1], -towards[0]])
    ours = [force, moment @ towards, moment @ aside]
    np.testing.assert_allclose(np.asarray(ours) / SIZE, wanted / SIZE, rtol=1e-8, atol=1e-11)


def test_polygon_converges_to_the_annulus_with_second_order():
    law, x = pj.load_silicone(), jnp.asarray([0.06, 37.0])
    exact = _in_plane(pj.annulus(10e-3, 1e-3), law, x)[jnp.asarray([0, 2])]
    errors, counts = [], np.array([32, 64, 128])
    for n in counts:
        ring = np.stack([np.cos(2 * np.pi * np.arange(n) / n), np.sin(2 * np.pi * np.arange(n) / n)], axis=-1)
        section = pj.polygon(5e-3 * ring, bore=4e-3 * ring)
        errors.append(np.abs(_in_plane(section, law, x)[jnp.asarray([0, 2])] - exact))
    order = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    print("order of force and moment, polygon with twice the corners:", np.round(order, 3).tolist())
    np.testing.assert_allclose(order, 2.0, atol=0.1)
    np.testing.assert_allclose(order[-1], 2.0, atol=0.01)


@pytest.mark.slow
def test_curvature_of_a_polygonal_actuator_converges_to_the_round_one():
    law, arrangement, geometry = pj.load_silicone(), pj.layout("pneuflex_s"), pj.design_geometry("pneuflex_s")
    exact = float(pj.solve(pj.make_actuator("pneuflex_s"), 20e3).curvature)
    gaps = []
    for n in (16, 32):
        ring = np.stack([np.cos(2 * np.pi * np.arange(n) / n), np.sin(2 * np.pi * np.arange(n) / n)], axis=-1)
        body = pj.build_actuator(pj.polygon(5e-3 * ring, bore=4e-3 * ring), arrangement, geometry, None, law)
        gaps.append(abs(float(pj.solve(body, 20e3).curvature) - exact))
    print(f"curvature off by {gaps[0] / exact:.1e} with 16 corners and {gaps[1] / exact:.1e} with 32")
    assert np.log2(gaps[0] / gaps[1]) == pytest.approx(2.0, abs=0.1)
    assert gaps[1] < 0.02 * exact


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["semicircle", "rectangle"])
def test_default_nodes_are_enough(shape):
    law, rng = pj.load_silicone(), np.random.default_rng(11)
    x = jnp.asarray(np.stack([rng.uniform(-0.3, 0.8, 400), rng.uniform(-120, 120, 400), rng.uniform(-120, 120, 400)], axis=1))
    over = lambda section: jax.jit(jax.vmap(lambda x: flat(section.integrate(law, x[0], x[1:]))))(x)  # noqa: E731
    shapes = {"rectangle": (pj.rectangle, 12e-3, 8e-3, 1e-3), "semicircle": (pj.semicircle, 14e-3, 1e-3)}
    make = lambda n: shapes[shape][0](*shapes[shape][1:], nodes=n)  # noqa: E731
    default = make(NODES if make(8).shapes[0].curved else STRAIGHT_NODES)
    error = np.abs(over(default) - over(make(50))) / SIZE / np.array([1.0, 5e-3, 5e-3])
    print(f"largest quadrature error: {error.max():.1e} of the wall's reference force")
    assert error.max() < 1e-8


@pytest.mark.parametrize("name", ["rectangle", *(pytest.param(name, marks=pytest.mark.slow) for name in ("semicircle", "star", "hexagon"))])
def test_jacobian_in_space_is_exact(name):
    section, law = SECTIONS[name](), pj.load_silicone()
    jacobian = jax.jit(jax.jacfwd(lambda x: _in_space(section, law, x)))
    steps = np.diag([1e-6, 1e-4, 1e-4])
    for x in ([0.1, 0.0, 0.0], [0.1, 0.0, 12.0], [0.011, 5.0, -3.0]):
        x = jnp.asarray(x)
        numeric = np.stack([(_in_space(section, law, x + s) - _in_space(section, law, x - s)) / (2 * s.sum()) for s in steps], axis=1)
        np.testing.assert_allclose(jacobian(x), numeric, rtol=2e-5, atol=1e-7)


def test_turning_figure_and_bend_turns_the_moment():
    law, bend = pj.load_silicone(), np.array([12.0, 30.0])
    force, *moment = _in_space(pj.polygon(STAR, 0.4e-3), law, jnp.asarray([0.03, *bend]))
    for angle in (0.4, 2.0, 5.1):
        r = turn(angle)
        f, *m = _in_space(pj.polygon(STAR @ r.T, 0.4e-3), law, jnp.asarray([0.03, *(r @ bend)]))
        np.testing.assert_allclose(f, force, rtol=1e-10)
        np.testing.assert_allclose(m, r @ np.asarray(moment), rtol=1e-9, atol=1e-13)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("build", "dimensions"),
    [
        (pj.rectangle, [12e-3, 8e-3, 1e-3]),
        (pj.semicircle, [14e-3, 1e-3]),
        (lambda *v: pj.polygon(jnp.reshape(jnp.stack(v[:-1]), (8, 2)), v[-1]), [*STAR.ravel(), 0.4e-3]),
    ],
    ids=["rectangle", "semicircle", "star"],
)
def test_gradients_in_every_dimension(build, dimensions):
    """Faces across the direction of bending included: their place matters though they add nothing."""
    law, load = pj.load_silicone(), jnp.asarray([0.05, 25.0])
    d = jnp.asarray(dimensions)

    def f(d):
        section = build(*d)
        wall = flat(section.integrate_in_plane(law, load[0], load[1]))
        return jnp.concatenate([wall / SIZE, section.enclosed_area[None] * 1e4, section.enclosed_centroid * 1e2])

    exact = jax.jit(jax.jacfwd(f))(d)
    assert np.all(np.isfinite(exact))
    steps = 1e-5 * np.diag(np.abs(dimensions) + 1e-3)
    run = jax.jit(f)
    numeric = np.stack([(run(d + s) - run(d - s)) / (2 * s.sum()) for s in steps], axis=1)
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=2e-4)


def test_an_eccentric_section_bends_by_pressure_alone():
    """Linear law: two equations for elongation and bend, wall and bore each with their own centroid."""
    section, length, pressure = pj.semicircle(14e-3, 1e-3), 56e-3, 2e3
    geometry = pj.design_geometry("pneusma2")
    body = pj.build_actuator(section, pj.Layout(), geometry, None, Linear())
    found = pj.solve(body, pressure)
    area, first, second = section.moments()
    matrix = MODULUS / length * np.array([[area, first[1]], [first[1], second[1, 1]]])
    push = pressure * float(section.enclosed_area)
    centre, bend = np.linalg.solve(matrix, [push, push * float(section.enclosed_centroid[1])])
    np.testing.assert_allclose([found.delta_centre, found.bend_angle], [centre, bend], rtol=1e-8)
    assert abs(bend) > 1e-3
    np.testing.assert_allclose(found.delta_1 - found.delta_2, bend * 7e-3, rtol=1e-8)


@pytest.mark.parametrize("springs", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_sides_are_the_extreme_points_of_a_lopsided_section(springs):
    body = pj.make_actuator("triangular") if springs else pj.build_actuator(
        SECTIONS["hexagon"](), pj.Layout(), pj.design_geometry("pneusma2"), None, Linear()
    )  # fmt: skip
    hot = tuple(pj.MartensiteFraction(x) for x in (0.4, 1.0, 1.0)[: len(body.springs)])
    found = pj.solve(body, 15e3 if springs else 2e3, hot)
    top, bottom = 3.943e-3, -6.5e-3
    np.testing.assert_allclose(found.delta_1, found.delta_centre + found.bend[1] * top, rtol=1e-12)
    np.testing.assert_allclose(found.delta_2, found.delta_centre + found.bend[1] * bottom, rtol=1e-12)
    np.testing.assert_allclose([found.radius + found.middle, found.middle - found.radius], [top, bottom], rtol=1e-12)


def lines(points):
    return 1e-3 * np.asarray(points, dtype=float)


SQUARE = [[-3, -3], [3, -3], [3, 3], [-3, 3]]


@pytest.mark.parametrize(
    ("build", "what"),
    [
        (lambda: pj.polygon(lines([[-3, -3], [3, 3], [3, -3], [-3, 3]]), 0.5e-3), r"must not cross itself, but it does near \(0, 0\) mm"),
        (lambda: pj.polygon(lines(SQUARE[::-1]), 0.5e-3), "clockwise: reverse them"),
        (lambda: pj.polygon(lines(SQUARE[:2]), 0.5e-3), "at least three vertices"),
        (lambda: pj.polygon(lines([*SQUARE[:2], SQUARE[1], SQUARE[2]]), 0.5e-3), r"two that follow each other are at \(3, -3\) mm"),
        (lambda: pj.polygon(lines([*SQUARE[:3], [0, np.nan]]), 0.5e-3), "must be finite"),
        (lambda: pj.polygon(lines([[-3, -3], [3, -3], [6, -3], [3, -3], [3, 3]]), 0.5e-3), r"cross itself, but it does near \(6, -3\) mm"),
        (lambda: pj.polygon(lines(SQUARE), 3e-3), "must be positive and leave a bore, but it is 3 mm"),
        (lambda: pj.polygon(lines(SQUARE), -1e-3), "must be positive"),
        (lambda: pj.polygon(lines(SQUARE), bore=lines(SQUARE)), "bore of a section must lie inside"),
        (lambda: pj.polygon(lines(SQUARE), bore=lines(SQUARE) + 20e-3), "bore of a section must lie inside"),
        (lambda: pj.polygon(lines(SQUARE), bore=lines(SQUARE) * 1.2), "bore of a section must lie inside"),
        (lambda: pj.polygon(lines(SQUARE)), "either a `wall_thickness` or a `bore`"),
        (lambda: pj.rectangle(10e-3, 4e-3, 2e-3), "2 mm where `height` is 4 mm"),
        (lambda: pj.rectangle(10e-3, 4e-3, -1e-3), "must be positive"),
        (lambda: pj.semicircle(8e-3, 2e-3), "leave a bore"),
        (lambda: Outline(lines(SQUARE), [2.0], (0,)), "at most half a circle"),
        (lambda: Outline(lines(SQUARE), [1.0], (0, 1)), "one bulge per curved edge"),
        (lambda: Section((Outline(lines(SQUARE)),), (1,), jnp.asarray(0.0), jnp.zeros(2), jnp.asarray(3e-3)), "encloses nothing"),
    ],
)  # fmt: skip
def test_what_is_no_section_is_refused(build, what):
    with pytest.raises(ValueError, match=what) as error:
        build()
    assert "\n" not in str(error.value)
