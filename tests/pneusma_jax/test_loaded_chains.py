"""Chains under weight, forces and moments: virtual work, one segment, elastic rods, gradients, histories."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases
from rods import rod

import pneusma_jax as pj
from pneusma_jax.actuator.loads import Load
from pneusma_jax.serial_chain.kinematics import arc_frame, side_points, transform
from pneusma_jax.serial_chain.loads import ChainWeight, LineLoad, PointLoad, generalised_forces
from pneusma_jax.serial_chain.shape import place_segments
from pneusma_jax.serial_chain.solve import simulate_chain_history, solve_chain
from pneusma_jax.serial_chain.weight import chain_weight, with_bodies
from pneusma_jax.silicone import SiliconeLaw

MODULUS = 2e5


class Linear(SiliconeLaw):
    """sigma = E eps with E = 0.2 MPa."""

    def __call__(self, strain):
        return MODULUS * strain


def beam(section, length, count, plane=90.0):
    """A chain of linear tubes without springs, and its stiffness in bending about x and y and in stretching."""
    layout, geometry = pj.Layout(bending_plane=plane), pj.Geometry(length=length / count)
    body = pj.build_actuator(section, layout, geometry, None, Linear())
    area, _, second = (np.asarray(x) for x in section.moments())
    return pj.chain_of(body, count), MODULUS * second[[1, 0], [1, 0]], MODULUS * float(area)


def turn_about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


# --- virtual work -------------------------------------------------------------------------------------------

RNG = np.random.default_rng(0)
ANGLES, CONNECTORS = RNG.uniform(-2.0, 2.0, 3), np.array([3e-3, 5e-3, 0.0])
REST = np.array([0.05, 0.06, 0.04])
FORCE, MOMENT = RNG.normal(size=3), RNG.normal(size=3)
WEIGHT = ChainWeight(
    [1.0, -2.0, 3.0], [1.0, 2.0, 3.0], 3e-3 * RNG.normal(size=(3, 2)), [0.5, 0.2, 0.7], 3e-3 * RNG.normal(size=(3, 3))
)
LINE = LineLoad([1.0, 0.3, -0.4], [2e-3, -1e-3])
INNER = PointLoad(FORCE, place=[1e-3, 2e-3, 3e-3], segment=1)
TWISTED = PointLoad(moment=MOMENT)
FOLLOWING = PointLoad(FORCE, MOMENT, [1e-3, 2e-3], follows=True)


def placed(q):
    """Shape of three segments from (elongation, bend) of each."""
    q = q.reshape(3, 3)
    return place_segments(q[:, 1:], REST + q[:, 0], ANGLES, CONNECTORS, jnp.zeros(3))


def end_of(shape, k):
    """Middle of a segment's end and its own axes there."""
    frame = shape.frames[k] @ arc_frame(shape.bends[k], shape.lengths[k])
    return frame[:3, 3], frame[:3, :3] @ turn_about_z(ANGLES[k])


def mean_of_fibre(shape, k, place, pieces=400):
    place = jnp.broadcast_to(turn_about_z(ANGLES[k])[:2, :2] @ place, (pieces, 2))
    share = (jnp.arange(pieces) + 0.5) / pieces
    points = side_points(shape.bends[k][None], shape.lengths[k][None], place, share)
    return jnp.mean(transform(shape.frames[k], points), axis=0)


def potential_of_weight(q):
    shape, energy = placed(q), 0.0
    for k in range(3):
        place, axes = end_of(shape, k)
        middle = mean_of_fibre(shape, k, WEIGHT.places[k])
        energy -= WEIGHT.acceleration @ (WEIGHT.masses[k] * middle)
        energy -= WEIGHT.acceleration @ (WEIGHT.end_masses[k] * (place + axes @ WEIGHT.end_places[k]))
    return energy


def potential_of_line(q):
    shape = placed(q)
    return -sum(REST[k] * LINE.per_length @ mean_of_fibre(shape, k, LINE.place) for k in range(3))


