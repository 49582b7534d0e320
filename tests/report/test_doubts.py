"""Constants and zeros that take up what a law leaves out: a report begins with that, and names the command."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

from fitting.calibrate.assumed import improbable_shifts
from fitting.calibrate.batch import Batch, Member
from fitting.calibrate.general.fit import MISFIT
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.registry import characterise
from fitting.calibrate.result import Estimate
from fitting.inference.lasting_noise import Lasting
from fitting.inference.least_squares.result import Status
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report import batch
from fitting.report.characterisation import another_cause
from fitting.report.general import text as general
from fitting.report.instrument_zeros import large_drifts, lasting_zeros
from fitting.report.spring import text as spring
from fitting.specimens.saved_models import DIAGNOSIS, AugmentedModel
from fitting.specimens.with_saved_model import Augmented
from fitting.synthesise import synthesise

NAMES = ("G_m", "G_a", "alpha_1", "rho_mean", "rho_span", "a", "b", *(f"d_spring__{k}" for k in range(1, 34)))
PATH = Path("my campaign")
COMMAND = "`pneusma diagnose 'my campaign'`"


def parameters(*shifts):
    """Constants with priors of one standard deviation, and their values so many of these away."""
    free = Parameters()
    names = NAMES[: len(shifts)]
    for name in names:
        free.add(Parameter(name, 10.0, prior=Prior(10.0, 1.0)))
    free.add(Parameter("held", 1.0, vary=False, prior=Prior(9.0, 1.0)))
    free.add(Parameter("flat", 1.0, 0.0, 99.0))
    values = {name: 10.0 + shift for name, shift in zip(names, shifts, strict=True)}
    return free, values | {"held": 1.0, "flat": 50.0}


def alone(shift, number):
    """One constant of several that moved, while recordings tell nothing of the others."""
    return (shift, *(0.0,) * (number - 1))


@pytest.mark.parametrize(
    ("shifts", "named"),
    [
        ((2.8, -4.0, 3.5, 0.1, 3.0), ("G_m", "G_a", "alpha_1", "rho_span")),
        ((2.1, -2.2, 0.3, 0.1, 0.5), ()),
        ((3.2, 0.0, 0.0, 0.0, 0.0), ()),
        ((4.0, 0.0), ("G_m",)),
        (alone(5.7, 13), ("G_m",)),  # a probability of 1e-8, but a sum of squares of 32 in 13
        (alone(-8.4, 40), ("G_m",)),
        ((1.95, 1.95, 1.95, -1.95, 1.95, 1.95), ()),  # 22.8 of six, and 24.1 is allowed
        ((2.01, 1.99, 1.99, -2.05, 2.0, 1.99), ("G_m", "rho_mean", "rho_span")),  # 24.1 and more
        ((1.99, 1.9, 1.95, -1.99, 1.99, 1.99, 0.9, *(1.95,) * 4), tuple(NAMES[k] for k in range(11) if k != 6)),
        ((), ()),
    ],
)
def test_shifts_that_chance_hardly_makes_are_those_of_all_constants_together_or_the_largest(shifts, named):
    """A lead of 0.15 ohm moved five constants by 2.8 to 4 standard deviations of their tolerances."""
    found = improbable_shifts(*parameters(*shifts))
    assert tuple(found) == named
    assert all(shift == pytest.approx(shifts[NAMES.index(name)]) for name, shift in found.items())


@pytest.mark.parametrize(("number", "limit"), [(1, 12.116), (2, 15.202), (5, 22.105), (9, 29.666), (13, 36.478)])
def test_equal_shifts_are_reported_from_the_tabulated_quantile_of_chi_square_on(number, limit):
    """Quantiles of 0.9995, half of one in a thousand, from a table."""
    each = np.sqrt(limit / number)
    assert not improbable_shifts(*parameters(*(0.999 * each,) * number))
    assert len(improbable_shifts(*parameters(*(1.001 * each,) * number))) == number


@pytest.mark.parametrize(("number", "limit"), [(9, 4.0309), (13, 4.1165), (40, 4.3687)])
def test_a_single_shift_is_reported_from_the_normal_quantile_of_so_many_tries_on(number, limit):
    """Two-sided normal quantiles of 0.0005 over the number of constants."""
    assert not improbable_shifts(*parameters(*alone(0.999 * limit, number)))
    assert list(improbable_shifts(*parameters(*alone(-1.001 * limit, number)))) == ["G_m"]


@pytest.mark.parametrize("missing", [np.nan, np.inf, -np.inf])
def test_a_constant_without_a_finite_value_hides_no_other(missing):
    assert list(improbable_shifts(*parameters(missing, 5.0, 0.1))) == ["G_a"]
    assert improbable_shifts(*parameters(missing, 0.5)) == {} == improbable_shifts(*parameters(missing))


@pytest.mark.parametrize(("number", "rate"), [(1, 0.5e-3), (9, 0.91e-3)])
def test_one_campaign_in_a_thousand_reaches_them_if_priors_are_right(number, rate):
    """Two tests of half the level overlap: of one constant they are the same, of nine mostly different.

    The rate of nine was counted in 20 million draws against quantiles of `scipy.stats`. Only draws whose sum
    of squares passes 19.7, or whose largest shift passes 3, can reach it, so only these are asked.
    """
    tries = 60_000
    draws = np.random.default_rng(1).standard_normal((tries, number))
    asked = draws[np.abs(draws).max(axis=1) > 3.0] if number == 1 else draws[
        (np.abs(draws).max(axis=1) > 3.0) | ((draws**2).sum(axis=1) > 19.7)
    ]  # fmt: skip
    reached = sum(bool(improbable_shifts(*parameters(*row))) for row in asked)
    low, high = binom.interval(0.999, tries, rate)
    assert low <= reached <= high


def spring_of(drift, shifts=(0.0,), reduced=1.0, beside=True, offset=0.0):
    """A spring's result as the sentences need it; zeros of resistance drift so far."""
    free, values = parameters(*shifts)
    joint = SimpleNamespace(reduced_chi_square=reduced, values=values)
    zeros = Lasting(np.array([1.0]), {"resistance": drift}, {"resistance": offset}, fitted_beside_zeros=beside)
    return SimpleNamespace(joint=joint, fitted=free, lasting=zeros, path=PATH)


