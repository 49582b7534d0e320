"""A kind of specimen from one module: the McKibben muscle of the examples, registered and forgotten again."""

import runpy
import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from click.testing import CliRunner

from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.recordings import Recording, read_campaign, schema, write_recording
from fitting.diagnose import diagnose
from fitting.simulate.recording import predict
from fitting.specimens import SPECIMENS, specimen_of, stack
from fitting.specimens.saved_models import AugmentedModel, add_effect
from fitting.synthesise import Wishes, synthesise
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.errors import InputError

EXAMPLE = Path(__file__).resolve().parents[2] / "notebooks" / "examples" / "mckibben_muscle.py"
REGISTRIES = (SPECIMENS, CATALOGUE, schema.KINDS, schema.GEOMETRY_NUMBERS)


@pytest.fixture(scope="module")
def muscle():
    """The module's names; afterwards nothing knows the kind any more."""
    with pytest.raises(InputError, match="muscle are not modelled"):
        specimen_of("muscle")
    before = [dict(known) for known in REGISTRIES]
    yield runpy.run_path(str(EXAMPLE))
    for known, kept in zip(REGISTRIES, before, strict=True):
        known.clear()
        known.update(kept)


def body(muscle, angle=23.0):
    return muscle["Muscle"](jnp.asarray(0.2), jnp.asarray(12e-3), jnp.asarray(np.deg2rad(angle)))


def test_a_muscle_stops_pulling_where_its_braid_is_at_the_magic_angle(muscle):
    one = body(muscle)
    largest = 1.0 - 1.0 / (np.sqrt(3.0) * np.cos(np.deg2rad(23.0)))  # cos^2 of the braid's angle is 1/3 there
    assert float(one.pull(2e5, largest)) == pytest.approx(0.0, abs=1e-9)
    angle = np.deg2rad(23.0)
    isometric = np.pi * 6e-3**2 * 2e5 * (3.0 / np.tan(angle) ** 2 - 1.0 / np.sin(angle) ** 2)
    assert float(one.pull(2e5, 0.0)) == pytest.approx(isometric)


def test_friction_is_a_loop_that_turns_over_its_width(muscle):
    one, eps = body(muscle), np.concatenate([np.linspace(0.0, 0.1, 41), np.linspace(0.1, 0.0, 41)[1:]])
    pressure, time = np.full(len(eps), 2e5), np.arange(len(eps)) * 1.0
    run = lambda *effects: np.asarray(  # noqa: E731
        muscle["simulate_muscle"](one, pressure, 0.2 * (1.0 - eps), time, effects)["force"]
    )
    lost = run() - run(muscle["BraidFriction"](friction=0.3, turn=0.01))
    state, expected = 0.0, []
    for step in np.diff(eps, prepend=eps[0]):
        state = min(max(state + 2.0 * step / 0.01, -1.0), 1.0)
        expected.append(0.3 * float(one.area) * 2e5 * state)
    np.testing.assert_allclose(lost, expected, atol=1e-9)
    absent = [muscle[name]() for name in ("BraidFriction", "BladderThreshold", "ConicalEnds")]
    np.testing.assert_allclose(run(*absent), run(), rtol=1e-12)


def test_every_effect_of_it_has_derivatives(muscle):
    campaign = synthesise("muscle", seed=1).campaign
    specimen = specimen_of("muscle")
    rows = stack(specimen.rows_for(campaign)[:1])

    def force(values):
        effects = (
            muscle["BraidFriction"](friction=values[0]), muscle["BladderThreshold"](threshold=1e4 * values[1]),
            muscle["ConicalEnds"](factor=1.0 + values[2]),
        )  # fmt: skip
        return jax.vmap(lambda row: specimen.answer({}, row, effects)[0]["force"])(rows)

    at, step = jnp.asarray([0.2, 0.5, 0.1]), 1e-6
    exact, force = np.asarray(jax.jit(jax.jacfwd(force))(at)), jax.jit(force)
    for k in range(3):
        above, below = (np.asarray(force(at.at[k].add(sign * step))) for sign in (1.0, -1.0))
        np.testing.assert_allclose(exact[..., k], (above - below) / (2.0 * step), rtol=1e-5, atol=1e-4)


