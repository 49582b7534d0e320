"""Martensite fractions of an actuator from its measured resistances, with their uncertainty.

The resistance determines the fraction of a cold wire well, and that of a hot wire hardly at all. A colder
spring is also longer, which changes its resistance too. So the fraction is modelled as a random walk. It is
smoothed as in `inference.latent_trajectory.denoise`, about the predictions of the whole actuator, by repeated
linearisation.

Each fraction has a gain: its first-order change with the resistance, as far as the resistance determines it.
Outputs get smaller weights where an uncertain fraction makes them uncertain.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.inference.latent_trajectory.denoise import smooth_walk
from pneusma_jax.numerics.safe import as_arrays
from pneusma_jax.program_cache import cached_program

from .actuator_rows import body_of, trajectory
from .rows import Rows, numbers, stack, with_extra

ROUNDS = 25
"""Maximum number of smoothing rounds."""
SETTLED = 1e-3
"""Maximum change of a fraction at which the rounds end [1]."""
LONGEST = 0.1
"""Maximum change of a fraction in one round [1]. Near full heat the tangent is almost flat, and a full step
would leave its range of validity."""
FLATTEST = 1e-6
"""Minimum slope of a wire's resistance over the fraction, relative to the resistance [1]."""
MISSTATED = 5.0
"""Maximum factor, up or down, on the stated noise of a resistance [1].

In ten simulated recordings with rows 3 s apart it was stated 0.2 to 3 times as large as it was. They are
missed by at most 1.2 of the curvature's noise. With any factor, two are missed by 10 and 39. Where readings
scatter more, `SCATTER` lets the noise be larger."""
SCATTER = 2.0
"""Maximum factor on the noise by the scatter of readings about their neighbours [1].

Of 30 readings that scatter is at least half the noise in 97 % of 5,000 draws, of 60 readings in 99.5 %."""
QUIET = 0.25
"""Share of the rows that are taken as quiet for it [1]. A spring may be heated in the others."""
UNSETTLED = "unsettled"
"""Name in `Rows.extra` of a mark: true if the rounds of a recording ended at no solution."""
UNKNOWN = 0.3
"""Standard deviation of a fraction that the resistance does not determine [1]."""
LEAST_NOISE = 2e-6
"""Minimum standard deviation of a reading, relative to the wire's resistance [1]."""
BLIND = 0.05
"""Standard deviation of a fraction above which its error counts as common to a recording, not as new in each
row [1]."""
NUDGE = 0.02
"""Change of a fraction for slopes by finite differences [1]."""
NARROWEST = 1e-9
BEGIN = 0.9
"""Fraction at which the rounds begin [1]. It is so far from full heat that no tangent is flat there."""
DECIDED = ("xi0", "gain", "ohms", "sd")
OUTPUTS = ("curvature", "bend_angle", "length", "bend_direction")

_rows = cached_program(
    lambda values, stacked: vars(jax.vmap(trajectory, (None, 0))(values, stacked)), "actuator rows"
)


def undecided(rows: Rows, count: int) -> Rows:
    """A recording whose springs are all fully martensitic (cold), as a start.

    Args:
        rows: recording without fractions.
        count: number of springs of the actuator.
    """
    fill = {"xi0": 1.0, "gain": 0.0, "ohms": 1.0, "sd": 0.0}
    blank = {name: tuple(np.full(len(rows.mask), fill[name]) for _ in range(count)) for name in DECIDED}
    clean = {name: np.asarray(weight) for name, weight in rows.weight.items()}
    return with_extra(rows, **blank, clean=clean)


def decided(values: Mapping[str, float], recordings: Sequence[Rows]) -> list[Rows]:
    """Recordings with the fractions, gains and weights that hold at these parameters.

    Args:
        values: free parameters by name, SI.
        recordings: recordings from `undecided` or from an earlier call.
    """
    values = as_arrays(values)
    wired = wired_springs(recordings[0])
    found = [_with_start(rows, [k for k, _ in wired]) for rows in recordings]
    if not wired:
        return found
    springs = list(enumerate(recordings[0].extra["layout"].spring_numbers))

    def evaluate(fixed: list[Rows]) -> dict[str, np.ndarray]:
        solved = jax.device_get(_rows(values, without_gains(stack(fixed))))
        drivers = {f"{name}_{n}": solved[name][:, k] for k, n in springs for name in ("ohms", "xi0", "gamma")}
        return drivers | {name: solved[name] for name in OUTPUTS}

    return [_with_gains(values, end, wired) for end in settled_rounds(found, wired, evaluate)]