def general_of(drift, shifts=(0.0,), reduced=1.0, beside=True, offset=0.0):
    """The same of a wire."""
    made = spring_of(drift, shifts, reduced, beside, offset)
    result = SimpleNamespace(values=made.joint.values)
    fit = SimpleNamespace(reduced_chi_square=reduced, result=result)
    return SimpleNamespace(fit=fit, fitted=made.fitted, lasting=made.lasting, campaign=SimpleNamespace(path=PATH), model=None)


KINDS = pytest.mark.parametrize(("doubts", "made"), [(spring.doubts, spring_of), (general.doubts, general_of)])


@KINDS
def test_zeros_that_drift_far_come_first_with_the_command(doubts, made):
    """Uneven heating was taken for zeros that drift, in a warning among others."""
    first, reason, cause = doubts(made(8.0))
    assert COMMAND in first and first.startswith("Do not trust these constants")
    assert reason.startswith("The fit needs zeros of instruments that drift far: that of resistance by 8 times its noise.")
    assert "Simulated springs whose zeros drifted by their noise gave 0.8 to 1.05; other kinds" in reason
    assert cause.startswith("Instruments that drift would look like that")
    assert not doubts(made(1.9)) and doubts(made(2.1))


@KINDS
def test_a_zero_that_is_off_by_a_constant_makes_no_doubt(doubts, made):
    """A load cell that was not set to zero is no sign of missing physics."""
    assert not doubts(made(1.0, offset=30.0))


@KINDS
def test_constants_that_moved_far_come_first_with_the_command(doubts, made):
    first, reason, cause = doubts(made(0.0, (2.8, -4.0, 0.5)))
    assert COMMAND in first
    assert reason == "The fit moved G_m and G_a by 2.8 to 4.0 standard deviations of what was known before."
    assert cause.startswith("Sizes or an alloy other than stated would look like that")
    assert len(doubts(made(8.0, (2.8, -4.0, 0.5)))) == 4


def model_from(description):
    """A model on disk that is fitted to the campaign of the title `Wires`."""
    path = Path("out/my diagnosis/augmented.toml")
    return Augmented("wire", AugmentedModel(name="augmented", description=description, path=path), "Wires")


BESIDE = "`pneusma diagnose 'my campaign' --model 'out/my diagnosis/augmented.toml'`"


