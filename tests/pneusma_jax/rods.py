"""An elastic rod solved without the package: it bends and stretches, does not shear and does not twist."""

import numpy as np
from scipy.integrate import solve_bvp
from scipy.spatial.transform import Rotation


def rod(
    length, bending, stretching, force=(0, 0, 0), moment=(0, 0, 0), per_length=(0, 0, 0), nodes=41, tol=1e-9
):
    """Tip of a clamped rod under loads that keep their direction: its place [m] and its rotation matrix.

    Place, quaternion and moment over the rest length; the moment about the tangent only turns the section, which is
    held (no twist). Loads are brought on in steps, so that the solver finds the branch connected with rest.

    Args:
        length: at rest, along z [m].
        bending: stiffness about the section's x and y [N m2].
        stretching: stiffness [N].
        force, moment: on the tip [N, N m]; per_length: along the rod, per rest length [N/m].
    """
    force, moment, per_length = (np.asarray(x, dtype=float) for x in (force, moment, per_length))

    def frames(q):
        w, x, y, z = q
        return np.array([
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ])  # fmt: skip

    def slopes(share):
        def of(s, state):
            q, m = state[3:7], state[7:10]
            turn = frames(q)
            n = share * (force[:, None] + per_length[:, None] * (length - s))
            tangent = turn[:, 2]
            ahead = tangent * (1.0 + np.einsum("is,is->s", n, tangent) / stretching)
            inside = np.einsum("jis,js->is", turn, m)
            kx, ky = inside[0] / bending[0], inside[1] / bending[1]
            w, x, y, z = q
            dq = 0.5 * np.array([-x * kx - y * ky, w * kx - z * ky, w * ky + z * kx, x * ky - y * kx])
            return np.concatenate([ahead, dq, -np.cross(ahead, n, axis=0)])

        return of

    def ends(share):
        clamp = np.array([0, 0, 0, 1, 0, 0, 0.0])
        return lambda a, b: np.concatenate([a[:7] - clamp, b[7:] - share * moment])

    s = np.linspace(0.0, length, nodes)
    state = np.zeros((10, nodes))
    state[2], state[3] = s, 1.0
    for share in np.linspace(0.1, 1.0, 10):
        exact = tol if share == 1.0 else 1e-3
        found = solve_bvp(slopes(share), ends(share), s, state, tol=exact, max_nodes=20000)
        assert found.success, found.message
        s, state = found.x, found.y
    return state[:3, -1], Rotation.from_quat(state[[4, 5, 6, 3], -1]).as_matrix()
