"""Batches: pooled constants against exact and simulated answers; one bad specimen stops no other."""

import json
import shutil
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import fitting.calibrate.batch
from fitting.calibrate.batch import Member, _pooled
from fitting.calibrate.pooling import pool, without_priors
from fitting.calibrate.result import Estimate
from fitting.characterise import characterise_batch
from fitting.cli import main
from fitting.engine import Store
from fitting.synthesise import synthesise, write_synthetic
from pneusma_jax.errors import InputError

SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"


def test_equal_errors_give_the_textbook_answer():
    """With equal errors REML is the analysis of variance: tau^2 = s_x^2 - s^2."""
    x, s = np.array([1.0, 2.0, 4.0, 5.0]), 0.5
    found = pool("abcd", x, np.full(4, s))
    tau = np.sqrt(np.var(x, ddof=1) - s**2)
    assert found.spread == pytest.approx(tau, rel=1e-4)
    assert found.mean == pytest.approx(3.0) and found.mean_sd == pytest.approx(np.std(x, ddof=1) / 2.0, rel=1e-4)
    np.testing.assert_allclose(found.shrunk, 3.0 + tau**2 / (tau**2 + s**2) * (x - 3.0), rtol=1e-4)
    assert found.differ < 1e-6


def test_specimens_that_are_alike_are_one():
    found = pool("abc", [1.0, 1.01, 0.99], [0.1, 0.1, 0.1])
    assert found.spread == 0.0 and found.differ > 0.9
    np.testing.assert_allclose(found.shrunk, found.mean)
    assert found.mean_sd == pytest.approx(0.1 / np.sqrt(3.0))


def test_a_wide_error_is_drawn_in_and_a_narrow_one_is_not():
    found = pool("abcd", [1.0, 2.0, 3.0, 9.0], [0.1, 0.1, 0.1, 6.0])
    assert abs(found.shrunk[3] - found.mean) < 0.1 * abs(9.0 - found.mean)
    assert abs(found.shrunk[0] - 1.0) < 0.05
    assert found.next_low < 1.0 and found.next_high > 3.0


def test_intervals_hold_a_further_specimen_as_often_as_they_say():
    random = np.random.default_rng(5)
    inside = []
    for _ in range(400):
        s = random.uniform(0.1, 0.6, 6)
        theta = 10.0 + 0.5 * random.standard_normal(7)
        found = pool("abcdef", theta[:6] + s * random.standard_normal(6), s)
        inside.append(found.next_low < theta[6] < found.next_high)
    assert 0.84 < np.mean(inside) < 0.95


def test_a_prior_is_taken_out_of_an_estimate():
    data, sd, mean, width = 3.0, 0.4, 1.0, 0.5
    precision = sd**-2 + width**-2
    posterior = (data / sd**2 + mean / width**2) / precision
    told = without_priors(*(np.array(x) for x in ([posterior], [[1.0 / precision]], [mean], [width])))
    np.testing.assert_allclose(np.ravel(told), [data, sd], rtol=1e-3)
    told = without_priors(*(np.array(x) for x in ([1.0], [[0.49**2]], [mean], [width])))
    assert told[1][0] == np.inf


def test_constants_that_only_their_product_is_told_of_count_no_prior_twenty_times():
    """Log-constants x + y measured to 0.1 in each of 20 specimens, under a common prior that is 1 sd off."""
    prior, mean, noise, random = np.full(2, 0.14), np.zeros(2), 0.1, np.random.default_rng(2)
    H = np.full((2, 2), noise**-2) + np.diag(prior**-2.0)
    found = []
    for _ in range(20):
        seen = 0.14 + 0.1 + noise * random.standard_normal()  # x = 0.14, y = 0.1
        posterior = np.linalg.solve(H, np.full(2, seen / noise**2))
        found.append(without_priors(posterior, np.linalg.inv(H), mean, prior))
    assert all(np.isinf(sd).all() for _, sd in found)


def test_a_correlated_constant_that_is_told_keeps_its_coverage():
    """x and x + y measured: x pooled over 20 specimens holds its truth as often as it says, whatever y's prior."""
    random, inside = np.random.default_rng(3), []
    prior, noise = np.array([0.5, 0.05]), np.array([0.1, 0.1])
    A = np.array([[1.0, 0.0], [1.0, 1.0]])
    H = A.T @ np.diag(noise**-2.0) @ A + np.diag(prior**-2.0)
    for _ in range(200):
        x, y = 0.3, 0.15  # y is three of its prior's standard deviations off, in every specimen
        told = []
        for _ in range(20):
            seen = A @ [x, y] + noise * random.standard_normal(2)
            posterior = np.linalg.solve(H, A.T @ (seen / noise**2))
            told.append([part[0] for part in without_priors(posterior, np.linalg.inv(H), np.zeros(2), prior)])
        both = pool([str(n) for n in range(20)], *np.array(told).T)
        inside.append(abs(both.mean - x) < 1.645 * both.mean_sd)
    assert 0.84 < np.mean(inside) < 0.97


def test_constants_of_different_laws_are_not_one():
    def member(name, law, mu):
        result = SimpleNamespace(parameters={"mu": Estimate(mu, 0.5, "kPa", False)}, law=law)
        return Member(name, Path(name), "elastomer", result, "")

    members = [member("a", "neo_hookean", 40.0), member("b", "gent", 30.0), member("c", "gent", 31.0)]
    pooled, left_out = _pooled(members)
    assert list(pooled) == ["mu (gent)"] and pooled["mu (gent)"].mean == pytest.approx(30.5)
    assert left_out == ["a: mu is of neo_hookean, which no other specimen follows"]
    assert list(_pooled(members[1:])[0]) == ["mu"]


