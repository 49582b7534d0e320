"""Studies that cannot be: one line that names file and place and says what would be right, exit code 2, no files."""

from pathlib import Path

import pytest
from click.testing import CliRunner
from study_texts import ISHIGAMI, PLAIN

from fitting.cli import main
from fitting.propagate.reading import study_examples

STATE = """
schema = "pneusma-study/1"
[model]
through = "state"
design = "pneusma2"
pressure_kPa = 30.0
xi0_2 = 0.4
[input]
G_m = {mean = 3.0, sd = 0.3, unit = "GPa"}
"""
CHAIN = """
schema = "pneusma-study/1"
[model]
through = "chain"
design = "orthogonal_chain"
pressure_kPa = 30.0
segment_1 = {xi0_1 = 0.2}
[vary]
priors = ["silicone"]
"""
GRID = STATE.replace("pressure_kPa = 30.0", "pressure_kPa = {from = 0.0, to = 50.0, points = 5}")
LOOP = STATE.replace('"state"', '"closed_loop"').replace("xi0_2 = 0.4", "")
CASES = {
    "no file": (None, "there is no such file"),
    "no TOML": ("schema = ", "not a TOML file"),
    "other schema": ('schema = "pneusma-protocol/1"', "schema is"),
    "no schema": ("[model]\n", "key 'schema' is missing; a study has schema = \"pneusma-study/1\""),
    "misspelt schema": ('shcema = "pneusma-study/1"', "unknown key 'shcema', did you mean 'schema'?"),
    "unknown table": (PLAIN + "[samples]\nrows = 3\n", "unknown key 'samples', did you mean 'sampling'?"),
    "nothing varies": (PLAIN.replace("[input]\na = {mean = 1.0, sd = 0.5}\nb = {mean = 0.0, sd = 1.0}", ""), "nothing varies"),
    "no model": ('schema = "pneusma-study/1"\n[input.a]\nmean = 0.0\nsd = 1.0\n', "[model] needs through"),
    "through what": (PLAIN.replace('"expression"', '"states"'), "did you mean 'state'?"),
    "unknown key of the model": (STATE.replace("xi0_2", "xi_2"), "unknown key 'xi_2'"),
    "no pressure": (STATE.replace("pressure_kPa = 30.0\n", ""), "needs pressure_kPa"),
    "pressure of a wrong unit": (STATE.replace("pressure_kPa", "pressure_mm"), "must be a pressure"),
    "no such spring": (STATE.replace("xi0_2", "xi0_3"), "there is no spring 3"),
    "no fraction": (STATE.replace("xi0_2 = 0.4", "xi0_2 = 1.4"), "from 0 (hot) to 1 (cold)"),
    "two drivers": (GRID.replace("xi0_2 = 0.4", "xi0_2 = [0.2, 0.4]"), "is the driver already"),
    "a driver that falls": (STATE.replace("30.0", "[30.0, 10.0]"), "must rise"),
    "no such design": (STATE.replace("pneusma2", "pneusma7"), "study.toml: [model] design is 'pneusma7', did you mean 'pneusma"),
    "no such alloy": (STATE.replace('"pneusma2"', '"pneusma2"\nalloy = "krl99"'), "study.toml: [model]: alloy: no table of constants is called 'krl99', did you mean 'krl45'? Known of kind alloy: krl35, krl45,"),
    "an alloy in two places": (STATE.replace('"pneusma2"', '"pneusma2"\nalloy = "krl35"\ngeometry = {alloy = "krl45"}'), "keep the first"),
    "a chain as an actuator": (STATE.replace('"pneusma2"', '"orthogonal_chain"'), "is a chain"),
    "no such number": (STATE.replace("G_m", "G_n"), "no number 'G_n' to vary, did you mean"),
    "a unit of something else": (STATE.replace("GPa", "mm"), "unit 'mm' is one of length"),
    "no such unit": (STATE.replace("GPa", "GPascal"), "unknown unit"),
    "no spread": (PLAIN.replace("sd = 0.5", "sd = 0.0"), "must be more than 0"),
    "an empty range": (PLAIN.replace("mean = 1.0, sd = 0.5", "low = 2.0, high = 1.0"), "must be less than"),
    "half a distribution": (PLAIN.replace("mean = 1.0, sd = 0.5", "mean = 1.0"), "needs distribution"),
    "no such distribution": (
        PLAIN.replace("mean = 1.0, sd = 0.5", "distribution = 'lognormal', s = 1.0"), "did you mean 'lognorm'?",
    ),
    "no such shape": (PLAIN.replace("mean = 1.0, sd = 0.5", "distribution = 'norm', mu = 1.0"), "is no parameter of norm"),
    "ends of a uniform by its name": (
        PLAIN.replace("mean = 1.0, sd = 0.5", "distribution = 'uniform', low = 0.0, high = 1.0"),
        "write its ends as low and high, and leave out distribution; in scipy.stats it has loc",
    ),
    "a missing shape": (PLAIN.replace("mean = 1.0, sd = 0.5", "distribution = 'lognorm'"), "needs the shape 's'"),
    "an impossible shape": (
        PLAIN.replace("mean = 1.0, sd = 0.5", "distribution = 'gamma', a = -1.0"), "is no distribution",
    ),
    "not a number": (PLAIN.replace("sd = 0.5", "sd = nan"), "must be a finite number"),
    "correlation of one": (PLAIN + "[[correlation]]\nbetween = ['a', 'b']\nvalue = 1.0\n", "between -1 and 1"),
    "correlation with nothing": (PLAIN + "[[correlation]]\nbetween = ['a', 'c']\nvalue = 0.5\n", "'c' does not vary"),
    "impossible correlations": (
        ISHIGAMI + "".join(
            f"[[correlation]]\nbetween = ['x{i}', 'x{j}']\nvalue = {v}\n" for i, j, v in ((1, 2, 0.9), (2, 3, 0.9), (1, 3, -0.9))
        ), "not positive definite",
    ),
    "correlated Sobol indices": (PLAIN + "[[correlation]]\nbetween = ['a', 'b']\nvalue = 0.5\n[indices]\n", "kind = 'shapley'"),
    "an expression of nothing": (PLAIN.replace("a + 2*b", "a + 2*c"), "'c', which is neither input nor output"),
    "an expression that is none": (PLAIN.replace("a + 2*b", "import os"), "is not an expression"),
    "an output that is not there": (STATE + "[[output]]\nname = 'curvature'\n", "no output 'curvature', did you mean"),
    "a limit on nothing": (PLAIN + "[[limit]]\non = 'z'\nabove = 1.0\n", "no output is called 'z'"),
    "a limit without a value": (PLAIN + "[[limit]]\non = 'y'\n", "say 'above' or 'below'"),
    "nothing holds": (PLAIN + "[[limit]]\non = 'y'\nabove = 1.0\nbelow = 2.0\n", "leave nothing"),
    "reduced twice": (GRID + "[[output]]\nname = 'curvature_1pm'\nreduce = 'mean'\nat = 3.0\n", "keep one"),
    "reduced without a driver": (STATE + "[[output]]\nname = 'curvature_1pm'\nreduce = 'mean'\n", "no driver"),
    "outside of the driver": (GRID + "[[output]]\nname = 'curvature_1pm'\nat = 60.0\n", "lies outside"),
    "no rows": (PLAIN + "[sampling]\nrows = 0\n", "whole number from 1"),
    "half a row": (PLAIN + "[sampling]\nrows = 10.5\n", "whole number"),
    "tiny chunks": (PLAIN + "[sampling]\nchunk = 1\n", "whole number from 100"),
    "no such method": (PLAIN + "[sampling]\nmethod = 'sobel'\n", "did you mean 'sobol'?"),
    "an index of one input": (PLAIN.replace("b = {mean = 0.0, sd = 1.0}", "").replace("+ 2*b", "") + "[indices]\n", "only one input"),
    "in two groups": (ISHIGAMI + "[indices.groups]\np = ['x1']\nq = ['x1', 'x2']\n", "is in p and in q"),
    "rare without a limit": (PLAIN + "[rare]\n", "needs a [[limit]]"),
    "no posterior": (STATE + "[vary]\nposterior = 'nowhere'\n", "there is no such file"),
    "no recording": (STATE.replace("state", "recording").replace("design", "recording"), "unknown key 'pressure_kPa'"),
    "no protocol": (STATE.replace("state", "protocol").replace("pressure_kPa = 30.0\nxi0_2 = 0.4\n", ""), "needs protocol"),
    "tolerance in percent": (STATE + "[vary]\ntolerance = {wall_thickness = 3.0}\n", "3 percent is 0.03"),
    "alloy without a name": (STATE.replace('"pneusma2"', '"pneusma2"\nalloy = ""'), "study.toml: [model]: alloy = '' must be a name"),
    "noise of an expression": (PLAIN + "[noise]\npressure_kPa = 0.1\n", "an expression has no channels"),
    "noise of no channel": (STATE + "[noise]\npresure_kPa = 0.1\n", "no channel 'presure_kPa', did you mean 'pressure_kPa'?"),
    "noise in a wrong unit": (STATE + "[noise]\npressure_mm = 0.1\n", "must be a pressure"),
    "no noise": (STATE + "[noise]\npressure_kPa = 0.0\n", "so more than 0"),
    "noise and input": (STATE + "[input.noise]\nlow = 0\nhigh = 1\n[noise]\npressure_kPa = 0.1\n", "drawn by [noise] already"),
    "a loop with heated springs": (STATE.replace('"state"', '"closed_loop"'), "unknown key 'xi0_2'"),
    "a loop along pressure": (
        GRID.replace('"state"', '"closed_loop"').replace("xi0_2 = 0.4", ""), "the pressure of a closed loop is one number",
    ),
    "a loop without springs": (
        LOOP.replace("pneusma2", "pneuflex_s"),
        "by two springs",
    ),
    "a loop by FORM": (
        LOOP + "[[output]]\nname = 'rmse_1pm'\n[[limit]]\non = 'rmse_1pm'\nabove = 1.0\n[rare]\n",
        "methods = ['subset']",
    ),
    "a loop that knows everything": (
        STATE.replace('"state"', '"closed_loop"').replace("xi0_2 = 0.4", "controller = 'all'"), "one of base, model",
    ),
    "a correlation stated twice": (
        PLAIN + "".join(f"[[correlation]]\nbetween = {pair}\nvalue = 0.5\n" for pair in ("['a', 'b']", "['b', 'a']")),
        "[[correlation]] 2: a and b have a correlation already, in [[correlation]] 1",
    ),
    "a limit stated twice": (PLAIN + 2 * "[[limit]]\non = 'y'\nabove = 1.0\n", "[[limit]] 2 is [[limit]] 1 again"),
    "an index stated twice": (PLAIN + "[indices]\nof = ['y', 'y']\n", "'y' is named twice"),
    "a specimen of no posterior": (PLAIN + "[vary]\nposterior_specimen = 2\n", "no posterior is named"),
    "a copula of no posterior": (PLAIN + "[vary]\nposterior_as = 'copula'\n", "no posterior is named"),
    "left out and varied": (STATE + "[vary]\nleave_out = ['G_m']\n", "leave_out has 'G_m', which varies by itself"),
    "a name of two lines": (PLAIN + '[[output]]\nname = "x\\ny"\nof = "y"\n', "must be one line"),
    "an exponent without end": (PLAIN.replace("a + 2*b", "a + 9**9**9**9"), "cannot be evaluated"),
    "an output without end": (PLAIN + "[[output]]\nname = 'z'\nof = 'y + 9**9**9**9'\n", "cannot be evaluated"),
    "two pressures": (STATE.replace("xi0_2", "pressure_bar = 0.2\nxi0_2"), "the pressure is stated already"),
    "a segment without such a key": (CHAIN.replace("xi0_1 = 0.2", "xi_1 = 0.2"), "segment_1: unknown key 'xi_1'"),
    "a segment of its own pressure": (CHAIN.replace("xi0_1 = 0.2", "pressure_bar = 0.2"), "unknown key 'pressure_bar'"),
    "a segment that is not counted so": (CHAIN.replace("segment_1", "segment_01"), "there is no such segment"),
    "rare and noise of a measurement": (
        PLAIN + "[[output]]\nname = 'y'\nnoise = 0.5\n[[limit]]\non = 'y'\nabove = 1.0\n[rare]\n", "[[output]] without noise",
    ),
    "tolerance and input": (STATE + "[vary]\ntolerance = {G_m = 0.03}\n", "keep one"),
}  # fmt: skip


