"""A spring that is heated and whose resistance nobody recorded is taken as cold: every command says so.

And heat by a current in a campaign of which one recording has none.
"""

from pathlib import Path
from types import SimpleNamespace

import equinox as eqx
import jax
import numpy as np
import pytest

from fitting.calibrate import batch
from fitting.calibrate.assumed import notices_of
from fitting.data.recordings import Campaign, Recording, heated_unseen, read_campaign, write_recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.diagnose.check import checked
from fitting.inference.parameters import Parameters
from fitting.propagate.responses.course import recording_response
from fitting.propagate.responses.noise import WhiteNoise
from fitting.report.batch import checks
from fitting.sample.models import model_problem
from fitting.simulate import predict
from fitting.specimens import specimen_of
from fitting.specimens.actuator_history import with_effects
from fitting.specimens.model_objects import BASE
from pneusma_jax.effects.heat import OpposingSpringHeating

ASKED = "check: spring 2 carries a current, but its resistance was not recorded: it is taken as cold"
HEATED = {"current_2_A": np.full(24, 0.15)}


def bent(name="run_1", **columns):
    time = np.arange(24.0)
    base = {"time_s": time, "pressure_kPa": time, "curvature_1pm": 0.1 * time, "length_mm": 70.0 + 0.1 * time}
    return Recording(name, None, "actuator", specimen="A", real=False, noise={"curvature_1pm": 0.1, "length_mm": 0.1},
                     geometry={"design": "pneusma2"}, columns=base | columns)  # fmt: skip


@pytest.fixture
def campaign(tmp_path):
    write_recording(bent(**HEATED), tmp_path / "mine")
    return read_campaign(tmp_path / "mine")


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"current_2_A": np.array([0.0, 0.15, -0.15, np.nan])}, [ASKED]),
        ({"current_2_A": np.array([0.0, 0.15, 0.15, 0.0])}, [ASKED]),
        ({"current_2_A": np.array([1e-3, -1e-3, 5e-4, 0.0])}, []),  # an instrument's zero
        ({"current_2_A": np.full(4, 0.15), "resistance_2_ohm": np.full(4, 2.4)}, []),
        ({}, []),
    ],
)
def test_a_current_without_a_resistance_is_asked_about(columns, said):
    time = np.arange(4.0)
    recording = Recording("r", None, "actuator", columns={"time_s": time, "pressure_kPa": time, **columns})
    assert heated_unseen(recording) == said


def test_so_is_that_of_a_spring_on_a_stand():
    time = np.arange(4.0)
    columns = {"time_s": time, "elongation_mm": time, "force_N": time, "temperature_degC": 20.0 + time}
    (said,) = heated_unseen(Recording("r", None, "spring", columns=columns | {"current_A": np.full(4, 0.5)}))
    assert said.startswith("check: the spring carries a current, but its resistance was not recorded")
    columns["resistance_ohm"] = np.full(4, 2.4)
    assert heated_unseen(Recording("r", None, "spring", columns=columns | {"current_A": np.full(4, 0.5)})) == []


def test_a_resistance_in_another_recording_does_not_tell_the_phase_of_this_one():
    other = bent("run_2", resistance_2_ohm=np.full(24, 2.4))
    said = checked(Campaign("c", [bent(**HEATED), other], Path("c")))
    assert [note for note in said if "carries" in note] == [f"run_1: {ASKED}"]


def test_every_way_of_using_a_recording_says_it(campaign):
    (recording,) = campaign.recordings
    assert ASKED in recording.notices
    rows, parameters = specimen_of("actuator").rows_for(campaign), specimen_of("actuator").parameters_for(campaign)
    told = {
        "characterise": notices_of(campaign.recordings, Parameters()),
        "diagnose": checked(campaign),
        "posterior": model_problem("c", campaign.recordings, rows, parameters).notices,
        "propagate": recording_response(campaign, BASE, 5, lambda channels: WhiteNoise({})).notices,
    }
    assert {name: list(said).count(f"run_1: {ASKED}") for name, said in told.items()} == dict.fromkeys(told, 1)
    assert ASKED in predict(recording, denoise=False).notices


