"""Construction of a case from its seed: bench, specimen, concealed physics at the requested strength, noise,
files, truth."""

import numpy as np

from . import stand
from .detectability import felt_inputs, linear_gains, occam, rest_of, verdict, whiteners
from .noise import Instruments
from .plans import plan, true_numbers
from .readout import read_out
from .registry import effect_class

MASKED_CHI2 = 1.22
"""Maximum reduced chi-square of a masked case on its fitted recordings, so that it looks acceptable."""
LADDER = np.geomspace(2e-3, 1.0, 8)


class Specimen:
    """Bench, true constants, effects and noise of one case; nothing here depends on the effects' strength."""

    def __init__(self, kind, names, seed, masked=False, attempt=0):
        def stream(purpose):
            return np.random.default_rng([seed, purpose, attempt])

        classes = [effect_class(kind, name) for name in names]
        wants = {k: v for cls in classes for k, v in cls.wants.items() if kind == "actuator"}
        self.bench = plan(kind, stream(1), masked=masked, blind=0.03 if names else 0.15, **wants)
        self.numbers = true_numbers(self.bench, stream(2))
        self.instruments = Instruments(self.bench, stream(3))
        self.effects = [cls(stream(10 + n), self.bench) for n, cls in enumerate(classes)]
        self.clean = {c: v[0] for c, v in stand.truth(self.bench, self.numbers).items()}
        for number, effect in enumerate(self.effects):
            effect.prepare(stream(30 + number), self.bench, self.clean)
        draws = stream(4)
        self.noise = {c: self.instruments.draw(c, self.clean[c], draws) for c in sorted(self.bench.noise)}
        names = sorted(self.bench.tolerance)
        self.true_z = np.array([(self.numbers[n] / self.bench.nominal[n] - 1.0) / self.bench.tolerance[n] for n in names])
        if classes:
            self.felt = felt_inputs(self.bench, self.clean, self.noise, self.true_z)
            self.whiten = whiteners(self.bench, self.instruments, self.clean, self.felt)
            self.rest = rest_of(self.bench, self.whiten, self.clean, self.noise, self.true_z, self.felt)
            self.start = self.rest.end if self.rest else self.true_z

    def columns(self, amplitudes):
        """Noise-free columns (B, K, N) at amplitudes (B, number of effects) in parts of each effect's
        ceiling."""
        amplitudes = np.asarray(amplitudes, float)
        for effect, column in zip(self.effects, amplitudes.T, strict=True):
            effect.amplitude = (effect.ceiling * column)[:, None]
        return stand.truth(self.bench, self.numbers, self.effects)

    def judge(self, amplitudes, starts=None, held=True):
        """The verdict on one set of amplitudes."""
        columns = {c: v[:1] for c, v in self.columns([amplitudes]).items()}
        active = max(int(np.count_nonzero(amplitudes)), 1)
        return verdict(
            self.bench, self.whiten, columns, self.noise, self.true_z, self.felt, self.rest, active, starts, held
        )

    def ladder(self, direction):
        """Amplitudes along a direction with their gains to first order; empty where no state exists."""
        for top in (1.0, 0.3, 0.08, 0.02):
            shares = top * LADDER
            try:
                with np.errstate(all="ignore"):
                    columns = self.columns(np.outer(shares, direction))
                    gains = linear_gains(
                        self.bench, self.whiten, self.clean, self.noise, self.true_z, self.felt, columns
                    )
            except (ArithmeticError, np.linalg.LinAlgError):
                continue
            if np.all(np.isfinite(gains)):
                return shares, np.maximum(gains, 1e-6)
        return np.array([]), np.array([])


def _none_if_unsolvable(function, *arguments):
    """Result of a function, or None where an extreme specimen has no equilibrium."""
    try:
        with np.errstate(all="ignore"):
            found = function(*arguments)
    except (ArithmeticError, np.linalg.LinAlgError):
        return None
    return found if np.isfinite(found["log_bayes"]) else None


def _share_for(shares, gains, gain):
    """Amplitude at which a ladder first reaches a gain; its top where it never does."""
    above = np.flatnonzero(gains >= gain)
    if len(above) == 0:
        return shares[-1]
    n = above[0]
    if n == 0:
        return shares[0] * np.sqrt(gain / gains[0])
    position = np.log(gain / gains[n - 1]) / np.log(gains[n] / gains[n - 1])
    return shares[n - 1] * (shares[n] / shares[n - 1]) ** position


