"""A case from its seed: bench, specimen, concealed physics at the strength asked for, noise, files, truth."""

import numpy as np

from . import stand
from .detectability import occam, verdict
from .noise import Instruments
from .plans import plan, true_numbers
from .registry import effect_class

MASKED_CHI2 = 1.22
"""Reduced chi-square that a masked case may leave in what is fitted: it looks acceptable."""
LADDER = np.geomspace(3e-3, 1.0, 9)


class Specimen:
    """Bench, true numbers, effects and noise of one case; nothing here depends on how strong the effects are."""

    def __init__(self, kind, names, seed, masked=False, attempt=0):
        def stream(purpose):
            return np.random.default_rng([seed, purpose, attempt])

        classes = [effect_class(kind, name) for name in names]
        wants = {k: v for cls in classes for k, v in cls.wants.items()}
        self.bench = plan(kind, stream(1), masked=masked, **wants)
        self.numbers = true_numbers(self.bench, stream(2))
        self.instruments = Instruments(self.bench, stream(3))
        self.effects = [cls(stream(10 + n), self.bench) for n, cls in enumerate(classes)]
        self.clean = {c: v[0] for c, v in stand.truth(self.bench, self.numbers).items()}
        draws = stream(4)
        self.noise = {c: self.instruments.draw(c, self.clean[c], draws) for c in sorted(self.bench.noise)}
        names = sorted(self.bench.tolerance)
        self.true_z = np.array([(self.numbers[n] / self.bench.nominal[n] - 1.0) / self.bench.tolerance[n] for n in names])

    def columns(self, amplitudes):
        """Noise-free columns (B, K, N) at amplitudes (B, number of effects) in parts of each effect's ceiling."""
        amplitudes = np.asarray(amplitudes, float)
        for effect, column in zip(self.effects, amplitudes.T, strict=True):
            effect.amplitude = (effect.ceiling * column)[:, None]
        return stand.truth(self.bench, self.numbers, self.effects)

    def judge(self, amplitudes):
        """The verdict on one set of amplitudes."""
        columns = {c: v[:1] for c, v in self.columns([amplitudes]).items()}
        active = int(np.count_nonzero(amplitudes))
        return verdict(self.bench, self.instruments, columns, self.noise, self.true_z, max(active, 1))


def _safe(function, *arguments):
    """None where a specimen this strange has no equilibrium."""
    try:
        with np.errstate(all="ignore"):
            found = function(*arguments)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return found if np.isfinite(found["log_bayes"]) else None


def _height(found, masked):
    """What is brought to its target: evidence; of a masked case what a validation recording shows."""
    if masked:
        return min(found["validation_gain"], 1e3 * max(MASKED_CHI2 - found["fit_chi2"], -0.01))
    return found["log_bayes"]


def _reach(specimen, direction, target):
    """Amplitude along `direction` whose post-refit evidence comes closest to a target, and its verdict."""
    low, high, best = 0.0, 1.0, None
    share = 0.25
    for _ in range(9):
        found = _safe(specimen.judge, share * direction)
        if found is None:
            high, share = share, 0.35 * share + 0.65 * low
            continue
        gain = max(found["log_bayes"] + occam(max(found["log_bayes"], 0.0)), 0.05)
        if best is None or abs(np.log(gain / target)) < abs(np.log(best[0] / target)):
            best = (gain, share, found)
        if abs(found["log_bayes"] / target - 1.0) < 0.12 or (share >= 1.0 and gain < target):
            break
        low, high = (share, high) if found["log_bayes"] < target else (low, share)
        wanted = share * np.clip(np.sqrt(target / gain), 0.15, 6.0)
        inside = low < wanted < high
        share = wanted if inside else high if wanted >= high and high == 1.0 else 0.5 * (low + high)
    return (None, None) if best is None else (best[1], best[2])


def _reach_masked(specimen, direction):
    """The largest amplitude that still looks acceptable in what is fitted."""
    low, high, best = 0.0, 1.0, (None, None)
    share = 0.1
    for _ in range(10):
        found = _safe(specimen.judge, share * direction)
        if found is not None and found["fit_chi2"] < MASKED_CHI2:
            best, low = (share, found), share
            if share >= 1.0 or found["validation_gain"] > 2000.0:
                break
        else:
            high = share
        share = min(3.0 * share, 1.0) if high == 1.0 and share < 1.0 else np.sqrt(max(low, 1e-3) * high)
    return best


def _strengthen(specimen, group, target):
    """Amplitudes and verdict of a case's effects."""
    count = len(specimen.effects)
    if group == "masked":
        share, found = _reach_masked(specimen, np.ones(count))
        return (None, None, None) if share is None else (np.full(count, share), found, None)
    alone = []
    for number in range(count):
        direction = np.eye(count)[number]
        share, found = _reach(specimen, direction, target)
        if share is None:
            return None, None, None
        alone.append((share, found))
    if count == 1:
        return np.array([alone[0][0]]), alone[0][1], None
    amplitudes = np.array([share for share, _ in alone])
    found = _safe(specimen.judge, amplitudes)
    each = [round(found_alone["log_bayes"], 1) for _, found_alone in alone]
    return (amplitudes, found, each) if found is not None else (None, None, None)


def _rounded(value):
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, (list, tuple)) else value


def build(kind, group, slugs, strength, seed):
    """(bench, recorded columns (K, N), truth) of a case.

    A specimen that cannot reach at least half the strength asked for is replaced, up to four times; then the strongest
    one is taken and what it reached is what the truth says.
    """
    if group == "null":
        specimen = Specimen(kind, (), seed)
        columns, found, each = specimen.columns(np.zeros((1, 0))), None, None
    else:
        tried = []
        for attempt in range(4):
            specimen = Specimen(kind, slugs, seed, group == "masked", attempt)
            amplitudes, found, each = _strengthen(specimen, group, strength)
            if found is None:
                continue
            height = found["validation_gain"] if group == "masked" else found["log_bayes"]
            tried.append((height, attempt, specimen, amplitudes, found, each))
            if height > (100.0 if group == "masked" else 0.5 * strength):
                break
        if not tried:
            raise ArithmeticError(f"no specimen of {kind} with {slugs} has an equilibrium")
        _, _, specimen, amplitudes, found, each = max(tried, key=lambda t: t[:2])
        columns = specimen.columns([amplitudes])
    bench = specimen.bench
    recorded = {c: columns[c][0] + specimen.noise.get(c, 0.0) for c in bench.measured}
    return bench, recorded, _truth(specimen, group, slugs, strength, found, each)


def _truth(specimen, group, slugs, strength, found, each):
    effects = specimen.effects
    truth = {
        "kind": specimen.bench.kind,
        "group": group,
        "slugs": ["unmodelled"] if group == "outside" else list(slugs),
        "outside": list(slugs) if group == "outside" else [],
        "strength": strength,
        "log_bayes_post_refit": found["log_bayes"] if found else None,
        "log_bayes_each": each,
        "component": effects[0].where(specimen.bench) if effects else None,
        "driver": list(effects[0].drivers) if effects else [],
        "where": [{"component": e.where(specimen.bench), "driver": list(e.drivers)} for e in effects],
        "parameters": {e.slug: e.describe() for e in effects},
        "base": {name: specimen.numbers[name] for name in sorted(specimen.bench.tolerance)},
        "flavour": specimen.bench.flavour,
        "refitted_base": {k: v for k, v in (found or {}).items() if k != "log_bayes"},
    }
    return _rounded(truth)