def wired_springs(rows: Rows) -> list[tuple[int, int]]:
    """Place and number of each spring with a resistance."""
    numbered = enumerate(rows.extra["layout"].spring_numbers)
    return [(k, n) for k, n in numbered if f"resistance_{n}" in rows.inputs]


@dataclass(frozen=True)
class Ended:
    """A recording whose fractions are smoothed about a model, and the model linearised there.

    Attributes:
        rows: recording, whose fractions follow no resistance.
        base: drivers of the model, by name, each of shape (rows,); NaN in rows without an equilibrium.
        slopes: slopes of the same over the fraction of a spring, by its place and by name, of the same shape.
        ended: true if the rounds ended at a solution.
    """

    rows: Rows
    base: dict[str, np.ndarray]
    slopes: dict[int, dict[str, np.ndarray]]
    ended: bool = False

    def misfit(self, wired: Sequence[tuple[int, int]]) -> tuple[int, float]:
        """Number of rows without an equilibrium, and the deviation of the other rows from their resistances.

        The latter is a sum of squares, in standard deviations of a reading.
        """
        read = {k: np.asarray(self.rows.inputs[f"resistance_{n}"]) - self.base[f"ohms_{n}"] for k, n in wired}
        noise = {k: noise_of(self.rows, k) for k in read}
        missed = np.array([x / noise[k] for k, x in read.items() if noise[k] > 0.0])
        return int(np.sum(~np.isfinite(missed))), float(np.nansum(missed**2))


def settled_rounds(
    fixed: list[Rows],
    wired: Sequence[tuple[int, int]],
    evaluate: Callable[[list[Rows]], dict[str, np.ndarray]],
) -> list[Ended]:
    """Recordings after rounds of smoothing their fractions about the predictions of a model.

    Where the rounds end at no solution, those fractions count that miss the resistances least. A round may
    take half its step (`relaxed`). It is the whole one that must be below `SETTLED`.

    No least squares replaces the rounds, because each estimates the walk's variance anew: there is no one sum
    of squares to lower. A spring that is heated through within two rows came back to 7e-5 of its fractions.
    With the variance held at one value, it missed them by 0.02, at another by 0.17.

    Args:
        fixed: recordings with the fractions to begin with, which follow no resistance.
        wired: place and number of each spring with a resistance.
        evaluate: function from recordings to drivers, by name, each of shape (recordings, rows). `ohms_N` and
            `xi0_N` of every wired spring are among them.
    """
    before, last = _linearised(fixed, wired, evaluate), fixed
    best: list[Ended] = []
    ended = [False] * len(fixed)
    for _ in range(ROUNDS):
        whole = [_smoothed(one, wired) for one in before]
        ended = [largest_change(one.rows, after) < SETTLED for one, after in zip(before, whole, strict=True)]
        after = [relaxed(*three) for three in zip(last, [x.rows for x in before], whole, strict=True)]
        last, before = [one.rows for one in before], _linearised(after, wired, evaluate)
        pairs = zip(best, before, strict=True) if best else zip(before, before, strict=True)
        best = [min(pair, key=lambda one: one.misfit(wired)) for pair in pairs]
        if all(ended):
            break
    return [
        replace(now, ended=True) if end else least
        for now, least, end in zip(before, best, ended, strict=True)
    ]


def _linearised(
    fixed: list[Rows],
    wired: Sequence[tuple[int, int]],
    evaluate: Callable[[list[Rows]], dict[str, np.ndarray]],
) -> list[Ended]:
    """Each recording with the model at its fixed fractions; slopes by finite differences."""
    base, slopes = evaluate(fixed), {}
    for k, n in wired:
        moved = evaluate([_perturbed(rows, k) for rows in fixed])
        nudge = moved[f"xi0_{n}"] - base[f"xi0_{n}"]
        slopes[k] = {name: (moved[name] - base[name]) / nudge for name in base}
    cut = lambda columns, j, rows: {name: x[j, : len(rows.mask)] for name, x in columns.items()}  # noqa: E731
    return [
        Ended(rows, cut(base, j, rows), {k: cut(slope, j, rows) for k, slope in slopes.items()})
        for j, rows in enumerate(fixed)
    ]


def finite(slope: np.ndarray) -> np.ndarray:
    """The same slopes with zero in rows without an equilibrium."""
    return np.nan_to_num(slope, posinf=0.0, neginf=0.0)


def _nudge(xi0: np.ndarray) -> np.ndarray:
    """Changes of fractions by `NUDGE` that stay within their range [1]."""
    return np.where(xi0 > 0.5, -NUDGE, NUDGE)


