"""Numbered cases of the blind trial. The concealed physics of each follows from its seed and is written
nowhere."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .generator import registry
from .generator.building import build
from .generator.readout import READOUTS
from .generator.writing import write

KINDS = ("actuator", "spring", "wire", "elastomer", "tube")
WEAKER = (6.0, 15.0, 30.0, 100.0)
"""Post-refit log Bayes factors of the ladder of weak effects. Strong effects are drawn from 30 to 3000."""
STRONG = (30.0, 3000.0)


@dataclass(frozen=True)
class Case:
    """One campaign to be made. `strength` is a target of the post-refit log Bayes factor of the true form, or
    None.

    For a null whose channels are digitised (group "readout") `slugs` names the digitisation. Its truth holds
    no effect.
    """

    name: str
    kind: str
    group: str
    slugs: tuple
    strength: float | None
    seed: int


def _pairs(rng, count):
    """Pairs of one kind whose members are not two names of one cause."""
    out = []
    while len(out) < count:
        kind = str(rng.choice(KINDS, p=[0.45, 0.2, 0.1, 0.1, 0.15]))
        slugs = sorted(s for k, s in registry.NAMED if k == kind)
        if len(slugs) < 2:
            continue
        two = tuple(str(s) for s in rng.choice(slugs, 2, replace=False))
        first, second = (registry.NAMED[kind, s] for s in two)
        clash = any(first.wants.get(k, v) != v for k, v in second.wants.items())
        if not clash and first.__name__ != second.__name__:
            out.append((kind, two))
    return out


def _strong(rng):
    return float(np.exp(rng.uniform(*np.log(STRONG))))


def _cycle(rng, options, count):
    """`count` draws that use all options before any is repeated."""
    order = []
    while len(order) < count:
        order += [options[k] for k in rng.permutation(len(options))]
    return order[:count]


SIZES = {"development": (10, 24, 8, 5, 5, 6), "fixed": (8, 8, 2, 2, 2, 2), "full": (320, 150, 200, 48, 48, 48)}
"""Numbers of cases: nulls, strong singles, weaker singles, pairs, masked, outside."""


READOUT_NULLS = 100
"""Number of cases of plan "readout": nulls whose channels are rounded, clipped or re-sampled."""


def case_list(plan, seed):
    """Cases of a plan ("development", "fixed", "full" or "readout"), in an order whose every prefix is a fair
    sample.

    The same plan and seed give the same list. Names say nothing of the truth. Raises ValueError for another
    plan.
    """
    if plan != "readout" and plan not in SIZES:
        raise ValueError(f"plan must be one of {', '.join([*SIZES, 'readout'])}, but is {plan!r}")
    rng = np.random.default_rng([seed, 7])
    if plan == "readout":
        ways = [(kind, way) for kind in KINDS for way in READOUTS]
        return _numbered([(kind, "readout", (way,), None) for kind, way in _cycle(rng, ways, READOUT_NULLS)], seed, rng)
    nulls, strong, weaker, pairs, masked, outside = SIZES[plan]
    named, beyond = sorted(registry.NAMED), sorted(registry.OUTSIDE)
    hidden = sorted(key for key, cls in registry.NAMED.items() if key[0] in cls.maskable)
    rows = [(kind, "null", (), None) for kind in _cycle(rng, KINDS, nulls)]
    rows += [(kind, "single", (slug,), _strong(rng)) for kind, slug in _cycle(rng, named, strong)]
    rows += [
        (kind, "single", (slug,), WEAKER[n % len(WEAKER)]) for n, (kind, slug) in enumerate(_cycle(rng, named, weaker))
    ]
    rows += [(kind, "pair", two, _strong(rng)) for kind, two in _pairs(rng, pairs)]
    rows += [(kind, "masked", (slug,), None) for kind, slug in _cycle(rng, hidden, masked)] if hidden else []
    rows += [(kind, "outside", (name,), _strong(rng)) for kind, name in _cycle(rng, beyond, outside)] if beyond else []
    return _numbered(rows, seed, rng)


def _numbered(rows, seed, rng):
    """Cases of rows (kind, group, slugs, strength), each with a seed of its own, in shuffled order."""
    seeds = np.random.SeedSequence([seed, 11]).generate_state(len(rows))
    order = rng.permutation(len(rows))
    return [Case(f"c{n:04d}", *rows[k], int(seeds[k])) for n, k in enumerate(order)]


def write_case(case, folder):
    """Write the campaign of a case into `folder` (made if absent) and return its truth, which is not
    written."""
    folder = Path(folder)
    bench, recorded, truth = build(case.kind, case.group, case.slugs, case.strength, case.seed)
    folder.mkdir(parents=True, exist_ok=True)
    write(bench, recorded, folder)
    return {"name": case.name} | truth


def truth_of(case):
    """Truth of a case, recomputed from its seed."""
    return {"name": case.name} | build(case.kind, case.group, case.slugs, case.strength, case.seed)[2]
