"""Wrong usage of commands: one clear line that names what is wrong, exit code 2, and nothing left behind."""

from pathlib import Path

import pytest

SILICONE = Path(__file__).parents[2] / "calibration_data" / "examples" / "pulled_silicone"


@pytest.fixture
def refused(run, tmp_path, monkeypatch):
    """The line that a command ends with, in an empty folder that stays empty."""
    monkeypatch.chdir(tmp_path)

    def line(*words: str) -> str:
        result = run(*map(str, words))
        assert result.exit_code == 2 and result.output == result.stderr, result.output
        assert result.stderr.count("\n") == 1 and not list(tmp_path.iterdir())
        return result.stderr

    return line


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "--design", "pneusma2", "--pressure-kPa", "nan"),
        ("invert", "--curvature-1pm", "inf"),
        ("invert", "--curvature-1pm", "40", "--clearance-mm", "nan"),
        ("plan", "--misfit", "nan", "--out", "o"),
        ("wiring", "--voltage", "inf", "--out", "o"),
        ("synthesise", "tube", "--drift", "nan", "--out", "o"),
    ],
)
def test_a_number_that_is_none_is_refused(refused, words):
    assert "is not a finite number" in refused(*words)


@pytest.mark.parametrize(
    "words",
    [
        ("diagnose", SILICONE, "--seed", "-1", "--out", "o"),
        ("synthesise", "tube", "--seed", "-1", "--out", "o"),
        ("posterior", SILICONE, "--max-steps", "-4", "--out", "o"),
        ("plan", "--draws", "0", "--out", "o"),
    ],
)
def test_a_count_that_cannot_be_is_refused_at_once(refused, words):
    assert "is not in the range" in refused(*words)


@pytest.mark.parametrize("command", ["characterise-batch", "diagnose"])
def test_a_campaign_named_twice_is_refused(refused, command):
    assert "this campaign is named twice" in refused(command, SILICONE, f"{SILICONE}/../pulled_silicone", "--out", "o")


@pytest.mark.parametrize("command", ["characterise-batch", "diagnose"])
def test_campaigns_none_of_which_is_there_are_refused(refused, command):
    assert "there is no such file or folder" in refused(command, "nowhere", "neither", "--out", "o")


@pytest.mark.parametrize(
    "words", [("control", "--out", "o"), ("invert", "--curvature-1pm", "10"), ("wiring", "--springs", "2")]
)
def test_a_study_in_the_place_of_a_design_is_called_one(refused, words):
    study = SILICONE.parent / "design_studies" / "wider_pneusma2.toml"
    said = refused(*words, "--design", study)
    assert "this is a study, which `pneusma design` or `pneusma propagate` takes, but a table" in said


@pytest.mark.parametrize("design", ["orthogonal_chain", SILICONE.parent / "chains" / "orthogonal_chain.toml"])
def test_a_chain_in_the_place_of_an_actuator_is_called_one(refused, design):
    said = refused("control", "--design", design, "--out", "o")
    assert "is a chain of actuators, but a table of constants, such as that of a single actuator," in said


def test_a_range_without_limits_is_not_described(run):
    said = run("control", "--help").output
    assert "None" not in said and "-100.0<x<1000.0" in said


def test_a_place_that_cannot_be_written_is_refused_before_the_work(refused):
    if not Path("/proc/self").exists():
        pytest.skip("no /proc here")
    assert "/proc/x: results cannot be written here (/proc: " in refused("diagnose", SILICONE, "--out", "/proc/x")


def test_a_very_long_path_is_told_by_its_ends(refused):
    deep = "/".join(["d" * 100] * 45)
    said = refused("diagnose", SILICONE, "--out", deep)
    assert "[...]" in said and len(said) < 350


def test_a_name_that_is_only_begun_is_completed(refused):
    assert "did you mean 'mullins_softening'?" in refused("effects", "mulins")


@pytest.mark.parametrize(
    ("words", "number"),
    [
        (("simulate", "--design", "pneusma2", "--pressure-kPa", "20,5"), "20.5"),
        (("invert", "--curvature-1pm", "-40,25"), "-40.25"),
        (("synthesise", "wire", "--out", "o", "--tolerance", "E_m=0,05"), "0.05"),
        (("characterise", SILICONE, "--out", "o", "--fix", "p_5=3,1"), "3.1"),
        (("import", SILICONE / "pull_1.csv", "--out", "o", "--dimension", "gauge_length_mm=0,25"), "0.25"),
        (("import", SILICONE / "pull_1.csv", "--out", "o", "--constant", "temperature_degC=20,5"), "20.5"),
    ],
)
def test_a_decimal_comma_is_hinted_at(refused, words, number):
    assert f"decimals have a point: {number}\n" in refused(*words)


def test_no_decimal_comma_is_seen_in_other_words(refused):
    assert "point" not in refused("simulate", "--design", "pneusma2", "--pressure-kPa", "much")


def test_an_unknown_option_is_not_answered_with_one_that_shares_its_dashes(refused):
    line = refused("wiring", "--model", "x").strip()
    assert line == "pneusma: no such option '--model'; see `pneusma wiring --help`"
    assert "'--curvature-1pm'" in refused("invert", "--curvatur-1pm", "4")
