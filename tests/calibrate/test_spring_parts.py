"""Parts of the pipeline of springs on exact problems: other modes, profiles that fall, how far to pull next."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.alloy_table import alloy_table
from fitting.calibrate.profile_likelihood import WIDTH_90
from fitting.calibrate.profiled_fits import lowest_point
from fitting.calibrate.spring import pipeline, search, stand_tests
from fitting.calibrate.spring import profiles as profiling
from fitting.calibrate.spring.joint import Joint, Start
from fitting.calibrate.spring.modes import apart, other_modes
from fitting.calibrate.spring.next_test import _reach, _sentence
from fitting.calibrate.spring.other_fits import lead, spanned
from fitting.calibrate.spring.profiles import profiles
from fitting.calibrate.spring.search import Fitted, Reading, order
from fitting.data.recordings.nominal import nominal_geometry
from fitting.inference.least_squares import Status
from fitting.inference.least_squares.covariance import Uncertainty
from fitting.inference.parameters import Parameter, Parameters
from fitting.report import profile_likelihood as shown
from fitting.report.spring.text import unended
from fitting.specimens.spring_rows import GEOMETRY
from pneusma_jax import SpringGeometry
from pneusma_jax.calibration.records import Prior, Quantity

NAMES = ("x", "y")


def uncertainty(sd):
    C = np.diag(np.full(2, sd**2))
    return Uncertainty(dict.fromkeys(NAMES, sd), NAMES, C, np.eye(2), ())


def ended(x, chi_square, converged):
    """A fit that ended at x; one that stalled has no errors of its own."""
    errors = uncertainty(0.01) if converged else Uncertainty.none(NAMES)
    return SimpleNamespace(
        values={"x": x, "y": 0.0}, chi_square=chi_square, success=converged, uncertainty=errors,
        status=Status.CONVERGED if converged else Status.STALLED,
    )  # fmt: skip


def joint_of(*results):
    starts = tuple(SimpleNamespace(name=f"start {n}", result=r) for n, r in enumerate(results))
    result = SimpleNamespace(
        uncertainty=uncertainty(0.01)
    )  # told from the model's curvature, whatever ended how
    return SimpleNamespace(starts=starts, result=result, problem=SimpleNamespace(parameters=NAMES))


@pytest.mark.parametrize("ends", [(True, True), (False, True), (True, False), (False, False)])
def test_two_parameter_sets_that_fit_alike_are_said_even_where_a_fit_stalled(ends):
    """chi-square (x^2 - 1)^2: minima at -1 and 1, two hundred standard errors apart."""
    found = other_modes(joint_of(ended(-1.0, 10.0, ends[0]), ended(1.0, 10.0, ends[1])))
    assert len(found) == 1 and found[0].values["x"] == 1.0 and found[0].converged == ends[1]
    assert found[0].distance == pytest.approx(200.0) and found[0].different[0][0] == "x"


def test_a_fit_that_gained_too_little_to_go_on_ended_well():
    """Where the law misses the tests every fit ends so, and the report said that it stalled and did not end well."""
    lingered = ended(1.0, 10.0, False)
    lingered.status = Status.LINGERING
    (mode,) = other_modes(joint_of(ended(-1.0, 10.0, True), lingered))
    assert mode.converged and unended(lingered) == []
    assert unended(ended(1.0, 10.0, False)) == [f"The joint fit did not end well. {Status.STALLED.value}"]


def test_a_worse_fit_a_near_one_and_one_known_already_are_no_other_modes():
    near, worse, again = ended(-0.99, 10.0, True), ended(2.0, 30.0, True), ended(1.001, 10.1, True)
    found = other_modes(joint_of(ended(-1.0, 10.0, True), ended(1.0, 10.0, True), near, worse, again))
    assert [mode.start for mode in found] == ["start 1"]


def test_a_fit_that_differs_by_less_than_every_standard_error_is_no_other_mode():
    """Across a stiff direction such a fit is far off in the metric, and yet nobody's other parameter set."""
    stiff = Uncertainty(
        dict.fromkeys(NAMES, 1.0), NAMES, np.array([[1.0, 1.0 - 1e-8], [1.0 - 1e-8, 1.0]]), np.eye(2), ()
    )
    joint = joint_of(ended(0.0, 10.0, True), ended(0.9, 10.0, True))
    joint.result.uncertainty = stiff
    assert apart(stiff, {"x": 0.0, "y": 0.0}, {"x": 0.9, "y": 0.0})[0] > 100.0
    assert not other_modes(joint)


