"""From a campaign of springs on a stand to a characterised alloy."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from fitting.calibrate.assumed import notices_of
from fitting.calibrate.profile_likelihood import Profile, loosest, lower_end
from fitting.calibrate.result import Characterisation, Estimate
from fitting.data.recordings import Campaign
from fitting.inference.parameters import Parameters
from fitting.specimens import SPRING, priors
from fitting.specimens.spring_trajectory import ALLOY
from pneusma_jax.calibration import Calibration, available, load_calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy
from pneusma_jax.precision import require_float64
from pneusma_jax.units import to_si

from .alloy_table import alloy_table, estimate
from .information import Information, information, sentences, spread_given_geometry
from .joint import Joint, fit_jointly, loosened, retried, shifted, spanned, try_others
from .memory_starts import memory_starts
from .modes import Mode, other_modes
from .next_test import NextTest, next_test
from .problem import Problem
from .profiles import profiles
from .scores import Score, scores
from .stages import Stage, run_stages
from .stand_tests import LEVEL, Phase, StandTest, classify

STARTS = 3
PROFILES = 2
CHANCE, MORE = 3.5, 6
"""Standard deviations of a reduced chi-square above 1 from which a known alloy is fitted from further starts,
and how many: rows that a spring remembers shut fits in."""
FAR = 4.0
"""Standard deviations along the loosest direction at which one start is placed."""


@dataclass(frozen=True)
class SpringCharacterisation(Characterisation):
    """An alloy identified, or checked, from springs on a stand.

    Attributes:
        title: of the campaign.
        identify: the alloy was identified; otherwise it was known and only adjusted within its tolerances.
        tests: the recordings, classified.
        stages: what each stage found; empty for a known alloy.
        joint: the joint fit.
        base: constants of the alloy that it started from.
        start: values of the free parameters before any fit, SI.
        information: what the tests say.
        identifiability: what they do not say, in words.
        modes: other parameter sets that fit as well.
        profiles: profile likelihoods by parameter.
        scores: every test predicted from resistance.
        next_test: which further test would help most.
        real: measured (True), simulated (False), or nobody said (None).
        notices: what was assumed or left out.
        seed: of the scattered starts.
    """

    title: str
    identify: bool
    tests: tuple[StandTest, ...]
    stages: tuple[Stage, ...]
    joint: Joint
    base: dict[str, Quantity]
    start: dict[str, float]
    information: Information
    identifiability: list[dict[str, Any]]
    modes: tuple[Mode, ...]
    profiles: dict[str, Profile]
    scores: tuple[Score, ...]
    next_test: NextTest
    real: bool | None
    notices: tuple[str, ...]
    seed: int

    @property
    def fitted(self) -> Parameters:
        """Free parameters at the values found, in SI, with standard errors and correlations."""
        return self.joint.parameters

    @property
    def alloy(self) -> Alloy:
        """The alloy found, as the model takes it."""
        return Alloy.from_calibration(self.table())

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Constants of the alloy and dimensions that were free, in the unit of files."""
        return {name: estimate(entry) for name, entry in self.fitted.items()}

    def sd_given_geometry(self) -> dict[str, float]:
        """Standard errors of the alloy's constants if the dimensions were exactly as stated, SI."""
        return spread_given_geometry(self.information, [n for n in self.information.names if n in ALLOY])

    def table(self) -> Calibration:
        """The alloy as a table of constants."""
        return alloy_table(self.title, self.base, self.fitted, self.real is False, {})


