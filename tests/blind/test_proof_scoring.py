"""The trial's own arithmetic on made-up reports, its running and resuming with a made-up diagnosis, other methods' regressions."""

import dataclasses
import functools
import json

import numpy as np
import pytest

from fitting.inference.channels import Channel
from pneusma_jax.errors import InputError
from validation.blind.cases import Case
from validation.blind.proof import __main__ as command
from validation.blind.proof import baselines, ledger, score, worker
from validation.blind.proof import run as running
from validation.blind.proof.figures import draw
from validation.blind.proof.judge import holds, judge
from validation.blind.proof.places import Places, read
from validation.blind.proof.regressors import GaussianProcess, SparseRegression


def _truth(name="c1", group="single", slugs=("gravity",), log_bayes=100.0, **more):
    null = group == "null"
    return {
        "name": name, "kind": "tube", "group": group, "slugs": list(slugs), "log_bayes_post_refit": None if null else log_bayes,
        "component": None if null else "environment", "driver": [] if null else ["pressure"], "parameters": {}, "base": {},
    } | more  # fmt: skip


def _effect(name, probability=0.9, close=(), **parameters):
    return {"name": name, "probability": probability, "confusable_with": list(close), "parameters": parameters}


def _report(*effects, said_set=(), unknown=0.01, before=5.0, after=1.1, departure=0.5, component="sensor", drivers=()):
    names = [e["name"] for e in effects]
    return {
        "verdict": "mismatch" if effects else "consistent", "effects": list(effects), "explanation_set": [*names, *said_set],
        "unknown_probability": unknown, "no_effect_probability": 0.0 if effects else 0.95,
        "candidates": [{"name": n, "probability": 0.9} for n in names],
        "where": {"component": component, "drivers": list(drivers)},
        "fit": {"before": {"reduced_chi2": before}, "after": {"reduced_chi2": after}},
        "base_parameters": {"x": {"departure_sd": {"alone": 3.0, "with_effects": -departure}}},
    }  # fmt: skip


def test_intervals_are_those_of_clopper_and_pearson():
    found = score.rate([False] * 300)
    assert (found["k"], found["n"], found["low"]) == (0, 300, 0.0)
    assert found["high"] == pytest.approx(1.0 - 0.025 ** (1 / 300), rel=1e-9)  # closed form where nothing happened
    # R: binom.test(9, 10)$conf.int
    found = score.rate([True] * 9 + [False])
    assert (found["low"], found["high"]) == (pytest.approx(0.5549839, abs=1e-6), pytest.approx(0.9974714, abs=1e-6))
    assert score.rate([])["rate"] is None


@pytest.mark.parametrize(
    ("truth", "report", "expected"),
    [
        (_truth(), _report(_effect("gravity")), {"top": True, "covered": True, "wrong": [], "modelled": True}),
        (_truth(), _report(_effect("tip_contact")), {"top": False, "covered": False, "wrong": ["tip_contact"]}),
        (_truth(), _report(_effect("tip_contact", 0.8)), {"wrong": []}),
        (_truth(), _report(_effect("tip_contact", close=["gravity"])), {"top": False, "covered": True, "wrong": []}),
        (_truth(), _report(_effect("tip_contact"), said_set=["gravity"]), {"covered": True, "wrong": ["tip_contact"]}),
        (_truth(), _report(_effect("gravity"), _effect("pressure_lag")), {"top": True, "wrong": ["pressure_lag"]}),
        (_truth(), _report(_effect("unmodelled"), unknown=0.9), {"top": False, "wrong": [], "confident_unmodelled": True}),
        (_truth(), _report(), {"mismatch": False, "top": False, "covered": False, "first": "consistent"}),
        (_truth(group="null", slugs=()), _report(), {"mismatch": False, "top": True, "strong": False}),
        (_truth(group="null", slugs=()), _report(_effect("gravity")), {"mismatch": True, "top": False, "wrong": ["gravity"]}),
        (_truth(group="outside", slugs=("unmodelled",)), _report(_effect("unmodelled"), drivers=["time", "pressure"]),
         {"top": True, "where_right": True, "component_right": False, "wrong": []}),
        (_truth(group="outside", slugs=("unmodelled",)), _report(_effect("gravity"), component="environment"),
         {"top": False, "where_right": True, "wrong": ["gravity"]}),
        (_truth(), {"error": "ValueError: no"}, {"top": False, "covered": False, "mismatch": False, "first": "error"}),
    ],
)  # fmt: skip
def test_a_report_is_judged_by_what_it_says_first_and_what_it_leaves_open(truth, report, expected):
    row = judge(report, truth)
    assert {key: row[key] for key in expected} == expected


