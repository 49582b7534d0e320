"""Other methods on the same sealed campaign, with the tool's own model, refit and noise, so that only the
method differs.

- recalibration: the base model refitted within its tolerances, and a chi-square test of the residual;
- BIC stepwise: the same candidate effects, entered one by one while BIC falls, errors taken as independent;
- Gaussian process: a discrepancy over the located drivers on top of the refitted base (Kennedy & O'Hagan
  2001);
- sparse regression: the residual on a library of terms of the drivers (sequential thresholding, Brunton et
  al. 2016).

Each answers in the form of a report, so that it is judged by the same rules. Held-out errors are reduced
chi-squares of the same whitened values. The held-out values are recordings with role validation, else folds
of recordings (or of blocks of the only one).
"""

import time
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.refit import Refitter
from fitting.specimens.registry import kind_of
from pneusma_jax import enable_float64

from . import stepwise
from .regressors import GaussianProcess, SparseRegression

FOLDS = 8
"""Number of cross-validation folds where no recording is for validation."""
LEVEL = 0.01
VALIDATION = "validation"
"""Label of a report that scored recordings of that role, and no others."""


@dataclass
class Fold:
    """Weights of the recordings' whitened values: those that are fitted, and those that are left out."""

    fit: list
    out: list


def answers(folder, report, seed):
    """Answers of every method on a campaign; a method that fails is reported as failed.

    Args:
        folder: folder of the campaign.
        report: report of the tool. Its located drivers are inputs of the Gaussian process, and its scored
            values are those of the others.
        seed: unused; every method is deterministic.
    """
    enable_float64()
    campaign = read_campaign(folder)
    program = Program.of(campaign, kind_of(campaign))
    if report.get("fit", {}).get("how", VALIDATION) != VALIDATION:  # the tool cross-validated, too
        program.fitted = np.ones_like(program.fitted)
    program, base = base_fit(program)  # noise and latent trajectories as the tool has them
    folds = [(fold, _refitted(program, base, fold)) for fold in _folds(program)]
    held_out_chi2 = held_out(program, [(f, fit.evaluation.misfit) for f, fit in folds])
    drivers = report.get("where", {}).get("drivers", [])
    ways = {
        "recalibration": lambda: _recalibration(program, base, held_out_chi2),
        "gaussian_process": lambda: _corrected(program, folds, GaussianProcess, drivers, held_out_chi2),
        "sparse_regression": lambda: _corrected(program, folds, SparseRegression, [], held_out_chi2),
        "bic_stepwise": lambda: _stepwise(program, base, folds, held_out_chi2),
    }
    found = {}
    for name, way in ways.items():
        start = time.perf_counter()
        try:
            found[name] = way()
        except Exception as problem:  # another method's failure is its result
            found[name] = {"error": f"{type(problem).__name__}: {problem}"}
        found[name]["seconds"] = round(time.perf_counter() - start, 2)
    return found


def _folds(program):
    sizes = [sum(len(c.measured) for c in channels) for channels in program.channels]
    if not program.fitted.all():
        fit = [np.full(size, float(f)) for size, f in zip(sizes, program.fitted, strict=True)]
        return [Fold(fit, [1.0 - w for w in fit])]
    if len(sizes) > 1:
        groups = np.array_split(np.arange(len(sizes)), min(len(sizes), FOLDS))
        outs = [[np.full(size, float(k in group)) for k, size in enumerate(sizes)] for group in groups]
    else:
        rows = len(program.channels[0][0].measured)
        block = np.arange(rows) * FOLDS // rows
        outs = [[np.tile((block == part).astype(float), len(program.channels[0]))] for part in range(FOLDS)]
    return [Fold([1.0 - w for w in out], out) for out in outs]


def _refitted(program, base, fold, slugs=(), start=None):
    """A model refitted to the fitted part of a fold."""
    if not program.fitted.all() and start is None:
        return base
    return Refitter(program, fold.fit).fit(slugs, base.u if start is None else start, rounds=6)


def held_out(program, parts):
    """Chi-square per held-out value that no latent trajectory uses up, as in reports. Parts are folds with
    whitened misfits of all recordings."""
    total, count = 0.0, 0.0
    for fold, misfit in parts:
        total += sum(float(np.sum((w * m) ** 2)) for w, m in zip(fold.out, misfit, strict=True))
        for k, (channels, weight) in enumerate(zip(program.channels, fold.out, strict=True)):
            counted = np.concatenate([np.isfinite(c.sigma) for c in channels])
            count += float(np.sum(counted & (weight > 0.0))) * program.free_share(k)
    return total / max(count, 1.0)