def characterise_spring(
    campaign: Campaign,
    *,
    base: str | Path | None = None,
    phases: Mapping[str, Phase] | None = None,
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    starts: int = STARTS,
    profile: int | Sequence[str] = PROFILES,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> SpringCharacterisation:
    """Identify an alloy from springs on a stand, or adjust a known one within its tolerances.

    With `alloy = "fit"` in the recordings everything is found, in the source's stages and then jointly; the
    tests whose resistance at rest is farthest from that of the stiffest are taken to be fully martensitic,
    and the stiffest fully austenitic, as the source does.
    With a named alloy only what `[tolerance]` leaves open is.

    Args:
        campaign: recordings of kind `spring` of one alloy.
        base: table to start from, instead of the one named, or of a nitinol that nobody has characterised.
        phases: `cold`, `hot` or `intermediate` for recordings, by name, whose phase is known better.
        adjust: changes to free parameters by name, each a mapping with any of `value`, `min`, `max` (in the
            unit of files), `vary` and `tie`: `{"gR_decay": {"value": 5, "vary": False}}`.
        starts: joint fits in all, from different places.
        profile: parameters to profile, or how many of the loosest.
        seed: of what is drawn.
        progress: called with a word for each step that is done.

    Raises:
        InputError: if the recordings or options cannot be used, in one line.
    """
    require_float64()
    recordings = campaign.of_kind("spring")
    if not any(recording.role == "fit" for recording in recordings):
        raise InputError(
            f'{campaign.path}: every recording has role = "validation"; at least one with role = "fit" is '
            "needed"
        )
    quantities, identify = priors.alloy_quantities(campaign, ALLOY, base)
    known = None if identify else Alloy(**{name: q.value for name, q in quantities.items()})
    tests = classify(recordings, phases, known)
    problem = _problem(campaign, tests, base, identify, adjust or {})
    start = {name: entry.value for name, entry in problem.parameters.items()}
    staged, stages = run_stages(problem, progress) if identify else (start, [])
    joint = fit_jointly(problem, staged, progress)
    if identify:
        again = memory_starts(joint.problem.inflated(1.0), staged, seed, progress)
        joint = retried(loosened(try_others(joint, again, progress), progress), progress)
    others = _other_starts(joint, stages, identify, starts - 1, seed)
    single = try_others(joint, others, progress)
    if not identify and _suspicious(single):
        more = _draws(single, MORE, np.random.default_rng([seed, 1]), "further draw")
        single = try_others(single, more, progress)
    joint = spanned(single)
    free = list(joint.problem.parameters)
    wanted = loosest(joint.parameters, free, profile) if isinstance(profile, int) else list(profile)
    profiled = profiles(joint, wanted)
    progress("profiles")
    lower = lower_end(profiled)
    if lower:  # the fit had not reached its end
        single = try_others(single, {f"the profile of {lower[0]}": lower[1]}, progress)
        joint = spanned(single)
        profiled = profiles(joint, wanted)
        progress("profiles again")
    told = information(joint.problem, joint.parameters)
    progress("information")
    fitted = [test for test in tests if test.fitted]
    further = next_test(joint.problem, joint.parameters, told, identify)
    stated = [recording.real for recording in recordings]
    return SpringCharacterisation(
        title=campaign.title,
        identify=identify,
        tests=tuple(tests),
        stages=tuple(stages),
        joint=joint,
        base=quantities,
        start=start,
        information=told,
        identifiability=sentences(told, joint.parameters, start, fitted),
        modes=tuple(other_modes(single)),
        profiles=profiled,
        scores=tuple(scores(joint.problem, joint.values)),
        next_test=further,
        real=False if False in stated else None if None in stated else True,
        notices=tuple(notices_of(recordings)),
        seed=seed,
    )


def _problem(
    campaign: Campaign, tests: Sequence[StandTest], base: Any, identify: bool, adjust: Mapping[str, Mapping]
) -> Problem:
    held = {t.name: LEVEL[t.phase] for t in tests if LEVEL[t.phase] is not None} if identify else {}
    parameters = SPRING.parameters_for(campaign, base=base)
    if not parameters:
        raise InputError(
            f"{campaign.path}: the alloy is known and the tolerances leave nothing open; "
            'state alloy = "fit", or a [tolerance]'
        )
    changes = {name: _in_si(parameters, name, change) for name, change in adjust.items()}
    rows = SPRING.rows_for(campaign, base=base, held_at=held)
    return Problem.of(tests, rows, priors.adjusted(parameters, changes))


def _in_si(parameters: Parameters, name: str, change: Mapping[str, Any]) -> dict[str, Any]:
    """A change in the unit of files, in SI."""
    if name not in parameters:
        return dict(change)
    unit = parameters[name].unit
    return {
        key: to_si(value, unit) if key in ("value", "min", "max") else value for key, value in change.items()
    }


def _other_starts(
    joint: Joint, stages: Sequence[Stage], identify: bool, count: int, seed: int
) -> dict[str, dict[str, float]]:
    """Further places to start from: along the loosest direction, the published alloys, then drawn from the
    priors.
    """
    free = joint.problem.parameters
    found = {"the loosest direction": shifted(joint.result, FAR)}
    last = stages[-1] if stages else None
    if last is not None and last.result is not None:
        found["what unloading gave alone"] = {n: last.result.values[n] for n in last.parameters}
    if identify:
        for name in available("alloy"):
            table = load_calibration(name).values()
            if set(free) <= set(table):
                found[f"the constants of {name}"] = {n: table[n] for n in free}
    found |= _draws(joint, max(count - len(found), 0), np.random.default_rng(seed), "draw")
    return dict(list(found.items())[: max(count, 0)])


def _draws(joint: Joint, count: int, random: np.random.Generator, name: str) -> dict[str, dict[str, float]]:
    """Starts drawn from the priors."""
    priors_of = {n: p.prior for n, p in joint.problem.parameters.items() if p.prior is not None}
    return {
        f"{name} {k + 1} from the priors": {n: random.normal(p.mean, p.sd) for n, p in priors_of.items()}
        for k in range(count)
    }


def _suspicious(joint: Joint) -> bool:
    """Whether more is left than chance leaves, so that the fit may have been shut in."""
    freedom = max(joint.starts[0].result.degrees_of_freedom, 1)
    return joint.reduced_chi_square > 1.0 + CHANCE * float(np.sqrt(2.0 / freedom))
