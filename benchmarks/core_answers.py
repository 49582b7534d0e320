"""Whether the core's answers are right, on states whose truth is known.

    python -m benchmarks.core_answers [round-trip|states|readings|hessian ...] [--seed N]

`round-trip` feeds the resistances of simulated thermal cycles back. `states` does so for single states.
`readings` adds noise to resistances and curvature, and predicts curvature as `pneusma simulate RECORDING`
does. `hessian` compares second derivatives with differences of first ones. Times are of the
processor. Chains are compared with a boundary-value problem by `tests/pneusma_jax/test_loaded_chains.py`.
"""

import argparse
import time

import jax
import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.simulate.recording import _denoised_history

WRONG = 0.01
"""Difference of curvature [1/m] from which a row counts as off."""
DESIGNS = ("pneusma1", "pneusma2", "triad")
EVERY_DESIGN = (*DESIGNS, "pneuflex_s", "pneuflex_t", "pneuflex_w")
PRESSURES = np.linspace(2.5e3, 50e3, 20)  # Pa
ROWS, STATES, RECORDINGS, LENGTH = 61, 20_000, 50, 128


def measured(found: pj.Equilibrium) -> tuple[pj.Resistance, ...]:
    """Resistances of solved rows as activations."""
    return tuple(pj.Resistance(np.asarray(spring.resistance)) for spring in found.springs)


def differences(found: pj.Equilibrium, true: pj.Equilibrium) -> np.ndarray:
    """Distance of curvature vectors [1/m]; infinite for a row without a result."""
    bent = [np.asarray(x.bend) / np.asarray(x.length)[:, None] for x in (found, true)]
    off = np.linalg.norm(bent[0] - bent[1], axis=1)
    return np.where(np.isfinite(off), off, np.inf)


def told(what: str, found: pj.Equilibrium, true: pj.Equilibrium) -> np.ndarray:
    """Number of rows, of failed, off, said to be several, and silently wrong ones; printed."""
    status, off = np.asarray(found.status), differences(found, true) > WRONG
    failed, several = ~np.asarray(found.converged), status == pj.Status.several_equilibria
    counts = np.array([len(off), failed.sum(), off.sum(), several.sum(), (off & ~several & ~failed).sum()])
    print(f"{what:22}" + "".join(f"{n:>9}" for n in counts), flush=True)
    return counts


def round_trip(seed: int) -> None:
    """Thermal cycles of three designs at 20 pressures, noise-free."""
    print(f"{'round trip':22}     rows   failed      off  several   silent")
    heat = np.interp(np.linspace(0.0, 1.0, ROWS), [0.0, 0.05, 0.45, 0.55, 0.95, 1.0], [1, 1, 0.4, 0.4, 1, 1])
    total = np.zeros(5, int)
    for design in DESIGNS:
        body = pj.make_actuator(design)
        given = tuple(pj.MartensiteFraction(x) for x in [*np.ones((len(body.springs) - 1, ROWS)), heat])
        for pressure in PRESSURES:
            true = pj.simulate_history(body, np.full(ROWS, pressure), given).rows
            back = pj.simulate_history(body, np.full(ROWS, pressure), measured(true)).rows
            total += told(f"  {design} {pressure / 1e3:.1f} kPa", back, true)
    print(f"{'all':22}" + "".join(f"{n:>9}" for n in total))


def states(seed: int) -> None:
    """Uniform states of PneuSMA2, and states crowded towards full heat, by resistance."""
    print(f"{'states':22}     rows   failed      off  several   silent")
    body, random = pj.make_actuator("pneusma2"), np.random.default_rng(seed)
    for name, power in (("  uniform", 1.0), ("  crowded towards hot", 3.0)):
        pressure, xi0 = random.uniform(0.0, 50e3, STATES), random.uniform(0.0, 1.0, (2, STATES)) ** power
        true = pj.solve_batch(body, pressure, tuple(map(pj.MartensiteFraction, xi0)))
        told(name, pj.solve_batch(body, pressure, measured(true)), true)