@pytest.mark.parametrize("case", [pytest.param(c, marks=pytest.mark.slow if c == "a loop by FORM" else ()) for c in CASES])
def test_a_study_that_cannot_be_is_refused_in_one_line(case, tmp_path):
    text, words = CASES[case]
    path, out = tmp_path / "study.toml", tmp_path / "out"
    if text is not None:
        path.write_text(text)
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    lines = result.stderr.splitlines()
    assert result.exit_code == 2, (result.output, result.exception)
    assert len(lines) == 1 and lines[0].startswith("pneusma: ") and words in lines[0], lines
    assert "study.toml" in lines[0] or "nowhere" in lines[0] or "pneusma7" in lines[0], lines
    assert result.stdout == "" and not out.exists(), "nothing is written"


def test_results_that_are_there_are_not_replaced(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN + "[sampling]\nrows = 200\n")
    assert CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)]).exit_code == 0
    before = {p: p.read_bytes() for p in Path(out).rglob("*") if p.is_file()}
    refused = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    assert refused.exit_code == 2 and "this study has begun here; go on with --resume" in refused.stderr
    assert before == {p: p.read_bytes() for p in Path(out).rglob("*") if p.is_file()}


def test_resume_does_not_replace_results_of_another_command(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN)
    out.mkdir()
    (out / "report.json").write_text("{}")
    refused = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out), "--resume"])
    assert refused.exit_code == 2 and "results are here already" in refused.stderr
    assert [p.name for p in out.iterdir()] == ["report.json"] and (out / "report.json").read_text() == "{}"


