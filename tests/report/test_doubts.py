"""Constants and zeros that take up what a law leaves out: a report begins with that, and names the command."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.assumed import CHANCE, FAR, surprising
from fitting.calibrate.general.fit import MISFIT
from fitting.inference.chance import chi_square_tail
from fitting.inference.lasting_noise import Lasting
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report.general import text as general
from fitting.report.spring import text as spring

NAMES = ("G_m", "G_a", "alpha_1", "rho_mean", "rho_span")
PATH = Path("my campaign")
COMMAND = "`pneusma diagnose 'my campaign'`"


def parameters(*shifts):
    """Constants with priors of one standard deviation, and their values so many of these away."""
    free = Parameters()
    for name in NAMES[: len(shifts)]:
        free.add(Parameter(name, 10.0, prior=Prior(10.0, 1.0)))
    free.add(Parameter("held", 1.0, vary=False, prior=Prior(9.0, 1.0)))
    free.add(Parameter("flat", 1.0, 0.0, 99.0))
    values = {name: 10.0 + shift for name, shift in zip(NAMES, shifts, strict=False)}
    return free, values | {"held": 1.0, "flat": 50.0}


@pytest.mark.parametrize(
    ("shifts", "named"),
    [
        ((2.8, -4.0, 3.5, 0.1, 3.0), ("G_m", "G_a", "alpha_1", "rho_span")),
        ((2.1, -2.2, 0.3, 0.1, 0.5), ()),
        ((3.2, 0.0, 0.0, 0.0, 0.0), ()),
        ((4.0, 0.0), ("G_m",)),
        ((1.99, 1.9, 1.99, -1.99, 1.99, 1.99), ()),
        ((), ()),
    ],
)
def test_shifts_that_chance_hardly_makes_are_those_of_all_constants_together(shifts, named):
    """A lead of 0.15 ohm moved five constants by 2.8 to 4 standard deviations of their tolerances."""
    found = surprising(*parameters(*shifts))
    assert tuple(found) == named and all(abs(shift) >= FAR for shift in found.values())
    if shifts:
        assert bool(named) == bool(chi_square_tail(sum(x**2 for x in shifts[: len(NAMES)]), len(shifts[: len(NAMES)])) <= CHANCE)


def test_one_campaign_in_a_thousand_reaches_them_if_priors_are_right():
    random = np.random.default_rng(1)
    reached = sum(bool(surprising(*parameters(*random.standard_normal(5)))) for _ in range(4000))
    assert reached <= 4000 * CHANCE + 3.0 * np.sqrt(4000 * CHANCE)


def spring_of(drift, shifts=(0.0,), reduced=1.0, beside=True):
    """A spring's result as the sentences need it; zeros of resistance drift so far."""
    free, values = parameters(*shifts)
    joint = SimpleNamespace(reduced_chi_square=reduced, values=values)
    zeros = Lasting(np.array([1.0]), {"resistance": drift}, {"resistance": 0.0}, fitted_beside_zeros=beside)
    return SimpleNamespace(joint=joint, fitted=free, lasting=zeros, path=PATH)


def general_of(drift, shifts=(0.0,), reduced=1.0, beside=True):
    """The same of a wire."""
    made = spring_of(drift, shifts, reduced, beside)
    result = SimpleNamespace(values=made.joint.values)
    fit = SimpleNamespace(reduced_chi_square=reduced, result=result)
    return SimpleNamespace(fit=fit, fitted=made.fitted, lasting=made.lasting, campaign=SimpleNamespace(path=PATH))


KINDS = pytest.mark.parametrize(("doubts", "made"), [(spring.doubts, spring_of), (general.doubts, general_of)])


@KINDS
def test_zeros_that_are_far_off_come_first_with_the_command(doubts, made):
    """Uneven heating was taken for zeros that drift, in a warning among others."""
    first, reason, cause = doubts(made(8.0))
    assert COMMAND in first and first.startswith("Do not trust these constants")
    assert "that of resistance is off by 0 and drifts by 8 times its noise" in reason
    assert cause.startswith("Instruments that drift would look like that")
    assert not doubts(made(0.9 * general.LARGE_ZERO))


@KINDS
def test_constants_that_moved_far_come_first_with_the_command(doubts, made):
    first, reason, cause = doubts(made(0.0, (2.8, -4.0, 0.5)))
    assert COMMAND in first
    assert reason == "The fit moved G_m and G_a by 2.8 to 4.0 standard deviations of what was known before."
    assert cause.startswith("Sizes or an alloy other than stated would look like that")
    assert len(doubts(made(8.0, (2.8, -4.0, 0.5)))) == 4


@KINDS
def test_a_law_that_misses_its_recordings_says_that_instead(doubts, made):
    assert not doubts(made(8.0, (4.0, 4.0), reduced=1.01 * MISFIT))