def _perturbed(rows: Rows, k: int) -> Rows:
    """The recording with the martensite fraction of spring k shifted by `NUDGE`."""
    xi0 = [np.asarray(x) for x in rows.extra["xi0"]]
    xi0[k] = xi0[k] + _nudge(xi0[k])
    return with_extra(rows, xi0=tuple(xi0))


def _smoothed(found: Ended, wired: Sequence[tuple[int, int]]) -> Rows:
    """One round of smoothing of all fractions. Rows without an equilibrium follow their neighbours."""
    rows = found.rows
    for k, n in wired:
        if noise_of(rows, k) > 0.0:
            missed = np.nan_to_num(np.asarray(rows.inputs[f"resistance_{n}"]) - found.base[f"ohms_{n}"])
            rows = smoothed(rows, k, missed, finite(found.slopes[k][f"ohms_{n}"]))
    return rows


def relaxed(last: Rows, before: Rows, after: Rows) -> Rows:
    """A recording after a round, half of whose step is taken if it goes back on the step before.

    A wire remembers its least fraction. So its resistance has another slope over fractions of single rows
    than over those of all. By the latter, rounds went to and fro by 0.002 in a cold spring.
    """
    step = np.subtract(after.extra["xi0"], before.extra["xi0"])
    if np.sum(step * np.subtract(before.extra["xi0"], last.extra["xi0"])) >= 0.0:
        return after
    return with_extra(after, xi0=tuple(np.asarray(before.extra["xi0"]) + 0.5 * step))


def largest_change(before: Rows, after: Rows) -> float:
    """Largest change of a fraction in any row of a recording [1]."""
    return float(np.max(np.abs(np.subtract(after.extra["xi0"], before.extra["xi0"]))))


def _with_start(rows: Rows, wired: Sequence[int]) -> Rows:
    """A recording whose measured springs start from earlier fractions, or from `BEGIN`."""
    xi0 = list(rows.extra["xi0"])
    for k in wired:
        if noise_of(rows, k) > 0.0 and not np.any(rows.extra["sd"][k] > 0.0):
            xi0[k] = np.full(len(rows.mask), BEGIN)
    return with_extra(rows, xi0=tuple(xi0))


def noise_of(rows: Rows, k: int) -> float:
    """Standard deviation of a reading of spring k's resistance [ohm]; 0 where it was not measured."""
    number = rows.extra["layout"].spring_numbers[k]
    stated = float(rows.extra[f"noise_resistance_{number}"])
    typical = float(np.median(np.asarray(rows.inputs[f"resistance_{number}"])))
    return max(stated, LEAST_NOISE * typical) if stated > 0.0 else 0.0


def smoothed(rows: Rows, k: int, missed: np.ndarray, slope: np.ndarray) -> Rows:
    """A recording with spring k's fractions after one Newton step, smoothed.

    The noise of a resistance is known within a factor, or by the scatter of its readings where they scatter
    more. If it were not, the fractions of a spring that is heated through in a few rows could pass for noise.
    All rows then got one fraction, from which the rounds went back: a cycle of seven.

    Args:
        rows: recording; k: place of the spring.
        missed: measured resistance less the predicted one [ohm], shape (rows,).
        slope: slope of the resistance over the fraction [ohm], shape (rows,).
    """
    before, number = np.asarray(rows.extra["xi0"][k]), rows.extra["layout"].spring_numbers[k]
    least = FLATTEST * float(np.median(np.asarray(rows.inputs[f"resistance_{number}"])))
    slope = np.where(np.abs(slope) < least, least, slope)
    step = np.clip(missed / slope, -LONGEST, LONGEST)
    noise = noise_of(rows, k)
    most = max(MISSTATED, SCATTER * scatter(rows.time, rows.inputs[f"resistance_{number}"]) / noise)
    walk = smooth_walk(np.asarray(rows.time), before + step, (slope / noise) ** 2, (1.0 / MISSTATED, most))
    after = np.clip(walk, 0.0, 1.0)
    return with_extra(rows, xi0=tuple(after if j == k else x for j, x in enumerate(rows.extra["xi0"])))


def understated(rows: Rows) -> dict[int, float]:
    """Ratio of the scatter of resistances about their predictions to their noise, by number of the spring.

    Only ratios above `MISSTATED` are in it.
    """
    found = {}
    for k, number in enumerate(rows.extra["layout"].spring_numbers):
        read = rows.inputs.get(f"resistance_{number}")
        noise = 0.0 if read is None else noise_of(rows, k)
        if noise > 0.0:
            missed = np.asarray(read) - np.asarray(rows.extra["ohms"][k])
            found[number] = scatter(rows.time, missed) / noise
    return {number: ratio for number, ratio in found.items() if ratio > MISSTATED}