def test_force_replaces_chunks_without_their_manifest_and_keeps_files_of_the_user(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN + "[sampling]\nrows = 200\n")
    run = ["propagate", str(path), "--out", str(out)]
    assert CliRunner().invoke(main, run).exit_code == 0
    (out / "recording.csv").write_text("time_s\n0.0\n")
    for manifest in (True, False):
        path.write_text(path.read_text().replace("2*b", "3*b") if manifest else PLAIN)
        if not manifest:
            (out / "study.json").unlink()
        result = CliRunner().invoke(main, [*run, "--force"])
        assert result.exit_code == 0, result.output
        assert (out / "recording.csv").exists()


def test_a_chunk_under_the_name_of_another_is_refused(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN + "[sampling]\nrows = 300\nchunk = 100\n")
    run = ["propagate", str(path), "--out", str(out)]
    assert CliRunner().invoke(main, run).exit_code == 0
    first, second = sorted((out / "chunks").iterdir())[:2]
    second.write_bytes(first.read_bytes())
    refused = CliRunner().invoke(main, [*run, "--resume"])
    assert refused.exit_code == 2 and "this is chunk 0 under the name of another" in refused.stderr


def test_a_cluster_and_workers_contradict_each_other(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(PLAIN)
    options = ["--out", str(tmp_path / "out"), "--workers", "2", "--cluster", "tcp://localhost:1"]
    refused = CliRunner().invoke(main, ["propagate", str(path), *options])
    assert refused.exit_code == 2 and "give one of them" in refused.stderr


def test_the_shipped_studies_are_read_by_name(tmp_path):
    for name in study_examples():
        result = CliRunner().invoke(main, ["propagate", name, "--out", str(tmp_path / "out"), "--check"])
        assert result.exit_code == 0 and "20,000 rows in 2 chunks" in result.stdout, result.output
    assert study_examples() == ["pneusma2_band"]


def test_the_study_of_the_documentation_is_one_that_can_be(tmp_path):
    page = Path(__file__).parents[2] / "docs" / "propagate.md"
    path = tmp_path / "study.toml"
    path.write_text(page.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0], encoding="utf-8")
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(tmp_path / "out"), "--check"])
    assert result.exit_code == 0, result.output
    assert " rows in " in result.stdout