def negative_work(load, q):
    """Of a point load, by the change of its place and of the axes there; forces that follow are held at `q`."""
    at = load.segment % 3
    axes_here = end_of(placed(q), at)[1]
    force, moment = (axes_here @ x if load.follows else x for x in (load.force, load.moment))

    def work(q):
        place, axes = end_of(placed(q), at)
        spin = axes @ axes_here.T
        turned = 0.5 * jnp.stack([spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1]])
        return -(force @ (place + axes[:, : load.place.shape[0]] @ load.place) + moment @ turned)

    return jax.grad(work)(q)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("load", "wanted", "off"),
    [
        (WEIGHT, jax.grad(potential_of_weight), 1e-6),  # 400 pieces of a fibre leave 3e-7
        (LINE, jax.grad(potential_of_line), 1e-6),
        (INNER, lambda q: negative_work(INNER, q), 1e-12),
        (TWISTED, lambda q: negative_work(TWISTED, q), 1e-12),
        (FOLLOWING, lambda q: negative_work(FOLLOWING, q), 1e-12),
    ],
    ids=["weight", "line", "inner", "moment", "following"],
)
def test_generalised_forces_are_the_virtual_work(load, wanted, off):
    """Bent segments of a turned chain with connectors, and the straight chain."""
    bent = np.concatenate([RNG.uniform(-0.01, 0.02, (3, 1)), RNG.uniform(-2.0, 2.0, (3, 2))], axis=1).ravel()

    def ours(q):
        parts = q.reshape(3, 3)
        rest, angles = jnp.asarray(REST), jnp.asarray(ANGLES)
        pull, turn = generalised_forces(
            (load,), rest + parts[:, 0], parts[:, 1:], angles, jnp.asarray(CONNECTORS), rest
        )
        return jnp.concatenate([pull[:, None], turn], axis=1).ravel()

    ours, wanted = jax.jit(ours), jax.jit(wanted)
    for q in (jnp.asarray(bent), jnp.zeros(9)):
        found, true = np.asarray(ours(q)), np.asarray(wanted(q))
        np.testing.assert_allclose(found, true, rtol=0, atol=off * np.abs(true).max())


# --- one segment --------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_loaded_segment_is_a_loaded_chain_of_one():
    """Weight and a tip force on a triad, as the segment's own loads and as the chain's."""
    body, drive, fall = pj.make_actuator("triad"), phases(0.9, 0.5, 0.4), [1.0, -9.0, 3.0]
    heavy = pj.weight(body, 1070.0, fall, 0.4e-3, [1e-3, -2e-3])
    push = pj.TipForce([5e-3, -8e-3, 3e-3], [1e-3, 2e-3])
    alone = pj.solve(body.with_loads(heavy, push), 15e3, drive)
    own = solve_chain(pj.chain_of(body.with_loads(heavy, push)), 15e3, (drive,))
    for ours, theirs in zip(jax.tree.leaves(own.segments[0]), jax.tree.leaves(alone), strict=True):
        if ours is not own.segments[0].steps and jnp.issubdtype(ours.dtype, jnp.inexact):
            np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-13)
    loads = chain_weight((body,), 1070.0, fall, 0.4e-3, [1e-3, -2e-3]), PointLoad(push.force, place=push.place)
    chains = solve_chain(pj.chain_of(body).with_loads(*loads), 15e3, (drive,))
    np.testing.assert_allclose(chains.end_pose, own.end_pose, rtol=1e-9, atol=1e-13)
    assert bool(own.stable) and bool(own.converged)


def test_weights_add_up():
    """A chain weighs what its segments do; bodies at one end count as one."""
    two, three = pj.make_actuator("pneusma2"), pj.make_actuator("triad")
    whole = chain_weight((two, three), [1070.0, 900.0], [0.0, 0.0, -9.8], 2e-3, None, 6e-3, 1e-3)
    np.testing.assert_allclose(whole.masses, [pj.mass_of(two, 1070.0)[0], pj.mass_of(three, 900.0)[0]])
    np.testing.assert_allclose(whole.end_masses, [1e-3, 2e-3])
    np.testing.assert_allclose(whole.end_places, [[0.0, 0.0, 3e-3], [0.0, 0.0, 0.0]], atol=1e-18)
    more = with_bodies(whole, jnp.asarray([3e-3, 0.0]), jnp.asarray([[2e-3, 0.0], [0.0, 0.0]]))
    np.testing.assert_allclose(more.end_masses, [4e-3, 2e-3])
    np.testing.assert_allclose(more.end_places[0], [1.5e-3, 0.0, 0.75e-3])


# --- elastic rods -------------------------------------------------------------------------------------------

RING = pj.annulus(10e-3, 1e-3)


def convergence(section, length, plane, loads, reference, counts=(4, 8)):
    """Errors of the tip's place (of the length) and of its axes for chains of ever more segments."""
    place, axes, pose = [], [], None
    for count in counts:
        chain, *_ = beam(section, length, count, plane)
        found = solve_chain(chain.with_loads(*loads(chain)), 0.0)
        assert bool(found.converged) and bool(found.stable)
        pose = np.asarray(found.end_pose)
        place.append(np.linalg.norm(pose[:3, 3] - reference[0]) / length)
        axes.append(np.abs(pose[:3, :3] - reference[1]).max())
    return np.array(place), np.array(axes)


