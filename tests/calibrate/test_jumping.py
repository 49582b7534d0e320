"""Errors of constants where the prediction jumps near the fit."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.alloy_table import _fitted
from fitting.calibrate.batch import Member, _pooled
from fitting.calibrate.general.information import informed, repeats
from fitting.calibrate.information import Information
from fitting.calibrate.open_constants import open_constants
from fitting.calibrate.quoted import estimates
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report.characterisation import estimate_text
from fitting.report.general.text import _understated, _unsettled, _without_error
from fitting.specimens.actuator_phase import UNSETTLED
from fitting.specimens.rows import Rows

ROWS = 40
TIME = np.arange(ROWS, dtype=float)
ERROR = 4e-5
"""Error of the leads, if all others were known [ohm]."""
SLOPE = 1.0 / (ERROR * np.sqrt(ROWS))
"""Change of each output in its standard deviations per ohm."""
BEST = 0.12


class Fit(SimpleNamespace):
    """A fit of two recordings by leads and a stiffness, whose outputs jump with the leads at one place.

    Args:
        where: leads at which all outputs jump [ohm].
        jump: size of the jump, in standard deviations.
        bent: function of the leads' distance from `BEST` in errors, in place of that distance.
        slope: slope at the fit of every output over the leads [1/ohm].
    """

    def __init__(self, where=0.0, jump=0.0, bent=lambda errors: errors, slope=SLOPE):
        parameters = Parameters()
        parameters.add(Parameter("leads", BEST, 0.0, 2.0, unit="ohm", prior=Prior(0.3, 0.6), standard_error=1.0))
        parameters.add(Parameter("stiffness", 1.0, 0.5, 2.0, unit="1", prior=Prior(1.0, 0.05), standard_error=1.0))
        result = SimpleNamespace(parameters=parameters, values=parameters.valuesdict())
        recordings = [SimpleNamespace(name=name, role="fit", specimen="one") for name in ("a", "b")]
        one = np.ones(ROWS)
        noise = np.random.default_rng(0).standard_normal(ROWS)
        rows = Rows(one > 0.0, TIME, {}, {"curvature": noise}, {"curvature": one / np.sqrt(2.0)}, {}, {}, np.asarray(1))
        super().__init__(
            model=SimpleNamespace(searches=False), recordings=recordings, rows=[rows, rows], result=result, zeros={},
            inflation=1.0, where=where, jump=jump, bent=bent, slope=slope, predictions=0,
        )  # fmt: skip

    def predict(self, values=None):
        self.predictions += 1
        values = values or self.result.values
        leads, stiffness = values["leads"], values["stiffness"]
        outputs = SLOPE * ERROR * self.bent((leads - BEST) / ERROR) + (40.0 + 4.0 * np.sin(TIME)) * (stiffness - 1.0)
        return [{"curvature": outputs + self.jump * (leads > self.where)}] * 2

    def derivative(self, name):
        slope = np.full(ROWS, self.slope) if name == "leads" else 40.0 + 4.0 * np.sin(TIME)
        return [{"curvature": slope}] * 2


FAR, NEAR = BEST + 3.0 * ERROR, BEST
"""Places of a jump: beyond three errors of the leads, and at the fit [ohm]."""


def sd_of(fit):
    fisher, each, _ = informed(fit)
    return fisher, each, dict(zip(fisher.names, fisher.sd(), strict=True))


def test_a_jump_beyond_an_error_does_not_change_it():
    """A step of a thousandth of the prior went over it, and gave a hundredth of the error."""
    fisher, _, found = sd_of(Fit(FAR, 1e3))
    smooth = sd_of(Fit(FAR, 0.0))[2]
    assert fisher.jumping == () and found == pytest.approx(smooth, rel=1e-6)
    assert fisher.sd_if_others_were_known()[0] == pytest.approx(ERROR, rel=1e-6)


@pytest.mark.parametrize("jump", [10.0, 1e3, 1e9])
def test_a_constant_that_jumps_at_the_fit_has_no_error_and_the_others_have_theirs(jump):
    """The largest jump shortened the step until both predictions were the same, and 0 / 0 passed for smooth."""
    fit = Fit(NEAR, jump)
    fisher, each, found = sd_of(fit)
    smooth = sd_of(Fit(NEAR, 0.0))[2]
    assert fisher.jumping == ("leads",) and list(fisher.told) == [False, True]
    assert found["stiffness"] == pytest.approx(smooth["stiffness"], rel=1e-6)
    assert found["stiffness"] > 5.0 * fisher.sd_if_others_were_known()[1]  # the leads count in it
    told = _characterised(fit)
    quoted = told.parameters
    assert not np.isfinite(quoted["leads"].sd) and quoted["leads"].interval == {}
    assert estimate_text(quoted["leads"]) == "0.12 ± n/a"
    assert quoted["stiffness"].sd == pytest.approx(smooth["stiffness"], rel=1e-6)
    none, others = _without_error(told)
    assert none.startswith("No error of leads is quoted: the misfit jumps")
    assert others == "The errors of the other constants allow for other values of leads, but for no jump."


def _characterised(fit):
    """The parts of a characterisation whose fit ended with the errors of its information."""
    fisher, _, found = sd_of(fit)
    correlation = fisher.covariance()[0, 1] / np.prod(list(found.values()))
    for one, other in (("leads", "stiffness"), ("stiffness", "leads")):
        fit.result.parameters[one].set(standard_error=float(found[one]), correlations={other: float(correlation)})
    quoted = estimates(fit.result.parameters, {}, jumping=fisher.jumping)
    return SimpleNamespace(information=fisher, parameters=quoted, fitted=fit.result.parameters, law="leads")


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("errors", [1e-3, 0.01, 0.1, 0.5, 0.9])
@pytest.mark.parametrize("jump", [0.3, 3.0, 30.0])
def test_a_jump_within_an_error_is_found_wherever_it_is(errors, jump, side):
    """Chi-square rises by 36,380 one error away from the fit if all outputs jump by 30. It had an error."""
    fit = Fit(BEST + side * errors * ERROR, jump)
    fisher, _, found = sd_of(fit)
    assert fisher.jumping == ("leads",) and fisher.unfollowed == ()
    assert found["stiffness"] == pytest.approx(sd_of(Fit())[2]["stiffness"], rel=1e-4)


@pytest.mark.parametrize("errors", [1.1, 2.0])
def test_a_jump_beyond_one_error_is_none_within_it(errors):
    assert sd_of(Fit(BEST + errors * ERROR, 30.0))[0].jumping == ()


@pytest.mark.parametrize("stair", [0.25, 1.0, 5.0, 25.0])
def test_stairs_jump_and_the_others_do_not_allow_for_them(stair):
    """A stair about the fit is flat. It passed for smooth, and the stiffness had an error ten times too small."""
    fit = Fit(bent=lambda errors: stair * np.round(errors / stair), slope=0.0)
    told = _characterised(fit)
    assert told.information.jumping == told.information.unfollowed == ("leads",)
    none, others = _without_error(told)
    assert none.startswith("No error of leads") and "hold only for leads as found" in others
    assert "allow for other values of leads" not in others


def test_stairs_far_below_an_error_do_not_count():
    fisher, _, found = sd_of(Fit(bent=lambda errors: 2.5e-3 * np.round(errors / 2.5e-3), slope=0.0))
    assert fisher.jumping == () and found == pytest.approx(sd_of(Fit())[2], rel=1e-2)


@pytest.mark.parametrize("slope", [0.0, np.nan, np.inf])
def test_a_slope_that_says_nothing_leaves_errors_of_the_others_that_are_said_to_be_conditional(slope):
    told = _characterised(Fit(NEAR, 1e3, slope=slope))
    assert told.information.jumping == told.information.unfollowed == ("leads",)
    assert told.parameters["stiffness"].sd == pytest.approx(told.information.sd_if_others_were_known()[1])
    assert "hold only for leads as found" in _without_error(told)[1]


@pytest.mark.parametrize(
    "bent",
    [
        lambda x: x + x**2,
        lambda x: x + 0.5 * x**3,
        lambda x: np.expm1(3.0 * x) / 3.0,
        lambda x: np.where(x > 0.0, 2.0, 0.2) * x,
        lambda x: x + 30.0 * np.maximum(x - 0.3, 0.0),
    ],
    ids=["square", "cube", "exponential", "kink at the fit", "kink beside it"],
)
def test_a_curved_prediction_does_not_jump(bent):
    """It deviates from its slope by more than half an error, but bit by bit."""
    fit = Fit(bent=bent)
    assert sd_of(fit)[0].jumping == ()


def test_a_smooth_constant_takes_four_predictions():
    fit = Fit()
    informed(fit)
    series = len(fit.recordings)  # one prediction for the residuals of each recording
    assert fit.predictions == 1 + 2 * (4 + 2) + series - 2  # the leads take a second step


def test_a_constant_that_jumps_is_not_pooled():
    """Its withheld error was. Others are pooled unless their errors hold only for it as found."""
    smooth, jumping, stairs = (_characterised(fit) for fit in (Fit(), Fit(NEAR, 1e3), Fit(NEAR, 1e3, slope=0.0)))

    def pooled(*results):
        return _pooled([Member(str(k), Path(str(k)), "actuator", one, "") for k, one in enumerate(results)])

    both, none = pooled(smooth, smooth)
    assert sorted(both) == ["leads", "stiffness"] and none == []
    found, left_out = pooled(smooth, jumping)
    assert left_out == ["1: leads has no error, because the misfit jumps within it"] and list(found) == ["stiffness"]
    beside = np.diag(np.linalg.inv(jumping.information.matrix + np.diag([0.6**-2, 0.0])))[1] ** 0.5
    assert found["stiffness"].sd[1] == pytest.approx(beside, rel=1e-3)
    found, left_out = pooled(smooth, stairs)
    assert found == {} and left_out[1] == "1: stiffness has an error that holds only for leads as found"


def test_it_is_in_no_sentence_and_no_gain_of_a_repeat():
    """Both constants are correlated by 0.99, and a repeat would shrink both."""
    found = {}
    for jump in (0.0, 1e3):
        fit = Fit(NEAR, jump)
        fisher, each, _ = sd_of(fit)
        start = {"leads": 0.3, "stiffness": 0.9}
        said = [e["kind"] for e in open_constants(fisher, fit.result.parameters, start)]
        one = repeats(fit, fisher, each)[0]
        found[jump] = said, [name for name, _ in one.shrinks], one.information
        stiffness = np.log(fisher.sd()[1] / fisher.sd(each[0])[1])
    assert found[0.0][0] == ["known_together"] and found[1e3][0] == []
    assert sorted(found[0.0][1]) == ["leads", "stiffness"] and found[1e3][1] == ["stiffness"]
    assert found[1e3][2] == pytest.approx(stiffness, rel=1e-6) and found[1e3][2] < 0.6 * found[0.0][2]


def test_constants_that_a_jumping_one_keeps_together_are_named_without_it():
    """The recordings tell a + b and c - b. If c were known, they would tell b, and so a."""
    rows = 1e3 * np.array([[1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    parameters = Parameters()
    for name in "abc":
        parameters.add(Parameter(name, 0.0, -10.0, 10.0, unit="1", prior=Prior(0.0, 1.0)))
    told = (tuple("abc"), rows.T @ rows, np.ones(3), np.ones(3), np.zeros(3, bool))
    start = dict.fromkeys("abc", 1.0)
    (loose, together) = open_constants(Information(*told, jumping=("c",)), parameters, start)
    assert loose["kind"] == "loose_direction" and sorted(loose["parameters"]) == ["a", "b"]
    assert together["kind"] == "known_together" and together["parameters"] == ["a", "b"]
    assert sorted(open_constants(Information(*told), parameters, start)[0]["parameters"]) == ["a", "b", "c"]


def test_a_table_says_that_its_error_is_not_known():
    entry = Parameter("G_m", 2.9e9, unit="GPa", prior=Prior(3.0e9, 1e8), standard_error=1e3)
    quoted = estimates({"G_m": entry}, {}, jumping=("G_m",))["G_m"]
    written = _fitted(entry, SimpleNamespace(unit="GPa"), "Fitted to c", quoted)
    assert written.prior is None and written.source.endswith("its error is not known")
    assert _fitted(entry, SimpleNamespace(unit="GPa"), "Fitted to c", None).prior is not None


def test_recordings_whose_fractions_did_not_settle_are_named():
    rows = [SimpleNamespace(extra={UNSETTLED: np.asarray(mark)}) for mark in (False, True)]
    fit = SimpleNamespace(recordings=[SimpleNamespace(name=name) for name in ("a", "b")], rows=rows)
    assert _unsettled(SimpleNamespace(fit=fit))[0].startswith("The martensite fractions of b did not settle")
    rows[1].extra = {}
    assert _unsettled(SimpleNamespace(fit=fit)) == []


@pytest.mark.parametrize("ratio", [0.2, 3.0, 8.0])
def test_resistances_that_scatter_far_more_than_their_noise_are_named(ratio):
    time, noise = np.arange(200.0), 1e-3 * np.random.default_rng(0).standard_normal(200)
    rows = SimpleNamespace(
        time=time,
        inputs={"resistance_2": 3.0 + noise},
        extra={
            "layout": SimpleNamespace(spring_numbers=(1, 2)),
            "noise_resistance_2": np.asarray(1e-3 / ratio),
            "ohms": (np.ones(200), np.full(200, 3.0)),
        },
    )
    said = _understated(SimpleNamespace(fit=SimpleNamespace(recordings=[SimpleNamespace(name="a")], rows=[rows])))
    assert bool(said) == (ratio > 5.0)
    assert all("that of spring 2 in a by a factor of" in sentence for sentence in said)
