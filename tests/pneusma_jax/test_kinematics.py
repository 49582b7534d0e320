"""Constant-curvature arcs: rotations, the straight tube, lengths of the sides, and which way a segment bends."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases
from scipy.linalg import expm

import pneusma_jax as pj
from pneusma_jax.serial_chain import kinematics as kin

BENDS = [(0.0, 0.0), (1e-9, -2e-9), (0.3, 0.0), (0.0, 0.999), (0.0, 1.001), (-1.1, 2.3), (4.0, -3.0)]
L0, RADIUS = 56e-3, 5e-3


@pytest.mark.parametrize("bend", BENDS)
def test_arc_is_the_exponential_of_its_twist(bend):
    """Independent value: the matrix exponential of the constant body twist (curvature theta x z, velocity z)."""
    ux, uy, _ = np.cross([*bend, 0.0], [0.0, 0.0, 1.0])
    twist = np.zeros((4, 4))
    twist[:3, :3] = [[0.0, 0.0, uy], [0.0, 0.0, -ux], [-uy, ux, 0.0]]
    twist[2, 3] = L0
    for fraction in (0.25, 1.0):
        np.testing.assert_allclose(
            kin.arc_frame(jnp.asarray(bend), L0, fraction), expm(fraction * twist), rtol=0, atol=2e-14
        )


@pytest.mark.parametrize("bend", BENDS)
def test_frames_are_rotations(bend):
    frame = kin.compose(kin.arc_frame(jnp.asarray(bend), L0), kin.shift_along(4e-3), kin.arc_frame(jnp.asarray([0.4, 0.2]), L0))
    R = np.asarray(kin.rotation(frame))
    np.testing.assert_allclose(R.T @ R, np.eye(3), rtol=0, atol=1e-13)
    assert np.linalg.det(R) == pytest.approx(1.0, abs=1e-13)
    np.testing.assert_array_equal(frame[3], [0.0, 0.0, 0.0, 1.0])


def test_positive_planar_bend_goes_towards_side_2():
    """By hand: side 1 (+y) longer by a quarter turn; the end points along -y, a radius 2 L / pi aside and ahead."""
    frame = kin.arc_frame(jnp.asarray([0.0, jnp.pi / 2]), L0)
    np.testing.assert_allclose(kin.tangent(frame), [0.0, -1.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(kin.position(frame), [0.0, -2 * L0 / np.pi, 2 * L0 / np.pi], atol=1e-15)


@pytest.mark.slow
def test_straight_tube_has_the_derivatives_of_the_limit():
    """Position is L (-theta/2 + ..., 1 - |theta|^2 / 6) and the tangent (-theta, 1 - |theta|^2 / 2) to second order."""
    zero = jnp.zeros(2)
    tip = lambda bend: kin.arc_points(bend, L0)  # noqa: E731
    slope, curve = jax.jacfwd(tip)(zero), jax.hessian(tip)(zero)
    np.testing.assert_allclose(slope, L0 * np.array([[-0.5, 0.0], [0.0, -0.5], [0.0, 0.0]]), atol=1e-15)
    np.testing.assert_allclose(curve[2], -L0 / 3 * np.eye(2), atol=1e-15)
    np.testing.assert_allclose(curve[:2], 0.0, atol=1e-15)
    ahead = lambda bend: kin.tangent(kin.arc_frame(bend, L0))  # noqa: E731
    np.testing.assert_allclose(jax.jacrev(ahead)(zero), [[-1.0, 0.0], [0.0, -1.0], [0.0, 0.0]], atol=1e-15)
    np.testing.assert_allclose(jax.hessian(ahead)(zero)[2], -np.eye(2), atol=1e-15)


@pytest.mark.slow
@pytest.mark.parametrize("bend", BENDS)
def test_derivatives_are_right_and_join_across_the_series(bend):
    bend, step = jnp.asarray(bend), 1e-5
    f = lambda b: kin.arc_frame(b, L0).ravel()  # noqa: E731
    numeric = jnp.stack([(f(bend + d) - f(bend - d)) / (2 * step) for d in step * jnp.eye(2)], axis=-1)
    np.testing.assert_allclose(jax.jacfwd(f)(bend), numeric, atol=1e-9)
    g = jax.jacfwd(f)
    numeric = jnp.stack([(g(bend + d) - g(bend - d)) / (2 * step) for d in step * jnp.eye(2)], axis=-1)
    np.testing.assert_allclose(jax.hessian(f)(bend), numeric, atol=1e-9)


@jax.jit
def _speeds(bend, length, place, shares):
    """Length of a side's line per share of it, at these shares."""
    line = lambda u: kin.side_points(bend, length, place, u)  # noqa: E731
    return jax.vmap(lambda u: jnp.linalg.norm(jax.jacfwd(line)(u)))(shares)


