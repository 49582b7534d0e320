"""Chains of segments: coherence with one segment, frames by hand, gradients, clearance, histories, refusals."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from activations import phases

import pneusma_jax as pj
from pneusma_jax.section.kinds import rectangle
from pneusma_jax.serial_chain import kinematics
from pneusma_jax.serial_chain.segments import (
    SegmentChain,
    chain_of,
    chain_shape,
    enclosing_radius,
)
from pneusma_jax.serial_chain.solve import simulate_chain_history, solve_chain

LENGTH, RADIUS = 56e-3, 5e-3


def shape_of(bends, connectors=0.0, lengths=None):
    bends = jnp.asarray(bends)
    chain = chain_of(pj.make_actuator("pneusma2"), len(bends), connectors=connectors)
    return chain_shape(chain, bends, jnp.full(len(bends), LENGTH) if lengths is None else jnp.asarray(lengths))


def test_a_segment_is_a_chain_of_one():
    body, drive = pj.make_actuator("pneusma2"), phases(1.0, 0.4)
    alone, chained = pj.solve(body, 15e3, drive), solve_chain(chain_of(body), 15e3, (drive,))
    for ours, theirs in zip(jax.tree.leaves(chained.segments[0]), jax.tree.leaves(alone), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(chained.end_pose, kinematics.arc_frame(alone.bend, alone.length), rtol=0, atol=1e-15)
    np.testing.assert_allclose(
        chained.shape.polyline(9)[:-1],
        kinematics.arc_points(alone.bend, alone.length, jnp.linspace(0.0, 1.0, 9)),
        atol=1e-16,
    )


def test_the_history_of_a_segment_is_that_of_a_chain_of_one():
    body, drive = pj.make_actuator("pneusma1"), phases(0.4)
    rows = jnp.linspace(5e3, 25e3, 12)
    history = pj.simulate_history(body, rows, drive)
    many = simulate_chain_history(chain_of(body), rows, (drive,))
    for ours, theirs in zip(jax.tree.leaves(many.segments[0]), jax.tree.leaves(history), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_segments_of_a_chain_do_not_know_of_each_other():
    """Two of one kind in one batch, one of another kind: each as if solved alone."""
    two, one = pj.make_actuator("pneusma2"), pj.make_actuator("pneusma1")
    thin = pj.make_actuator("pneusma2", wall_thickness=0.8e-3)
    drives = (phases(1.0, 0.4), phases(0.6), phases(0.5, 0.9))
    found = solve_chain(chain_of((two, one, thin)), 15e3, drives)
    for body, drive, result in zip((two, one, thin), drives, found.segments, strict=True):
        alone = pj.solve(body, 15e3, drive)
        np.testing.assert_allclose(result.bend, alone.bend, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(result.length, alone.length, rtol=1e-12)
    cold = solve_chain(chain_of((two, one, thin)), 15e3)
    np.testing.assert_allclose(cold.segments[1].bend, pj.solve(one, 15e3).bend, rtol=1e-12)


def test_four_quarter_turns_close_a_circle():
    shape = shape_of([[0.0, np.pi / 2]] * 4)
    np.testing.assert_allclose(shape.end_pose, np.eye(4), atol=1e-15)
    assert float(jnp.linalg.norm(shape.polyline()[50] - shape.polyline()[0])) == pytest.approx(4 * LENGTH / np.pi)


def test_connectors_and_mounting_angles_by_hand():
    """Quarter turn towards -y, 10 mm straight, then a segment mounted at 90 deg: its -y is the base's +x."""
    body = pj.make_actuator("pneusma2")
    chain = chain_of(body, 2, angles=(0.0, np.pi / 2), connectors=10e-3)
    shape = chain_shape(chain, jnp.asarray([[0.0, np.pi / 2]] * 2), jnp.full(2, LENGTH))
    a = 2 * LENGTH / np.pi
    np.testing.assert_allclose(shape.frames[1][:3, 3], [0.0, -a - 10e-3, a], atol=1e-16)
    np.testing.assert_allclose(shape.end_pose[:3, 2], [1.0, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(shape.end_pose[:3, 3], [a, -a - 10e-3 - a, a], atol=1e-15)
    line = shape.polyline(401)
    assert line.shape == (803, 3)
    run = np.linalg.norm(np.diff(line, axis=0), axis=1).sum()
    assert run == pytest.approx(2 * LENGTH + 10e-3, rel=1e-6)
    side = np.asarray(shape.line(1, body.spring_places[0], points=2001))
    assert np.linalg.norm(np.diff(side, axis=0), axis=1).sum() == pytest.approx(LENGTH + RADIUS * np.pi / 2, rel=1e-6)


@pytest.mark.slow
def test_turning_the_mounting_turns_the_pose():
    body, drives = pj.make_actuator("pneusma2"), (phases(1.0, 0.4), phases(0.5, 1.0))
    angle = 0.7
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    before = solve_chain(chain_of(body, 2, angles=(0.0, np.pi / 2), connectors=3e-3), 15e3, drives)
    after = solve_chain(chain_of(body, 2, angles=(angle, angle + np.pi / 2), connectors=3e-3), 15e3, drives)
    np.testing.assert_allclose(after.end_pose, turn @ before.end_pose @ turn.T, atol=1e-14)
    np.testing.assert_allclose(after.shape.clearance().smallest, before.shape.clearance().smallest, rtol=1e-9)


@pytest.mark.slow
def test_end_pose_is_differentiable():
    """Against central differences, over activations, pressure, dimensions, mounting and connector."""

    def tip(x):
        body = pj.make_actuator("pneusma2", wall_thickness=x[0], length=x[1], active_coils=x[2], prestrain=0.17)
        chain = chain_of(body, 2, angles=jnp.stack([0.0 * x[3], x[3]]), connectors=x[4])
        states = (pj.fresh_states(body, pj.design_geometry("pneusma2", prestrain=0.17)),) * 2
        found = solve_chain(chain, x[5], (phases(1.0, x[6]), phases(x[7], 0.9)), states, throw=False)
        return jnp.concatenate([found.end_pose[:3, 3] / LENGTH, found.end_pose[:3, 2]])

    x = jnp.asarray([1e-3, 56e-3, 52.0, 1.1, 4e-3, 15e3, 0.45, 0.6])
    run, slopes = jax.jit(tip), np.asarray(jax.jit(jax.jacrev(tip))(x)) * x
    numeric = [(run(x * (1 + 1e-6 * e)) - run(x * (1 - 1e-6 * e))) / 2e-6 for e in np.eye(x.size)]
    assert np.all(np.max(np.abs(slopes), axis=0)[[0, 1, 3, 4, 5, 6, 7]] > 1e-3)
    np.testing.assert_allclose(slopes, np.stack(numeric, axis=-1), rtol=1e-6, atol=2e-8)


@pytest.mark.parametrize("bend", [0.0, 1.0, 4.0, 5.5, 6.2, 7.0])
def test_clearance_within_a_segment(bend):
    """Base to end is L sinc(phi / 2); past a full turn the tube has run into itself."""
    free = LENGTH * np.sinc(bend / 2 / np.pi) if bend < 2 * np.pi else 0.0
    found = shape_of([[0.6 * bend, 0.8 * bend]]).clearance()
    assert float(found.within[0]) == pytest.approx(free - 2 * RADIUS, abs=1e-12)
    assert float(found.smallest) == float(found.within[0]) and found.pairs == ()


@pytest.mark.slow
def test_clearance_between_segments_by_hand():
    straight = shape_of([[0.0, 0.0]] * 3, connectors=4e-3).clearance()
    np.testing.assert_allclose(straight.within, LENGTH - 2 * RADIUS, atol=1e-9)
    assert straight.pairs == ((0, 1), (0, 2), (1, 2))
    np.testing.assert_allclose(straight.between, LENGTH - 2 * RADIUS + np.array([0.0, 4e-3, 0.0]), atol=1e-9)
    hairpin = shape_of([[0.0, 0.0], [np.pi, 0.0], [0.0, 0.0]]).clearance()  # legs 2 L / pi apart
    np.testing.assert_allclose(hairpin.between[1], 2 * LENGTH / np.pi - 2 * RADIUS, atol=1e-9)
    circle = shape_of([[0.0, np.pi / 2]] * 4).clearance()
    assert float(circle.smallest) == pytest.approx(-2 * RADIUS, abs=1e-9)


def test_clearance_against_all_pairs_of_a_dense_sampling():
    """Random chains: pairs of 300 points per piece; where pieces adjoin, those a segment's length apart or more."""
    rng = np.random.default_rng(3)
    for _ in range(4):
        bends = rng.uniform(-2.8, 2.8, (3, 2))
        lengths = rng.uniform(40e-3, 70e-3, 3)
        shape = shape_of(bends, [6e-3, 0.0], lengths)
        found = shape.clearance()
        pieces, places, count = [], [], 300
        for k in range(3):
            arc = np.asarray(shape.line(k, points=count))
            s = np.linspace(0.0, lengths[k], count)
            if k == 0:
                arc = np.concatenate([arc, np.linspace(arc[-1], shape.frames[1][:3, 3], 40)])
                s = np.concatenate([s, lengths[0] + np.linspace(0.0, 6e-3, 40)])
            pieces.append(arc)
            places.append(s + sum(lengths[:k]) + (6e-3 if k else 0.0))
        for (i, j), free in zip(found.pairs, found.between, strict=True):
            gap = np.linalg.norm(pieces[i][:, None] - pieces[j][None], axis=-1)
            apart = places[j][None] - places[i][:, None]
            allowed = apart >= min(lengths[i], lengths[j]) - 1e-12 if j == i + 1 else np.full(gap.shape, True)
            assert float(free) + 2 * RADIUS == pytest.approx(gap[allowed].min(), abs=2e-4)


@pytest.mark.slow
def test_clearance_has_the_right_gradient():
    bends = jnp.asarray([[0.5, 1.1], [1.9, -0.6], [2.2, 0.9]])

    def tightest(x):
        chain = chain_of(pj.make_actuator("pneusma2"), 3, connectors=x[6:8])
        return chain_shape(chain, x[:6].reshape(3, 2), jnp.asarray([50e-3, 56e-3, 64e-3])).clearance().between

    x = jnp.concatenate([bends.ravel(), jnp.asarray([5e-3, 7e-3])])
    slopes = jax.jit(jax.jacrev(tightest))(x)
    steps = 1e-5 * jnp.concatenate([jnp.eye(8), -jnp.eye(8)])
    moved = jax.jit(jax.vmap(tightest))(x + steps)
    numeric = (moved[:8] - moved[8:]) / 2e-5
    assert float(jnp.max(jnp.abs(slopes))) > 1e-3
    np.testing.assert_allclose(slopes, np.stack(numeric, axis=-1), rtol=1e-4, atol=1e-7)


@pytest.mark.slow
def test_history_of_a_chain_carries_every_memory():
    """One segment goes through a heat-cool cycle and does not return; the other, cold throughout, does."""
    body, turn = pj.make_actuator("pneusma2"), np.linspace(0.0, 2.0, 41)
    xi0 = 0.4 + 0.6 * np.abs(turn - 1.0)
    pressure = jnp.full(41, 20e3)
    drives = (phases(1.0, xi0), phases(1.0, 1.0))
    chain = chain_of(body, 2, angles=(0.0, np.pi / 2), connectors=2e-3)
    history = simulate_chain_history(chain, pressure, drives)
    assert bool(jnp.all(history.converged)) and history.shape.frames.shape == (41, 3, 4, 4)
    for drive, part in zip(drives, history.segments, strict=True):
        alone = pj.simulate_history(body, pressure, drive)
        np.testing.assert_allclose(part.rows.bend, alone.rows.bend, rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(part.states[1].xi_min, alone.states[1].xi_min, rtol=1e-12)
    tip = history.shape.end_pose[:, :3, 3]
    assert float(jnp.linalg.norm(tip[-1] - tip[0])) > 1e-3
    np.testing.assert_allclose(tip[:, 0], 0.0, atol=1e-12)  # the second, turned, segment stays straight
    np.testing.assert_allclose(history.shape.row(20).end_pose, history.shape.end_pose[20])
    assert history.shape.polyline(5).shape == (41, 11, 3)
    assert history.shape.clearance().within.shape == (41, 2)


def test_a_segment_without_equilibrium_is_named():
    body = pj.make_actuator("pneusma1")
    drives = (phases(0.5), phases(jnp.nan))
    with pytest.raises(RuntimeError, match=r"Segment 2: .* not a finite number"):
        solve_chain(chain_of(body, 2), 15e3, drives)
    found = solve_chain(chain_of(body, 2), 15e3, drives, throw=False)
    assert [int(s.status) for s in found.segments] == [pj.Status.converged, pj.Status.input_not_finite]
    assert bool(jnp.all(jnp.isfinite(found.frames[1]))) and not bool(jnp.any(jnp.isfinite(found.end_pose[:3, 3])))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (dict(segments=()), "at least one actuator"),
        (dict(angles=jnp.zeros(3)), r"`angles` must have shape \(2,\) for 2 segments"),
        (dict(connectors=jnp.zeros(2)), r"`connectors` must have shape \(1,\)"),
        (dict(connectors=jnp.asarray([-1e-3])), "must not be negative"),
    ],
)
def test_impossible_chains_are_refused(change, what):
    body = pj.make_actuator("pneusma2")
    with pytest.raises(ValueError, match=what):
        SegmentChain(**(dict(segments=(body, body), angles=jnp.zeros(2), connectors=jnp.zeros(1)) | change))


def test_enclosing_radius_of_round_and_rectangular_tubes():
    assert float(enclosing_radius(pj.annulus(10e-3, 1e-3))) == pytest.approx(5e-3, rel=1e-12)
    assert float(enclosing_radius(rectangle(12e-3, 8e-3, 1e-3))) == pytest.approx(np.hypot(6e-3, 4e-3), rel=1e-3)


def test_drives_that_do_not_fit_are_refused():
    body = pj.make_actuator("pneusma2")
    chain = chain_of(body, 2)
    with pytest.raises(ValueError, match="`activations` must have one entry per segment, 2 here, but it has 1"):
        solve_chain(chain, 1e4, (phases(1.0, 1.0),))
    with pytest.raises(ValueError, match="`states` must have one entry per segment"):
        simulate_chain_history(chain, jnp.full(3, 1e4), states=())
    with pytest.raises(ValueError, match="one entry per spring, 2 here"):
        solve_chain(chain, 1e4, (phases(1.0), phases(1.0, 1.0)))
    with pytest.raises(ValueError, match="`count` must be left out"):
        chain_of((body, body), 2)
    with pytest.raises(ValueError, match="at least one row"):
        simulate_chain_history(chain, jnp.zeros(0))
    with pytest.raises(ValueError, match="must not go backwards"):
        simulate_chain_history(chain, jnp.zeros(2), time=jnp.asarray([1.0, 0.0]))


def test_a_chain_is_a_pytree():
    chain = chain_of(pj.make_actuator("triad"), 3, connectors=1e-3)
    leaves, structure = jax.tree.flatten(chain)
    again = jax.tree.unflatten(structure, leaves)
    assert [f.name for f in dataclasses.fields(again)] == ["segments", "angles", "connectors", "loads"]
    np.testing.assert_array_equal(again.connectors, chain.connectors)
