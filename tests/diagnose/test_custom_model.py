"""A base model of one's own: the term that is missing is found among rivals, and untouched recordings are predicted."""

import json

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.diagnose.custom_model import OwnModel, OwnRecording, Term, explain_own
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.report.results import save, text
from pneusma_jax.effects import Spec
from pneusma_jax.errors import InputError

PRESSURE = np.linspace(0.0, 1.0, 25)


def base(values, columns, facts, slot):
    pressure = slot("pressure", columns["pressure"])
    return {"angle": slot("angle", values["compliance"] * facts["length"] * pressure)}


TERMS = (
    Term("leak", "Air leaks.", "pressure", {"share": Spec(0.0, 0.0, 1.0, 0.3, "1", "lost at full scale")},
         lambda v, own, c, f: v * (1.0 - 0.5 * own["share"] * v)),
    Term("tilt", "The camera is turned.", "angle", {"tilt": Spec(0.0, -5.0, 5.0, 1.0, "deg", "of the camera")},
         lambda v, own, c, f: v + own["tilt"]),
    Term("shut", "Folds stay shut at first.", "pressure", {"onset": Spec(0.0, 0.0, 0.4, 0.1, "1", "pressure that opens them")},
         lambda v, own, c, f: jnp.where(v > own["onset"], v - own["onset"], 0.0)),
)  # fmt: skip


def parameters():
    return Parameters(Parameter("compliance", 1.0, min=0.2, max=3.0, prior=Prior(1.0, 0.2, 0.2, 3.0)))


def recordings(truth, seed=0, rows=25):
    rng = np.random.default_rng(seed)
    made = []
    for k, length in enumerate((10.0, 20.0, 30.0, 40.0, 25.0, 35.0)):
        pressure = PRESSURE[: rows - k]  # of different lengths
        angle = truth(pressure, length) + 0.1 * rng.standard_normal(len(pressure))
        angle[3] = np.nan
        role = "validation" if k >= 4 else "fit"
        made.append(OwnRecording(f"r{k}", {"pressure": pressure}, {"angle": angle}, {"angle": 0.1}, {"length": np.array(length)}, role))
    return made


def leaking(pressure, length):
    """Another form than the candidate's: the pressure saturates exponentially."""
    return 1.1 * length * 1.2 * (1.0 - np.exp(-pressure / 1.2))


@pytest.fixture(scope="module")
def explained():
    return explain_own(OwnModel(base, parameters(), TERMS), recordings(leaking))


def test_the_missing_term_is_found_and_predicts(explained):
    assert explained.named[0] == "leak"
    before, after = explained.errors()
    assert before["angle"] > 0.5 and after["angle"] < 0.25 * before["angle"]
    share = explained.final.result.parameters["leak__share"]
    assert 0.3 < share.value < 1.0 and not share.at_bound
    assert "leak: Air leaks." in text(explained) and "Never fitted: RMSE of angle" in text(explained)
    whole = explained.predict({"pressure": PRESSURE}, {"length": np.array(50.0)})["angle"]
    np.testing.assert_allclose(whole, leaking(PRESSURE, 50.0), atol=0.8)


def test_an_idle_threshold_is_scored_by_a_typical_one(explained):
    gains = explained.problem.gains(explained.base)
    assert gains["shut"] > 0.0 and gains["leak"] > 0.0


def test_nothing_is_missing_from_the_truth():
    result = explain_own(OwnModel(base, parameters(), TERMS), recordings(lambda p, length: 1.1 * length * p, seed=3))
    assert result.named == () and result.final is result.base
    assert "None of the candidates" in result.report()


def test_everything_is_written(explained, tmp_path):
    assert {path.name for path in save(explained, tmp_path / "out")} == {"report.json", "report.html", "predictions.png"}
    report = json.loads((tmp_path / "out" / "report.json").read_text(), parse_constant=pytest.fail)
    assert report["terms"] == list(explained.named) and set(report["rmse"]) == {f"r{k}" for k in range(6)}
    share = explained.final.result.parameters["leak__share"]
    assert report["parameters"]["leak__share"]["value"] == share.value
    assert report["parameters"]["leak__share"]["sd"] == pytest.approx(share.standard_error * explained.inflation**0.5)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "The base misses leak" in page and "Air leaks." in page and page.count("<figure>") == 1


def test_wrong_slots_names_and_recordings_are_refused():
    stray = Term("stray", "Acts nowhere.", "presure", TERMS[0].specs, TERMS[0].apply)
    with pytest.raises(InputError, match="no such slot.*pressure"):
        explain_own(OwnModel(base, parameters(), (stray,)), recordings(leaking))
    with pytest.raises(InputError, match="two terms"):
        OwnModel(base, parameters(), (TERMS[0], TERMS[0]))
    with pytest.raises(InputError, match="identifier"):
        Term("no good", "", "pressure", TERMS[0].specs, TERMS[0].apply)
    unlike = recordings(leaking)
    unlike[1] = OwnRecording("odd", {"p": PRESSURE}, unlike[0].measured, {"angle": 0.1}, unlike[0].facts)
    with pytest.raises(InputError, match="odd.*other columns"):
        explain_own(OwnModel(base, parameters(), TERMS), unlike)
    with pytest.raises(InputError, match="nothing is left to fit"):
        explain_own(OwnModel(base, parameters(), TERMS), recordings(leaking)[4:])
