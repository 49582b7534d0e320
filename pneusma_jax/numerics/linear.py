"""Linear solves of one to three unknowns by the adjugate.

An equilibrium has at most three unknowns. In a batch, a LAPACK factorisation of so small a matrix costs more
than the whole residual. The closed formula is a few multiplications that vectorise over the batch.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float


def solve_small(matrix: Float[Array, "n n"], vector: Float[Array, "n"]) -> Float[Array, "n"]:
    """Solution of `matrix @ x = vector` for n of 1, 2 or 3; infinite or NaN where the matrix is singular."""
    n = matrix.shape[-1]
    if n == 1:
        return vector / matrix[0, 0]
    if n == 2:
        (a, b), (c, d) = matrix
        x, y = vector
        return jnp.stack([d * x - b * y, a * y - c * x]) / (a * d - b * c)
    if n == 3:
        rows = [jnp.cross(matrix[:, (i + 1) % 3], matrix[:, (i + 2) % 3]) for i in range(3)]
        return jnp.stack([row @ vector for row in rows]) / (matrix[:, 0] @ rows[0])
    raise ValueError(f"Argument `matrix` must have 1 to 3 rows, but it has {n}.")


def determinant(matrix: Array) -> Array:
    """Determinant of one to three rows, over trailing axes; of NumPy or JAX, as the matrix is."""
    count = matrix.shape[0]
    if count == 1:
        return matrix[0, 0]
    if count == 2:
        return matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    minors = [
        matrix[1, (k + 1) % 3] * matrix[2, (k + 2) % 3] - matrix[1, (k + 2) % 3] * matrix[2, (k + 1) % 3]
        for k in range(3)
    ]
    return matrix[0, 0] * minors[0] + matrix[0, 1] * minors[1] + matrix[0, 2] * minors[2]