def test_pairs_need_both_and_are_strong_where_each_is():
    truth = _truth(group="pair", slugs=("gravity", "pressure_lag"), log_bayes_each=[90.0, 12.0])
    both = judge(_report(_effect("pressure_lag"), _effect("gravity")), truth)
    assert both["top"] and not both["strong"]
    assert not judge(_report(_effect("pressure_lag")), truth)["top"]
    assert judge(_report(_effect("pressure_lag", close=["gravity"])), truth)["covered"]
    assert judge(_report(), truth | {"log_bayes_each": [90.0, 31.0]})["strong"]


def test_what_a_model_must_do_on_recordings_that_were_not_fitted():
    assert holds(1.2, 1.3) and holds(101.0, 5.9) and not holds(101.0, 6.1)
    assert not holds(5.0, None) and not holds(5.0, float("nan")) and not holds(1.0, 1.4)


@pytest.mark.parametrize(("within_errors", "predicted"), [
    (None, False),  # recordings that are left out in turn have none
    ({"before": 9.0, "after": 1.05}, True),
    ({"before": 9.0, "after": 1.5}, False),
])  # fmt: skip
def test_a_model_that_leaves_numbers_open_may_predict_within_their_errors_and_not_hold(within_errors, predicted):
    report = _report(_effect("gravity"), after=2.0)
    report["fit"]["predictive_reduced_chi2"] = within_errors
    row = judge(report, _truth())
    assert (row["modelled"], row["predicted"]) == (False, predicted)
    assert judge(_report(_effect("gravity"), after=1.1), _truth())["predicted"]  # a model that holds does


def test_parameters_are_compared_where_they_mean_the_same():
    delay = {"value": 0.33, "sd": 0.02, "unit": "s"}
    truth = _truth(slugs=("channel_lag",), parameters={"channel_lag": {"amplitude": 0.3}})
    (error,) = judge(_report(_effect("channel_lag", delay=delay, other=delay)), truth)["parameters"]
    assert error["parameter"] == "channel_lag.delay"
    assert error["relative"] == pytest.approx(0.1) and error["sd"] == pytest.approx(1.5)


def _many():
    """Twelve cases whose rates are counted by hand below."""
    truths, reports = {}, {}
    made = [
        *[(_truth(group="null", slugs=()), _report()) for _ in range(3)],
        (_truth(group="null", slugs=()), _report(_effect("gravity"))),
        *[(_truth(), _report(_effect("gravity"))) for _ in range(2)],
        (_truth(), _report(_effect("gravity"), after=2.0, departure=3.0)),
        (_truth(), _report(_effect("tip_contact", 0.95))),
        (_truth(log_bayes=8.0), _report()),
        (_truth(log_bayes=8.0), _report(_effect("tip_contact", 0.6, ["gravity"]))),
        (_truth(group="outside", slugs=("unmodelled",)), _report(_effect("unmodelled", 0.7), unknown=0.7)),
        (_truth(), {"error": "it broke"}),
    ]
    for n, (truth, report) in enumerate(made):
        truths[f"c{n}"], reports[f"c{n}"] = truth | {"name": f"c{n}"}, report
    return truths, reports


