"""Cases that `core_speed` measures, and their rows.

Every case is a function of a number of rows or segments that returns what is timed. All use PneuSMA2
and the same random rows. Pressures from 0 to 50 kPa and both martensite fractions from 0 to 1 are uniform.
Resistances are those that the model has there.
"""

import dataclasses
from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.optimize import minimize, root

import pneusma_jax as pj
from benchmarks import numpy_models
from pneusma_jax.actuator.balance import Problem, residual
from pneusma_jax.actuator.equilibrium import BLOCK

SEED = 35
FLOOR_ROWS = 10_000
PULSE = 0.1
"""Interval between rows of a history driven by current [s], a tenth of the wire's time constant."""

Call = Callable[[], object]


@dataclasses.dataclass(frozen=True)
class Rows:
    """Random rows, and one history.

    Attributes:
        pressure: [Pa], shape (rows,).
        xi0, resistance: of both springs [1, ohm], shape (rows, 2).
        unknowns: scaled configuration of the solution [1], shape (rows, 2).
        curvature: of the solution [1/m], shape (rows,).
        history_pressure, history_xi0, history_resistance: the same of a history [Pa, 1, ohm].
    """

    pressure: np.ndarray
    xi0: np.ndarray
    resistance: np.ndarray
    unknowns: np.ndarray
    curvature: np.ndarray
    history_pressure: np.ndarray
    history_xi0: np.ndarray
    history_resistance: np.ndarray

    def phases(self, n: int) -> tuple:
        """Activations of the first rows by their phases."""
        return tuple(pj.MartensiteFraction(self.xi0[:n, k]) for k in range(2))

    def resistances(self, n: int) -> tuple:
        """Activations of the first rows by their resistances."""
        return tuple(pj.Resistance(self.resistance[:n, k]) for k in range(2))


def prepared(rows: int, history: int) -> Rows:
    """Rows and a history solved by phase, so that their resistances are consistent."""
    actuator, random = pj.make_actuator("pneusma2"), np.random.default_rng(SEED)
    pressure, xi0 = random.uniform(0.0, 50e3, rows), random.uniform(0.0, 1.0, (rows, 2))
    phases = tuple(pj.MartensiteFraction(xi0[:, k]) for k in range(2))
    found = pj.solve_batch(actuator, pressure, phases)
    good = np.asarray(found.converged)
    if not good.all():
        raise RuntimeError(f"{np.sum(~good)} of {rows} rows by phase have no equilibrium.")
    turn = np.linspace(0.0, 4.0 * np.pi, history)
    p, warm = 25e3 - 15e3 * np.cos(turn), 0.5 + 0.5 * np.cos(0.5 * turn)
    cycle = pj.simulate_history(
        actuator, p, (pj.MartensiteFraction(warm), pj.MartensiteFraction(np.ones(history)))
    )
    ohm = lambda found: np.stack([np.asarray(s.resistance) for s in found.springs], axis=1)  # noqa: E731
    return Rows(
        pressure, xi0, ohm(found), np.asarray(found.unknowns), np.asarray(found.curvature),
        p, np.stack([warm, np.ones(history)], axis=1), ohm(cycle.rows),
    )  # fmt: skip


def wait(result: object) -> object:
    """The result, once it is there."""
    return jax.block_until_ready(eqx.filter(result, eqx.is_array))


# --- one evaluation -------------------------------------------------------------------------------------


@eqx.filter_jit
def _residuals(actuator: pj.Actuator, rows: tuple, block: int) -> jax.Array:
    return jax.lax.map(lambda row: _residual(actuator, row, row[2]), rows, batch_size=block)


@eqx.filter_jit
def _floor(actuator: pj.Actuator, rows: tuple, block: int) -> tuple:
    def one(row: tuple) -> tuple:
        def twice(z: jax.Array) -> tuple:
            value = _residual(actuator, row, z)
            return value, value

        slope, value = jax.jacfwd(twice, has_aux=True)(row[2])
        return value, slope

    return jax.lax.map(one, rows, batch_size=block)


def _residual(actuator: pj.Actuator, row: tuple, z: jax.Array) -> jax.Array:
    pressure, xi0, _ = row
    phases = tuple(pj.MartensiteFraction(xi0[k]) for k in range(2))
    return residual(z, Problem(actuator, pressure, phases, actuator.fresh_states()), 1)


def evaluation(data: Rows, function: Callable) -> Callable[[int], Call]:
    """Balance of all rows at their solutions."""
    actuator = pj.make_actuator("pneusma2")

    def prepare(n: int) -> Call:
        rows = jax.tree.map(jnp.asarray, (data.pressure[:n], data.xi0[:n], data.unknowns[:n]))
        return lambda: function(actuator, rows, min(BLOCK, n))

    return prepare


