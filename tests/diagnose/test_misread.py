"""A column in a wrong unit, or of the wrong sign, is asked about before any effect is named."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.data.recordings import Recording, Reduction, read_campaign
from fitting.data.recordings.unusual import USUAL
from fitting.diagnose import run
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit import misread
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.confused_units import confused_pairs, factors_of, units_of
from fitting.diagnose.fit.misread import Misread, _of_springs, misread_in, scaled
from fitting.diagnose.settings import DEFAULT
from fitting.inference.parallel import RUNS
from fitting.inference.readings import readings_of

TUBE = Path(__file__).parents[2] / "calibration_data" / "examples" / "tube"


@pytest.fixture(scope="module")
def asked():
    """What is asked of the shipped tube after its recordings were changed, by a function of each."""
    campaign = read_campaign(TUBE)
    like = Program.of(campaign, "tube", slugs=[])

    def build(recordings, nominal=False) -> Program:
        changed = dataclasses.replace(campaign, recordings=list(recordings))
        return Program.of(changed, "tube", [], like=like, nominal_alone=nominal)

    def asked(changed, unexplained=False) -> Misread | None:
        program, fit = base_fit(build([changed(k, r) for k, r in enumerate(campaign.recordings)]))
        return misread_in(program, fit, build, unexplained)

    return asked


def test_a_trial_of_a_slip_runs_the_nominal_model_once():
    """A program evaluates it when it is built."""
    campaign, built = read_campaign(TUBE), []
    like = Program.of(campaign, "tube", slugs=[])

    def build(recordings, nominal=False) -> Program:
        changed = dataclasses.replace(campaign, recordings=list(recordings))
        made = Program.of(changed, "tube", [], like=like, nominal_alone=nominal)
        built.append((made, made.tally[RUNS]))
        return made

    errors = misread._nominal_errors(like, "pressure_kPa", 10.0, build)
    ((made, runs),) = built
    assert made.tally[RUNS] == runs == 1
    whole = build([scaled(recording, "pressure_kPa", 10.0) for recording in like.recordings])
    again = whole.evaluate(whole.unknowns.neutral, whole.unknowns.base[:0])
    np.testing.assert_array_equal(errors, misread._errors(whole, again))


@pytest.mark.parametrize(("hidden", "called"), [(False, []), (True, ["prepare", "count_input_noise", "prepare"])])
def test_the_nominal_model_alone_counts_noise_of_inputs_where_hidden_states_follow_it(monkeypatch, hidden, called):
    campaign, seen = read_campaign(TUBE), []
    like = Program.of(campaign, "tube", slugs=[])
    monkeypatch.setattr(Program, "hidden", hidden)
    for name in ("prepare", "count_input_noise"):
        monkeypatch.setattr(Program, name, lambda *_, name=name: seen.append(name))
    Program.of(campaign, "tube", [], like=like, nominal_alone=True)
    assert seen == called


def test_readings_of_other_columns_are_those_of_the_recording_before_it_was_scaled():
    """They are told once, and not by every trial. The scaled column's own ones are told anew."""
    recording = read_campaign(TUBE).recordings[0]
    known = readings_of(recording, "length")
    for one in (scaled(recording, "pressure_kPa", 10.0), scaled(recording, "pressure_kPa", -1.0)):
        assert readings_of(one, "length") is known
        alone = dataclasses.replace(one, columns=dict(one.columns))
        np.testing.assert_array_equal(readings_of(alone, "length").counted, known.counted)
    assert readings_of(scaled(recording, "length_mm", 10.0), "length") is not known


def test_nothing_is_asked_of_a_model_that_fits(asked):
    assert asked(lambda _, recording: recording) is None


@pytest.mark.parametrize("slip", [10.0, 0.1, -1.0])
def test_a_slip_in_all_recordings_is_found(asked, slip):
    found = asked(lambda _, recording: scaled(recording, "pressure_kPa", slip))
    assert (found.column, found.recordings) == ("pressure_kPa", ())
    assert found.factor == pytest.approx(1.0 / slip)
    assert found.after < 0.02 < DEFAULT.share.minor < found.before