def scatter(time: np.ndarray, readings: np.ndarray) -> float:
    """Standard deviation of readings about the line between their neighbours, in the unit of the readings.

    It comes from the quietest rows, so that fast changes in the other rows hardly count. Slow changes do not
    count. 0 for fewer than three readings.

    Args:
        time: time [s], ascending, shape (rows,).
        readings: shape (rows,).
    """
    t, x = np.asarray(time), np.asarray(readings)
    if len(t) < 3:
        return 0.0
    later = (t[1:-1] - t[:-2]) / np.maximum(t[2:] - t[:-2], np.finfo(float).tiny)
    off = x[1:-1] - (1.0 - later) * x[:-2] - later * x[2:]
    sizes = np.abs(off) / np.sqrt(1.0 + later**2 + (1.0 - later) ** 2)
    return float(np.quantile(sizes, QUIET) / NormalDist().inv_cdf(0.5 + 0.5 * QUIET))


def _with_gains(values: Mapping[str, Array], end: Ended, wired: Sequence[tuple[int, int]]) -> Rows:
    """A recording with gains, resistances and weights at the fractions at which its rounds ended."""
    ohms = tuple(end.base[f"ohms_{n}"] for n in end.rows.extra["layout"].spring_numbers)
    rows = with_extra(end.rows, ohms=ohms, **{UNSETTLED: np.asarray(not end.ended)})
    variance = {
        name: 1.0 / np.where(w > 0.0, w, np.inf) ** 2 for name, w in end.rows.extra["clean"].items()
    }
    for k, n in wired:
        if noise_of(rows, k) > 0.0:
            rows = _with_gain(values, rows, k, end.base[f"gamma_{n}"], end.slopes[k][f"ohms_{n}"])
        sd = rows.extra["sd"][k]
        share = np.where(sd > BLIND, max(np.sum(sd > BLIND), 1), 1.0)
        for name, known in variance.items():
            slope = end.slopes[k][name]
            known += np.where(np.isfinite(slope), share * (slope * sd) ** 2, 0.0)
    return _reweighted(rows, variance)


def _with_gain(
    values: Mapping[str, Array], rows: Rows, k: int, gamma: np.ndarray, slope: np.ndarray
) -> Rows:
    """A recording with the gain and uncertainty of spring k's fraction.

    Args:
        gamma: shear strain of the wire [1]; slope: of its resistance over the fraction [ohm]; shape (rows,).
    """
    noise = noise_of(rows, k)
    spring = body_of(numbers(values, rows), rows).springs[k]
    xi0 = jnp.asarray(rows.extra["xi0"][k])
    mean_slope = np.asarray(_mean_slope(spring, xi0, jnp.asarray(gamma), jnp.asarray(noise)))
    sd = noise / np.sqrt(mean_slope**2 + (noise / UNKNOWN) ** 2)
    gain = np.where(sd < BLIND, slope / (slope**2 + (noise / UNKNOWN) ** 2), 0.0)
    put = lambda name, column: tuple(  # noqa: E731
        column if j == k else old for j, old in enumerate(rows.extra[name])
    )
    return with_extra(rows, sd=put("sd", sd), gain=put("gain", gain))


@eqx.filter_jit
def _mean_slope(spring: pj.Spring, xi0: Array, gamma: Array, noise: Array) -> Array:
    """Mean slope of the resistance over the fractions that agree with one noisy reading [ohm].

    Near full heat the tangent is flat but curved. At a fraction of 0.4 it has a slope, yet any smaller
    fraction has almost the same resistance.
    """
    length = spring.geometry.wire_length
    ohms = spring.alloy.resistivity(xi0, gamma) * length
    ends = [spring.alloy.martensite_fraction((ohms + s * noise) / length, gamma).xi0 for s in (1.0, -1.0)]
    return 2.0 * noise / jnp.maximum(jnp.abs(ends[0] - ends[1]), NARROWEST)


def _reweighted(rows: Rows, variance: Mapping[str, np.ndarray]) -> Rows:
    """A recording with these added variances of its outputs, in the rows that count."""
    clean = rows.extra["clean"]
    weight = {name: np.where(clean[name] > 0.0, variance[name] ** -0.5, 0.0) for name in clean}
    return eqx.tree_at(lambda r: r.weight, rows, weight)


def without_gains(rows: Rows) -> Rows:
    """The same recording, or stack of them, with fixed fractions, which follow no resistance."""
    return with_extra(rows, gain=tuple(0.0 * np.asarray(gain) for gain in rows.extra["gain"]))