def residual_alone(data: Rows) -> Callable[[int], Call]:
    return evaluation(data, _residuals)


def floor(data: Rows) -> Callable[[int], Call]:
    return evaluation(data, _floor)


# --- batches and their gradients ------------------------------------------------------------------------


def by_phase(data: Rows) -> Callable[[int], Call]:
    actuator = pj.make_actuator("pneusma2")
    return lambda n: lambda: pj.solve_batch(actuator, data.pressure[:n], data.phases(n))


def by_resistance(data: Rows) -> Callable[[int], Call]:
    actuator = pj.make_actuator("pneusma2")
    return lambda n: lambda: pj.solve_batch(actuator, data.pressure[:n], data.resistances(n))


def _summed(actuator: pj.Actuator, pressure: jax.Array, activations: tuple) -> jax.Array:
    return jnp.nansum(pj.solve_batch(actuator, pressure, activations).curvature)


@eqx.filter_jit
def _by_inputs(actuator: pj.Actuator, pressure: jax.Array, activations: tuple) -> tuple:
    return eqx.filter_grad(lambda given: _summed(actuator, *given))((pressure, activations))


@eqx.filter_jit
def _by_numbers(actuator: pj.Actuator, pressure: jax.Array, activations: tuple) -> pj.Actuator:
    return eqx.filter_grad(_summed)(actuator, pressure, activations)


def gradient(function: Callable, drive: str) -> Callable[[Rows], Callable[[int], Call]]:
    def of(data: Rows) -> Callable[[int], Call]:
        actuator = pj.make_actuator("pneusma2")

        def prepare(n: int) -> Call:
            given = jax.tree.map(jnp.asarray, (data.pressure[:n], getattr(data, drive)(n)))
            return lambda: function(actuator, *given)

        return prepare

    return of


def reverse(by_numbers: bool) -> Callable[[Rows], Callable[[int], Call]]:
    """Reverse derivatives of curvature outside of `jax.jit`, from given ones of bend and length."""

    def of(data: Rows) -> Callable[[int], Call]:
        actuator = pj.make_actuator("pneusma2")

        def shape(actuator: pj.Actuator, pressure: jax.Array, activations: tuple) -> tuple:
            found = pj.solve_batch(actuator, pressure, activations)
            return found.bend, found.length

        def prepare(n: int) -> Call:
            given = jax.device_put((data.pressure[:n], data.phases(n)))
            weights = jax.device_put((np.broadcast_to([0.0, 1.0], (n, 2)), np.ones(n)))

            def call() -> tuple:
                if by_numbers:
                    return eqx.filter_vjp(lambda body: shape(body, *given), actuator)[1](weights)
                return eqx.filter_vjp(lambda inputs: shape(actuator, *inputs), given)[1](weights)

            return call

        return prepare

    return of


# --- histories ------------------------------------------------------------------------------------------


def history(drive: str) -> Callable[[Rows], Callable[[int], Call]]:
    """The same course in any number of rows: two turns of pressure while spring 1 heats and cools."""

    def of(data: Rows) -> Callable[[int], Call]:
        actuator = pj.make_actuator("pneusma2")
        length = len(data.history_pressure)

        def prepare(n: int) -> Call:
            if drive == "current":
                turn = np.linspace(0.0, 4.0 * np.pi * n / FLOOR_ROWS, n)
                heated = pj.Heating(0.25 * (1.0 - np.cos(0.5 * turn)))
                given = (heated, pj.Heating(np.zeros(n)))
                pressure = 25e3 - 15e3 * np.cos(turn)
                return lambda: pj.simulate_history(actuator, pressure, given, time=PULSE * np.arange(n))
            kept = np.linspace(0, length - 1, n).astype(int)
            kind, values = {
                "phase": (pj.MartensiteFraction, data.history_xi0),
                "resistance": (pj.Resistance, data.history_resistance),
            }[drive]
            given = tuple(kind(values[kept, k]) for k in range(2))
            return lambda: pj.simulate_history(actuator, data.history_pressure[kept], given)

        return prepare

    return of


def coupon(data: Rows) -> Callable[[int], Call]:
    law = pj.load_silicone()
    return lambda n: lambda: pj.simulate_coupon(law, 0.5 - 0.5 * np.cos(np.linspace(0.0, 6.0, n)))


def tube(data: Rows) -> Callable[[int], Call]:
    body = pj.make_tube(pj.Geometry(), pj.load_silicone())
    return lambda n: lambda: pj.simulate_tube(body, np.linspace(0.0, 30e3, n))