def test_a_model_of_a_diagnosis_that_has_looked_sends_nobody_to_a_diagnosis():
    """The report said to wait for the command that had made the model."""
    result = general_of(8.0, (2.8, -4.0, 0.5))
    result.model = model_from(f"{DIAGNOSIS} Wires, seed 0")
    said = general.doubts(result)
    assert said[0].startswith("Do not trust these constants yet, although a diagnosis of this campaign has looked")
    assert "The model augmented holds what it found." in said[0] and "pneusma diagnose" not in " ".join(said)
    assert said[-1].startswith("Sizes or an alloy other than stated or instruments that drift would look like that: check them first.")
    assert not another_cause(["a", "b"], ["c"], PATH, result.model)


@pytest.mark.parametrize("description", ["", f"{DIAGNOSIS} Wires of another alloy, seed 0", "Fitted to Wires"])
def test_a_model_of_elsewhere_is_diagnosed_with_it(description):
    """The command named began from the base model, without what the model has."""
    result = general_of(8.0, (2.8, -4.0, 0.5))
    result.model = model_from(description)
    first, *_, cause = general.doubts(result)
    assert first == f"Do not trust these constants before {BESIDE} has looked for physics that the model leaves out."
    assert "would look like that, too" in cause
    (said,) = another_cause(["a", "b"], [], PATH, result.model)
    assert said == f"Physics that the model leaves out looks like this, too. {BESIDE} tells whether any is there."


class OfAWire(GeneralCharacterisation):
    """A result that is told of by its attributes."""

    fitted = parameters = lasting = None

    def __init__(self, drift):
        self.__dict__ |= vars(general_of(drift)) | {"parameters": {"E": Estimate(1.0, 0.1, "kPa", False)}}


def test_a_batch_passes_the_first_sentence_of_such_a_report_on():
    """A table over specimens had constants in it that no single report trusted."""
    doubtful, sure = OfAWire(8.0), OfAWire(0.0)
    members = [Member("a", PATH, "wire", doubtful, ""), Member("b", PATH, "wire", sure, "")]
    members.append(Member("c", PATH, "wire", None, "no recording"))
    found = Batch(tuple(members), {}, ())
    assert batch.verdict(found) == [
        "2 of 3 campaigns were characterised.",
        "c was not: no recording",
        f"a: {general.doubts(doubtful)[0]}",
    ]
    report = batch.report_of(found)
    assert [one["cautions"] for one in report.content()["campaigns"]] == [general.doubts(doubtful), [], []]
    assert [row[2] for row in batch.specimen_table(found).rows] == ["fitted, not to be trusted", "fitted", "failed"]


@KINDS
def test_a_law_that_misses_its_recordings_says_that_instead(doubts, made):
    assert not doubts(made(8.0, (4.0, 4.0), reduced=1.01 * MISFIT))


@pytest.mark.slow
def test_a_simulated_camera_that_is_off_by_a_constant_makes_no_doubt():
    """Three times the noise, fitted beside zeros: they are found as off, and not as drifting."""
    campaign = synthesise("tube", seed=1).campaign
    for recording in campaign.recordings:
        recording.columns["length_mm"] = recording.columns["length_mm"] + 3.0 * recording.noise["length_mm"]
    result = characterise(campaign, starts=1, profile=False)
    assert result.lasting.fitted_beside_zeros and result.lasting.offset["length"] > 2.0
    assert result.lasting.drift["length"] < 1.0 and not large_drifts(result.lasting)
    assert not any("Do not trust" in said for said in general.verdict(result))


def test_sizes_of_zeros_have_their_unit_each():
    """`off by 0.41 and drifts by 2.3 times its noise` left the first number without a unit."""
    (sentence,) = lasting_zeros(Lasting(np.array([1.0]), {"stress": 2.3}, {"stress": 0.41}, fitted_beside_zeros=True))
    assert "that of stress is off by 0.41 times its noise, and drifts by 2.3 times. Constants" in sentence


def test_a_fit_without_steps_left_names_the_option_that_the_command_has():
    """It had said `allow more`, which no option does."""
    said = general._unended(Status.MAX_STEPS)
    assert said.endswith("The command has a fixed number of steps; `--starts` begins in more places.")
    assert "--starts" not in general._unended(Status.STALLED)