def test_its_recordings_are_written_read_and_refused(muscle, tmp_path):
    for recording in synthesise("muscle", seed=1).recordings:
        write_recording(recording, tmp_path)
    campaign = read_campaign(tmp_path)
    assert campaign.kinds == ["muscle"]
    assert campaign.recordings[0].full_geometry()["braid_angle_deg"] == 23.0
    sidecar = tmp_path / "run_1.toml"
    sidecar.write_text(sidecar.read_text().replace("braid_angle_deg = 23.0", "braid_angle_deg = 0.0", 1))
    with pytest.raises(InputError, match="braid_angle_deg = 0 must be more than 0"):
        read_campaign(tmp_path)


def test_simulation_shows_what_was_concealed(muscle):
    friction = muscle["BraidFriction"](friction=0.25, turn=0.01)
    recording = muscle["synthesise_muscles"](Wishes(seed=1, spread="none"), (friction,)).recordings[0]
    model = AugmentedModel(added=(add_effect(friction, "known"),))
    misses = []
    for one in (AugmentedModel(), model):
        found = predict(recording, model=one).outputs["force_N"] - recording.columns["force_N"]
        misses.append(float(np.sqrt(np.mean(found**2))))
    assert misses[1] < 1.5 * muscle["NOISE"]["force_N"] < 0.5 * misses[0]


def test_a_single_row_without_a_force_can_be_simulated(muscle):
    columns = {"time_s": np.zeros(1), "pressure_kPa": np.full(1, 200.0), "length_mm": np.full(1, 190.0)}
    recording = Recording("state", None, "muscle", columns=columns | {"force_N": np.full(1, np.nan)})
    (force,) = predict(recording).outputs["force_N"]
    assert force == pytest.approx(float(body(muscle).pull(2e5, 0.05)))


def test_dimensions_are_found_within_their_errors(muscle, tmp_path):
    made = synthesise("muscle", seed=1)
    fit = characterise(made.campaign)
    for k, specimen in enumerate(("A", "B"), start=1):
        true = made.truth["specimens"][specimen]["geometry"]
        for name, key in (("braid_angle", "braid_angle_deg"), ("outer_diameter", "outer_diameter_mm")):
            found = fit.parameters[f"{name}__{k}"]
            assert abs(found.value - true[key]["value"]) < 4.0 * found.sd
            assert found.sd < 0.3 * 0.05 * true[key]["nominal"]
    assert fit.fit.reduced_chi_square == pytest.approx(1.0, abs=0.2)
    assert {"report.json", "report.html"} <= {path.name for path in fit.save(tmp_path / "out")}


@pytest.mark.parametrize("hidden", [False, True])
def test_a_diagnosis_names_a_concealed_friction_and_nothing_where_nothing_is(muscle, hidden):
    effects = (muscle["BraidFriction"](friction=0.25, turn=0.01),) if hidden else ()
    found = diagnose(muscle["synthesise_muscles"](Wishes(seed=2), effects).campaign)
    assert found.mismatch is hidden
    assert [f.slug for f in found.found] == (["braid_friction"] if hidden else [])
    assert found.component == ("braid" if hidden else "none")
    if hidden:
        assert found.found[0].probability > 0.9
        assert found.found[0].parameters["friction"]["value"] == pytest.approx(0.25, rel=0.1)


def test_the_module_is_the_command_line(muscle, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["mckibben_muscle.py", "synthesise", "muscle", "--out", str(tmp_path / "made")])
    with pytest.raises(SystemExit) as ended:
        muscle["main"]()
    assert not ended.value.code and (tmp_path / "made" / "run_5.csv").exists()


def test_a_raw_file_of_it_is_imported_where_its_kind_is_stated(muscle, tmp_path):
    raw = tmp_path / "contraction.csv"
    raw.write_text("Time (s),Pressure (bar),Length (mm),Force (N)\n" + "".join(f"{k},2,{200 - k},{90 - 2 * k}\n" for k in range(12)))
    run = CliRunner().invoke(main, ["import", str(raw), "--out", str(tmp_path / "campaign"), "--kind", "muscle"])
    assert run.exit_code == 0, run.output
    (recording,) = read_campaign(tmp_path / "campaign").recordings
    assert recording.kind == "muscle"
    np.testing.assert_allclose(recording.columns["pressure_kPa"], 200.0)