def test_psi_read_as_bar_are_asked_about_as_such(asked):
    """It was asked with 1/10, the nearest power of ten."""
    found = asked(lambda _, recording: scaled(recording, "pressure_kPa", 100.0 / 6.894757))
    assert found.factor == pytest.approx(6.894757 / 100.0, rel=1e-6)
    assert "1/14.5 of these readings (psi read as bar)" in found.text


@pytest.mark.parametrize(
    ("column", "factor", "units"),
    [
        ("pressure_kPa", 0.0689476, "psi read as bar"),
        ("pressure_kPa", 1.0 / 6.894757, "kPa read as psi"),
        ("pressure_kPa", 6.894757, "psi read as kPa"),
        ("stress_MPa", 6.894757, "psi read as kPa or ksi read as MPa"),
        ("bend_angle_deg", 57.29578, "rad read as deg"),
        ("pressure_kPa", 10.0, "kPa read as mbar"),
        ("pressure_kPa", 3.0, ""),
        ("strain", 10.0, ""),
    ],
)
def test_a_factor_is_named_by_the_units_that_it_leads_between(column, factor, units):
    named = units_of(column, factor)
    assert named == units or units in re.split(", | or ", named)
    assert not units or any(np.isclose(factor, known, rtol=1e-5) for known in factors_of(column))


PAIRS = [(column, *pair) for column in (*USUAL, "strain", "time_s", "bend_angle_deg") for pair in confused_pairs(column)]


@pytest.mark.parametrize(("column", "ratio", "meant", "stated"), PAIRS)
def test_every_pair_of_confused_units_is_tried_and_named(column, ratio, meant, stated):
    """Ratios of 9.81 and 102 were those of powers of ten, which no units have, and 3600 was not tried."""
    words = {"1": "fractions"}
    tried = [factor for factor in factors_of(column) if factor > 0.0]
    nearest = min(tried, key=lambda factor: abs(np.log(factor / ratio)))
    assert nearest == pytest.approx(ratio, rel=DEFAULT.share.alike)
    assert f"{words.get(meant, meant)} read as {words.get(stated, stated)}" in units_of(column, nearest)


def test_confused_units_are_those_of_laboratories():
    named = {(meant, stated) for _, _, meant, stated in PAIRS}
    for pair in (
        ("ms", "s"), ("min", "h"), ("h", "s"), ("mm", "um"), ("in", "mm"), ("cm", "mm"), ("mbar", "kPa"), ("N", "mN"),
        ("kgf", "N"), ("N", "gf"), ("lbf", "N"), ("inHg", "mmHg"), ("%", "1"), ("deg", "rad"), ("ohm", "mohm"), ("mA", "A"),
    ):  # fmt: skip
        assert pair in named and pair[::-1] in named


@pytest.mark.parametrize(
    ("column", "factor", "units"),
    [
        ("force_N", 9.80665, "gf read as mN, kgf read as N or a slip of the decimal point"),
        ("stress_MPa", 0.1, "a slip of the decimal point or MPa read as kgf/mm2"),
        ("stress_MPa", 1.0 / 9.80665, "MPa read as kgf/mm2 or a slip of the decimal point"),
        ("force_N", 100.0, "a slip of the decimal point, N read as gf or kN read as kgf"),
        ("pressure_kPa", 10.0, "kPa read as mbar, MPa read as bar or kPa read as cmH2O"),
        ("resistance_2_ohm", 1e-3, "ohm read as kohm or mohm read as ohm"),
        ("strain", 100.0, "fractions read as %"),
        ("pressure_kPa", -1.0, ""),
    ],
)
def test_a_slip_that_is_hardly_told_from_another_one_names_both(column, factor, units):
    assert units_of(column, factor) == units


