"""Choice of the sampler by a short pilot run.

The choice counts evaluations instead of seconds, so that the same data and seed give the same choice on every
machine.

First emcee runs. The pilot estimates its autocorrelation time, and so the evaluations until the chains are
long enough. If those are few, emcee continues from the pilot. It also continues where draws about the fit
are a share of its steps: they are independent at one evaluation each. With them, an open alloy (22
constants) had 6,351 effective samples after 7 minutes of one core. Gradients had 172 after 12 minutes, 69
of them a draw.

Otherwise the gradient is tested along segments through the pilot's points: Simpson's rule over the slope
must give the change of the log-density. If it does, chains that follow gradients take over. If not, the
posterior has kinks or steps, and emcee stays.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.inference.numbers import number
from pneusma_jax.errors import counted

from .chart import PROBES, choose_chart
from .convergence import BURN_LENGTHS, LENGTHS, assess
from .ensembles import Ensembles
from .laplace import Laplace, start_spread
from .settings import Settings
from .target import LogDensity, Target
from .unbounded import WhitenedMaps

STEPS = 200
"""Number of steps of the pilot. Autocorrelation times above some 20 steps are then underestimated, which
favours emcee. They are therefore at least `2 / moving - 1`, as if each accepted step were an independent
draw. In a bent valley of ten constants the estimate is 16 steps, this bound 32 and the truth 1,500."""
LATE = 50
"""Number of last steps of the pilot that tell how often walkers move. Before, they have not spread."""
SAID = 20
"""Number of steps of the pilot between two words on its progress."""
GRADIENTS = 8
"""Number of gradients of one draw (measured in whitened coordinates: 3 to 7 in 1 to 5 dimensions)."""
DRAWS = 600
"""Number of draws of each chain until 1,000 effective samples are there (measured: 300 to 900)."""
COST = 3.0
"""Factor of a gradient's cost on that of an evaluation within a batch (measured: 1.7 for wires, 2.3 for
tubes)."""
GAIN = 2.0
"""Minimum factor by which gradients must be cheaper. It pays for the compilation of another program."""
SEGMENTS = 8
"""Number of segments on which the gradient is tested."""
LENGTH = 0.5
"""Length of a segment in standard deviations; a trajectory's step is about as long."""
ERROR = 0.1
"""Maximum error of the integrated slope on a smooth segment, in nats. Acceptance then suffers by less than a
tenth."""
SMOOTH = 7
"""Minimum number of smooth segments."""


@dataclass(frozen=True)
class Choice:
    """Result of the pilot.

    Attributes:
        settings: settings with the sampler decided.
        why: reason, one sentence.
        chains: chains of the pilot to continue; None where another sampler was chosen.
    """

    settings: Settings
    why: str
    chains: Ensembles | None


def pilot(
    target: Target, found: Laplace, settings: Settings, tell: Callable[[str], None] = lambda _: None
) -> Choice:
    """Choose between emcee and chains that follow gradients.

    Args:
        target: target to sample.
        found: Laplace approximation of the target.
        settings: resolved settings, with sampler "auto".
        tell: called with a word for each step that begins.

    Raises:
        InputError: if no usable starting points are found.
    """
    own = replace(settings, sampler="emcee")
    ensembles = Ensembles(target, own)
    tell("starting points")
    ensembles.begin(found)
    steps = min(STEPS, settings.max_steps)
    for done in range(0, steps, SAID):
        tell(f"a pilot of emcee, {done} of {counted(steps, 'step')}")
        ensembles.advance(min(SAID, steps - done))
    tau = float(np.max(assess(ensembles.judged).tau))
    tau = max(tau if np.isfinite(tau) else STEPS, 2.0 / _moving(ensembles) - 1.0)
    lengths = (LENGTHS + BURN_LENGTHS) * tau
    emcee = lengths * settings.walkers * settings.ensembles
    nuts = COST * GRADIENTS * settings.ensembles * (settings.warm_up + DRAWS)
    if emcee < GAIN * nuts:
        why = f"emcee: a pilot expects it to converge after some {number(emcee, '.1g')} evaluations."
        return Choice(own, why, ensembles)
    if ensembles.share_about_the_fit > 0:
        why = (
            "emcee: in a pilot draws about the fit are accepted, so that its walkers need not follow the "
            "posterior step by step, as chains that follow gradients do."
        )
        return Choice(own, why, ensembles)
    tell("slopes of the log-density, for chains that would follow them")
    smooth = _smooth_segments(target, found, ensembles.coordinates[:, -1].reshape(-1, target.dimension), own)
    if smooth < SMOOTH:
        why = (
            f"emcee: the log-density has kinks or steps (its slope explains its changes on {smooth} of "
            f"{SEGMENTS} segments), so that chains cannot follow gradients."
        )
        return Choice(own, why, ensembles)
    why = (
        f"nuts: the posterior is smooth, and a pilot of emcee expects {emcee:.1g} evaluations or more, "
        f"against the worth of {nuts:.1g} with gradients."
    )
    return Choice(replace(settings, sampler="nuts"), why, None)


def _moving(ensembles: Ensembles) -> float:
    """Share of walkers that moved in a late step of the pilot."""
    moved = np.any(np.diff(ensembles.coordinates[:, -LATE:], axis=1) != 0.0, axis=-1)
    return max(float(np.mean(moved)), 1.0 / STEPS)


def _smooth_segments(
    target: Target, found: Laplace, points: Float[np.ndarray, "m n"], settings: Settings
) -> int:
    """Number of segments on which Simpson's rule over the slope gives the change of the log-density."""
    density = LogDensity(target, PROBES)
    chart = choose_chart(target, found, start_spread(target, found), density, settings.seed)
    maps = WhitenedMaps.around(target, found, chart, settings.seed)
    random = np.random.default_rng(settings.seed)
    chosen = points[random.choice(len(points), SEGMENTS, replace=len(points) < SEGMENTS)]
    ways = random.standard_normal((SEGMENTS, target.dimension))
    ways *= LENGTH / np.linalg.norm(ways, axis=1, keepdims=True)
    starts = np.stack([maps.whitened(u) for u in chosen])

    @eqx.filter_jit
    def errors(target: Target, maps: WhitenedMaps, starts: Array, ways: Array) -> Array:
        def one(start: Array, way: Array) -> Array:
            def along(share: Array) -> tuple[Array, Array]:
                return jax.jvp(lambda s: maps.log_density(target, start + s * way), (share,), (jnp.ones(()),))

            values, slopes = jax.vmap(along)(jnp.asarray([0.0, 0.5, 1.0]))
            simpson = (slopes[0] + 4.0 * slopes[1] + slopes[2]) / 6.0
            return jnp.abs(values[2] - values[0] - simpson)

        return jax.lax.map(lambda pair: one(*pair), (starts, ways))

    found_errors = np.asarray(errors(target, maps, jnp.asarray(starts), jnp.asarray(ways)))
    return int(np.sum(found_errors < ERROR))  # NaN is not smooth
