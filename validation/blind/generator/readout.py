"""Digitisation by a data acquisition: rounded, clipped at full scale, held, interpolated, or sparse readings.

Nothing here is physics. Its differences between a model and a recording are no mismatch.
"""

from dataclasses import replace

import numpy as np

COARSEST = 12.0
"""Maximum step of a rounded output in standard deviations of its noise. Inputs are rounded to at most a
quarter of that."""
STATED = 0.3
"""Share of campaigns whose sidecars state the noise. Where it is not stated, rounding is hardest to
distinguish from it."""


def rounded(bench, takes, rng):
    """Rounding of every noisy channel to whole steps: half to twelve standard deviations for an output, up to
    three for an input."""
    noise = dict(bench.noise)
    for channel, sigma in bench.noise.items():
        most = COARSEST if channel in bench.outputs else COARSEST / 4.0
        step = sigma * float(np.exp(rng.uniform(np.log(0.5), np.log(most))))
        for _, columns in takes:
            columns[channel] = step * np.round(columns[channel] / step)
        noise[channel] = float(np.hypot(sigma, step / np.sqrt(12.0)))
    return noise, takes


def clipped(bench, takes, rng):
    """Amplifier at full scale: outputs stop at a level that 3 to 12 % of the readings exceed. Steps below it
    are a third of a standard deviation."""
    for channel in bench.outputs:
        step = bench.noise[channel] / 3.0
        everything = np.concatenate([columns[channel] for _, columns in takes])
        sign = 1.0 if np.max(everything) >= -np.min(everything) else -1.0
        level = step * np.round(np.quantile(sign * everything, 1.0 - rng.uniform(0.03, 0.12)) / step)
        for _, columns in takes:
            columns[channel] = sign * np.minimum(step * np.round(sign * columns[channel] / step), level)
    return bench.noise, takes


def held(bench, takes, rng):
    """Logger that writes faster than it reads: every reading is repeated two to four times while the clock
    continues."""
    times = int(rng.integers(2, 5))
    return bench.noise, [
        (_finer(time, times), {c: np.repeat(x, times) for c, x in columns.items()}) for time, columns in takes
    ]


def slow_output(bench, takes, rng):
    """Outputs that are read every second to fourth row and held in between, while the inputs change."""
    times = int(rng.integers(2, 5))
    for time, columns in takes:
        last = times * (np.arange(len(time)) // times)
        for channel in bench.outputs:
            columns[channel] = columns[channel][last]
    return bench.noise, takes


def interpolated(bench, takes, rng):
    """Readings interpolated in straight lines onto a clock that is 1.5 to 4 times finer."""
    ratio = rng.uniform(1.5, 4.0)
    found = []
    for time, columns in takes:
        fine = np.linspace(time[0], time[-1], int(ratio * len(time)))
        found.append((fine, {c: np.interp(fine, time, x) for c, x in columns.items()}))
    return bench.noise, found


def sparse(bench, takes, rng):
    """Every third or fourth reading only."""
    every = int(rng.integers(3, 5))
    return bench.noise, [(time[::every], {c: x[::every] for c, x in columns.items()}) for time, columns in takes]


READOUTS = {f.__name__: f for f in (rounded, clipped, held, slow_output, interpolated, sparse)}
"""Function by name, from (bench, [(time, columns)] of the recordings, rng) to (noise, the same as
digitised)."""


def read_out(bench, recorded, way, rng):
    """Bench and recorded columns of a campaign whose channels are digitised by one of the `READOUTS`.

    Columns of recordings may have different lengths then: lists of (N_k,) by name.
    """
    takes = [
        (take.time[: take.rows], {c: np.array(recorded[c][k][: take.rows]) for c in bench.measured})
        for k, take in enumerate(bench.recordings)
    ]
    noise, takes = READOUTS[way](bench, takes, rng)
    recordings = [
        replace(take, time=time, rows=len(time)) for take, (time, _) in zip(bench.recordings, takes, strict=True)
    ]
    stated = bool(rng.random() < STATED)
    columns = {c: [columns[c] for _, columns in takes] for c in bench.measured}
    return replace(bench, recordings=recordings, noise=noise, noise_stated=stated), columns


def _finer(time, times):
    """A clock that runs `times` as fast through the same rows."""
    rows = np.arange(times * len(time)) / times
    step = time[-1] - time[-2]
    return np.interp(rows, np.arange(len(time) + 1), np.append(time, time[-1] + step))
