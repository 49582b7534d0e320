"""A chain of four driven to tip poses, and through a lumen."""

import numpy as np
import pytest

from fitting.invert import Inverse, Limits
from fitting.invert.lumen import Lumen, distances, pass_through

LIMITS = Limits((0.0, 50e3), 0.1)


@pytest.fixture(scope="module")
def inverse():
    return Inverse("orthogonal_chain", LIMITS)


@pytest.mark.slow
def test_poses_of_random_drives_are_met(inverse):
    random = np.random.default_rng(5)
    drives = np.column_stack(
        [random.uniform(0.0, 50e3, 30), random.uniform(0.3, 1.0, (30, len(inverse.springs)))]
    )
    pose = np.asarray(inverse.verified(drives).end_pose)
    found = inverse.solve(("tip", "direction"), np.column_stack([pose[:, :3, 3], pose[:, :3, 2]]))
    assert found.met.mean() >= 0.9
    far = inverse.solve(("tip",), np.array([[0.0, 0.0, 0.9]]))
    assert not far.met[0] and "pressure at its highest" in far.held[0]


@pytest.mark.slow
def test_the_chain_follows_a_bent_lumen_clear_of_its_wall(inverse):
    s = np.linspace(0.0, 1.0, 80)
    angle = 0.6 * np.sin(np.pi * s) ** 2
    step = 0.23 / (len(s) - 1)
    slope = np.stack([np.zeros_like(s), np.sin(angle), np.cos(angle)], axis=1)
    points = np.concatenate([np.zeros((1, 3)), np.cumsum(slope[:-1] * step, axis=0)])
    lumen = Lumen("bent", points, np.full(len(points), 18e-3))
    found = pass_through(inverse, lumen)
    assert found.passes and found.offset < 3e-3
    away, room = (np.asarray(x) for x in distances(found.line, (points, lumen.diameter)))
    radius = float(inverse.body.segments[0].section.radius)
    assert np.min(room - away) - radius == pytest.approx(found.clearance, abs=1e-9)