@pytest.mark.parametrize(
    "ends, said",
    [((1.0, 2.0), "0.9 to 2.5 GPa"), ((1.0, np.inf), "0.9 GPa or more"), ((-np.inf, 2.0), "2.5 GPa or less")],
)
def test_the_quoted_interval_is_told_in_the_unit_of_files_with_its_open_end(ends, said):
    """It may be wider than the rise of 90 % asks, as where a profile stays low further out."""
    profile = SimpleNamespace(interval=lambda rise: tuple(1e9 * end for end in ends))
    result = SimpleNamespace(
        parameters={"G_m": SimpleNamespace(value=1.5, unit="GPa", interval={90: (0.9, 2.5)})},
        fitted={"G_m": SimpleNamespace(value=1.5e9)},
        profiles={"G_m": profile},
    )
    assert shown.interval(result, "G_m") == said


def test_the_next_test_names_each_constant_once():
    """The best test, and for two other constants the best that shrinks each of them most."""

    def candidate(text, name, gain):
        return SimpleNamespace(text=text, information=gain, shrinks=((name, 0.5),) if name else ())

    found = [
        candidate("pull one", "a", 5.0),
        candidate("pull two", "b", 4.0),
        candidate("pull three", "b", 3.0),
    ]
    found += [
        candidate("pull four", "", 2.5),
        candidate("pull five", "a", 2.0),
        candidate("pull six", "c", 1.0),
    ]
    said = _sentence(found)
    assert said.startswith("Pull one") and said.count("For b") == said.count("For c") == 1
    assert (
        "pull two" in said
        and "pull six" in said
        and not any(f"pull {n}" in said for n in ("three", "four", "five"))
    )


class Names(list):
    def __contains__(self, name):
        return name in NAMES


@pytest.fixture
def profiled(monkeypatch):
    """Profile of x, whose fit ended at 0, along a chi-square that is a test's own."""

    def of(chi_square):
        entry = Parameter("x", 0.0, -9.0, 9.0, standard_error=1.0)
        errors = uncertainty(1.0)
        problem = SimpleNamespace(
            parameters=Names(NAMES), data=lambda: {"rows": None}, at=lambda values: problem
        )
        joint = SimpleNamespace(
            problem=problem,
            parameters={"x": entry},
            values={"x": 0.0, "y": 0.0},
            result=SimpleNamespace(uncertainty=errors),
        )

        def pinned(problem, data, held, known=None):
            x = held.get("x", 0.0)
            return SimpleNamespace(chi_square=chi_square(x), success=True, values={"x": x, "y": 2.0 * x})

        monkeypatch.setattr(profiling, "fit_constrained", pinned)
        monkeypatch.setattr(profiling, "decided", lambda values, rows: rows)
        monkeypatch.setattr(profiling, "values_of", lambda parameters, values: values)
        return profiles(joint, ["x"])["x"]

    return of


def test_a_profile_that_falls_below_the_fit_is_said_and_says_where(profiled):
    found = profiled(lambda x: 50.0 + 9.0 * ((x - 2.0) ** 2 - 4.0))
    assert found.below == pytest.approx(36.0 - 9.0 * (2.0 - WIDTH_90) ** 2) and found.rise.min() == 0.0
    name, place = lowest_point({"x": found})
    assert name == "x" and place == {"x": WIDTH_90, "y": 2.0 * WIDTH_90}
    low, high = found.interval()
    assert low > 1.0


def test_a_profile_above_its_fit_is_left_as_it_is(profiled):
    found = profiled(lambda x: 50.0 + x**2)
    assert found.below == 0.0 and lowest_point({"x": found}) is None and not found.curved
    np.testing.assert_allclose(found.interval(), [-1.0, 1.0])