def test_check_says_what_would_be_done_and_does_nothing(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN)
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out), "--check"])
    assert result.exit_code == 0 and "10,000 rows in 1 chunk," in result.stdout and not out.exists()
    alone = CliRunner().invoke(main, ["propagate", str(path), "--check"])
    assert alone.exit_code == 0 and alone.stdout == result.stdout


def test_a_run_without_a_folder_is_refused(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(PLAIN)
    result = CliRunner().invoke(main, ["propagate", str(path)])
    assert result.exit_code == 2 and "missing option '--out'" in result.stderr


@pytest.mark.parametrize("more", ["", "[indices]\n", "[indices]\nkind = 'shapley'\n", "[rare]\n"])
def test_a_study_in_which_every_row_fails_ends_with_a_report(tmp_path, more):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    limit = "[[limit]]\non = 'y'\nabove = 1.0\n"
    path.write_text(PLAIN.replace("a + 2*b", "sqrt(-1 - a*a) + b") + limit + more + "[sampling]\nrows = 200\n")
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    assert result.exit_code == 0, result.exception
    assert "(100 %) have no result" in " ".join(result.stdout.split()) and (out / "report.html").exists()


def test_a_study_of_one_row_ends_with_a_report(tmp_path):
    path, out = tmp_path / "study.toml", tmp_path / "out"
    path.write_text(PLAIN + "[sampling]\nrows = 1\n")
    result = CliRunner().invoke(main, ["propagate", str(path), "--out", str(out)])
    assert result.exit_code == 0 and "expressions: 1 row. A row is the model computed once" in result.stdout, result.exception
