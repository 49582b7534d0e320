"""`pneusma workspace`: the CSV, what the source says of the designs, and rows without result."""

import csv
from types import SimpleNamespace

import numpy as np
import pytest
from borders import faults

import pneusma_jax as pj
from fitting.report.figures.workspace import _words, workspace_figure
from fitting.simulate.workspace import compute_workspace, grid

COARSE = ("--pressures", 4, "--activations", 3)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    from click.testing import CliRunner

    from fitting.cli import main

    folder = tmp_path_factory.mktemp("workspace")
    result = CliRunner().invoke(main, ["workspace", "--out", str(folder), *map(str, COARSE)])
    assert result.exit_code == 0, result.output
    with open(folder / "workspace.csv", newline="") as file:
        return folder, result, list(csv.DictReader(file))


def _largest(rows, design):
    return max(float(row["curvature_1pm"]) for row in rows if row["design"] == design)


def test_every_state_has_its_row(written):
    folder, result, rows = written
    counts = {
        design: sum(row["design"] == design for row in rows)
        for design in ("pneuflex_s", "pneusma1", "pneusma2")
    }
    assert counts == {"pneuflex_s": 4, "pneusma1": 12, "pneusma2": 24}
    assert {row["status"] for row in rows} == {"converged"}
    assert all(row["xi0_1"] == "" for row in rows if row["design"] != "pneusma2")
    assert "12 of 12" in result.stdout
    for name in ("workspace.png", "activation.png"):
        assert (folder / name).read_bytes().startswith(b"\x89PNG")


def test_what_the_source_says_of_the_designs(written):
    _, _, rows = written
    assert _largest(rows, "pneusma1") > _largest(rows, "pneusma2")  # the tightest bend
    assert _largest(rows, "pneusma1") > _largest(rows, "pneuflex_s")
    both = [float(row["curvature_1pm"]) for row in rows if row["design"] == "pneusma2"]
    assert min(both) == pytest.approx(-max(both), rel=1e-8)  # bends both ways alike
    assert max(abs(float(r["bend_angle_deg"])) for r in rows if r["design"] == "pneusma1") > 270.0


def test_states_without_result_are_counted_in_words():
    space = compute_workspace("pneusma1", np.array([-90e3, -60e3, 0.0, 20e3]), np.array([1.0, 0.5, 0.2]))
    assert space.solved < space.curvature.size
    lost = space.status != pj.Status.converged
    assert np.all(np.isnan(space.curvature[lost]))
    assert any("have no result" in sentence for sentence in space.cautions)
    assert set(space.columns()["status"][lost.ravel()]) <= {s.name for s in pj.Status}


@pytest.mark.parametrize(("touching_deg", "said"), [(270.0, True), (np.inf, False)])
def test_a_picture_says_where_contact_is_not_modelled(touching_deg, said):
    state = {name: np.full((1, 1, 1), 5.0) for name in ("curvature", "bend")}  # 286 degrees
    space = SimpleNamespace(
        **state, pressure=np.zeros(1), touching_deg=touching_deg, activation_of=lambda index: {}
    )
    assert ("contact is not modelled" in _words(space, (0, 0, 0))) is said


def test_shapes_are_drawn_beside_a_bar_of_the_length_that_it_tells():
    spaces = [
        compute_workspace(name, np.array([0.0, 30e3]), np.array([1.0, 0.5])) for name in ("pneuflex_s", "pneusma2")
    ]
    figure = workspace_figure(spaces)
    (bar,) = [text for axes in figure.axes for text in axes.texts if text.get_text() == "20 mm"]
    ends = [line.get_xdata() for line in bar.axes.lines if np.ptp(line.get_ydata()) == 0.0]
    assert any(np.ptp(x) == pytest.approx(20.0) for x in ends)
    assert faults(figure) == []


def test_options(run, tmp_path):
    result = run(
        "workspace", "--design", "pneuflex_w", "--out", tmp_path, "--pressures", 4, "--pressure-kPa-max", 30
    )
    assert result.exit_code == 0 and not (tmp_path / "activation.png").exists()
    lines = (tmp_path / "workspace.csv").read_text().splitlines()
    assert [line.split(",")[1] for line in lines[1:]] == ["0", "10", "20", "30"]


def test_free_bending_heats_springs_alone_and_in_pairs():
    heat = grid.branches_of(pj.make_actuator("triad"))
    assert heat.shape == (12, 3) and np.all(heat.max(axis=1) == 1.0)
    assert {tuple(row) for row in heat} >= {(0, 0, 1), (1, 1, 0), (0.5, 1, 0), (0, 1, 0.5)}
    assert grid.branches_of(pj.make_actuator("pneusma2")).tolist() == [[0, 1], [1, 0]]
    assert grid.branches_of(pj.make_actuator("pneuflex_s")).shape == (1, 0)
    assert grid.fractions_of(heat, np.array([1.0, 0.1]))[:3, 1].tolist() == [
        [1, 1, 0.1],
        [1, 0.1, 1],
        [0.1, 1, 1],
    ]