def asked_of_wires(column, factor, count=2):
    """What is asked of the first shipped recordings of a wire after a column of each was scaled."""
    campaign = read_campaign(TUBE.parent / "wire")
    recordings = [scaled(recording, column, factor) for recording in campaign.recordings[:count]]

    def build(recordings, nominal=False, like=None) -> Program:
        changed = dataclasses.replace(campaign, recordings=list(recordings))
        return Program.of(changed, "wire", [], like=like, nominal_alone=nominal)

    program, fit = base_fit(build(recordings))
    return misread_in(program, fit, lambda changed, nominal: build(changed, nominal, program))


def test_a_wires_stress_that_drives_it_is_asked_about_though_its_transformation_is_unknown():
    """The readings of a stress that drives were compared as if they were predicted, so no factor helped."""
    found = asked_of_wires("stress_MPa", 10.0)
    assert {one.column for one in (found, *found.alike)} == {"stress_MPa"} and found.after < 0.05
    assert any(one.factor == pytest.approx(0.1) for one in (found, *found.alike))


def told(monkeypatch, column, slips):
    """Factors that are told, the best first, of slips of a column by what they leave."""
    monkeypatch.setattr(misread, "_errors", lambda *_: np.array([5.0]))
    monkeypatch.setattr(misread, "_promising", lambda *_: [(1.0, (column, factor, None)) for factor in slips])
    monkeypatch.setattr(
        misread, "_refitted",
        lambda program, errors, column, factor, *_: Misread(column, factor, (), 1.0, 0.01, slips[factor]),
    )  # fmt: skip
    found = misread_in(SimpleNamespace(), SimpleNamespace(evaluation=None), None)
    return [found.factor, *(one.factor for one in found.alike)]


@pytest.mark.parametrize(
    ("slips", "order"),
    [
        ({0.3: 1.0, 6.894757: 1.005, 0.25: 1.001, 4.0: 1.1}, [6.894757, 0.3, 0.25, 4.0]),
        ({0.3: 1.0, 6.894757: 1.2, 0.25: 1.1}, [0.3, 0.25, 6.894757]),
        ({6.894757: 1.2, -1.0: 1.0}, [-1.0, 6.894757]),
    ],
)
def test_the_slip_that_explains_most_comes_first_and_of_equal_ones_that_between_units(monkeypatch, slips, order):
    """A third of the readings is no unit. A ratio of units came before a sign that explained 20 % more."""
    assert told(monkeypatch, "pressure_kPa", slips) == order


def test_a_slip_in_one_recording_names_it(asked):
    found = asked(lambda k, recording: scaled(recording, "pressure_kPa", 10.0) if k == 1 else recording)
    assert found.recordings == ("inflation_2",)
    assert found.factor == pytest.approx(0.1)
    assert "pressure_kPa in inflation_2" in found.text


def test_a_small_misfit_is_asked_about_where_nothing_explains_it(asked, monkeypatch):
    """An actuator that is mainly heated hardly shows a pressure that is ten times too small."""
    monkeypatch.setattr(misread, "SHARE", dataclasses.replace(DEFAULT.share, minor=np.inf))

    def slipped(_, recording):
        return scaled(recording, "pressure_kPa", 0.1)

    assert asked(slipped) is None
    assert asked(slipped, unexplained=True).factor == pytest.approx(10.0)
    assert asked(lambda _, recording: recording, unexplained=True) is None


def test_an_output_that_does_not_vary_hides_no_slip(asked):
    """One such recording missed infinitely much whatever was tried, so that nothing was asked."""

    def slipped(k, recording):
        if k == 0:
            still = np.full(len(recording), recording.columns["length_mm"][0])
            recording = scaled(recording, "pressure_kPa", 1e-6)
            return dataclasses.replace(recording, columns={**recording.columns, "length_mm": still})
        return scaled(recording, "pressure_kPa", 10.0)

    found = asked(slipped)
    assert found.column == "pressure_kPa" and found.factor == pytest.approx(0.1)


