"""The inverse of a model on disk: its effects hold targets back, and what cannot act is refused."""

import numpy as np
import pytest
from click.testing import CliRunner

import pneusma_jax as pj
from fitting.cli import main
from fitting.invert import Inverse, Limits
from fitting.specimens.saved_models import load_model
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError

SIZES = """
material = "dragon_skin_10_fast"
wall_thickness = {value = 1.1, unit = "mm", status = "fitted", source = "here"}
"""


@pytest.fixture
def path(contact_model):
    return contact_model("pneuflex_s", 0.002, SIZES)


@pytest.mark.slow
def test_drives_of_a_model_give_the_target_in_its_simulation(path):
    model = load_model(path)
    inverse = Inverse("pneuflex_s", Limits((0.0, 50e3)), model=model)
    wanted = np.deg2rad([[40.0], [90.0]])  # before contact at 57 deg, and beyond
    found = inverse.solve(("bend_angle",), wanted)
    assert found.met.all()
    tube = pj.make_actuator("pneuflex_s", wall_thickness=1.1e-3)
    effect = find_effect("tip_contact")(stiffness=0.002, angle=1.0, exponent=1.5)
    bend = [pj.simulate_history(tube, [p], time=[0.0], effects=(effect,)).rows.bend_angle[0] for p in found.pressure]
    np.testing.assert_allclose(bend, wanted[:, 0], atol=1e-5)
    free = [float(pj.solve(tube, p).bend_angle) for p in found.pressure]
    assert free[0] == pytest.approx(wanted[0, 0], abs=1e-5) and free[1] > 1.05 * wanted[1, 0]


def test_what_effects_cannot_do_is_refused(path, tmp_path):
    run = lambda *given: CliRunner().invoke(main, ["invert", "--model", str(path), *given])  # noqa: E731
    (tmp_path / "t.csv").write_text("time_s,bend_angle_deg\n0,30\n1,40\n", encoding="utf-8")
    over_time = run("--targets", str(tmp_path / "t.csv"))
    assert over_time.exit_code == 2 and "give targets without time" in over_time.stderr
    chain = run("--design", "orthogonal_chain", "--tip-mm", "40", "30", "150")
    assert chain.exit_code == 2 and "a chain takes numbers of mine.toml, but not its effects" in chain.stderr


def test_a_model_brings_its_design_and_is_named_before_anything_is_solved(path, monkeypatch):
    asked = []

    def begun(design, limits, alloy, material, seed, model):
        asked.append((design, material, [effect.slug for effect in model.effects]))
        raise InputError("as far as this")

    monkeypatch.setattr("fitting.invert.Inverse", begun)
    found = CliRunner().invoke(main, ["invert", "--model", str(path), "--bend-angle-deg", "40"])
    assert found.exit_code == 2 and asked == [("pneuflex_s", "dragon_skin_10_fast", ["tip_contact"])]
    assert found.stderr.splitlines()[0] == "note: mine.toml adds tip_contact to the base model"


@pytest.mark.slow
def test_a_model_brings_its_design(path):
    found = CliRunner().invoke(main, ["invert", "--model", str(path), "--bend-angle-deg", "40"])
    assert found.exit_code == 0 and found.stdout.startswith("pneuflex_s\n")
    assert found.stderr.splitlines()[0] == "note: mine.toml adds tip_contact to the base model"