def _answer(mismatch, before, after, effects=()):
    return {
        "verdict": "mismatch" if mismatch else "consistent",
        "effects": list(effects),
        "explanation_set": [e["name"] for e in effects],
        "fit": {"before": {"reduced_chi2": before}, "after": {"reduced_chi2": after}},
    }


def _mismatch(program, base):
    count = program.observations(program.fitted)
    return bool(chi2.sf(base.evaluation.chi2(program.fitted.astype(float)), count) < LEVEL)


def _recalibration(program, base, held_out_chi2):
    return _answer(_mismatch(program, base), held_out_chi2, held_out_chi2)


def _corrected(program, folds, regressor, drivers, held_out_chi2):
    """Answer of a regression of the refitted base's residual, trained on the fitted part and subtracted
    elsewhere."""
    parts = [(fold, _misfit_with(program, fit, fold, regressor, drivers)) for fold, fit in folds]
    return _answer(_mismatch(program, folds[0][1]), held_out_chi2, held_out(program, parts))


def _misfit_with(program, fit, fold, regressor, wanted):
    """Whitened misfits of all recordings after subtraction of the residuals' regression."""
    drivers = _drivers(program, fit, wanted)
    place = [_places(channels) for channels in program.channels]
    corrected = [[] for _ in program.channels]
    for quantity in dict.fromkeys(c.quantity for channels in program.channels for c in channels):
        inputs, residuals, keep, where = [], [], [], []
        for k, channels in enumerate(program.channels):
            for j, channel in enumerate(channels):
                if channel.quantity == quantity:
                    predicted = fit.evaluation.predicted[k][j]
                    good = np.isfinite(channel.sigma) & np.isfinite(predicted)
                    scale = np.where(good, channel.sigma, 1.0)
                    residual = np.where(good, (predicted - channel.measured) / scale, 0.0)
                    inputs.append(drivers[k])
                    residuals.append(residual)
                    keep.append(good & (fold.fit[k][place[k][j]] > 0.0))
                    where.append((k, j, channel, good, scale))
        learnt = regressor(np.concatenate(inputs), np.concatenate(residuals), np.concatenate(keep))
        for x, residual, (k, j, channel, good, scale) in zip(inputs, residuals, where, strict=True):
            rest = np.where(good, residual - learnt(x), 0.0) * scale
            whitened = np.where(good, channel.whitened(rest), fit.evaluation.misfit[k][place[k][j]])
            corrected[k].append((j, whitened))
    return [np.concatenate([w for _, w in sorted(mine, key=lambda pair: pair[0])]) for mine in corrected]


def _places(channels):
    """Slice of each channel among a recording's whitened values."""
    ends = np.cumsum([len(c.measured) for c in channels])
    return [slice(end - len(c.measured), end) for end, c in zip(ends, channels, strict=True)]


def _drivers(program, fit, wanted):
    """Scaled drivers of rows, (rows, drivers) of every recording: the requested ones, or all that vary."""
    found = {name: np.nan_to_num(np.asarray(v)) for name, v in fit.evaluation.drivers.items()}
    found = {name: v for name, v in found.items() if not name.startswith(("gamma", "ohms"))}
    found["time"] = np.asarray(program.stacked.time)
    if "strain" in found:
        found["max_strain"] = np.maximum.accumulate(found["strain"], axis=1)
    names = [n for n in wanted if n in found] or list(found)
    count = len(program.channels)
    table = np.stack([found[n][:count] for n in names], axis=-1)
    mask = np.asarray(program.stacked.mask)[:count] > 0.0
    mean, spread = table[mask].mean(axis=0), table[mask].std(axis=0)
    varies = spread > 1e-9 * (1.0 + np.abs(mean))
    return ((table - mean) / np.where(varies, spread, 1.0))[..., varies]


def _stepwise(program, base, folds, held_out_chi2):
    whitened = program.channels
    try:
        program.channels = [[replace(c, correlation=0.0) for c in channels] for channels in whitened]
        found = stepwise.search(program, base)
        parts = [_refitted(program, base, fold, found.slugs, found.fit.u) for fold, _ in folds]
    finally:
        program.channels = whitened
    fits = [(fold, program.evaluate(fit.u, fit.free).misfit) for (fold, _), fit in zip(folds, parts, strict=True)]
    after = held_out(program, fits) if found.slugs else held_out_chi2
    return _answer(bool(found.slugs), held_out_chi2, after, found.effects) | {"evaluations": found.evaluations}