@pytest.mark.parametrize("power", [0.5, 3.0])
def test_a_slip_that_leaves_a_gross_misfit_is_none(asked, power):
    """A hundredth of the pressure misses a tube that hardly moves by half its range, where all of it misses
    it by twenty times that."""

    def stiff(_, recording):
        pressure = np.abs(recording.columns["pressure_kPa"])
        reach = 0.02 * np.ptp(recording.columns["length_mm"])
        length = recording.columns["length_mm"][0] + reach * (pressure / np.max(pressure)) ** power
        return dataclasses.replace(recording, columns={**recording.columns, "length_mm": length})

    assert asked(stiff) is None


@pytest.mark.slow
@pytest.mark.parametrize("slip", [0.1, 0.01])
def test_a_slip_in_a_temperature_is_found(slip):
    """A wire's nominal transition temperature is read off its recordings; it changes with their unit."""
    found = asked_of_wires("temperature_degC", slip, count=5)
    assert found.column == "temperature_degC" and found.factor == pytest.approx(1.0 / slip)
    assert found.recordings == () and found.after < 0.05


def test_a_softer_tube_is_no_slip(asked):
    """A real effect of the pressure, ever more than proportional to it, is left to the search."""

    def squared(_, recording):
        values = recording.columns["pressure_kPa"]
        bent = {**recording.columns, "pressure_kPa": 3.0 * values * np.abs(values) / np.max(np.abs(values))}
        return dataclasses.replace(recording, columns=bent)

    assert asked(squared) is None


def test_factors_are_ratios_of_units_once_each():
    factors = factors_of("pressure_kPa")
    assert {0.1, 10.0, 100.0, 1000.0, -1.0} <= {round(f, 9) for f in factors}
    assert any(np.isclose(f, 6.894757, rtol=1e-6) for f in factors)  # psi
    positive = np.sort([f for f in factors if f > 1.0])
    ratios = positive[np.log10(positive) % 1.0 != 0.0]
    assert np.all(np.diff(np.log(ratios)) > DEFAULT.share.alike)
    assert np.all(np.diff(np.log(positive)) > DEFAULT.share.same)
    low, high = DEFAULT.instruments.confused_units
    assert np.all((positive >= low) & (positive < 1.2 * high))


@pytest.mark.parametrize(("column", "ratio"), [("stress_MPa", 9.80665), ("force_N", 9.80665), ("pressure_kPa", 98.0665)])
def test_powers_of_ten_are_tried_exactly_beside_a_ratio_near_them(column, ratio):
    """10 and 100 had gone, and 9.81 and 98.1, which are 2 % off, stood for them."""
    factors = factors_of(column)
    for factor in (ratio, 10.0, 100.0, 1000.0):
        assert any(np.isclose(factor, known, rtol=1e-6) for known in factors)
        assert any(np.isclose(1.0 / factor, known, rtol=1e-6) for known in factors)


@pytest.mark.parametrize(
    ("slips", "order"),
    [
        ({9.80665: 1.2, 10.0: 1.0, 1000.0: 1.1}, [10.0, 1000.0]),
        ({10.0: 1.2, 9.80665: 1.0, 1000.0: 1.1}, [9.80665, 1000.0]),
        ({9.80665: 1.0, 10.0: 1.0001}, [10.0]),
    ],
)
def test_factors_that_are_nearly_equal_count_once_and_the_best_is_told(monkeypatch, slips, order):
    """The nominal model does not tell 9.81 from 10, so both are refitted. Of equals the power of ten is told."""
    assert told(monkeypatch, "force_N", slips) == order


