"""Choice of the further test that shrinks error bars most, by expected information from the model's
sensitivities.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import numpy as np

from fitting.calibrate.information import Information
from fitting.inference.parameters import Parameters
from fitting.specimens import Rows, stack
from fitting.specimens.process_noise import WALK
from fitting.specimens.spring_rows import GEOMETRY
from fitting.specimens.spring_trajectory import at_phase, undecided
from pneusma_jax import SpringGeometry
from pneusma_jax.errors import InputError

from .information import fisher
from .problem import Problem
from .reach import HOT_STEPS, steps_of
from .residuals import values_of
from .stand_tests import LEVEL, Phase, StandTest

BETWEEN = (0.9, 0.75, 0.6)
"""Martensite fractions of the candidate tests between cold and hot."""
CYCLES = (0.2, 0.4, 0.6, 0.8, 1.0)
"""Peaks of the cyclic pull, as shares of the furthest strain (the source's sequence)."""
RATE = 0.0384
"""Spring strain per second of the source's tests."""
NOTHING = 0.02
"""Shrinkage of an error bar below which a test is not said to help it."""


@dataclass(frozen=True)
class Candidate:
    """A further test and what it is worth.

    Attributes:
        name: such as `cold_575`.
        text: description of the test.
        information: expected gain about all free parameters [nats].
        sd: standard error of each parameter after it, SI.
        shrinks: parameters whose error bar it shrinks most, with the ratio after to before, the most first.
    """

    name: str
    text: str
    information: float
    sd: dict[str, float]
    shrinks: tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class NextTest:
    """The candidates, the most informative first.

    Attributes:
        sd: standard error of each parameter now, SI.
        candidates: further tests.
        text: the recommendation.
    """

    sd: dict[str, float]
    candidates: tuple[Candidate, ...]
    text: str


def next_test(problem: Problem, parameters: Parameters, found: Information, identify: bool) -> NextTest:
    """Compare further tests of the same specimen on the same stand.

    Args:
        problem: the fitted problem.
        parameters: free parameters at the values found.
        found: information of the tests that were made.
        identify: the alloy is being identified, so cold and hot tests are held at those phases. Of a known
            alloy they are, where tests of that phase that were made are.
    """
    template = problem.rows[problem.fitted[0]]
    plans = _plans([problem.tests[k] for k in problem.fitted], _reach(template))
    values = parameters.valuesdict()
    level = np.asarray(problem.stacked.extra["level"])
    held = {float(level[k]) for k in problem.fitted if k not in problem.free_tests}
    held |= {0.0, 1.0} if identify else set()
    designed = [_design(problem, template, phase, xi0, strain, held) for _, _, phase, xi0, strain in plans]
    stacked = _measured(values_of(problem.parameters, values), stack(designed, problem.stacked))
    each = fisher(problem, values, stacked)
    now = found.sd()
    candidates = []
    for (name, text, *_), more in zip(plans, each, strict=False):
        after = found.sd(more)
        ratio = np.where(now > 0.0, after / np.where(now > 0.0, now, 1.0), 1.0)
        order = np.argsort(ratio)
        shrinks = tuple((found.names[k], float(ratio[k])) for k in order[:4] if ratio[k] < 1.0 - NOTHING)
        sd = dict(zip(found.names, (float(x) for x in after), strict=True))
        candidates.append(Candidate(name, text, found.gain(more), sd, shrinks))
    candidates.sort(key=lambda candidate: -candidate.information)
    sd = dict(zip(found.names, (float(x) for x in now), strict=True))
    return NextTest(sd, tuple(candidates), _sentence(candidates))


def _reach(template: Rows) -> tuple[float, float]:
    """Spring strains to which a specimen is pulled cold, and hot; 0 where its dimensions give no answer."""
    geometry = SpringGeometry(**{name: float(template.base[name]) for name in GEOMETRY})
    try:
        steps = steps_of(geometry)
    except InputError:
        return 0.0, 0.0
    return steps[-1], steps[HOT_STEPS - 1]


def _plans(
    tests: Sequence[StandTest], reach: tuple[float, float]
) -> list[tuple[str, str, Phase, float, float]]:
    """Name, words, phase, martensite fraction and largest spring strain of every candidate.

    Args:
        tests: tests that were made, at least one.
        reach: limits from `_reach`; tests that were made keep their own largest strain.
    """
    made = max(test.strain for test in tests)
    far, hot_far = (strain or made for strain in reach)
    plans: list[tuple[str, str, Phase, float, float]] = []
    for phase, xi0 in (("cold", 1.0), ("hot", 0.0)):
        reached = max((test.strain for test in tests if test.phase == phase), default=0.0)
        furthest = max(far if phase == "cold" else hot_far, reached)
        percent = 100.0 * furthest
        how = "at room temperature" if phase == "cold" else "at full heating"
        again = " again" if reached > 0.95 * furthest else ""
        plans.append((
            f"{phase}_{percent:.0f}",
            f"pull the spring {how}{again}, in five growing cycles to {percent:.0f} % spring strain",
            phase, xi0, furthest,
        ))  # fmt: skip
    for xi0 in BETWEEN:
        strain = far if xi0 > 0.85 else hot_far
        plans.append((
            f"between_{100.0 * xi0:.0f}",
            f"hold the resistance that the relaxed spring has at a martensite fraction of {xi0:g} and "
            "pull it in five "
            f"growing cycles to {100.0 * strain:.0f} % spring strain",
            "intermediate", xi0, strain,
        ))  # fmt: skip
    return plans


def _design(
    problem: Problem, template: Rows, phase: Phase, xi0: float, strain: float, held: Collection[float]
) -> Rows:
    """A test that has not been made, at a constant martensite fraction; as long as those that have."""
    size = problem.stacked.mask.shape[1] * 3 // 4
    peaks = np.array(CYCLES) * strain * float(template.base["free_length"])
    corners = np.concatenate([[0.0], np.stack([peaks, np.zeros(len(peaks))], axis=1).ravel()])
    walked = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)))])
    place = np.linspace(0.0, walked[-1], size)
    elongation = np.interp(place, walked, corners)
    sigma = {name: _typical(problem, name) for name in template.weight}
    level = LEVEL[phase] if LEVEL[phase] in held else None
    usual = lambda name: np.asarray(np.median(np.asarray(problem.stacked.extra[name])))  # noqa: E731
    extra = {
        **undecided(template).extra,
        "level": np.asarray(xi0 if level is None else level),
        "level_sd": np.asarray(0.5 if level is None else 0.0),
        **{name: usual(name) for name in WALK},
        "loading": np.ones(size),
    }
    return Rows(
        mask=np.ones(size, bool),
        time=place / (RATE * float(template.base["free_length"])),
        inputs={"elongation": elongation, "resistance": np.full(size, xi0)},
        measured={name: np.zeros(size) for name in template.measured},
        weight={name: np.full(size, 1.0 / (s * problem.inflation)) for name, s in sigma.items()},
        base=template.base,
        extra=extra,
        specimen=template.specimen,
    )


