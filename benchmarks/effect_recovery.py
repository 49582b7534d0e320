"""Every effect, on every kind of recording that it concerns, simulated and found again by a diagnosis.

An effect is simulated at typical strength, with noise. The steps are those of a diagnosis: the base model is
refitted, its noise settled, the effect screened and fitted together with the base from all its starts.

    python benchmarks/effect_recovery.py [KIND ...] [--seed 1]

Recordings are those of `calibration_data/examples`, their measured outputs replaced. A row says how far the
strengths end from the truth, in standard errors of the fit, and what the fit leaves; `not seen` where the
screen does not see the effect. `no trace` where these recordings do not show it at all, since its signature
is below a standard deviation of the noise; no method can recover that.
"""

import argparse
import dataclasses
from pathlib import Path

import jax
import numpy as np
from scipy.ndimage import gaussian_filter1d

import pneusma_jax as pj
from fitting.data.recordings import Campaign, read_campaign
from fitting.diagnose.evaluate.evaluation import trajectories_of, with_trajectories
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.candidates import candidate_fits
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.score_test import score_effects
from fitting.inference.readings import noise_of
from fitting.specimens import SPECIMENS
from fitting.specimens.rows import numbers
from fitting.specimens.spring_rows import spring_of
from pneusma_jax import enable_float64
from pneusma_jax.units import from_si, unit_of_column

EXAMPLES = Path(__file__).parents[1] / "calibration_data" / "examples"
TRACE = 1.0
"""Length of a signature in standard deviations of the noise, below which nothing can be recovered."""
WITHIN = 3.0
SMOOTH = 3.0
"""Rows over which the examples' latent trajectories are smoothed: memories would keep the peaks of their
noise."""


def simulated(program: Program, u: np.ndarray) -> list[list[np.ndarray]]:
    """Outputs at `u`, SI, by recording and channel; fractions follow smooth courses near those recorded."""
    nothing = program.unknowns.base[:0]
    if program.process_noise.shape[1]:
        smooth = gaussian_filter1d(trajectories_of(program.stacked), SMOOTH, axis=-1, mode="nearest")
        stacked = with_trajectories(program.stacked, np.clip(smooth, 0.0, 1.0))
        return program.evaluate(u, nothing, stacked).predicted
    if program.kind != "spring":
        return program.evaluate(u, nothing).predicted
    course = program.evaluate(program.unknowns.neutral, nothing).drivers["xi0"]
    values, effects, found = program.unknowns.values(u), program.unknowns.effects(u), []
    for k, channels in enumerate(program.channels):
        rows = jax.tree.map(lambda x, k=k: x[k], program.stacked)
        known, held = numbers(values, rows), np.asarray(rows.mask, bool)
        smooth = np.clip(gaussian_filter1d(course[k][held], SMOOTH, mode="nearest"), 0.0, 1.0)
        history = pj.simulate_spring(
            spring_of(known),
            rows.inputs["elongation"][held],
            pj.MartensiteFraction(smooth),
            pj.SpringState(known["prestrain"], np.ones(())),
            time=rows.time[held],
            effects=effects,
        )
        found.append([np.asarray(history.seen[channel.quantity]) for channel in channels])
    return found


def concealed(campaign: Campaign, program: Program, u: np.ndarray, rng: np.random.Generator) -> Campaign:
    """The campaign with outputs as the model has them at `u`, and white noise; every recording is fitted."""
    recordings = []
    for recording, channels, outputs in zip(
        campaign.recordings, program.channels, simulated(program, u), strict=True
    ):
        columns, rows = dict(recording.columns), len(recording)
        for channel, value in zip(channels, outputs, strict=True):
            name = recording.column(channel.quantity)
            error = noise_of(recording, channel.quantity) * rng.standard_normal(rows)
            value = np.where(np.isfinite(recording.si(name)), value[:rows] + error, np.nan)
            columns[name] = from_si(value, unit_of_column(name)[1])
        recordings.append(dataclasses.replace(recording, columns=columns, role="fit"))
    return dataclasses.replace(campaign, recordings=recordings)


def recovered(campaign: Campaign, program: Program, slug: str, rng: np.random.Generator) -> tuple[str, float]:
    """What came back of an effect, in words, and its distance from the truth in standard errors."""
    unknowns = program.unknowns
    u, own = unknowns.neutral.copy(), unknowns.amplitudes(slug)
    u[own] = [unknowns.items[k].start for k in own]
    pair = (program.evaluate(x, unknowns.base[:0]).misfit for x in (unknowns.neutral, u))
    size = float(np.sqrt(sum(np.sum((a - b) ** 2) for a, b in zip(*pair, strict=True))))
    if not size >= TRACE:
        return "no trace", 0.0
    made, base = base_fit(Program.of(concealed(campaign, program, u, rng), program.kind))
    found = score_effects(Refitter(made), base, [slug], rng)
    trials = candidate_fits(made, base, found, lambda _: None, 1)
    if not trials:
        return "not seen" + "".join(f" (p = {score.p_value:.2g})" for score in found.scores), np.inf
    fit = trials[0].fit
    free = [k for k in own if unknowns.items[k].start != 0.0] or list(own)
    z = [abs(fit.u[k] - u[k]) / max(fit.sd(k), 1e-9) for k in free]
    worst = free[int(np.argmax(z))]
    item = unknowns.items[worst]
    strength, true = (float(item.value(x[worst])) for x in (fit.u, u))
    left = f"reduced chi2 {reduced(made, base, made.fitted):.4g} -> {reduced(made, fit, made.fitted):.3f}"
    words = f"{item.name} {strength:.4g} of {true:.4g} {item.unit}; {left}"
    if max(z) > WITHIN:  # whether the search or the recordings are at fault
        beyond = Refitter(made).fit((slug,), u).objective - fit.objective
        words += f"; objective of a fit from the truth {beyond:+.1f}"
    return words, max(z)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", default=list(SPECIMENS))
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    enable_float64()
    total, good, silent = 0, 0, 0
    for kind in chosen.kinds or list(SPECIMENS):
        campaign = read_campaign(EXAMPLES / kind)
        program = Program.of(campaign, kind)
        if any(len(r) > program.stacked.mask.shape[1] for r in campaign.recordings):
            raise SystemExit(f"{EXAMPLES / kind}: recordings are longer than what a diagnosis evaluates")
        for number, slug in enumerate(program.unknowns.slugs):
            rng = np.random.default_rng([chosen.seed, number])
            words, z = recovered(campaign, program, slug, rng)
            silent += words == "no trace"
            total, good = total + (words != "no trace"), good + (words != "no trace" and z <= WITHIN)
            print(f"{kind:10s} {slug:36s} {z:6.2f} sd   {words}", flush=True)
    print(f"{good} of {total} within {WITHIN:g} standard errors; {silent} leave no trace in these recordings")


if __name__ == "__main__":
    main()
