"""Characterisation of an alloy from a campaign of springs on a stand."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fitting.calibrate.alloy_table import alloy_table
from fitting.calibrate.assumed import notices_of
from fitting.calibrate.combinations import Combination
from fitting.calibrate.information import Information
from fitting.calibrate.open_constants import of_unfitted, open_constants
from fitting.calibrate.profile_likelihood import Profile
from fitting.calibrate.profiled_fits import with_intervals
from fitting.calibrate.quoted import estimates
from fitting.calibrate.result import Characterisation, Estimate
from fitting.data.recordings import Campaign, all_real
from fitting.inference.lasting_noise import (
    Lasting,
    covariance_beside_zeros,
    side_variances_by_name,
    variances_by_name,
)
from fitting.inference.notes import joined
from fitting.inference.parameters import Parameters
from fitting.inference.progress import Stages
from fitting.specimens import priors
from fitting.specimens.rows import MARK
from fitting.specimens.specimen import EVERY
from fitting.specimens.spring_rows import ALLOY
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.nitinol import Alloy
from pneusma_jax.precision import require_float64

from .information import information, informing_tests, spread_given_geometry, why_not_shown
from .joint import Joint
from .modes import Mode, other_modes
from .next_test import NextTest, next_test
from .other_fits import spanned
from .plateaus import plateaus
from .profiles import with_other_fits
from .scores import Score, scores
from .search import Fitted, Reading, begun_readings, best_of_begun, best_of_readings, order, readings_of
from .searched import FITS, LAST, PROFILE, ZERO, Searched, searched_to_the_end
from .stages import Stage
from .stand_tests import STATED, Phase, Softer, StandTest
from .valleys import with_valleys

STARTS = 3
DIAMETER = "wire_diameter"


@dataclass(frozen=True)
class SpringCharacterisation(Characterisation):
    """An alloy identified, or checked, from springs on a stand.

    Attributes:
        title: title of the campaign.
        identify: the alloy was identified; otherwise it was known and only adjusted within its tolerances.
        tests: the recordings, classified.
        stages: results of the stages; empty for a known alloy.
        joint: the joint fit.
        base: constants of the alloy that it started from.
        start: values of the free parameters before any fit, SI.
        information: Fisher information of the tests.
        identifiability: sentences about open or loosely known constants.
        modes: other parameter sets that fit as well.
        profiles: profile likelihoods by parameter.
        scores: every test predicted from resistance.
        next_test: the further test that would help most.
        real: measured (True), simulated (False), or nobody said (None).
        notices: assumptions and omissions.
        seed: seed of the scattered starts.
        softer: the phase that was taken as the softer one; None for a known alloy.
        combinations: quantities that the tests determine best: resistivities and stresses of both phases.
        path: folder or file of the campaign.
        lasting: zeros of force and resistance that are off or drift, and what they add to errors.
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
    softer: Softer | None = None
    combinations: tuple[Combination, ...] = ()
    lasting: Lasting | None = None
    path: Path | None = None

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
        if self.lasting is None:
            return estimates(self.fitted, self.profiles)
        names = self.information.names
        variances = variances_by_name(self.lasting, names)
        return estimates(self.fitted, self.profiles, variances, side_variances_by_name(self.lasting, names))

    def sd_given_geometry(self) -> dict[str, float]:
        """Standard errors of the alloy's constants if the dimensions were exactly as stated, SI."""
        return spread_given_geometry(self.information, [n for n in self.information.names if n in ALLOY])

    def table(self) -> Calibration:
        """The alloy as a table of constants."""
        begun = [test.recording.full_geometry()["prestrain"] for test in self.tests]
        return alloy_table(self.title, self.base, self.fitted, self.real is False, self.parameters, begun)