def _typical(problem: Problem, name: str) -> float:
    """Median 1-sigma of an output over the tests."""
    weight = np.asarray(problem.stacked.weight[name])
    return float(np.median(1.0 / weight[weight > 0.0])) if np.any(weight > 0.0) else 1.0


@jax.jit
def _measured(values: Mapping, stacked: Rows) -> Rows:
    """The designed tests with what they would measure; `inputs["resistance"]` holds the phase until then."""

    def simulate(rows: Rows) -> dict:
        found = at_phase(values, rows, rows.inputs["resistance"])
        return {"force": found.force, "resistance": found.resistance}

    outputs = jax.vmap(simulate)(stacked)
    return eqx.tree_at(
        lambda r: (r.measured, r.inputs["resistance"]), stacked, (outputs, outputs["resistance"])
    )


def _sentence(candidates: Sequence[Candidate]) -> str:
    best = candidates[0]
    helped = ", ".join(f"{name} to {100.0 * ratio:.0f} %" for name, ratio in best.shrinks)
    text = f"{best.text[0].upper()}{best.text[1:]}: expected information {best.information:.1f} nats"
    text += f"; it would shrink the error of {helped} of its present size." if helped else "."
    first: dict[str, Candidate] = {}  # that shrinks a constant most of all, the most informative
    for candidate in candidates:
        if candidate.shrinks:
            first.setdefault(candidate.shrinks[0][0], candidate)
    others = [(name, candidate) for name, candidate in first.items() if candidate is not best]
    for name, candidate in others[:2]:
        ratio = candidate.shrinks[0][1]
        text += (
            f" For {name} ({100.0 * ratio:.0f} % left): {candidate.text} ({candidate.information:.1f} nats)."
        )
    return text