def test_a_specimen_whose_files_cannot_be_written_stops_no_other(tmp_path):
    for seed in (1, 2):
        write_synthetic(synthesise("elastomer", seed=seed), tmp_path / f"strip_{seed}")
    seen = []

    def finished(member):
        seen.append(member.name)
        if len(seen) == 1:
            raise OSError("the disk is full")

    found = characterise_batch([tmp_path / "strip_1", tmp_path / "strip_2"], finished, law="neo_hookean")
    assert seen == ["strip_1", "strip_2"] and len(found.done) == 2
    assert "the disk is full" in found.members[0].problem and "the disk is full" in " ".join(found.report().split())


def test_a_batch_goes_on_with_what_it_has_fitted(tmp_path, monkeypatch):
    for seed in (1, 2):
        write_synthetic(synthesise("elastomer", seed=seed), tmp_path / f"strip_{seed}")
    paths, store, told = [tmp_path / "strip_1", tmp_path / "strip_2"], Store(tmp_path / "fitted"), []
    first = characterise_batch(paths[:1], store=store, law="neo_hookean")
    asked = []
    real = fitting.calibrate.batch.characterise
    monkeypatch.setattr(
        fitting.calibrate.batch, "characterise", lambda campaign, **o: asked.append(campaign.path.name) or real(campaign, **o)
    )
    both = characterise_batch(paths, store=store, kept=lambda member: told.append(member.name), law="neo_hookean")
    assert asked == ["strip_2"] and told == ["strip_1"], "only what is missing is fitted"
    assert both.members[0].result.parameters == first.members[0].result.parameters
    again = characterise_batch(paths, store=store, law="neo_hookean")
    assert len(asked) == 1 and again.report() == both.report()
    recording = next((tmp_path / "strip_1").glob("*.csv"))
    lines = recording.read_text().splitlines()
    recording.write_text("\n".join(lines[:-1]) + "\n")
    characterise_batch(paths, store=store, law="neo_hookean")
    assert asked == ["strip_2", "strip_1"], "a campaign that changed is fitted again"
    characterise_batch(paths[1:], store=store, law="gent")
    assert asked[-1] == "strip_2" and len(asked) == 3, "other options are another fit"


@pytest.fixture(scope="module")
def batch(tmp_path_factory):
    """Three wires of one alloy, one folder that is none."""
    folder = tmp_path_factory.mktemp("wires")
    for seed in (1, 2, 3):
        write_synthetic(synthesise("wire", seed=seed), folder / f"wire_{seed}")
    (folder / "empty").mkdir()
    paths = [folder / name for name in ("wire_1", "empty", "wire_2", "wire_3")]
    return characterise_batch(paths, starts=1)


def test_one_bad_specimen_stops_no_other(tmp_path):
    for seed in (1, 2):
        write_synthetic(synthesise("elastomer", seed=seed), tmp_path / f"strip_{seed}")
    (tmp_path / "empty").mkdir()
    paths = [tmp_path / name for name in ("strip_1", "empty", "strip_2")]
    found = characterise_batch(paths, law="neo_hookean")
    assert [member.result is not None for member in found.members] == [True, False, True]
    assert "no recording" in found.members[1].problem
    said = " ".join(found.report().split())
    assert "2 of 3 campaigns were characterised" in said and "empty was not" in said


@pytest.mark.slow
def test_one_bad_wire_stops_no_other(batch):
    assert [member.result is not None for member in batch.members] == [True, False, True, True]
    assert "no recording" in batch.members[1].problem
    said = " ".join(batch.report().split())
    assert "3 of 4 campaigns were characterised" in said and "empty was not" in said


@pytest.mark.slow
def test_a_batch_is_summarised_across_specimens(batch):
    middle = batch.pooled["T_mid"]
    assert middle.names == ("wire_1", "wire_2", "wire_3")
    assert middle.spread > 0.5 and middle.differ < 0.01  # drawn with 5 % between specimens
    assert middle.next_low < 45.0 < middle.next_high
    assert "gR_slope" not in batch.pooled and any("gR_slope" in line for line in batch.left_out)
    report = json.loads(batch.documents()["report.json"])
    assert report["schema"] == "pneusma-characterisation-batch/1"
    assert report["pooled"]["T_mid"]["mean"] == pytest.approx(middle.mean)
    assert report["pooled"]["T_mid"]["unit"] == middle.unit == "degC"
    assert "T_mid [degC]" in batch.report() and "T_mid,3," in batch.documents()["summary.csv"]
    panels = [panel.get_xlabel() for panel in batch.plot()["specimens"].axes if panel.get_visible()]
    assert all(label.endswith("]") for label in panels)
    assert report["campaigns"][1]["problem"] and report["campaigns"][1]["parameters"] is None


def test_nothing_but_bad_specimens_is_refused(tmp_path):
    with pytest.raises(InputError, match="none of 1 campaign could"):
        characterise_batch([tmp_path])


@pytest.mark.slow
def test_the_command_writes_each_and_all(tmp_path, capsys):
    shutil.copytree(SHIPPED / "tube", tmp_path / "tube")
    (tmp_path / "bad").mkdir()
    with pytest.raises(SystemExit) as left:
        main(["characterise-batch", str(tmp_path / "tube"), str(tmp_path / "bad"), "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert left.value.code == 1 and "bad" in said.err and "1 of 2 campaigns" in said.out
    assert (tmp_path / "out" / "tube" / "report.html").exists()
    assert {"report.json", "report.html", "specimens.csv", "summary.csv"} <= {
        p.name for p in (tmp_path / "out").iterdir()
    }
    pooled = json.loads((tmp_path / "out" / "report.json").read_text())["pooled"]
    assert set(pooled["silicone_stiffness"]["specimens"]) == {"tube 1", "tube 2"}