def test_a_further_test_goes_as_far_as_this_springs_wire_bears():
    published = dict(zip(GEOMETRY, (0.25e-3, 0.9e-3, 0.269e-3, 52.0, 14e-3), strict=True))
    assert _reach(SimpleNamespace(base=published)) == (5.75, 3.45)
    stiff = dict(zip(GEOMETRY, (0.5e-3, 1.0e-3, 0.55e-3, 30.0, 16.5e-3), strict=True))
    cold, hot = _reach(SimpleNamespace(base=stiff))
    assert 1.0 < hot < cold < 3.5  # the source's own strains would tear it


@pytest.mark.parametrize(("free", "said"), [("G_m", 1), ("wire_diameter", 0), ("wire_diameter__2", 0)])
def test_stresses_of_an_open_alloy_are_said_to_rest_on_an_exact_diameter(free, said):
    """A wire 3.4 % thinner than stated put all stresses some 10 % off, at a reduced chi-square of 1.1."""
    parameters = Parameters()
    parameters.add(Parameter(free, 1.0))
    found = pipeline._exact_diameter(parameters)
    assert len(found) == said and all("stresses are off by 2.5 %" in one for one in found)


def test_the_power_of_the_diameter_is_that_of_the_sources_spring():
    """Logarithmic derivatives of stress and modulus, as the notice and the page say."""
    nominal = nominal_geometry("spring", {})
    wire, mandrel = (1e-3 * nominal[f"{key}_diameter_mm"] for key in ("wire", "mandrel"))
    made = [SpringGeometry(w, mandrel, 0.269e-3, 52.0, 14e-3) for w in (0.999 * wire, 1.001 * wire)]
    stresses = np.array([1.0 / float(one.force(1.0)) for one in made])
    moduli = stresses / [float(one.shear_strain(0.01)) for one in made]
    powers = [np.log(x[1] / x[0]) / np.log(1.001 / 0.999) for x in (stresses, moduli)]
    assert powers == pytest.approx([-2.5, -3.1], abs=0.06)


def several(*ends):
    """A joint fit whose starts ended at (x, chi-square)."""
    results = [SimpleNamespace(values={"x": x, "y": 0.0}, chi_square=c, success=True) for x, c in ends]
    starts = tuple(Start(f"start {n}", r, None) for n, r in enumerate(results))
    return Joint(SimpleNamespace(inflation=1.0), None, starts, 1.0, 1.0)


def test_a_best_fit_that_one_start_alone_found_is_not_sure():
    assert lead(several((0.0, 100.0), (0.3, 113.0), (0.5, 150.0))) == pytest.approx(13.0)
    assert lead(several((0.0, 100.0), (0.001, 100.2), (0.5, 150.0))) == 0.0
    assert lead(several((0.0, 100.0))) == 0.0


@pytest.mark.parametrize(("second", "wider"), [(113.0, True), (100.2, False)])
def test_errors_span_what_was_found_where_the_best_fit_was_found_once(second, wider):
    parameters = Parameters()
    for name in NAMES:
        parameters.add(name, 0.0)
    joint = several((0.0, 100.0), (0.0 if second < 101.0 else 0.2, second), (0.4, 140.0))
    result = Best(parameters, uncertainty(0.01))
    found = spanned(replace(joint, result=result)).result.parameters["x"].standard_error
    assert (found > 0.08) == wider and found >= 0.01


@dataclass(frozen=True)
class Best:
    """What `spanned` reads of a fit, and changes."""

    parameters: Parameters
    uncertainty: Uncertainty


def readings(*pairs):
    """Tests by slope at the beginning and resistance at rest."""
    return [stand_tests._Reading(5.0, 0.1, slope, rho, True, False) for slope, rho in pairs]


def phases_of(found, softer):
    return [phase for phase, _ in stand_tests._phases(found, softer)]


def test_which_phase_is_the_softer_one_decides_what_a_stiff_test_is():
    usual = readings((3.0, 20.0), (5.0, 18.5), (8.0, 17.0))
    assert phases_of(usual, "martensite") == ["cold", "intermediate", "hot"]
    assert phases_of(usual, "austenite") == ["hot", "intermediate", "cold"]
    other = readings((8.0, 20.0), (5.0, 18.5), (3.0, 17.0))  # austenite softer, martensite resists more
    assert phases_of(other, "austenite") == ["cold", "intermediate", "hot"]


