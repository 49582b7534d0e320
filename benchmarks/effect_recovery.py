"""Every effect, on every kind of recording that it concerns: simulated at typical strength, with noise, and
fitted again together with the base model's constants.

    python benchmarks/effect_recovery.py [KIND ...] [--seed 1]

Recordings are those of `calibration_data/examples`, their measured outputs replaced. A row says how far the
strengths end from the truth, in standard errors of the fit; `no trace` where these recordings do not show the
effect at all (its signature is below a standard deviation of the noise), which no method can recover.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np

from fitting.diagnosis.program import Program
from fitting.diagnosis.refit import Refitter
from fitting.models.with_effects import LETTERS
from fitting.recordings import read_campaign
from pneusma_jax import enable_float64

EXAMPLES = Path(__file__).parents[1] / "calibration_data" / "examples"
TRACE = 1.0
"""Length of a signature in standard deviations of the noise, below which nothing can be recovered."""
WITHIN = 3.0


def concealed(program: Program, u: np.ndarray, rng: np.random.Generator) -> Program:
    """The program with outputs as the model has them at `u`, and noise as the channels state it."""
    predicted = program.evaluate(u, program.unknowns.base[:0]).predicted
    channels = []
    for members, values in zip(program.channels, predicted, strict=True):
        row = []
        for channel, value in zip(members, values, strict=True):
            there = np.isfinite(channel.sigma) & np.isfinite(value)
            error = rng.standard_normal(len(value))
            rho = np.broadcast_to(channel.correlation, error.shape)
            for k in range(1, len(error)):
                error[k] = rho[k] * error[k - 1] + np.sqrt(1 - rho[k] ** 2) * error[k]
            sigma = np.where(there, channel.sigma, np.inf)
            measured = np.where(there, value + np.where(there, sigma, 0.0) * error, 0.0)
            row.append(dataclasses.replace(channel, measured=measured, sigma=sigma))
        channels.append(row)
    return dataclasses.replace(program, channels=channels, fitted=np.ones_like(program.fitted))


def recovered(program: Program, slug: str, rng: np.random.Generator) -> tuple[str, float]:
    """What came back of an effect, in words, and its distance from the truth in standard errors."""
    unknowns = program.unknowns
    u = unknowns.neutral.copy()
    own = unknowns.amplitudes(slug)
    u[own] = [unknowns.items[k].start for k in own]
    made = concealed(program, u, rng)
    without = made.evaluate(unknowns.neutral, unknowns.base[:0]).misfit
    along = made.evaluate(u, unknowns.base[:0]).misfit
    size = float(np.sqrt(sum(np.sum((a - b) ** 2) for a, b in zip(along, without, strict=True))))
    if not size >= TRACE:
        return "no trace", 0.0
    start = unknowns.neutral.copy()
    start[own] = 0.5 * u[own]
    fit = Refitter(made).fit((slug,), start)
    free = [k for k in own if unknowns.items[k].start != 0.0] or list(own)
    z = [abs(fit.u[k] - u[k]) / max(fit.sd(k), 1e-9) for k in free]
    worst = free[int(np.argmax(z))]
    item = unknowns.items[worst]
    found, true = (float(item.value(x[worst])) for x in (fit.u, u))
    words = f"{item.name} {found:.4g} of {true:.4g} {item.unit}"
    return words, max(z)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", default=list(LETTERS))
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    enable_float64()
    total, good, silent = 0, 0, 0
    for kind in chosen.kinds or list(LETTERS):
        program = Program.of(read_campaign(EXAMPLES / kind), kind)
        for number, slug in enumerate(program.unknowns.slugs):
            words, z = recovered(program, slug, np.random.default_rng([chosen.seed, number]))
            silent += words == "no trace"
            total, good = total + (words != "no trace"), good + (words != "no trace" and z <= WITHIN)
            print(f"{kind:10s} {slug:36s} {z:6.2f} sd   {words}", flush=True)
    print(f"{good} of {total} within {WITHIN:g} standard errors; {silent} leave no trace in these recordings")


if __name__ == "__main__":
    main()