def _others(reports, factor):
    return {
        name: {"bic_stepwise": r if "error" in r else r | {"fit": {"before": {"reduced_chi2": 5.0}, "after": {"reduced_chi2": factor}}}}
        for name, r in reports.items()
    }


def test_rates_are_over_the_cases_that_they_are_about():
    truths, reports = _many()
    found = score.scored(truths, reports, {"c0": {"seconds": 3.0, "cpu_seconds": 2.0}}, _others(reports, 2.0))
    counts = {key: (r["k"], r["n"]) for key, r in found["rates"].items()}
    expected = {
        "false_alarms": (1, 4), "named_first": (3, 5), "covered": (3, 5), "confident_wrong": (1, 5), "confident_wrong_all": (2, 12),
        "weak_detected": (1, 2), "weak_covered": (1, 1), "outside_unmodelled": (1, 1), "outside_where_right": (0, 1),
        "modelled": (2, 3), "predicted": (2, 3), "nulls_modelled": (3, 3), "base_back": (2, 3), "errors": (1, 12), "pairs_both_named": (0, 0),
    }  # fmt: skip
    assert {key: counts[key] for key in expected} == expected
    assert found["times"]["all"]["median_seconds"] == 3.0
    assert sum(b["detected"]["n"] for b in found["curve"]) == 7
    assert found["confusion"]["gravity"] == {"gravity": 3, "tip_contact": 1, "error": 1}
    other = found["methods"]["bic_stepwise"]
    assert (other["tool_is_better"]["k"], other["tool_is_better"]["n"], other["tool_is_worse"]["k"]) == (6, 7, 0)
    assert other["median_held_out"] == 2.0 and found["methods"]["pneusma diagnose"]["median_held_out"] == 1.1
    present = {round(b["stated"], 2): (b["so"]["k"], b["so"]["n"]) for b in found["reliability"]["present"]}
    assert present == {0.65: (1, 2), 0.9: (3, 4), 0.95: (0, 1)}