def _next_share(low, high, goal):
    """Next amplitude from the closest (amplitude, gain) below and above a goal, either of which may be
    missing."""
    if low is None or high is None:
        share, gain = low or high
        return share * np.clip(np.sqrt(goal / gain), 0.4, 2.5)
    position = np.log(goal / low[1]) / np.log(high[1] / low[1])
    return low[0] * (high[0] / low[0]) ** np.clip(position, 0.2, 0.8)


def _reach(specimen, direction, target):
    """Amplitude along `direction` whose post-refit evidence is closest to a target, and its verdict.

    A linear ladder gives the start. Refits correct it, because a base that adapts more than to first order
    leaves less evidence.
    """
    shares, gains = specimen.ladder(direction)
    if len(shares) == 0:
        return None, None
    goal, starts = target + occam(target), [specimen.start]
    share, best, low, high = _share_for(shares, gains, goal), None, None, None
    for _ in range(6):
        found = _none_if_unsolvable(specimen.judge, share * direction, starts, False)
        if found is None:
            share *= 0.5
            continue
        gain = max(found["log_bayes"] + occam(max(found["log_bayes"], 0.0)), 0.3)
        miss = abs(np.log(gain / goal))
        if best is None or miss < best[0]:
            best = (miss, share, found)
        if miss < 0.2 or (share >= shares[-1] and gain < goal):
            break
        low, high = ((share, gain), high) if gain < goal else (low, (share, gain))
        share = min(_next_share(low, high, goal), shares[-1])
        starts = [found["end"]]
    if best is None:
        return None, None
    ends = [best[2]["end"]] + ([] if specimen.bench.hidden else [np.zeros_like(specimen.true_z)])
    return best[1], _none_if_unsolvable(specimen.judge, best[1] * direction, ends)


def _reach_masked(specimen, direction):
    """The largest amplitude that still looks acceptable on the fitted recordings, without being obvious
    elsewhere."""
    shares, gains = specimen.ladder(direction)
    if len(shares) == 0:
        return None, None
    rows = int(np.sum(specimen.bench.kept()[specimen.bench.fitted()])) * len(specimen.bench.outputs)
    aim, best = 0.5 * rows * (MASKED_CHI2 - 1.0), (None, None)
    for _ in range(5):
        share = _share_for(shares, gains, aim)
        found = _none_if_unsolvable(specimen.judge, share * direction, [specimen.start])
        obvious = found is not None and found["log_bayes"] > 20.0 and found["validation_gain"] > 5000.0
        if found is not None and found["fit_chi2"] < MASKED_CHI2 and not obvious:
            if best[0] is None or share > best[0]:
                best = (share, found)
            if share >= shares[-1] or found["fit_chi2"] > MASKED_CHI2 - 0.1:
                break
            aim *= 2.0
        else:
            aim *= 0.5
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
    found = _none_if_unsolvable(specimen.judge, amplitudes)
    each = [round(found_alone["log_bayes"], 1) for _, found_alone in alone]
    return (amplitudes, found, each) if found is not None else (None, None, None)


def _rounded(value):
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, dict):
        return {k: _rounded(v) for k, v in value.items()}
    return [_rounded(v) for v in value] if isinstance(value, (list, tuple)) else value


def build(kind, group, slugs, strength, seed):
    """Bench, recorded columns (K, N) and truth of a case.

    A group "readout" is a null whose channels are digitised as its slug says; see `readout`. A specimen that
    cannot reach at least half the requested strength is replaced, up to four times. Then the strongest one is
    taken, and the truth states its actual strength.
    """
    if group in ("null", "readout"):
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
    truth = _truth(specimen, group, slugs, strength, found, each)
    if group == "readout":
        bench, recorded = read_out(bench, recorded, slugs[0], np.random.default_rng([seed, 5]))
        truth |= {"slugs": [], "readout": slugs[0]}
    return bench, recorded, truth


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
        "refitted_base": {k: v for k, v in (found or {}).items() if k not in ("log_bayes", "end")},
    }
    return _rounded(truth)
