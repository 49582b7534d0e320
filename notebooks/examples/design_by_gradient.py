"""Design by gradient: which wall thickness and how many coils give a wanted curvature at a pressure?

Spring 2 of a PneuSMA2 is heated to a martensite fraction of 0.3 at 30 kPa. Wanted is a curvature of 50 1/m
without any change of length (56 mm), two conditions for two dimensions. The gradient goes through the
equilibrium, so an off-the-shelf least-squares solver finds the design in a few steps.

    python notebooks/examples/design_by_gradient.py --curvature 50
"""

import argparse

import jax
import jax.numpy as jnp
import optimistix as optx

import pneusma_jax as pj

PITCH = (
    0.269e-3  # m, of the unstretched spring: more coils make a longer spring, stretched less when attached
)


def equilibrium(thickness, coils):
    """PneuSMA2 of a wall thickness [m] and a number of coils at 30 kPa, spring 2 hot."""
    sizes = dict(wall_thickness=thickness, active_coils=coils, free_length=coils * PITCH)
    body = pj.make_actuator("pneusma2", **sizes)
    return pj.solve(body, 30e3, (pj.MartensiteFraction(1.0), pj.MartensiteFraction(0.3)), throw=False)


def miss(scales, wanted):
    """Relative distance from the wanted curvature and length; NaN where there is no equilibrium."""
    found = equilibrium(*dimensions(scales))
    return jnp.stack([found.curvature / wanted[0] - 1.0, found.length / wanted[1] - 1.0])


def dimensions(scales):
    """Wall thickness [m] and number of coils: positive whatever the solver tries."""
    return jnp.exp(scales) * jnp.asarray([1e-3, 52.0])


def main(arguments=None):
    """Run the example; returns the wall thickness [m] and the number of coils."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--curvature", type=float, default=50.0, help="wanted curvature [1/m]")
    options = parser.parse_args(arguments)
    pj.enable_float64()
    wanted, usual = jnp.asarray([options.curvature, 56e-3]), jnp.zeros(2)

    # how good the usual design is, and which way it gets better
    loss, slope = jax.jit(jax.value_and_grad(lambda x: jnp.sum(miss(x, wanted) ** 2)))(usual)
    print(f"usual design: loss {loss:.4g}; slope over ln(wall), ln(coils): {slope[0]:+.4g}, {slope[1]:+.4g}")

    # Levenberg-Marquardt on the two misses, with exact derivatives
    solver = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-10)
    answer = optx.least_squares(miss, solver, usual, wanted, max_steps=100, throw=False)
    thickness, coils = dimensions(answer.value)
    worst = float(jnp.max(jnp.abs(miss(answer.value, wanted))))
    if not worst < 1e-6:
        raise SystemExit(f"No such design was found: the best one misses by {worst:.1%}.")
    print(f"after {answer.stats['num_steps']} steps: wall {thickness * 1e3:.4f} mm, {coils:.2f} coils")

    # verified by solving anew, also for the nearest that can be made: whole coils, tenths of a millimetre
    made = (jnp.round(thickness, 4), jnp.round(coils))
    for label, design in (("as found", (thickness, coils)), ("as made", made)):
        found = equilibrium(*design)
        words = pj.Status(int(found.status)).sentence
        print(f"{label}: {found.curvature:.4f} 1/m at {found.length * 1e3:.4f} mm. {words}")
    return float(thickness), float(coils)


if __name__ == "__main__":
    main()