def test_the_ledger_only_grows_and_its_table_quotes_the_counts(tmp_path, capsys):
    truths, reports = _many()
    found = score.scored(truths, reports, {}, _others(reports, 2.0))
    path = tmp_path / "ledger.jsonl"
    for _ in range(2):
        ledger.append(path, ledger.entry(found, "fixed", 5, "", {"abc"}, "2026-01-02", ledger.lines(path)))
    first, second = ledger.lines(path)
    assert first["rates"] == second["rates"] and (first["scored_before"], second["scored_before"]) == (0, 1)
    assert command.main(["table", "--ledger", str(path)]) == 0
    text = capsys.readouterr().out
    assert "| Strong single effect named first | 3/5 (60 %) | 14.7-94.7 % | at least 92 % |" in text
    assert "| Median reduced chi2 on values not fitted | 1.1 | 2 |" in text
    assert command.main(["table", "--ledger", str(path), "--plan", "full"]) == 2
    ledger.append(path, ledger.entry(found, "fixed", 6, "again", {"abc"}, "2026-01-03"))
    capsys.readouterr()
    assert command.main(["table", "--ledger", str(path), "--since", "2026-01-01"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("2 runs of 2026-01-02 to 2026-01-02")  # opened cases do not count twice
    assert "| Strong single effect named first | 6/10 (60 %) | 26.2-87.8 % | at least 92 % |" in text
    assert command.main(["table", "--ledger", str(path), "--since", "2026-01-03"]) == 2


def test_the_slope_of_stated_probabilities_is_one_where_they_are_what_they_say():
    def table(said, so, n=400):
        return [{"stated": p, "so": score.rate_of(round(n * q), n)} for p, q in zip(said, so, strict=True)]

    honest = score.slope(table([0.1, 0.5, 0.9], [0.1, 0.5, 0.9]))
    assert honest["slope"] == pytest.approx(1.0) and honest["low"] < 1.0 < honest["high"] and honest["n"] == 1200
    boasting = score.slope(table([0.1, 0.5, 0.9], [0.3, 0.5, 0.7]))
    assert boasting["slope"] == pytest.approx(0.5) and boasting["high"] < 0.7
    assert score.slope(table([0.9], [0.9])) is None and score.slope([]) is None


def test_digitised_nulls_have_a_rate_of_their_own():
    truths = {f"c{n}": _truth(f"c{n}", "readout", (), log_bayes=None) | {"readout": "rounded"} for n in range(3)}
    reports = {"c0": _report(), "c1": _report(_effect("gravity")), "c2": _report()}
    found = score.scored(truths, reports, {}, {})["rates"]
    assert (found["readout_false_alarms"]["k"], found["readout_false_alarms"]["n"]) == (1, 3)
    assert found["false_alarms"]["n"] == found["named_first"]["n"] == 0


def test_figures_are_drawn_of_few_cases_as_of_many(tmp_path):
    truths, reports = _many()
    paths = draw(score.scored(truths, reports, {}, _others(reports, 2.0)), tmp_path)
    assert [p.name for p in paths] == [f"proof_{n}.png" for n in ("detection", "confusion", "reliability", "held_out")]
    assert all(p.read_bytes().startswith(b"\x89PNG") for p in paths)
    only_null = {"c0": truths["c0"]}
    draw(score.scored(only_null, {"c0": reports["c0"]}, {}, {}), tmp_path / "null")


def _made_up(seen, folder, seed):
    """A diagnosis that sees only a folder, and fails on the second one it meets."""
    seen.append(folder)
    assert sorted(p.suffix for p in folder.iterdir()) == [".csv", ".toml"]
    if len(seen) == 2:
        raise RuntimeError("singular")
    return _report()


def _write_campaign(case, folder):
    folder.mkdir(parents=True)
    (folder / "run_1.csv").write_text(f"{case.seed}\n")
    (folder / "run_1.toml").write_text("")
    return {"name": case.name} | _truth(case.name, "null", ())


@pytest.fixture
def small(monkeypatch):
    """Four cases whose campaigns cost nothing."""
    cases = [Case(f"c{n}", kind, "null", (), None, n) for n, kind in enumerate(("wire", "tube", "wire", "actuator"))]
    monkeypatch.setattr(running, "case_list", lambda plan, seed: cases)
    monkeypatch.setattr("validation.blind.seal.write_case", _write_campaign)
    monkeypatch.setattr(running, "truth_of", lambda case: {"name": case.name} | _truth(case.name, "null", ()))
    return cases


def test_a_run_goes_by_kind_outlives_failures_and_resumes(tmp_path, small):
    places, seen = Places(tmp_path / "x"), []
    done = running.run(small, places, diagnose=functools.partial(_made_up, seen))
    assert [case.name for case in done] == ["c0", "c1", "c2", "c3"]
    assert [folder.name for folder in seen] == ["c3", "c0", "c2", "c1"]
    assert read(places.report("c0"))["error"] == "RuntimeError: singular"
    places.report("c2").unlink()
    assert len(running.run(small, places, diagnose=functools.partial(_made_up, seen))) == 4
    assert [folder.name for folder in seen[4:]] == ["c2"]
    later = Places(tmp_path / "x", "later")  # another tool, the same sealed cases
    assert running.run(small, later, minutes=1e-9, diagnose=functools.partial(_made_up, seen)) == []
    assert not (places.campaigns / "opened.json").exists()


def _report_of(folder, seed):
    """A diagnosis that says where it was."""
    return _report() | {"folder": folder.name}


def test_cases_may_be_done_elsewhere_in_any_order_and_a_run_that_broke_goes_on(tmp_path, small):
    def breaks(job, numbers):
        for number in reversed(list(numbers)):
            yield number, job(number)
            raise InputError("the cluster is gone")

    places, calls = Places(tmp_path), []
    with pytest.raises(InputError, match="is gone"):
        running.run(small, places, scheduler=breaks, diagnose=_report_of)
    assert not list(places.reports.glob("*/report.json")), "no case was sealed to its end"

    def elsewhere(job, numbers):
        calls.append(list(numbers))
        return ((number, job(number)) for number in reversed(calls[-1]))

    done = running.run(small, places, scheduler=elsewhere, diagnose=_report_of)
    assert [case.name for case in done] == ["c0", "c1", "c2", "c3"]
    assert calls == [[0, 1, 2], [0, 1, 2, 3]], "one case was sealed before the break"
    assert all(read(places.report(case.name))["folder"] == case.name for case in small)
    assert list(running.truths(small, places, elsewhere)) == ["c0", "c1", "c2", "c3"]


def test_a_case_that_kills_its_process_is_recorded(tmp_path, small):
    places, seen = Places(tmp_path), []
    (places.reports / "c0").mkdir(parents=True)
    (places.reports / "c0" / "attempts.json").write_text(str(worker.MOST_ATTEMPTS))
    running.run(small[:1], places, diagnose=functools.partial(_made_up, seen))
    assert not seen and "the process ended 3 times" in read(places.report("c0"))["error"]


def test_the_command_scores_what_has_a_report_and_nothing_else(tmp_path, small, monkeypatch, capsys):
    own = ["--plan", "fixed", "--seed", "7", "--out", str(tmp_path)]
    monkeypatch.setattr(command, "run", functools.partial(running.run, diagnose=functools.partial(_made_up, [])))
    assert command.main(["score", *own]) == 2
    assert command.main(["run", *own, "--limit", "3"]) == 0
    assert command.main(["score", *own]) == 0
    folder = tmp_path / "fixed-7"
    assert [line["cases"] for line in ledger.lines(folder / "ledger.jsonl")] == [3, 3]
    assert json.loads((folder / "score.json").read_text())["rates"]["false_alarms"]["n"] == 3
    small.append(Case("c9", "wire", "null", (), None, 9))  # the generator's plan has changed
    assert command.main(["score", *own]) == 2
    assert "others than when" in capsys.readouterr().err


def test_a_truth_stays_sealed_without_its_report_and_must_match_its_seal(tmp_path, small):
    places = Places(tmp_path)
    running.run(small, places, diagnose=functools.partial(_made_up, [None] * 2))
    places.report("c1").rename(tmp_path / "aside.json")
    with pytest.raises(ValueError, match="stays sealed"):
        running.truths(small, places)
    assert not (places.campaigns / "opened.json").exists()
    (tmp_path / "aside.json").rename(places.report("c1"))
    assert list(running.truths(small, places)) == ["c0", "c1", "c2", "c3"]
    opened = places.campaigns / "opened.json"
    opened.write_text(opened.read_text().replace('"tube"', '"wire"', 1))
    with pytest.raises(ValueError, match="does not match"):
        running.truths(small, places)


def test_a_case_that_cannot_be_made_is_left_out(tmp_path, small, monkeypatch):
    def write(case, folder):
        if case.name == "c2":
            raise ArithmeticError("no equilibrium")
        return _write_campaign(case, folder)

    monkeypatch.setattr("validation.blind.seal.write_case", write)
    for _ in range(2):
        done = running.run(small, Places(tmp_path), diagnose=functools.partial(_made_up, [None] * 2))
        assert [case.name for case in done] == ["c0", "c1", "c3"]
    assert read(tmp_path / "unmade.json") == {"c2": "no equilibrium"}


def test_a_gaussian_process_interpolates_and_returns_to_nothing_far_away():
    rng = np.random.default_rng(0)
    x = rng.uniform(-2.0, 2.0, (300, 2))
    y = 6.0 * np.sin(2.0 * x[:, 0]) + rng.standard_normal(300)
    learnt = GaussianProcess(x, y, np.arange(300) < 150)
    assert np.sqrt(np.mean((learnt(x[150:]) - 6.0 * np.sin(2.0 * x[150:, 0])) ** 2)) < 0.6
    assert np.abs(learnt(np.full((1, 2), 60.0)))[0] < 0.1
    step = 1e-6
    theta = np.array([1.0, 0.2, 0.3, 0.5])
    for k in range(4):
        move = step * np.eye(4)[k]
        slope = (learnt._cost(theta + move)[0] - learnt._cost(theta - move)[0]) / (2.0 * step)
        assert learnt._cost(theta)[1][k] == pytest.approx(slope, rel=1e-4, abs=1e-5)


@dataclasses.dataclass
class _Program:
    """What folds and held-out errors need of a program."""

    fitted: np.ndarray
    channels: list
    free: float = 1.0

    def free_share(self, k):
        """Part of recording k's values that no latent trajectory takes up."""
        return self.free


def _channels(*lengths):
    return [Channel("force", np.zeros(n), np.r_[np.ones(n - 2), np.inf, np.inf], 0.0) for n in lengths]


@pytest.mark.parametrize(
    ("fitted", "lengths", "folds"),
    [([True, True, False], [(8,), (8,), (8,)], 1), ([True] * 6, [(8, 8)] * 6, 6), ([True], [(40, 40)], 8)],
)
def test_every_value_is_left_out_once_and_counted_once(fitted, lengths, folds):
    program = _Program(np.array(fitted), [_channels(*mine) for mine in lengths])
    made = baselines._folds(program)
    out = [np.sum([fold.out[k] for fold in made], axis=0) for k in range(len(fitted))]
    judged = [np.full(sum(mine), float(all(fitted) or not f)) for mine, f in zip(lengths, fitted, strict=True)]
    assert len(made) == folds
    for fold in made:
        assert all(np.array_equal(a + b, np.ones_like(a)) for a, b in zip(fold.fit, fold.out, strict=True))
    assert all(np.array_equal(a, b) for a, b in zip(out, judged, strict=True))
    misfit = [np.concatenate([np.where(np.isfinite(c.sigma), 2.0, 0.0) for c in mine]) for mine in program.channels]
    parts = [(fold, misfit) for fold in made]
    assert baselines.held_out(program, parts) == pytest.approx(4.0)
    program.free = 0.5
    assert baselines.held_out(program, parts) == pytest.approx(8.0)


@pytest.mark.slow
def test_a_sealed_coupon_from_campaign_to_answers_of_every_method(tmp_path):
    case = Case("c0", "elastomer", "single", ("strain_stiffening",), 300.0, 4)
    places = Places(tmp_path)
    (done,) = running.run([case], places, compare=worker.compare_folder)
    assert done is case and read(places.timing("c0"))["seconds"] > 0.0
    report, answers = read(places.report("c0")), read(places.baselines("c0"))
    assert report["effects"][0]["name"] == answers["bic_stepwise"]["effects"][0]["name"] == "strain_stiffening"
    before = report["fit"]["before"]["reduced_chi2"]
    for method in score.METHODS:
        assert answers[method]["fit"]["before"]["reduced_chi2"] == pytest.approx(before, rel=1e-6)
    assert answers["bic_stepwise"]["fit"]["after"]["reduced_chi2"] < before


def test_sparse_regression_keeps_the_terms_that_are_there():
    rng = np.random.default_rng(1)
    x = rng.uniform(-1.0, 1.0, (200, 3))
    true = 4.0 * x[:, 0] * x[:, 1] - 3.0 * x[:, 2]
    learnt = SparseRegression(x, true + 0.1 * rng.standard_normal(200), np.ones(200, bool))
    assert np.count_nonzero(learnt.weights) == 2
    np.testing.assert_allclose(learnt(x), true, atol=0.1)


def test_a_run_may_be_of_some_kinds_and_groups():
    chosen = running.chosen_cases("development", 3, 5, ["tube", "elastomer"], ["pair", "outside"])
    assert chosen and {c.kind for c in chosen} <= {"tube", "elastomer"} and {c.group for c in chosen} <= {"pair", "outside"}
    with pytest.raises(ValueError, match="unknown group 'pairs': one of"):
        running.chosen_cases("development", 3, groups=["pairs"])