def check_second_order(place, axes, least):
    """Errors fall as the square of a segment's length: by four when their number doubles, 3.5 to 4.5 here."""
    print("place:", place, place[:-1] / place[1:], "axes:", axes, axes[:-1] / axes[1:])
    for errors in (place, axes):
        order = np.log2(errors[:-1] / errors[1:])
        assert np.all(order > np.log2(3.5)) and np.all(order < np.log2(4.5))
    assert max(place[-1], axes[-1]) < least


@pytest.mark.slow
def test_a_tip_force_bends_a_chain_as_it_bends_a_rod():
    """A tip deflection of more than half the length, in the plane: F L^2 / EI is 3."""
    _, bending, stretching = beam(RING, 0.2, 4)
    reference = rod(0.2, bending, stretching, force=(0.0, -4.3e-3, 1e-3))
    loads = lambda chain: [PointLoad([0.0, -4.3e-3, 1e-3])]  # noqa: E731
    check_second_order(*convergence(RING, 0.2, 90.0, loads, reference, (4, 8, 16)), 1e-3)


@pytest.mark.slow
def test_weight_bends_a_chain_as_it_bends_a_rod():
    _, bending, stretching = beam(RING, 0.1, 4)
    heavy = -1070.0 * float(RING.moments()[0]) * 9.80665
    reference = rod(0.1, bending, stretching, per_length=(0.0, heavy, 0.0))
    loads = lambda chain: [chain_weight(chain.segments, 1070.0, pj.gravity_vector("horizontal"))]  # noqa: E731
    check_second_order(*convergence(RING, 0.1, 90.0, loads, reference), 3e-3)


@pytest.mark.slow
def test_a_rod_of_unequal_stiffness_bent_in_space():
    """Force, moment and a line load, none in a plane of symmetry: the rod winds in space."""
    box = pj.rectangle(12e-3, 8e-3, 1e-3)
    force, moment, line = (3e-3, -5e-3, -2e-3), (1e-4, -2e-4, 3e-4), (0.02, -0.01, 0.0)
    _, bending, stretching = beam(box, 0.2, 4)
    assert abs(bending[0] / bending[1] - 1.0) > 0.2
    reference = rod(0.2, bending, stretching, force, moment, line)
    assert np.all(np.abs(reference[0][:2]) > 0.1 * 0.2)
    loads = lambda chain: [PointLoad(force, moment), LineLoad(line)]  # noqa: E731
    check_second_order(*convergence(box, 0.2, None, loads, reference), 4e-3)