def test_recordings_in_memory_are_asked_about_too():
    made = bent(**HEATED)
    assert f"run_1: {ASKED}" in notices_of([made], Parameters())
    assert ASKED in predict(made, denoise=False).notices


def test_a_batch_says_it(campaign, monkeypatch):
    result = SimpleNamespace(parameters={}, law="")
    monkeypatch.setattr(batch, "characterise", lambda *_, **__: result)
    found = batch.characterise_batch([campaign.path])
    assert checks(found) == [f"mine: run_1: {ASKED}"]


def test_a_diagnosis_names_a_column_that_it_does_not_use(tmp_path):
    """`Curvature` for `curvature_1pm` was left aside without a word."""
    write_recording(bent(), tmp_path / "mine")
    file = tmp_path / "mine" / "run_1.csv"
    file.write_text(file.read_text().replace("length_mm", "Length"))
    told = checked(read_campaign(tmp_path / "mine"))
    assert "run_1: column Length is not one that a recording of kind actuator has: kept and ignored" in told


# --- heat by a current, of which one recording has none: the driven spring's austenite stands for it there -------

ROWS = 24
XI0 = np.linspace(1.0, 0.3, ROWS)


def driven(name, **columns):
    base = {
        "time_s": 3.0 * np.arange(ROWS), "pressure_kPa": np.full(ROWS, 30.0), "curvature_1pm": np.full(ROWS, 20.0),
        "resistance_2_ohm": np.linspace(3.8, 3.4, ROWS),
    }  # fmt: skip
    return Recording(name, None, "actuator", specimen="A", columns=base | columns,
                     geometry=nominal_geometry("actuator", {"design": "pneusma2"}),
                     noise={"resistance_2_ohm": 1e-4, "curvature_1pm": 0.25})  # fmt: skip


@pytest.fixture
def one_with_a_current():
    """A campaign of two recordings, of which the second has the current of spring 2."""
    return Campaign("c", [driven("bare"), driven("heated", current_2_A=np.full(ROWS, 0.2))], None)


def test_effects_are_told_which_recordings_have_a_current(one_with_a_current, monkeypatch):
    """`OpposingSpringHeating` counts a current where its recording has one; see its own tests."""

    class Enough(Exception):
        """No state needs to be solved."""

    def told(*given):
        known.append(given[6])
        raise Enough

    known = []
    monkeypatch.setattr("fitting.specimens.actuator_history.track_history", told)
    for rows in specimen_of("actuator").rows_for(one_with_a_current):
        with pytest.raises(Enough):
            with_effects({name: np.asarray(value) for name, value in rows.base.items()}, rows, ())
    for one, has in zip(known, (0.0, 1.0), strict=True):
        np.testing.assert_array_equal(one["has_currents"][2], has)
    np.testing.assert_allclose(known[1]["currents"][2], 0.2)
    assert np.all(np.isfinite(known[0]["currents"][2]))  # times zero, which does not stop what is not a number


@pytest.mark.slow
def test_a_recording_without_a_current_is_not_taken_as_unheated(one_with_a_current):
    campaign = one_with_a_current
    program = jax.jit(with_effects)

    def left(rows, by_current):
        """Fractions of the cold spring while the other one is heated."""
        rows = eqx.tree_at(lambda r: r.extra["xi0"], rows, (np.ones(ROWS), XI0))
        values = {name: np.asarray(value) for name, value in rows.base.items()}
        effect = OpposingSpringHeating(gain=0.4, by_current=by_current)
        return np.asarray(program(values, rows, (effect,))[1]["xi0_1"])

    bare, heated = specimen_of("actuator").rows_for(campaign)
    assert left(bare, 0.0)[-1] < 0.95
    np.testing.assert_allclose(left(bare, 1.0), left(bare, 0.0), rtol=1e-9)
    assert left(heated, 1.0)[-1] < left(heated, 0.0)[-1] - 0.1