def noisy_recording(seed: int, k: int) -> tuple:
    """A recording of springs heated in turn, or one alone, at 5 to 50 kPa.

    Returns:
        Actuator, times [s], pressures [Pa], its true equilibria, resistances with noise, curvature with noise
        [1/m], and the noise of resistances [ohm] and of curvature [1/m].
    """
    random = np.random.default_rng(1000 * seed + k)
    body = pj.make_actuator(("pneusma1", "pneusma2")[k % 2])
    springs = len(body.springs)
    t, pressure = np.arange(float(LENGTH)), np.full(LENGTH, random.uniform(5e3, 50e3))
    heat = np.zeros((springs, LENGTH))
    for n in range(springs if random.uniform() < 0.5 else 1):
        begin = LENGTH * n // springs
        place = [begin + 5, begin + 0.4 * LENGTH / springs, begin + 0.6 * LENGTH / springs,
                 begin + 0.95 * LENGTH / springs]  # fmt: skip
        heat[-1 - n] = np.interp(t, place, [0.0, 1.0, 1.0, 0.0]) * random.uniform(0.2, 0.9)
    true = pj.simulate_history(body, pressure, tuple(pj.MartensiteFraction(1.0 - h) for h in heat)).rows
    ohm, camera = 10.0 ** random.uniform(-5.0, np.log10(5e-4)), random.uniform(0.1, 0.4)

    def noisy(x: jax.Array, noise: float) -> np.ndarray:
        return np.asarray(x) + random.normal(0.0, noise, LENGTH)

    read = [pj.Resistance(noisy(spring.resistance, ohm)) for spring in true.springs]
    return body, t, pressure, true, read, noisy(true.curvature, camera), ohm, camera


def readings(seed: int) -> None:
    """Recordings of two designs at 5 to 50 kPa, springs heated in turn or one alone, with noise."""
    misfits = []
    for k in range(RECORDINGS):
        body, t, pressure, _, read, seen, ohm, camera = noisy_recording(seed, k)
        back, _ = _denoised_history(body, t, pressure, read, body.fresh_states())
        misfits.append(float(np.sqrt(np.mean((np.asarray(back.curvature) - seen) ** 2)) / camera))
        print(f"  {k:3d} {pressure[0] / 1e3:5.1f} kPa {1e3 * ohm:6.3f} mohm {misfits[-1]:7.3f}", flush=True)
    good = sum(misfit <= 1.2 for misfit in misfits)
    print(f"curvature rmse over noise: {good} of {len(misfits)} within 1.2, worst {max(misfits):.2f}")


def hessian(seed: int) -> None:
    """Second derivatives of every design by pressure and fractions, one row and rows together."""
    print("second derivatives less differences: largest error of an entry, of itself and of the largest one")
    for design in EVERY_DESIGN:
        body = pj.make_actuator(design)
        warm = (0.83, 0.91, 0.95)[: len(body.springs)]
        at, scale = jnp.asarray([1.7, *warm]), jnp.asarray([1e4, *[1.0] * len(warm)])

        def one(q: jax.Array, body: pj.Actuator = body, scale: jax.Array = scale) -> jax.Array:
            q = q * scale
            found = pj.solve(body, q[0], tuple(map(pj.MartensiteFraction, q[1:])), throw=False)
            return found.bend[0] + 2.0 * found.bend[1] + 100.0 * found.delta_centre

        def many(q: jax.Array, body: pj.Actuator = body, scale: jax.Array = scale) -> jax.Array:
            q = (q * scale)[:, None]
            found = pj.solve_batch(body, q[0], tuple(map(pj.MartensiteFraction, q[1:])))
            return (found.bend[:, 0] + 2.0 * found.bend[:, 1] + 100.0 * found.delta_centre)[0]

        for name, f in (("solve", one), ("solve_batch", many)):
            began = time.process_time()
            slope, second = jax.jit(jax.grad(f)), np.asarray(jax.jit(jax.hessian(f))(at))
            near, far = (
                np.stack([(slope(at + h) - slope(at - h)) / (2.0 * size) for h in size * np.eye(len(at))])
                for size in (1e-4, 2e-4)
            )
            wanted = (4.0 * near - far) / 3.0
            error, most = np.abs(second - wanted), np.abs(wanted).max()
            own = np.max(error[np.abs(wanted) > 1e-6 * most] / np.abs(wanted)[np.abs(wanted) > 1e-6 * most])
            spent = time.process_time() - began
            print(f"  {design:11} {name:12} {own:8.1e} {error.max() / most:8.1e}  {spent:5.1f} s", flush=True)


CHECKS = {"round-trip": round_trip, "states": states, "readings": readings, "hessian": hessian}


def main() -> None:
    """Run the checks that are named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("checks", nargs="*", metavar="CHECK")
    parser.add_argument("--seed", type=int, default=35)
    given = parser.parse_args()
    pj.enable_float64()
    for name in given.checks or CHECKS:
        began = time.process_time()
        CHECKS[name](given.seed)
        print(f"{name}: {time.process_time() - began:.0f} s\n", flush=True)


if __name__ == "__main__":
    main()
