"""Errors of constants where the prediction jumps near the fit."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.alloy_table import _fitted
from fitting.calibrate.general.information import informed, repeats
from fitting.calibrate.information import Information
from fitting.calibrate.open_constants import open_constants
from fitting.calibrate.quoted import estimates
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report.characterisation import estimate_text
from fitting.report.general.text import _unsettled, _without_error
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
    """

    def __init__(self, where, jump):
        parameters = Parameters()
        parameters.add(Parameter("leads", BEST, 0.0, 2.0, unit="ohm", prior=Prior(0.3, 0.6), standard_error=1.0))
        parameters.add(Parameter("stiffness", 1.0, 0.5, 2.0, unit="1", prior=Prior(1.0, 0.05), standard_error=1.0))
        result = SimpleNamespace(parameters=parameters, values=parameters.valuesdict())
        recordings = [SimpleNamespace(name=name, role="fit") for name in ("a", "b")]
        one = np.ones(ROWS)
        noise = np.random.default_rng(0).standard_normal(ROWS)
        rows = Rows(one > 0.0, TIME, {}, {"curvature": noise}, {"curvature": one / np.sqrt(2.0)}, {}, {}, np.asarray(1))
        super().__init__(
            model=SimpleNamespace(searches=False), recordings=recordings, rows=[rows, rows], result=result, zeros={},
            inflation=1.0, where=where, jump=jump,
        )  # fmt: skip

    def predict(self, values=None):
        values = values or self.result.values
        leads, stiffness = values["leads"], values["stiffness"]
        outputs = SLOPE * (leads - BEST) + (40.0 + 4.0 * np.sin(TIME)) * (stiffness - 1.0)
        return [{"curvature": outputs + self.jump * (leads > self.where)}] * 2

    def derivative(self, name):
        slope = np.full(ROWS, SLOPE) if name == "leads" else 40.0 + 4.0 * np.sin(TIME)
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
    quoted = estimates(fit.result.parameters, {}, jumping=fisher.jumping)
    assert not np.isfinite(quoted["leads"].sd) and quoted["leads"].interval == {}
    assert estimate_text(quoted["leads"]) == "0.12 ± n/a" and quoted["stiffness"].sd == 1.0
    told = SimpleNamespace(information=fisher, parameters=quoted)
    assert _without_error(told)[0].startswith("No error of leads is quoted: the misfit jumps")


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