@pytest.mark.parametrize("follows", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_a_moment_bends_every_segment_alike(follows):
    """A pure moment across the plane makes an arc, however many segments; a moment that follows is the same one."""
    chain, bending, _ = beam(RING, 0.2, 2)
    size = 2.0 * bending[0] / 0.2  # two radians in all
    found = solve_chain(chain.with_loads(PointLoad(moment=[size, 0.0, 0.0], follows=follows)), 0.0)
    np.testing.assert_allclose([float(s.bend_angle) for s in found.segments], 1.0, rtol=1e-9)
    np.testing.assert_allclose([float(s.length) for s in found.segments], 0.1, rtol=1e-12)
    assert bool(found.stable)


@pytest.mark.slow
def test_a_column_buckles_at_eulers_load():
    """Just below it the straight chain is stable, just above it is an equilibrium that would not stay.

    Fifteen segments: their arcs raise the critical load by 0.1 %, and the rod shortens by less.
    """
    chain, bending, stretching = beam(RING, 0.4, 15)
    critical = np.pi**2 * bending[0] / (4.0 * 0.4**2)
    assert critical / stretching < 1e-3
    push = lambda share: solve_chain(chain.with_loads(PointLoad([0.0, 0.0, -share * critical])), 0.0)  # noqa: E731
    below, above = push(0.99), push(1.01)
    assert bool(below.converged) and bool(below.stable)
    assert bool(above.converged) and not bool(above.stable)
    np.testing.assert_allclose(above.shape.bends, 0.0, atol=1e-12)
    aside = solve_chain(chain.with_loads(PointLoad([0.0, -1e-3 * critical, -1.5 * critical])), 0.0)
    assert bool(aside.stable) and abs(float(aside.end_pose[1, 3])) > 0.3 * 0.4


# --- actuators ----------------------------------------------------------------------------------------------


def catheter(loads=True, wall=1e-3, count=2):
    """Free PneuSMA2 segments, every other one turned, under weight and a force in no plane of theirs."""
    body = dataclasses.replace(pj.make_actuator("pneusma2", wall_thickness=wall), bending_plane=None)
    chain = pj.chain_of(body, count, angles=[0.5 * np.pi * (k % 2) for k in range(count)], connectors=4e-3)
    if not loads:
        return chain
    heavy = chain_weight(chain.segments, 1070.0, pj.gravity_vector("horizontal"), 0.5e-3, None, 4e-3, 0.2e-3)
    return chain.with_loads(heavy, PointLoad([3e-3, 2e-3, -1e-3]))


DRIVES = (phases(1.0, 0.5), phases(0.6, 1.0))


@pytest.mark.slow
def test_no_loads_and_loads_of_nothing_are_the_same():
    chain = catheter(loads=False)
    none = chain.with_loads(PointLoad(), LineLoad([0.0, 0.0, 0.0]))
    free, loaded = solve_chain(chain, 15e3, DRIVES), solve_chain(none, 15e3, DRIVES)
    np.testing.assert_allclose(loaded.end_pose, free.end_pose, atol=1e-10)
    assert free.stable is None and bool(loaded.stable)


@pytest.mark.slow
def test_a_load_across_the_springs_bends_out_of_their_plane_and_is_carried_by_all():
    chain = catheter()
    found = solve_chain(chain, 15e3, DRIVES)
    free = solve_chain(catheter(loads=False), 15e3, DRIVES)
    for segment, alone in zip(found.segments, free.segments, strict=True):
        assert abs(float(segment.bend[0])) > 0.02 > 1e-9 > abs(float(alone.bend[0]))
        assert float(segment.residual) < 1e-9
    held = dataclasses.replace(chain, segments=tuple(pj.make_actuator("pneusma2") for _ in range(2)))
    stiff = solve_chain(held, 15e3, DRIVES)
    np.testing.assert_allclose([segment.bend[0] for segment in stiff.segments], 0.0, atol=1e-15)


@pytest.mark.slow
def test_gradients_of_the_tip_through_loads_and_segments():
    """By force, moment, wall, pressure, phase and density, against fourth-order differences."""

    def tip(x):
        chain = catheter(loads=False, wall=x[0])
        heavy = chain_weight(chain.segments, x[1], pj.gravity_vector("horizontal"), x[2])
        push = PointLoad(jnp.stack([x[3], 2e-3, -1e-3]), jnp.stack([1e-5, 0.0 * x[4], x[4]]))
        drives = (phases(1.0, x[5]), phases(0.6, 1.0))
        found = solve_chain(chain.with_loads(heavy, push), x[6], drives, throw=False)
        return found.end_pose[:3, 3] @ jnp.asarray([0.3, 0.8, 0.5]), found.converged

    x = jnp.asarray([1e-3, 1070.0, 0.5e-3, 3e-3, 2e-5, 0.5, 15e3])
    slopes = jax.jit(jax.vmap(jax.value_and_grad(tip, has_aux=True)))
    e = jnp.diag(1e-4 * x)
    (values, good), gradients = slopes(jnp.concatenate([x[None], x + e, x - e, x + 2 * e, x - 2 * e]))
    assert bool(jnp.all(good))
    near, mirrored, far, far_mirrored = values[1:].reshape(4, -1)
    numeric = (8 * (near - mirrored) - (far - far_mirrored)) / 12
    exact = np.asarray(gradients[0] * 1e-4 * x)
    assert np.all(np.abs(exact) > 1e-12)
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-6 * np.abs(exact).max())


@pytest.mark.slow
def test_a_history_carries_loads_and_memories():
    """Heat and cool one segment: the first row is the state alone; the chain does not return to it."""
    chain, rows = catheter(), 9
    xi0 = 0.4 + 0.6 * np.abs(np.linspace(-1.0, 1.0, rows))
    drives = (phases(1.0, xi0), phases(1.0, 1.0))
    history = simulate_chain_history(chain, jnp.full(rows, 15e3), drives)
    assert bool(jnp.all(history.converged)) and history.segments[0].temperatures.shape == (rows, 2)
    first = solve_chain(chain, 15e3, (phases(1.0, 1.0), phases(1.0, 1.0)))
    np.testing.assert_allclose(history.shape.row(0).end_pose, first.end_pose, atol=1e-9)
    warm = [tuple(jax.tree.map(lambda x: x[3], s) for s in part.states) for part in history.segments]
    again = solve_chain(chain, 15e3, (phases(1.0, xi0[4]), phases(1.0, 1.0)), warm)
    np.testing.assert_allclose(history.shape.row(4).end_pose, again.end_pose, atol=1e-9)
    tips = np.asarray(history.shape.end_pose)[:, :3, 3]
    assert np.linalg.norm(tips[-1] - tips[0]) > 1e-3


