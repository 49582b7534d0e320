"""The quadrature against exact integrals, its convergence, and refusals."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from pneusma_jax.section import Disc, Section
from pneusma_jax.silicone import SiliconeLaw

MODULUS = 2e5


class Linear(SiliconeLaw):
    """sigma = E eps, for which every integral is a moment of the area."""

    def __call__(self, strain):
        return MODULUS * strain


def test_linear_law_gives_the_moments_of_the_annulus():
    section = pj.annulus(10e-3, 1e-3)
    area = np.pi * (5e-3**2 - 4e-3**2)
    inertia = np.pi / 4 * (5e-3**4 - 4e-3**4)
    force, moment = jax.jit(lambda bend: section.integrate(Linear(), 0.1, bend))(jnp.asarray([3.0, -7.0]))
    np.testing.assert_allclose(force, MODULUS * area * 0.1, rtol=1e-12)
    np.testing.assert_allclose(moment, MODULUS * inertia * np.asarray([3.0, -7.0]), rtol=1e-12)


def test_plane_and_space_agree():
    section, law = pj.annulus(10e-3, 1e-3), pj.load_silicone()
    space = jax.jit(lambda g: section.integrate(law, 0.05, g))(jnp.asarray([0.0, -40.0]))
    plane = jax.jit(lambda g: section.integrate_in_plane(law, 0.05, g))(jnp.asarray(-40.0))
    np.testing.assert_allclose(space[0], plane[0], rtol=1e-10)
    np.testing.assert_allclose(space[1][1], plane[1][1], rtol=1e-13)


def test_jacobian_in_space_is_exact_also_when_straight():
    section, law = pj.annulus(10e-3, 1e-3), pj.load_silicone()
    load = jax.jit(lambda x: jnp.concatenate([jnp.atleast_1d(v) for v in section.integrate(law, x[0], x[1:])]))
    jacobian = jax.jit(jax.jacfwd(load))
    for x in ([0.1, 0.0, 0.0], [0.1, 5.0, -3.0], [0.0, 0.0, 0.0], [0.011, 1.0, 1.0]):
        x = jnp.asarray(x)
        exact = jacobian(x)
        steps = jnp.diag(jnp.asarray([1e-6, 1e-4, 1e-4]))
        numeric = jnp.stack([(load(x + s) - load(x - s)) / (2 * s.sum()) for s in steps], axis=1)
        np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-7)


def test_rotating_the_bend_rotates_the_moment():
    section, law = pj.annulus(10e-3, 1e-3), pj.load_silicone()
    integrate = jax.jit(lambda gradient: section.integrate(law, 0.03, gradient))
    force, moment = integrate(jnp.asarray([0.0, 30.0]))
    for angle in np.linspace(0.1, 6.0, 7):
        turned = jnp.asarray([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        f, m = integrate(turned @ jnp.asarray([0.0, 30.0]))
        np.testing.assert_allclose(f, force, rtol=1e-8)
        np.testing.assert_allclose(m, turned @ moment, rtol=1e-8, atol=1e-12)


def test_default_error_is_below_1e_8():
    """Against a rule five times finer, over random states of strain that cross every cut of the law."""
    law, rng = pj.load_silicone(), np.random.default_rng(20261121)
    centre = jnp.asarray(np.concatenate([rng.uniform(-0.3, 0.8, 1500), rng.uniform(-0.05, 0.05, 1500)]))
    slope = jnp.asarray(np.concatenate([rng.uniform(-150, 150, 1500), rng.uniform(-15, 15, 1500)]))
    over = lambda nodes: jax.jit(jax.vmap(lambda c, s: pj.annulus(10e-3, 1e-3, nodes).integrate_in_plane(law, c, s)))  # noqa: E731
    (force, moment), (fine_force, fine_moment) = over(14)(centre, slope), over(70)(centre, slope)
    size = 1e5 * np.pi * (5e-3**2 - 4e-3**2)  # stress of the order of the modulus over the wall [N]
    error = max(np.max(np.abs(force - fine_force)) / size, np.max(np.abs(moment - fine_moment)) / size / 5e-3)
    print(f"largest quadrature error of the default rule: {error:.1e} of the wall's reference force")
    assert error < 1e-8


def test_eccentric_bore_by_the_same_sum_of_shapes():
    outer, bore = Disc(5e-3), Disc(4e-3, jnp.asarray([0.0, 0.5e-3]))
    section = Section((outer, bore), (1, -1), jnp.pi * 4e-3**2, jnp.asarray([0.0, 0.5e-3]), jnp.asarray(5e-3))
    force, moment = section.integrate(Linear(), 0.1, jnp.zeros(2))
    np.testing.assert_allclose(moment[1], -MODULUS * 0.1 * np.pi * 4e-3**2 * 0.5e-3, rtol=1e-12)


@pytest.mark.parametrize(("wall", "what"), [(-1e-3, "positive"), (5e-3, "bore"), (0.0, "positive")])
def test_impossible_walls_are_refused(wall, what):
    with pytest.raises(ValueError, match=what):
        pj.annulus(10e-3, wall)


def test_a_section_that_encloses_nothing_is_refused():
    with pytest.raises(ValueError, match="encloses nothing"):
        Section((Disc(5e-3),), (1,), jnp.asarray(0.0), jnp.zeros(2), jnp.asarray(5e-3))