@pytest.mark.parametrize("slopes, contradiction", [((3.0, 8.0), False), ((8.0, 3.0), True)])
def test_stiffness_and_resistance_that_contradict_ask_for_two_readings(slopes, contradiction):
    found = readings((slopes[0], 20.0), (slopes[1], 17.0))
    tests = [
        SimpleNamespace(phase=phase, reason=reason, resistivity=r.resistivity)
        for r, (phase, reason) in zip(found, stand_tests._phases(found, "martensite"), strict=True)
    ]
    assert stand_tests.contradicts(tests) is contradiction
    stated = [SimpleNamespace(**{**vars(test), "reason": stand_tests.STATED}) for test in tests]
    assert not stand_tests.contradicts(stated)


def fitted(softer, cost, whole=True):
    return Fitted(Reading([], softer), {}, {}, [], joint_of(ended(0.0, cost, True)), whole)


def test_of_two_readings_the_one_that_was_taken_is_named():
    said = order([fitted("martensite", 5000.0), fitted("austenite", 900.0)], 1)[0]
    assert "With austenite as the softer phase the chi-square is 900, with martensite 5000." in said
    assert "--softer martensite" in said and "stiffest test resists most" in said and "one start" not in said
    assert order([fitted("martensite", 5000.0)], 0) == []
    alike = order([fitted("martensite", 5000.0, False), fitted("neither", 900.0)], 1)[0]
    assert "equally stiff" in alike and "one start only" in alike


@pytest.mark.parametrize(
    ("softer", "costs", "noise", "taken", "whole"),
    [
        ("austenite", (5000.0, 900.0), (), 1, (True, True)),
        ("austenite", (5000.0, 900.0), (900.0,), 1, (False, True)),
        ("neither", (960.0, 900.0), (960.0, 900.0), 0, (True, False)),  # free fractions fit noise, too
        ("neither", (5000.0, 900.0), (900.0,), 1, (False, True)),
    ],
)
def test_of_two_readings_the_better_one_is_fitted_in_full(monkeypatch, softer, costs, noise, taken, whole):
    first = dict(zip(("martensite", softer), costs, strict=True))
    begin = lambda campaign, reading, *_: fitted(reading.softer, first[reading.softer], False)  # noqa: E731
    monkeypatch.setattr(search, "_begun", begin)
    monkeypatch.setattr(search, "_completed", lambda begun, *_: replace(begun, whole=True))
    monkeypatch.setattr(search, "_suspicious", lambda joint: joint.starts[0].result.chi_square not in noise)
    readings = [Reading([], "martensite"), Reading([], softer)]
    found, best = search.best_of_readings(None, readings, None, True, {}, 3, 0, print)
    assert best == taken and tuple(one.whole for one in found) == whole


def test_phases_that_are_equally_stiff_are_told_by_resistance():
    found = readings((3.0, 20.1), (3.1, 18.5), (2.9, 17.3), (3.0, 17.31))
    assert phases_of(found, "martensite") == ["cold"] * 4
    assert phases_of(found, "neither") == ["cold", "intermediate", "hot", "intermediate"]
    tests = [
        SimpleNamespace(phase=phase, reason=reason, resistivity=r.resistivity)
        for r, (phase, reason) in zip(found, stand_tests._phases(found, "martensite"), strict=True)
    ]
    assert stand_tests.equally_stiff(tests)
    assert not stand_tests.equally_stiff(tests[2:])  # one phase, measured twice
    assert not stand_tests.equally_stiff([SimpleNamespace(**{**vars(t), "reason": "x"}) for t in tests])


def test_a_constant_that_was_held_keeps_its_interval_in_the_table():
    low, high = 23e9, 25e9
    held = Quantity("G_m", 24e9, "GPa", "fitted", "an earlier fit", Prior(24e9, 0.5e9), (low, high))
    table = alloy_table("A", {"G_m": held}, Parameters(), simulated=True)
    assert table.quantities["G_m"] == held
