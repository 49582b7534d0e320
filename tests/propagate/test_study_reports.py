"""What is said and drawn where a study has little to say: no results, no spread, few rows, odd names."""

import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from study_texts import PLAIN

from fitting.cli import main
from fitting.propagate.distributions import Gaussian
from fitting.report.figures import axis_label, unit_of
from fitting.report.propagate.figures import indices_along

SMALL = "[sampling]\nrows = 200\n"
LIMIT = "[[limit]]\non = 'y'\nabove = {}\n"


def run(tmp_path, text):
    tmp_path.mkdir(exist_ok=True)
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
        ("1e-170*a", 200, "y has no indices: its variance is zero or no finite number."),
        ("a + 2*b", 3, "y: indices of so few rows, 1 whole blocks, have no interval; take more."),
        ("sin(1e6*a) * sin(1e6*b)", 24, "these rows do not tell one input from another: take more."),
    ],
)
def test_what_is_not_known_is_said_in_words(tmp_path, kind, output, rows, words):
    text = PLAIN.replace("a + 2*b", output) + f"[indices]\nkind = '{kind}'\n[sampling]\nrows = {rows}\n"
    said, _ = run(tmp_path, text)
    assert words in said and " nan" not in said


def test_the_output_that_costs_rows_is_named_and_what_is_left_is_said(tmp_path):
    """The mean of the other one was 20 of its errors off, and nothing said which output was to blame."""
    outputs = "".join(f"[[output]]\nname = '{n}'\nof = '{of}'\n" for n, of in (("y", "y"), ("root", "sqrt(y)")))
    said, _ = run(tmp_path, f"{PLAIN}{outputs}[sampling]\nrows = 4000\n")
    lost = int(re.search(r"([\d,]+) rows \([\d.]+ %\) have no result", said)[1].replace(",", ""))
    assert f"{lost:,}: The output root is not a finite number)" in said
    assert said.count(f", of the {4000 - lost:,} rows with a result.") == 2
    assert "A study that leaves out root counts it for the others." in said
    without, _ = run(tmp_path / "y", PLAIN + "[sampling]\nrows = 4000\n")
    assert "no result" not in without and "with a result" not in without


@pytest.mark.parametrize("count", [1, 4, 6])
def test_indices_with_wide_intervals_have_a_panel_each(count):
    """Bands of few rows had lain over each other, and beyond the shares that are possible."""
    value = np.outer(np.linspace(0.8, 0.05, count), np.ones(11))
    value, half = value + 0.1 * np.sin(np.arange(11)), np.full(value.shape, 0.6)
    driver = SimpleNamespace(values=np.linspace(0.0, 50.0, 11), name="pressure_kPa")
    columns = SimpleNamespace(of=lambda name: slice(0, 11), driver=driver)
    sums = SimpleNamespace(kind="sobol", estimates=lambda: {"total": (value, half)})
    problem = SimpleNamespace(columns=columns, index_columns=range(11), groups=[f"g{k}" for k in range(count)])
    figure = indices_along(SimpleNamespace(problem=problem, summary=SimpleNamespace(indices=sums)), "y")
    drawn = [axes for axes in figure.axes if axes.collections]
    assert [axes.get_title() for axes in drawn] == [f"g{k}" for k in range(count)]
    for k, axes in enumerate(drawn):
        assert len(axes.collections) == 1 and 0.0 == axes.get_ylim()[0] < axes.get_ylim()[1] <= 1.05
        told = np.isfinite(axes.lines[1].get_ydata())
        np.testing.assert_array_equal(told, value[k] > 0.6)  # elsewhere the interval holds 0


@pytest.mark.parametrize(("of", "told", "more"), [("", 4, 1), ("of = ['five', 'y']\n", 2, 0)])
def test_every_output_with_indices_has_its_sentence_or_is_counted(tmp_path, of, told, more):
    names = ("two", "three", "four", "five")
    outputs = "".join(f"[[output]]\nname = '{name}'\nof = '{k + 2}*y'\n" for k, name in enumerate(names))
    first = "[[output]]\nname = 'y'\nof = 'y'\n"
    said, _ = run(tmp_path, f"{PLAIN}{first}{outputs}[indices]\nkind = 'sobol'\n{of}{SMALL}")
    assert said.count("depends on most (total Sobol index, 95 %): b 0.") == told
    assert ("What five depends on most" in said) == bool(of)
    assert ("The table has the indices of 1 more output." in said) == bool(more)


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


def test_few_failed_rows_do_not_tell_where_they_failed_and_many_do(tmp_path):
    """Rows fail where a is small, which one or two of them cannot show among two inputs and forty can."""
    few, out = run(tmp_path, PLAIN.replace("a + 2*b", "sqrt(a + 0.375) + b") + "[sampling]\nrows = 400\n")
    assert "So few do not tell in which input they differ" in few, few
    assert not (out / "failed_rows.png").exists()  # it drew a spike for each input
    (tmp_path / "more").mkdir()
    many, out = run(tmp_path / "more", PLAIN.replace("a + 2*b", "sqrt(a - 0.36) + b") + "[sampling]\nrows = 400\n")
    assert "They differ from other rows most in a:" in many, many
    assert (out / "failed_rows.png").exists()