def wire(data: Rows) -> Callable[[int], Call]:
    specimen = pj.load_wire()

    def prepare(n: int) -> Call:
        temperature = 50.0 + 40.0 * np.cos(np.linspace(0.0, 4.0 * np.pi, n))
        return lambda: pj.simulate_wire(specimen, stress=jnp.asarray(150e6), temperature=temperature)

    return prepare


def spring(data: Rows) -> Callable[[int], Call]:
    dimensions = pj.SpringGeometry(0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3)
    specimen = pj.Spring(dimensions, pj.load_alloy("krl35"), 14e-3)
    warm = pj.MartensiteFraction(0.6)
    return lambda n: lambda: pj.simulate_spring(
        specimen, 20e-3 - 20e-3 * np.cos(np.linspace(0.0, 4.0 * np.pi, n)), warm
    )


# --- chains ---------------------------------------------------------------------------------------------


def chain(loaded: bool) -> Callable[[Rows], Callable[[int], Call]]:
    """Segments in series that are all alike, one spring of each warm; under weight and a tip force or not."""

    def of(data: Rows) -> Callable[[int], Call]:
        actuator = pj.make_actuator("pneusma2")

        def prepare(n: int) -> Call:
            segments = pj.chain_of(actuator, n)
            if loaded:
                heavy = pj.chain_weight(segments.segments, 1070.0, pj.gravity_vector("horizontal"))
                segments = segments.with_loads(heavy, pj.PointLoad([0.0, 1e-3, 0.0]))
            drive = ((pj.MartensiteFraction(0.6), pj.MartensiteFraction(1.0)),) * n
            return lambda: pj.solve_chain(segments, 10e3, drive)

        return prepare

    return of


# --- other methods --------------------------------------------------------------------------------------

NOMINAL = (1.0, 1e-3)
"""Scale of the silicone's stress [1] and wall [m] of PneuSMA2 in `numpy_models`."""


def numpy_rows(data: Rows, n: int, one: Callable) -> np.ndarray:
    """Curvature [1/m] of rows solved one after the other, each from the source's first trial."""
    found = np.empty(n)
    first = np.array([0.0, 0.5 * numpy_models.FIRST_BEND])
    for k in range(n):
        z = one(first, (*NOMINAL, {}, data.pressure[k], *data.xi0[k]))
        found[k] = z[1] / numpy_models.OUTER / (1.0 + z[0]) if z is not None else np.nan
    return found


def hybrid(first: np.ndarray, arguments: tuple) -> np.ndarray | None:
    found = root(numpy_models.balance, first, arguments, method="hybr", tol=1e-10)
    return found.x if found.success else None


def simplex(first: np.ndarray, arguments: tuple) -> np.ndarray | None:
    size = lambda z: np.sum(numpy_models.balance(z, *arguments) ** 2)  # noqa: E731
    ends = {"xatol": 1e-10, "fatol": 1e-20, "maxiter": 2000, "maxfev": 4000}
    found = minimize(size, first, method="Nelder-Mead", options=ends)
    return found.x if found.success else None


def scipy_root(data: Rows) -> Callable[[int], Call]:
    return lambda n: lambda: numpy_rows(data, n, hybrid)


def nelder_mead(data: Rows) -> Callable[[int], Call]:
    return lambda n: lambda: numpy_rows(data, n, simplex)


# --- all of them ----------------------------------------------------------------------------------------


BESIDE = {
    "resistance": "phase", "inputs": "phase", "numbers": "phase", "inputs_resistance": "resistance",
    "known_inputs": "phase", "known_numbers": "phase",
    "history": "phase", "history_resistance": "resistance",
}  # fmt: skip
"""Cases that are timed in turn with another one, at the same number of rows."""
CASES: dict[str, Callable[[Rows], Callable[[int], Call]]] = {
    "residual": residual_alone,
    "floor": floor,
    "phase": by_phase,
    "resistance": by_resistance,
    "current": history("current"),
    "inputs": gradient(_by_inputs, "phases"),
    "numbers": gradient(_by_numbers, "phases"),
    "inputs_resistance": gradient(_by_inputs, "resistances"),
    "known_inputs": reverse(by_numbers=False),
    "known_numbers": reverse(by_numbers=True),
    "history": history("phase"),
    "history_resistance": history("resistance"),
    "chain": chain(False),
    "loaded_chain": chain(True),
    "coupon": coupon,
    "tube": tube,
    "wire": wire,
    "spring": spring,
    "scipy_root": scipy_root,
    "nelder_mead": nelder_mead,
}
