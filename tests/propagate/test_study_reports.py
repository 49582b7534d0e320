"""What is said and drawn where a study has little to say: no results, no spread, few rows, odd names."""

import json

import numpy as np
import pytest
from click.testing import CliRunner
from conftest import PLAIN

from fitting.cli import main
from fitting.propagate.distributions import Gaussian

SMALL = "[sampling]\nrows = 200\n"
LIMIT = "[[limit]]\non = 'y'\nabove = {}\n"


def run(tmp_path, text):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(text, encoding="utf-8")
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    assert result.exit_code == 0, (result.output, result.exception)
    return " ".join(result.stdout.split()), out


@pytest.mark.parametrize("kind", ["sobol", "shapley"])
@pytest.mark.parametrize(
    ("output", "rows", "words"),
    [
        ("log(-1 - a*a) + b", 200, "y: no row has a result."),
        ("log(-1 - a*a) + b", 200, "y has no indices: no block is whole."),
        ("3 + 0*a", 200, "y has no indices: it is the same in every row."),
        ("a + 2*b", 3, "y: indices of so few rows, 1 whole blocks, have no interval; take more."),
    ],
)
def test_what_is_not_known_is_said_in_words(tmp_path, kind, output, rows, words):
    text = PLAIN.replace("a + 2*b", output) + f"[indices]\nkind = '{kind}'\n[sampling]\nrows = {rows}\n"
    said, _ = run(tmp_path, text)
    assert words in said and " nan" not in said


def test_names_that_differ_in_signs_only_have_figures_of_their_own(tmp_path):
    outputs = "".join(f"[[output]]\nname = '{name}'\nof = 'y'\n" for name in ("x+$\\frac$", "x-$\\frac$", "größe/µ"))
    said, out = run(tmp_path, PLAIN + outputs + "[indices]\ngroups = {'a $x$' = ['a']}\n" + SMALL)
    drawn = sorted(p.name for p in out.glob("*.png"))
    assert len(drawn) == 6 and "distribution_größe_µ.png" in drawn, drawn
    assert set(json.loads((out / "report.json").read_text())["columns"]) == {"x+$\\frac$", "x-$\\frac$", "größe/µ"}


def test_limits_that_differ_in_the_ninth_digit_are_counted_apart(tmp_path):
    limits = LIMIT.format(1.00000001) + LIMIT.format(1.00000002)
    _, out = run(tmp_path, PLAIN + limits + SMALL)
    assert set(json.loads((out / "report.json").read_text())["limits"]) == {"y above 1.00000001", "y above 1.00000002"}


@pytest.mark.parametrize(("limit", "share"), [(1e9, 0.0), (-1e9, 1.0), (0.0, 0.5)])
def test_small_probabilities_end_where_nothing_everything_or_half_fails(tmp_path, limit, share):
    """At the limit itself nothing has failed, as in counting: half of the rows lie on it."""
    model = PLAIN.replace("a + 2*b", "maximum(b, 0) + 0*a" if limit == 0.0 else "a + 2*b")
    said, out = run(tmp_path, model + LIMIT.format(limit) + "[rare]\n" + SMALL)
    rare = next(iter(json.loads((out / "report.json").read_text())["rare"].values()))
    for found in (rare["subset"], rare["importance_sampling"]):
        low, high = found["interval"]
        assert found["probability"] == pytest.approx(share, abs=0.02)
        assert low <= high and (share == 0.5 or low <= share <= high)
    assert "1 to 1 (95 %)" not in said and rare["agree"]


def test_slopes_of_a_gaussian_are_finite_at_any_score():
    marginal = Gaussian(1.0, 0.5, -np.inf, np.inf)
    np.testing.assert_allclose(marginal.slope(np.array([-1e9, 0.0, 3.0, 1e9])), [0.0, 0.5, 0.5, 0.0])