def test_bands_beside_indices_count_the_independent_rows(tmp_path):
    """Of 20,007 rows the report had counted 20,006, and of these only 4,446 made its bands and shares."""
    text = PLAIN.replace("a + 2*b", "sqrt(a - 0.1) + b") + "[indices]\nkind = 'sobol'\n[sampling]\nrows = 400\n"
    said, out = run(tmp_path, text)
    header, row = (line.split(",") for line in (out / "columns.csv").read_text().splitlines()[:2])
    counted = int(dict(zip(header, row, strict=True))["rows"])
    assert 0 < counted < 200 and f", of the {counted} rows with a result." in said
    assert "2 rows of each block of 4 are independent." in said
    low, high = re.search(r"the mean of y would be between (\S+) and (\S+)\. At", said).groups()
    assert float(low) < float(high)
    assert "intervals count these 200 alone." in said


@pytest.mark.parametrize(
    ("column", "label", "unit"),
    [
        ("curvature_1pm", "curvature [1/m]", "[1/m]"),
        ("force_2_N", "force 2 [N]", "[N]"),
        ("tip_angle", "tip angle", ""),
        ("xi0_2", "xi0 2", ""),
        ("y", "y", ""),
    ],
)
def test_an_axis_has_a_unit_where_its_name_ends_in_one(column, label, unit):
    assert (axis_label(column), unit_of(column)) == (label, unit)


def many(count):
    """An expression of so many inputs, each with its own share of the variance."""
    inputs = "".join(f"[input.x{k}]\nmean = 0\nsd = {1 + 0.1 * k}\n" for k in range(count))
    return f"schema = 'pneusma-study/1'\n[model]\nthrough = 'expression'\noutputs = {{y = '{' + '.join(f'x{k}' for k in range(count))}'}}\n{inputs}"


@pytest.mark.parametrize(("count", "cut"), [(12, False), (16, True)])
def test_a_table_of_the_largest_indices_says_how_many_there_are_and_which_file_has_all(tmp_path, count, cut):
    """The other indices were left out without a word."""
    said, out = run(tmp_path, many(count) + "[indices]\nkind = 'sobol'\n[sampling]\nrows = 2000\n")
    assert len(re.findall(r"x\d+ on y", said)) == min(count, 12)
    assert (f"For each output, the 12 largest of {count}; indices.csv has all." in said) == cut
    listed = {line.split(",")[0] for line in (out / "indices.csv").read_text().splitlines()[1:]}
    assert len(listed) == count
    assert ("The 15 largest of 16 inputs or groups are drawn." in (out / "report.html").read_text()) == cut


def test_a_study_says_what_its_rows_are_and_why_there_are_more_than_asked_for(tmp_path):
    """A newcomer read `4,004 rows` of a study that asks for 4,000."""
    said, _ = run(tmp_path, many(20) + "[indices]\nkind = 'sobol'\n[sampling]\nrows = 4000\n")
    assert "4,004 rows. A row is the model computed once, with one set of values of 20 inputs (Sobol points)." in said
    assert "The study asks for 4,000. Indices need whole blocks of 22 rows, so there are 4,004." in said
    said, _ = run(tmp_path / "plain", PLAIN + SMALL)
    assert "200 rows. A row is the model" in said and "blocks" not in said


@pytest.mark.parametrize(
    ("output", "pattern"),
    [
        ("0.506 + 1e-7*a", r"y: median 0\.5060001, 90 % of rows between (0\.50\d+) and (0\.50\d+),"),
        ("3 + 0*a", r"y: 3 in 90 % of rows or more, which have no spread, nominal 3\."),
        ("(a > 2) * a", r"y: 0 in 90 % of rows or more, which have no spread, and all between 0 and (\d+\.\d+), nominal 0\."),
    ],
)
def test_an_interval_shows_its_width_or_says_that_there_is_none(tmp_path, output, pattern):
    """It read `0.506 to 0.506`."""
    text = PLAIN.replace("a + 2*b", output)
    said, _ = run(tmp_path, text + SMALL)
    found = re.search(pattern, said)
    assert found, said
    if len(found.groups()) == 2:
        low, high = map(float, found.groups())
        assert high - low == pytest.approx(2 * 1.645 * 0.5e-7, rel=0.1)
        assert "nominal 0.5060001." in said
        (row,) = re.findall(r"\by 0\.506\d* .*?Each output", said)
        assert found[1] in row and found[2] in row  # the table tells them apart, too


@pytest.mark.parametrize(("output", "cell"), [("a + 2*b", "every row has one"), ("a + 2*sqrt(b + 1)", r"0\.\d+ to 0\.\d+")])
def test_bounds_for_rows_without_a_result_stand_where_there_are_any(tmp_path, output, cell):
    """Where every row has a result, the bounds read `0.506 to 0.506`."""
    said, _ = run(tmp_path, PLAIN.replace("a + 2*b", output) + LIMIT.format(3) + SMALL)
    assert re.search(rf"y above 3 +0\.\d+ +0\.\d+ to 0\.\d+ +{cell}\b", said), said


@pytest.mark.parametrize(
    ("value", "half", "text"), [(0.84, 0.012, "0.84 ± 0.01"), (0.84, 2.3e-5, "0.84000 ± 0.00002"), (0.84, np.nan, "0.84 ± n/a"), (0.0, 0.0, "0.00 ± 0.00")]
)
def test_the_width_of_an_index_keeps_a_digit(value, half, text):
    from fitting.report.cells import with_half_width

    assert with_half_width(value, half, 2) == text


def test_bounds_that_one_failed_row_makes_are_told_apart(tmp_path):
    """They had been told as `between 164.5 and 164.5`."""
    said, _ = run(tmp_path, PLAIN.replace("a + 2*b", "1000 + sqrt(a + 0.375) + b") + "[sampling]\nrows = 4000\n")
    low, high = re.search(r"the mean of y would be between (\S+) and (\S+)\. At", said).groups()
    assert float(low) < float(high)