@pytest.mark.slow
def test_free_bending_and_other_sections(run, tmp_path):
    result = run("workspace", "--design", "triad", "--design", "rectangular", "--out", tmp_path, *COARSE)
    assert result.exit_code == 0, result.output
    with open(tmp_path / "workspace.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    triad = [row for row in rows if row["design"] == "triad"]
    assert len(triad) == 12 * 4 * 3  # three springs alone, nine mixtures of two
    alone = [r for r in triad if [r[f"xi0_{k}"] for k in (1, 2, 3)] == ["1", "1", "0.1"]]
    assert [float(r["bend_direction_deg"]) for r in alone] == pytest.approx([150.0] * 4)
    flat = [row for row in rows if row["design"] == "rectangular"]
    assert len(flat) == 24 and all(row["xi0_3"] == "" == row["bend_direction_deg"] for row in flat)
    for name in ("workspace.png", "activation.png", "direction.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_lots_of_rows_are_the_rows(monkeypatch):
    pressure, xi0 = np.linspace(0.0, 30e3, 15), np.ones(1)
    whole, told = compute_workspace("pneuflex_s", pressure, xi0), []
    monkeypatch.setattr(grid, "CHUNK", 4)
    again = compute_workspace("pneuflex_s", pressure, xi0, progress=told.append)
    assert told == [4, 4, 4, 3]
    np.testing.assert_allclose(again.curvature, whole.curvature, rtol=1e-9, atol=1e-9)


@pytest.mark.slow
def test_a_chain_of_one_kind_reaches_what_its_segments_do(run, tmp_path):
    path = tmp_path / "two.toml"
    path.write_text(
        'schema = "pneusma-chain/1"\nname = "two"\n[[segment]]\ndesign = "pneuflex_s"\ncount = 2\n'
    )
    result = run("workspace", "--design", path, "--samples", 3, "--out", tmp_path / "o", "--pressures", 3)
    assert result.exit_code == 0, result.output
    with open(tmp_path / "o" / "tips_two.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    body = pj.make_actuator("pneuflex_s")
    wanted = pj.solve_chain(pj.chain_of(body, 2), 30e3).end_pose[:3, 3]
    half = [[float(row[f"tip_{axis}_mm"]) for axis in "xyz"] for row in rows if row["pressure_kPa"] == "30"]
    assert len(rows) == 9 and len(half) == 3
    np.testing.assert_allclose(half, np.broadcast_to(1e3 * np.asarray(wanted), (3, 3)), atol=1e-6)


@pytest.mark.slow
def test_a_loaded_chain_is_solved_as_a_whole(run, tmp_path):
    """Two fibre-reinforced segments under a force on the tip: where Python says that the tip is."""
    path = tmp_path / "two.toml"
    path.write_text(
        'schema = "pneusma-chain/1"\nname = "two"\n'
        'tip_force_y = {value = -5.0, unit = "mN", status = "assumed", source = "x"}\n'
        '[[segment]]\ndesign = "pneuflex_s"\ncount = 2\n'
    )
    result = run("workspace", "--design", path, "--samples", 2, "--out", tmp_path / "o", "--pressures", 3)
    assert result.exit_code == 0, result.output
    with open(tmp_path / "o" / "tips_two.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    chain = pj.chain_of(pj.make_actuator("pneuflex_s"), 2)
    wanted = pj.solve_chain(chain.with_loads(pj.PointLoad([0.0, -5e-3, 0.0])), 30e3).end_pose[:3, 3]
    half = [[float(row[f"tip_{axis}_mm"]) for axis in "xyz"] for row in rows if row["pressure_kPa"] == "30"]
    assert len(rows) == 6 and len(half) == 2
    np.testing.assert_allclose(half, np.broadcast_to(1e3 * np.asarray(wanted), (2, 3)), atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--design", "pneusma"), "did you mean 'pneusma2'?"),
        (("--pressure-kPa-min", 10, "--pressure-kPa-max", 5), "ascend"),
        (("--xi0-min", 1.5), "--xi0-min"),
        (("--alloy", "krl53"), "did you mean"),
    ],
)
def test_refusals(refused, tmp_path, arguments, words):
    assert words in refused("workspace", "--out", tmp_path / "out", *arguments)
    assert not (tmp_path / "out").exists()


def test_a_chain_without_any_result_is_told_and_no_crash(run, tmp_path):
    """Far below ambient every wall is sucked flat, so there is no tip whose range could be told."""
    result = run(
        "workspace", "--design", "orthogonal_chain", "--samples", 2, "--out", tmp_path, "--pressures", 2,
        "--activations", 2, "--pressure-kPa-min", -95, "--pressure-kPa-max", -90,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "0 of 4" in result.output and "none" in result.output and "nan" not in result.output


def test_options_without_a_use_are_told(run, tmp_path):
    result = run(
        "workspace", "--design", "pneuflex_s", "--out", tmp_path, "--pressures", 2, "--alloy", "krl45",
        "--samples", 7,
    )  # fmt: skip
    assert "--alloy has no effect: there is no spring" in result.output
    assert "--samples has no effect: there is no chain" in result.output
    assert "--seed has" not in result.output


@pytest.mark.slow
def test_what_a_model_adds_and_where_it_is_not_at_home_is_said(run, contact_model, tmp_path):
    model = contact_model("pneusma1", 0.01)
    used = ("workspace", "--model", model, *COARSE, "--out", tmp_path / "out")
    adds = "note: mine.toml adds tip_contact to the base model"
    elsewhere = "note: mine.toml was made with the design pneusma1, and its numbers are used with pneuflex_s here"
    assert run(*used, "--design", "pneusma1").stderr.splitlines() == [adds]
    both = run(*used, "--design", "pneuflex_s", "--design", "pneusma1", "--force")
    assert both.stderr.splitlines() == [adds, elsewhere]
    state = run("simulate", "--model", model, "--pressure-kPa", 10)
    assert state.exit_code == 0 and state.stderr.splitlines() == [adds]
