"""Where measured resistances leave one equilibrium and where several, and which branch a heating follows.

    python notebooks/examples/equilibria_map.py [FIGURE.png]
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

import pneusma_jax as pj

PRESSURES = (20e3, 35e3, 45e3)  # Pa
STATES = 4000  # random pairs of fractions per pressure
SEED = 1


def main(path: str) -> None:
    """Draw the figure."""
    pj.enable_float64()
    body = pj.make_actuator("pneusma2")
    heat = np.linspace(1.0, 0.4, 61)
    figure, axes = plt.subplots(2, len(PRESSURES), figsize=(12.0, 7.5), layout="constrained")
    for column, pressure in enumerate(PRESSURES):
        draws = np.random.default_rng(SEED).uniform(0.0, 1.0, (2, STATES))
        draws[:, ::2] = 1.0 - draws[:, ::2] ** 3  # half of them near the cold end, where there are several
        given = tuple(pj.MartensiteFraction(x) for x in draws)
        states = pj.solve_batch(body, np.full(STATES, pressure), given)
        ohms = [np.asarray(spring.resistance) for spring in states.springs]
        found = pj.solve_batch(body, np.full(STATES, pressure), tuple(pj.Resistance(r) for r in ohms))
        several = np.asarray(found.equilibria) > 1
        way = (pj.MartensiteFraction(np.ones(len(heat))), pj.MartensiteFraction(heat))
        heated = pj.simulate_history(body, np.full(len(heat), pressure), way).rows
        read = [np.asarray(spring.resistance) for spring in heated.springs]

        top, bottom = axes[:, column]
        top.plot(ohms[0][~several], ohms[1][~several], ".", ms=2, color="0.75", label="one equilibrium")
        top.plot(ohms[0][several], ohms[1][several], ".", ms=3, color="C1", label="several")
        top.plot(*read, "C0", lw=2, label="spring 2 is heated")
        top.set(title=f"{1e-3 * pressure:g} kPa", xlabel="resistance 1 [ohm]", ylabel="resistance 2 [ohm]")

        every = [
            pj.solve_all(body, pressure, tuple(pj.Resistance(r[k]) for r in read), _before(heat, k))
            for k in range(0, len(heat), 2)
        ]
        for k, row in zip(range(0, len(heat), 2), every, strict=True):
            curvatures = np.asarray(row.curvature)[: int(row.equilibria[0])]
            bottom.plot(np.full(len(curvatures), 1.0 - heat[k]), curvatures, ".", color="C1", ms=6)
        bottom.plot(1.0 - heat, heated.curvature, "C0", lw=1.5)
        bottom.set(xlabel="heat of spring 2, 1 - xi0 [1]", ylabel="curvature [1/m]")
    axes[0, 0].legend(loc="lower left", fontsize=8)
    axes[1, 0].set_title("line: the heating; dots: all equilibria of its resistances", fontsize=9)
    figure.savefig(path, dpi=130)


def _before(heat: np.ndarray, k: int) -> tuple[pj.SpringState, ...]:
    """What the springs remember before row k: the pre-strain, and the hottest phase so far."""
    return (pj.SpringState.fresh(0.1924), pj.SpringState(np.asarray(0.1924), np.asarray(heat[max(k - 1, 0)])))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "equilibria_map.png")
