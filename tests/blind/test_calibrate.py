"""The curve of something unknown: from campaigns with a known truth, never from those of the blind trial."""

import tomllib

import numpy as np
import pytest

from fitting.diagnose.verdict.unknown import Signs, curve
from validation.blind import calibrate
from validation.blind.calibrate import (
    CURVE,
    ROWS,
    curve_of,
    fitted,
    log_loss,
    main,
    read_rows,
    unknown_acts,
    weights,
    write_rows,
)


def simulated(count, odds, seed=0):
    """Rows of campaigns whose signs are random, and whose answers follow a curve."""
    rng = np.random.default_rng(seed)
    rows = []
    for k in range(count):
        signs = Signs(*(10.0 ** rng.uniform(-3.0, 0.0, 2)), 10.0 ** rng.uniform(-1.0, 2.0))
        acts = rng.random() < 1.0 / (1.0 + np.exp(-signs.scaled @ odds))
        rows.append(dict(zip(calibrate.COLUMNS, (
            "5", f"c{k}", "tube", "single", f"{signs.kept:.6g}", f"{signs.outdone:.6g}",
            f"{signs.beside:.6g}", str(int(acts)), "x",
        ), strict=True)))  # fmt: skip
    return rows


def test_a_curve_is_found_again():
    odds = np.array([-3.0, 2.0, 1.0, 0.5])
    table = tomllib.loads(curve_of(simulated(2000, odds)))
    assert list(table["odds"].values()) == pytest.approx(odds, abs=0.3)
    assert table["campaigns"] == 2000 and table["seeds"] == [5]
    assert table["log_loss"] == pytest.approx(table["log_loss_left_out"], rel=0.01)


def test_a_sign_that_tells_nothing_gets_no_weight():
    x = np.stack([np.ones(400), np.random.default_rng(1).uniform(0.0, 2.0, 400)], axis=1)
    y = (x[:, 1] < 0.7).astype(float)  # the other way round
    assert fitted(x, y, np.ones(400))[1] == 0.0
    assert log_loss(x @ fitted(x, y, np.ones(400)), y, np.ones(400)) < np.log(2.0)


def test_groups_count_as_in_the_full_plan():
    rows = [{"group": group} for group in ("single", "single", "outside", "outside", "pair", "masked")]
    weight = weights(rows, ["single", "outside", "pair"])
    assert weight / weight[2] == pytest.approx([175.0 / 48.0, 0.5, 1.0]) and weight.mean() == pytest.approx(1.0)


def test_too_few_campaigns_make_no_curve():
    with pytest.raises(ValueError, match="ten of each are needed"):
        curve_of(simulated(12, np.array([-8.0, 0.0, 0.0, 0.0])))


def test_the_shipped_curve_is_that_of_the_shipped_rows():
    table, made = (tomllib.loads(text) for text in (CURVE.read_text(encoding="utf-8"), curve_of(read_rows())))
    assert table["odds"] == pytest.approx(made["odds"], abs=0.02) and table["campaigns"] == made["campaigns"]
    assert list(curve()) == list(table["odds"].values())
    assert max(int(row["seed"]) for row in read_rows()) < 1000


def test_rows_are_kept_as_they_are(tmp_path):
    write_rows(read_rows(), tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_bytes() == ROWS.read_bytes()


@pytest.mark.parametrize(("group", "slugs", "each", "told", "acts"), [
    ("outside", ["unmodelled"], None, {"unmodelled", "gravity"}, True),
    ("pair", ["gravity", "thick_wall"], [40.0, 50.0], {"gravity"}, True),
    ("pair", ["gravity", "thick_wall"], [40.0, 2.0], {"gravity"}, False),  # nobody could name the other one
    ("pair", ["gravity", "thick_wall"], [40.0, 50.0], {"gravity", "thick_wall"}, False),
    ("single", ["gravity"], None, {"thick_wall"}, True),
])  # fmt: skip
def test_something_acts_unknown_where_it_is_strong_and_not_told(group, slugs, each, told, acts):
    truth = {"group": group, "slugs": slugs, "log_bayes_each": each, "log_bayes_post_refit": 90.0}
    assert unknown_acts(truth, told) is acts


def test_a_seed_of_the_blind_trial_is_refused(capsys):
    assert main(["--seeds", "20261121"]) == 2
    assert "take one below 1000" in capsys.readouterr().err
    assert main(["--seeds", "5", "--kinds", "rope"]) == 2
    assert "unknown kind 'rope'" in capsys.readouterr().err


def test_rows_of_other_columns_are_refused_in_one_line(tmp_path):
    """Rows of older code have no third sign."""
    (tmp_path / "rows.csv").write_text("seed,case,kind,group,kept,outdone,unknown_acts,commit\n901,c0001,wire,pair,0,0,0,x\n")
    with pytest.raises(ValueError, match="rows of older code cannot be used"):
        read_rows(tmp_path / "rows.csv")
