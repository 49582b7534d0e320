"""Claims about derivatives: implicit ones against differences of solutions, and against closed forms."""

import functools
from collections.abc import Iterator

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.silicone import SiliconeLaw

from .claims import Claim
from .silicone import AREA, INERTIA, PUSHED, Linear

STEP = 1e-3  # Relative step of the differences; they are of fourth order, so their own error is about 1e-10
# where the derivative is taken: a bent PneuSMA2, away from every kink (at the source's pre-strain of 0.1924
# the two bounds of the residual strain meet); SI
POINT = {
    "pressure": 30e3,
    "xi0_1": 0.95,
    "xi0_2": 0.45,
    "outer_diameter": 10e-3,
    "wall_thickness": 1e-3,
    "length": 56e-3,
    "wire_diameter": 0.25e-3,
    "prestrain": 0.17,
    "G_m": 3.0e9,
    "G_a": 8.25e9,
    "gamma_L": 0.1013,
    "beta_2": None,
    "silicone_stiffness": 1.0,
}


_ALLOY = ("G_m", "G_a", "gamma_L", "beta_2")
_SIZES = ("outer_diameter", "wall_thickness", "length", "wire_diameter", "prestrain")
# places where a derivative may fail: equal sides, no pressure, fully cold, fully hot
SINGULAR = tuple(
    {"pressure": pressure, "xi0_1": first, "xi0_2": second, "prestrain": 0.1924}
    for pressure, first, second in ((0.0, 1.0, 1.0), (30e3, 1.0, 1.0), (30e3, 1.0, 0.0), (0.0, 0.0, 0.0))
)


@functools.cache
def _slopes() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Derivatives of PneuSMA2's curvature with respect to the parameters of `POINT`.

    Returns:
        Implicit derivatives at the point and differences there, each of shape (parameters,), and implicit
        derivatives at the singular places, shape (places, parameters). One compiled program gives all.
    """
    alloy, silicone = pj.load_alloy("krl35"), pj.load_silicone()
    start = {name: float(getattr(alloy, name)) if value is None else value for name, value in POINT.items()}
    centre = np.array(list(start.values()))
    steps = np.diag(STEP * centre)
    singular = np.array([list((start | changed).values()) for changed in SINGULAR])
    rows = np.concatenate([centre[None], singular, *(centre + k * steps for k in (-2.0, -1.0, 1.0, 2.0))])
    slopes, values = (np.asarray(x) for x in _curvatures(alloy, silicone, pj.layout("pneusma2"), rows))
    far_left, left, right, far_right = values[1 + len(SINGULAR) :].reshape(4, len(start))
    differences = (far_left - 8.0 * left + 8.0 * right - far_right) / (12.0 * STEP * centre)
    return slopes[0], differences, slopes[1 : 1 + len(SINGULAR)]


@stored_jit()
def _curvatures(
    alloy: pj.Alloy, silicone: SiliconeLaw, arrangement: pj.Layout, rows: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """Derivatives of the curvature by the parameters of `POINT`, (rows, parameters), and itself, (rows,)."""

    def curvature(values: jax.Array) -> tuple[jax.Array, jax.Array]:
        given = dict(zip(POINT, values, strict=True))
        geometry = pj.Geometry(**{name: given[name] for name in _SIZES}, attached_length=given["length"])
        own = _with(alloy, _ALLOY, [given[name] for name in _ALLOY])
        law = _with(silicone, ("stiffness",), [given["silicone_stiffness"]])
        body = pj.round_actuator(arrangement, geometry, own, law)
        springs = (pj.MartensiteFraction(given["xi0_1"]), pj.MartensiteFraction(given["xi0_2"]))
        states = (pj.SpringState.fresh(given["prestrain"]),) * 2
        kappa = pj.solve(body, given["pressure"], springs, states, throw=False).curvature
        return kappa, kappa

    return jax.vmap(jax.jacfwd(curvature, has_aux=True))(rows)


@stored_jit()
def _slope_over_pressure(body: pj.Actuator, pressure: jax.Array) -> jax.Array:
    """Derivative of the curvature over pressure [1/(m Pa)]."""
    return jax.grad(lambda p: pj.solve(body, p, throw=False).curvature)(pressure)


def _with(module: eqx.Module, names: tuple[str, ...], values: list) -> eqx.Module:
    """A module with some of its constants replaced."""
    return eqx.tree_at(lambda m: [getattr(m, name) for name in names], module, values)


def claims() -> Iterator[Claim]:
    """All claims about derivatives and precision."""
    group = "derivatives"
    yield Claim("precision", "bits of a number", lambda: (jnp.result_type(float).itemsize * 8, 64))
    for index, name in enumerate(POINT):
        yield Claim(
            group,
            f"of PneuSMA2's curvature with respect to {name}, against differences",
            lambda k=index: (_slopes()[0][k], _slopes()[1][k]),
            1e-6,
        )

    def closed_form() -> tuple:
        radius, length, modulus, pressure = 5e-3, 56e-3, 2e5, 20e3
        body = pj.round_actuator(pj.layout("pneuflex_s"), pj.Geometry(), None, Linear(np.asarray(modulus)))
        slope = _slope_over_pressure(body, np.asarray(pressure))
        # theta = c P, kappa = theta / (L + R theta)
        c = PUSHED * radius * length / (modulus * (INERTIA + AREA * radius**2))
        return slope, c * length / (length + radius * c * pressure) ** 2

    yield Claim(
        group, "of a linear PneuFLEX's curvature over pressure, against its closed form", closed_form, 1e-9
    )
    yield Claim(
        group,
        "of it that are not finite at xi0 = 0 and 1, at equal sides and without pressure",
        lambda: (np.sum(~np.isfinite(_slopes()[2])), 0.0),
        0.0,
    )
