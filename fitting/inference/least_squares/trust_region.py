"""The linear algebra of one trust-region step: column scaling, the secular equation, the box."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

PASSES = 3
"""Number of passes that fix the parameters at bounds that a step reaches, and solve again for the others."""


class Linearised(eqx.Module):
    """The residual's linear model at one point, reduced to its triangular factor.

    With J = Q R, `triangle` is R (k, n) and `projected` is Q^T r (k,), k = min(m, n). They hold every part of
    |J p + r| that depends on p. `scale` (n,) is the running maximum of the norms of J's columns, MINPACK's
    metric.
    """

    triangle: Float[Array, "k n"]
    projected: Float[Array, " k"]
    scale: Float[Array, " n"]


class Proposal(eqx.Module):
    """A step (n,), its length in the scaled metric, and its predicted reduction of the cost."""

    step: Float[Array, " n"]
    length: Float[Array, ""]
    reduction: Float[Array, ""]


class Box(eqx.Module):
    """Bounds (n,) on the fitting coordinates; infinite where there is none."""

    lower: Float[Array, " n"]
    upper: Float[Array, " n"]

    def added(self, y: Float[Array, " n"], step: Float[Array, " n"]) -> Float[Array, " n"]:
        """`y + step`, exactly on a bound where it reaches one (the sum could miss it by one ulp)."""
        over, under = step >= self.upper - y, step <= self.lower - y
        return jnp.where(over, self.upper, jnp.where(under, self.lower, y + step))


def linearise(tangent: Callable[[Array], Array], residual: Array, previous_scale: Array) -> Linearised:
    """QR factorisation of the Jacobian of a linearisation.

    Args:
        tangent: Jacobian-vector product at the point.
        residual: residual at the point, shape (m,).
        previous_scale: column norms so far, zero if none, shape (n,).
    """
    jacobian = jax.vmap(tangent, out_axes=1)(jnp.eye(previous_scale.size, dtype=previous_scale.dtype))
    orthogonal, triangle = jnp.linalg.qr(jacobian)
    scale = jnp.maximum(previous_scale, jnp.linalg.norm(jacobian, axis=0))
    return Linearised(triangle, orthogonal.T @ residual, scale)


def damping_for_length(singular: Array, weight: Array, radius: Array) -> Array:
    """Damping t for which the step s w / (s^2 + t) has the length `radius`; zero if it is shorter undamped.

    The method is Newton's iteration on the reciprocal length (Hebden; Moré 1978, section 5). It rises
    monotonically to the root from any point below. Each component alone gives such a point: |s w| / radius -
    s^2. The largest is within a factor sqrt(n) of the root. Four iterations leave less than the tenth that
    MINPACK allows.
    """
    tiny = jnp.finfo(singular.dtype).tiny
    pull = jnp.abs(singular * weight)
    start = jnp.maximum(jnp.max(pull / jnp.maximum(radius, tiny) - singular**2), 0.0)

    def towards(damping, _):
        stiffness = jnp.maximum(singular**2 + damping, tiny)
        parts = pull / stiffness
        length = jnp.linalg.norm(parts)
        slope = jnp.sum(parts**2 / stiffness)
        excess = jnp.maximum(length / jnp.maximum(radius, tiny) - 1.0, 0.0)
        return damping + jnp.where(
            slope > 0, excess * length**2 / jnp.where(slope > 0, slope, 1.0), 0.0
        ), None

    return jax.lax.scan(towards, start, length=4)[0]


def free_to_move(model: Linearised, y: Array, box: Box) -> Bool[Array, " n"]:
    """False for parameters at a bound that the descent would only push further out."""
    gradient = model.triangle.T @ model.projected
    return ~(((y <= box.lower) & (gradient > 0)) | ((y >= box.upper) & (gradient < 0)))


def _solve(model: Linearised, free: Array, target: Array, radius: Array) -> tuple[Array, Array]:
    """Step of the free parameters within the radius that lowers |R p + target| most, and the undamped
    gain."""
    scale = jnp.where(model.scale > 0, model.scale, 1.0)
    left, singular, right = jnp.linalg.svd(jnp.where(free, model.triangle / scale, 0.0), full_matrices=False)
    floor = jnp.finfo(target.dtype).eps * max(model.triangle.shape) * singular[0]
    singular = jnp.where(singular > floor, singular, 0.0)
    weight = jnp.where(singular > 0, left.T @ target, 0.0)
    stiffness = jnp.where(singular > 0, singular**2 + damping_for_length(singular, weight, radius), 1.0)
    return -(right.T @ (singular * weight / stiffness)) / scale, jnp.sum(weight**2)


def undamped(model: Linearised, y: Array, box: Box | None) -> tuple[Array, Array]:
    """Gauss-Newton step of the parameters that are free to move, without regard to other bounds.

    It vanishes where, and only where, y is a minimum within the box. So it measures convergence.

    Returns:
        The step (n,), and the part of the squared residual norm that it removes in the linear model.
    """
    free = jnp.ones(y.shape, bool) if box is None else free_to_move(model, y, box)
    return _solve(model, free, model.projected, jnp.asarray(jnp.inf, y.dtype))


def propose(model: Linearised, y: Array, radius: Array, box: Box | None) -> Proposal:
    """Minimise the linear model of the cost within `radius` of y (scaled metric) and inside the box.

    Inside a box the problem is a small quadratic program. A step that leaves it is cut at the bounds that it
    crosses. It is solved again for the others, `PASSES` times; any remaining excess is cut. If such a step
    predicts no decrease, the search refuses it. A shorter one tends to the projected gradient, which
    descends.

    Args:
        model: the linearised residual at y.
        y: current point, shape (n,).
        radius: maximum length of the step.
        box: bounds, or None for none.
    """
    pinned = jnp.zeros_like(y)
    free = jnp.ones(y.shape, bool) if box is None else free_to_move(model, y, box)
    for _ in range(1 if box is None else PASSES):
        remaining = jnp.sqrt(jnp.maximum(radius**2 - jnp.sum((model.scale * pinned) ** 2), 0.0))
        wanted, _ = _solve(model, free, model.projected + model.triangle @ pinned, remaining)
        wanted = jnp.where(free, wanted, pinned)
        step = wanted if box is None else jnp.clip(wanted, box.lower - y, box.upper - y)
        free = free & (step == wanted)
        pinned = jnp.where(free, 0.0, step)
    change = model.triangle @ step
    reduction = -jnp.dot(model.projected, change) - 0.5 * jnp.dot(change, change)
    return Proposal(step, jnp.linalg.norm(model.scale * step), reduction)