def characterise_spring(
    campaign: Campaign,
    *,
    base: str | Path | None = None,
    phases: Mapping[str, Phase] | None = None,
    softer: Softer | None = None,
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    starts: int = STARTS,
    profile: int | Sequence[str] = EVERY,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> SpringCharacterisation:
    """Identify an alloy from springs on a stand, or adjust a known one within its tolerances.

    With `alloy = "fit"` in the recordings everything is found, in the source's stages and then jointly. As in
    the source, the stiffest tests are taken to be fully austenitic. Those whose resistance at rest is
    farthest from theirs are taken to be fully martensitic. With a named alloy, only the constants that
    `[tolerance]` leaves open are adjusted.

    Args:
        campaign: recordings of kind `spring` of one alloy.
        base: table to start from, instead of the one named, or of a nitinol that nobody has characterised.
        phases: `cold`, `hot` or `intermediate` for recordings, by name, whose phase is known better.
        softer: the phase whose wire is the softer one; the martensite by default. No nitinol resists less at
            rest when cold than when hot. If the tests say so, both phases are tried and the better fit
            decides. `neither` reads the phases from the resistances at rest alone.
        adjust: changes to free parameters by name. Each is a mapping with any of `value`, `min`, `max` (in
            the unit of files), `vary` and `tie`. Example: `{"gR_decay": {"value": 5, "vary": False}}`.
        starts: joint fits in all, from different places.
        profile: parameters to profile, or how many of the loosest.
        seed: seed of all draws.
        progress: called with a word for each step that begins.

    Raises:
        InputError: if the recordings or options cannot be used, in one line.
    """
    require_float64()
    quantities, identify, readings = _begun(campaign, base, phases, softer)
    stages = Stages(progress, (FITS, ZERO, *([PROFILE] if profile else []), LAST))
    tried, best = best_of_readings(
        campaign, readings, base, identify, adjust or {}, starts, seed, stages.of(FITS)
    )
    found = searched_to_the_end(tried[best].single, profile, identify, stages)
    return _characterisation(campaign, quantities, identify, tried, best, found, seed, stages.of(LAST, 2))


def values_found(
    campaign: Campaign, progress: Callable[[str], None] = lambda _: None
) -> Iterator[Mapping[str, Estimate]]:
    """Constants of an alloy by name, where a search for missing physics may begin: those found soonest first.

    The first are of the fit from the stages, the last of the best fit from all starts. Each is fitted when it
    is asked for. Left out is what only a result needs: zeros of the instruments, profiles, the next test. A
    search for missing physics fits the constants again, with zeros and noise of its own.

    Args:
        campaign: recordings of kind `spring` of one alloy.
        progress: called with a word for each fit that begins.

    Raises:
        InputError: if the recordings cannot be used, in one line.
    """
    require_float64()
    _, identify, readings = _begun(campaign, None, None, None)
    begins = Stages(progress, (FITS,)).of(FITS)
    begun = begun_readings(campaign, readings, None, identify, {}, begins)
    yield estimates(min(begun, key=lambda one: one.chi_square).single.parameters, {})
    tried, best = best_of_begun(begun, identify, STARTS, 0, begins)
    yield estimates(tried[best].single.parameters, {})


def _begun(
    campaign: Campaign,
    base: str | Path | None,
    phases: Mapping[str, Phase] | None,
    softer: Softer | None,
) -> tuple[dict[str, Quantity], bool, list[Reading]]:
    """Constants to start from, whether the alloy is to be identified, and the readings of the tests.

    The arguments are those of `characterise_spring`.
    """
    recordings = campaign.fittable("spring")
    quantities, identify = priors.alloy_quantities(campaign, ALLOY, base)
    known = None if identify else Alloy(**{name: q.value for name, q in quantities.items()})
    return quantities, identify, readings_of(recordings, phases, known, softer)


def _characterisation(
    campaign: Campaign,
    quantities: dict[str, Quantity],
    identify: bool,
    tried: Sequence[Fitted],
    best: int,
    found: Searched,
    seed: int,
    progress: Callable[[str], None],
) -> SpringCharacterisation:
    """The result, with what follows from the fits: information, next test, scores and notices.

    Args:
        campaign: the campaign.
        quantities: constants of the alloy that the fits started from.
        identify: true if the alloy was identified.
        tried: every reading of the tests, fitted.
        best: index of the best one.
        found: its fit, searched to the end.
        seed: seed of all draws.
        progress: called with a word for each of two steps.
    """
    chosen, single, profiled = tried[best], found.single, found.profiled
    joint = spanned(single)
    tests = joint.problem.tests
    fitted = [test for test in tests if test.fitted]
    progress("what the tests tell")
    fisher = information(joint.problem, joint.parameters)
    progress("the next test")
    further = next_test(joint.problem, joint.parameters, fisher, identify)
    uncertainty, recordings = single.result.uncertainty, campaign.fittable("spring")
    drifting = covariance_beside_zeros(
        found.lasting, fisher.names, uncertainty.covariance, uncertainty.names
    )
    all_ends = (*single.starts, *(valley.start for valley in found.others))
    return SpringCharacterisation(
        title=campaign.title,
        identify=identify,
        tests=tests,
        stages=tuple(chosen.stages),
        joint=joint,
        base=quantities,
        start=chosen.start,
        information=fisher,
        identifiability=_identifiability(fisher, joint, chosen.start, fitted, profiled),
        modes=tuple(other_modes(replace(single, starts=all_ends))),
        profiles=with_valleys(with_other_fits(profiled, single), found.others),
        scores=tuple(scores(joint.problem, joint.values)),
        next_test=further,
        real=all_real(recordings),
        notices=(
            *order(tried, best),
            *(_exact_diameter(joint.parameters) if identify else _held(joint)),
            *notices_of(recordings, joint.parameters),
        ),
        seed=seed,
        softer=chosen.reading.softer,
        combinations=tuple(plateaus(single, quantities, fitted, profiled, drifting)),
        lasting=found.lasting,
        path=campaign.path,
    )


def _held(joint: Joint) -> list[str]:
    """A notice of tests of a known alloy that were held at full cold or full heat."""
    problem, said = joint.problem, []
    level, free = np.asarray(problem.stacked.extra["level"]), problem.free_tests
    for phase, fraction in (("cold", 1.0), ("hot", 0.0)):
        held = [k for k in problem.fitted if k not in free and problem.tests[k].reason != STATED]
        names = [problem.tests[k].name for k in held if level[k] == fraction]
        if names:
            was = "was" if len(names) == 1 else "were"
            said.append(
                f"{joined(names)} {was} taken as fully {phase} throughout: a free martensite fraction "
                "explains no more than noise. Standard errors hold for exactly that phase: with 0.3 % of the "
                "other a modulus moves by about five of them"
            )
    return said


def _exact_diameter(free: Parameters) -> list[str]:
    """A notice that the stresses of an identified alloy rest on the diameter of its wire, if that was held.

    The stress of a force (Eq. 2.9) goes as the diameter to the power of -2.5 for the source's spring, and a
    modulus to that of -3.1, since the strain goes with it.
    """
    if any(name.partition(MARK)[0] == DIAMETER for name in free):
        return []
    return [
        "The wire's diameter was taken as exact, since [tolerance] leaves it out. If it is off by 1 %, "
        "stresses are off by 2.5 % and moduli by 3 %. No recording shows that, and no interval counts it"
    ]


def _identifiability(
    fisher: Information,
    joint: Joint,
    start: Mapping[str, float],
    fitted: Sequence[StandTest],
    profiled: Mapping[str, Profile],
) -> list[dict[str, Any]]:
    """Constants that stay open, the tests that would show them, and those that do."""
    needed, reach = partial(why_not_shown, fitted), partial(informing_tests, fitted)
    own = with_intervals(profiled)
    aside = of_unfitted(fisher.names, [test.recording for test in joint.problem.tests])
    return open_constants(
        fisher, joint.parameters, start, profiled=own, needed=needed, reach=reach, unfitted=aside
    )
