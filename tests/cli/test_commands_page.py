"""Every command has an example in docs/commands.md, every example runs as it is printed, no figure is cut."""

import io
import re
import shlex
from pathlib import Path

import pytest
from borders import cut_at, cut_pictures, faults
from matplotlib.figure import Figure

from fitting.cli import COMMANDS

ROOT = Path(__file__).resolve().parents[2]
PAGE, DESIGN = ROOT / "docs" / "commands.md", ROOT / "docs" / "design.md"
BAND = ROOT / "calibration_data" / "examples" / "studies" / "pneusma2_band.toml"
RAW = "Sample A\nTime (s),Strain (%),Stress (kPa)\n" + "".join(f"{k},{2 * k},{3.0 * k}\n" for k in range(20))


def examples() -> list[tuple[str, bool]]:
    """Commands of the page in order, and whether each takes longer than a test in `make test` may."""
    found, long = [], False
    for block in re.finditer(r"^## |<!-- long -->|```\n(.*?)```", PAGE.read_text(), flags=re.S | re.M):
        if block[1] is None:
            long = block[0] == "<!-- long -->"
        else:
            found += [(line, long) for line in block[1].splitlines() if line.startswith("pneusma ")]
    return found


def run_all(run, commands) -> None:
    Path("RAW.csv").write_text(RAW)
    Path("my_study.toml").write_text(re.search(r"```toml\n(.*?)```", DESIGN.read_text(), flags=re.S)[1])
    Path("my_band.toml").write_text(
        BAND.read_text().replace("rows = 20000", "rows = 256").replace("chunk = 10000", "chunk = 128")
    )
    for command in commands:
        result = run(*shlex.split(command)[1:])
        assert result.exit_code == 0, f"{command}\n{result.output}\n{result.stderr}"


def test_every_command_has_an_example():
    named = {command.split()[1] for command, _ in examples()}
    assert named == set(COMMANDS)


def test_the_short_examples_run(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    short = [command for command, long in examples() if not long]
    assert len(short) >= 8
    run_all(run, short)
    assert (tmp_path / "my_import" / "RAW.csv").exists()


@pytest.fixture
def pictured(monkeypatch) -> dict[str, list[str]]:
    """Faults of every figure that is saved from here on, by the caller's file and number."""
    found: dict[str, list[str]] = {}
    save = Figure.savefig

    def saved(figure, *arguments, **options):
        save(figure, *arguments, **options)
        title = figure.get_suptitle() or next((axes.get_title("left") or axes.get_title() for axes in figure.axes), "")
        found[f"{len(found) + 1}: {title}"] = faults(figure)

    monkeypatch.setattr(Figure, "savefig", saved)
    return found


@pytest.mark.slow
def test_all_examples_run(run, tmp_path, monkeypatch, pictured):
    monkeypatch.chdir(tmp_path)
    run_all(run, [command for command, _ in examples()])
    run_all(run, ["pneusma effects mullins_softening --plot --out out/effect"])
    pictures = list(tmp_path.rglob("*.png"))
    assert len(pictures) > 15 and len(pictured) > 15
    assert not cut_pictures(tmp_path)
    assert not {name: said for name, said in pictured.items() if said}


@pytest.mark.slow
def test_the_steps_after_a_design_study_run(run, tmp_path, monkeypatch):
    """Each command of the section, of the study that the page begins with."""
    monkeypatch.chdir(tmp_path)
    page = DESIGN.read_text()
    section = re.search(r"^## After a study\n(.*?)^## ", page, flags=re.S | re.M)[1].replace("\\\n", " ")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", section, flags=re.S | re.M)
    commands = [line for language, block in blocks if not language for line in block.splitlines()]
    assert [line.split()[1] for line in commands] == [
        "simulate", "simulate", "workspace", "invert", "control", "propagate", "import",
    ]  # fmt: skip
    band = re.search(r"```toml\n(.*?)```", section, flags=re.S)[1]
    Path("band.toml").write_text(band.replace("rows = 20000", "rows = 256\nchunk = 128"))
    rows = "".join(f"{k},0.08,{7.65 - 0.01 * k},{4.0 + k}\n" for k in range(10))
    Path("test.csv").write_text("t [s],Pressure [bar],R2 [Ohm],Curvature [1/m]\n" + rows)
    loop = commands.pop(4)
    run_all(run, ["pneusma design my_study.toml --out out/study", *commands])
    result = run(*shlex.split(loop)[1:])
    assert result.exit_code == 1 and "no equilibrium" in result.output
    assert (tmp_path / "out" / "control" / "report.html").exists()
    assert "active_coils = 80" in (tmp_path / "my_actuator" / "test.toml").read_text()


@pytest.mark.parametrize(("place", "borders"), [(0.5, []), (1.0, ["right"]), (0.0, ["left"])])
def test_text_that_is_cut_at_a_border_is_seen(tmp_path, place, borders):
    figure = Figure(figsize=(2, 1))
    figure.text(place, 0.5, "stress [kPa]", ha="center", va="center")
    figure.savefig(tmp_path / "a.png")
    assert cut_at(tmp_path / "a.png") == borders


def test_a_label_without_a_unit_or_a_quantity_and_a_legend_beyond_the_picture_are_seen():
    figure = Figure(figsize=(3, 2), layout="constrained")
    axes = figure.subplots()
    axes.plot([0.0, 1.0], label="a line")
    axes.set(xlabel="time (s)", ylabel="stress [kPa]")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0))
    figure.savefig(io.BytesIO())
    assert faults(figure) == ["no unit: time (s)"]
    axes.set_xlabel("x [mm]")
    assert faults(figure) == ["no quantity: x [mm]"]
    axes.set_xlabel("time [s]")
    axes.get_legend().set_in_layout(False)
    axes.legend(loc="center left", bbox_to_anchor=(2.0, 0.5)).set_in_layout(False)
    figure.savefig(io.BytesIO())
    assert "beyond the picture: 'legend'" in faults(figure)