def test_a_scaled_recording_scales_what_is_stated_of_it():
    recording = read_campaign(TUBE).recordings[0]
    recording = dataclasses.replace(
        recording, noise={"pressure_kPa": 0.2, "length_mm": 0.1}, zero={"pressure_kPa": 0.5},
        reduction=Reduction(recording, np.arange(len(recording)), 1, ""),
    )  # fmt: skip
    other = scaled(recording, "pressure_kPa", -10.0)
    assert other.noise == {"pressure_kPa": 2.0, "length_mm": 0.1} and other.zero == {"pressure_kPa": 5.0}
    for one, before in ((other, recording), (other.whole, recording.whole)):
        np.testing.assert_allclose(one.columns["pressure_kPa"], -10.0 * before.columns["pressure_kPa"])
        np.testing.assert_array_equal(one.columns["length_mm"], before.columns["length_mm"])


def test_other_factors_that_explain_as_much_are_told():
    other = Misread("stress_MPa", 1.0 / 6.89, (), 0.47, 0.014, 2e-4)
    found = Misread("stress_MPa", 0.1, ("cycle_2",), 0.47, 0.014, 2e-4, (other,))
    assert found.text == (
        "Has stress_MPa in cycle_2 the right unit? With 1/10 of these readings (a slip of the decimal point or "
        "MPa read as kgf/mm2) the refitted base model misses "
        "outputs by at most 1.4 % of their range. With the readings as they are it does by 47 %. As much is "
        "explained by 1/6.89 of the readings of stress_MPa (kPa read as psi or MPa read as ksi)."
    )


def test_columns_of_two_springs_are_exchanged_with_what_is_stated_of_them():
    recording = Recording(
        "run", None, "actuator", noise={"resistance_2_ohm": 0.01},
        columns={"curvature_1pm": np.arange(3.0), "resistance_2_ohm": np.ones(3), "current_1_A": np.zeros(3)},
    )  # fmt: skip
    other = scaled(recording, "resistance_2_ohm", None)
    assert list(other.columns) == ["curvature_1pm", "resistance_1_ohm", "current_2_A"]
    assert other.noise == {"resistance_1_ohm": 0.01}
    assert Misread("resistance_2_ohm", None, (), 0.4, 0.01, 1e-4).text.startswith(
        "Are the springs 1 and 2 exchanged? With the columns of springs 1 and 2 exchanged the refitted base model"
    )


@pytest.mark.parametrize(("design", "found"), [("pneusma1", None), ("pneusma2", "resistance_1_ohm")])
def test_the_spring_of_an_actuator_with_one_is_never_exchanged(design, found):
    recording = Recording("run", None, "actuator", geometry={"design": design}, columns={"resistance_1_ohm": np.ones(3)})
    assert _of_springs([recording]) == found


@pytest.mark.slow
def test_exchanged_springs_of_an_actuator_are_found():
    campaign = read_campaign(TUBE.parent / "actuator")
    recordings = [scaled(r, "resistance_2_ohm", None) for r in campaign.recordings[:2]]
    campaign = dataclasses.replace(campaign, recordings=recordings)
    program, fit = base_fit(Program.of(campaign, "actuator", slugs=[]))

    def build(changed, nominal) -> Program:
        whole = dataclasses.replace(campaign, recordings=list(changed))
        return Program.of(whole, "actuator", slugs=[], like=program, nominal_alone=nominal)

    found = misread_in(program, fit, build)
    assert found.factor is None and found.after < 0.03


def test_a_base_model_without_an_answer_is_told_in_words():
    text = Misread("pressure_kPa", 0.1, (), np.inf, 0.01, 1e-4).text
    assert text.endswith("With the readings as they are it has no answer to some of them.") and "inf" not in text


def test_a_second_look_asks_as_the_first_one(monkeypatch):
    """Where only all recordings together contradict the base model, the verdict is of the second look."""
    found, look = Misread("pressure_kPa", 0.1, (), 0.5, 0.01, 1e-4), SimpleNamespace(second_look=None)
    first = SimpleNamespace(program=None, base=None, nearest=None, second_look=look)
    monkeypatch.setattr(run, "explain", lambda *_: first)
    monkeypatch.setattr(run, "misread_in", lambda *_: found)
    searched = run._search(None, "tube", 0, print, None, False, None)
    assert searched(None) is first
    assert first.misread is look.misread is found