@pytest.mark.slow
def test_a_heated_history_of_one_segment_is_that_of_the_actuator():
    """By current, under a load: the chain of one, as a chain's load, is the actuator, as its own."""
    body, rows = pj.make_actuator("pneusma1"), 6
    time, current = jnp.linspace(0.0, 20.0, rows), jnp.asarray([0.0, 0.3, 0.3, 0.3, 0.0, 0.0])
    drive, pressure = (pj.Heating(current, jnp.asarray(22.0)),), jnp.full(rows, 15e3)
    force = [0.0, -5e-3, 2e-3]
    alone = pj.simulate_history(body.with_loads(pj.TipForce(force)), pressure, drive, time=time)
    chain = pj.chain_of(body).with_loads(PointLoad(force))
    many = simulate_chain_history(chain, pressure, (drive,), time=time)
    assert bool(jnp.all(many.converged)) and float(jnp.ptp(alone.temperatures)) > 5.0
    np.testing.assert_allclose(many.segments[0].temperatures, alone.temperatures, rtol=1e-9)
    np.testing.assert_allclose(many.segments[0].rows.bend, alone.rows.bend, rtol=1e-7, atol=1e-10)
    np.testing.assert_allclose(many.segments[0].states[0].xi_min, alone.states[0].xi_min, rtol=1e-9)


@pytest.mark.slow
def test_resistances_give_the_loaded_chain_back():
    """The resistances of a chain that was solved by its phases."""
    chain = catheter()
    given = solve_chain(chain, 15e3, DRIVES)
    ohms = [tuple(pj.Resistance(spring.resistance) for spring in part.springs) for part in given.segments]
    found = solve_chain(chain, 15e3, ohms)
    np.testing.assert_allclose(found.end_pose, given.end_pose, atol=1e-8)


@pytest.mark.slow
def test_a_load_that_cannot_be_borne_is_said():
    """A row without equilibrium has a status, is NaN throughout, and stops no other row of a batch."""
    chain, *_ = beam(RING, 0.1, 3)
    forces = jnp.asarray([[0.0, 1e-3, 0.0], [0.0, jnp.nan, 0.0], [0.0, 0.0, -6.0], [0.0, 2e-3, 0.0]])
    found = jax.jit(jax.vmap(lambda f: solve_chain(chain.with_loads(PointLoad(f)), 0.0, throw=False)))(forces)
    wanted = ("converged", "input_not_finite", "collapsed", "converged")  # 6 N press the tube to nothing
    assert [pj.Status(int(code)).name for code in found.status] == list(wanted)
    assert np.isfinite(found.end_pose[:, 0, 3]).tolist() == [True, False, False, True]
    with pytest.raises(RuntimeError, match="The loaded chain: .* not a finite number"):
        solve_chain(chain.with_loads(PointLoad([0.0, jnp.nan, 0.0])), 0.0)


class Odd(Load):
    """A load that knows one segment only."""

    def potential(self, length, bend):
        return length

    def generalised_force(self, length, bend):
        return jnp.ones(()), jnp.zeros(2)


def test_loads_that_do_not_fit_are_refused():
    chain, *_ = beam(RING, 0.1, 3)
    for load, words in (
        (PointLoad([1.0, 0.0]), r"`force` of a point load must have shape \(3,\)"),
        (PointLoad([1.0, 0.0, 0.0], place=[0.0]), "`place` of a point load"),
        (PointLoad([1.0, 0.0, 0.0], segment=3), "an index into 3 segments, but it is 3"),
        (LineLoad([1.0, 0.0]), r"`per_length` of a line load must have shape \(3, 3\)"),
        (ChainWeight([0.0, 0.0, 1.0], [1.0], [[0.0, 0.0]], [0.0], [[0.0, 0.0, 0.0]]), "`masses` of a weight"),
    ):
        with pytest.raises(ValueError, match=words):
            chain.with_loads(load)
    with pytest.raises(ValueError, match="must not carry a Odd"):
        pj.chain_of(chain.segments[0].with_loads(Odd()), 2)