@pytest.mark.parametrize("bend", BENDS)
def test_sides_are_as_long_as_the_model_says(bend):
    """Arc length of the line at place r is L0 + delta(r), by Gauss quadrature of its differentiated points."""
    bend, delta_centre = np.asarray(bend), 3e-3
    x, w = np.polynomial.legendre.leggauss(8)
    for angle in np.radians([90.0, 270.0, 17.0]):
        place = RADIUS * np.asarray([np.cos(angle), np.sin(angle)])
        speed = _speeds(bend, L0 + delta_centre, place, 0.5 * (1.0 + x))
        delta = delta_centre + bend @ place
        np.testing.assert_allclose(0.5 * w @ np.asarray(speed), jnp.abs(L0 + delta), rtol=1e-13)


def test_turning_the_bend_turns_the_arc():
    bend, angle = jnp.asarray([0.7, -1.2]), 0.83
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turned = kin.rotate_in_section(bend, angle)
    np.testing.assert_allclose(kin.arc_points(turned, L0), turn @ kin.arc_points(bend, L0), atol=1e-15)
    np.testing.assert_allclose(kin.bend_rotation(turned), turn @ kin.bend_rotation(bend) @ turn.T, atol=1e-14)


def test_points_broadcast_and_lie_on_the_frames():
    bends = jnp.asarray(BENDS)[:, None, :]
    points = jax.jit(kin.arc_points)(bends, jnp.full((len(BENDS), 1), L0), jnp.linspace(0.0, 1.0, 9))
    assert points.shape == (len(BENDS), 9, 3)
    np.testing.assert_allclose(points[:, -1], kin.position(kin.arc_frame(bends[:, 0], L0)), atol=1e-16)
    np.testing.assert_array_equal(points[:, 0], 0.0)
    frames = kin.arc_frame(bends[:, 0], L0)
    back = kin.transform(frames, jnp.asarray([0.0, 0.0, 0.0]))
    np.testing.assert_array_equal(back, kin.position(frames))


@pytest.mark.parametrize(("hot", "side"), [(0, 90.0), (1, 210.0), (2, 330.0)])
def test_a_heated_spring_of_the_triad_pulls_the_tube_over_to_its_side(hot, side):
    body = pj.make_actuator("triad")
    found = pj.solve(body, 10e3, phases(*(0.3 if k == hot else 1.0 for k in range(3))))
    tip = np.asarray(kin.arc_points(found.bend, found.length))
    assert np.hypot(*tip[:2]) > 5e-3
    lean = np.degrees(np.arctan2(tip[1], tip[0]))
    assert (lean - side + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=1e-6)
    assert int(np.argmin(found.spring_elongations)) == hot


def test_planar_and_spatial_conventions_agree():
    """PneuSMA2 with spring 2 hot: side 1 the longer, curvature positive, tip towards side 2 at -y."""
    found = pj.solve(pj.make_actuator("pneusma2"), 10e3, phases(1.0, 0.3))
    x, y, z = kin.arc_points(found.bend, found.length)
    assert float(found.curvature) > 0.0 and float(found.delta_1) > float(found.delta_2)
    assert float(y) < -5e-3 and float(x) == 0.0
    r = 1.0 / float(found.curvature)
    phi = float(found.bend_angle)
    np.testing.assert_allclose([y, z], [-r * (1.0 - np.cos(phi)), r * np.sin(phi)], rtol=1e-12)
