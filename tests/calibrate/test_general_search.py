"""When a fit of a wire, tube or actuator goes on to look for a better minimum, on fits that only say how they end."""

from types import SimpleNamespace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.general import fit as general
from fitting.calibrate.general import pipeline
from fitting.characterise import characterise
from fitting.data.recordings import Campaign, Recording, write_recording
from fitting.inference.least_squares import Status
from fitting.inference.parameters import Parameters
from fitting.report.general import text, wires
from fitting.report.open_constants import grouped_warnings
from fitting.specimens import WIRE
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import simulate_wire
from pneusma_jax.nitinol.wire import load_wire

STARTS = 8


@pytest.fixture
def stated(monkeypatch):
    """Fits of recordings whose noise is stated, so that residuals tell none."""
    monkeypatch.setattr(general, "with_noise_of_residuals", lambda recordings, rows, predict: rows)


@pytest.fixture
def searching(monkeypatch, stated):
    """Starts of every fit that is made, where reduced chi-square is `bare` and, noise of drivers counted, `decided`."""

    def of(bare, decided):
        asked = []

        def fitted(model, recordings, rows, parameters, starts, seed):
            asked.append(starts)
            reduced = decided if rows[0] == "decided" else bare
            return SimpleNamespace(
                chi_square=100.0 * reduced, reduced_chi_square=reduced, status=Status.CONVERGED, values={},
                parameters=Parameters(), start_chi_squares=[100.0 * reduced] * (starts if isinstance(starts, int) else 1),
            )  # fmt: skip

        monkeypatch.setattr(general, "_fit", fitted)
        monkeypatch.setattr(general, "_misfits", lambda fit: [np.random.default_rng(0).standard_normal(100)])
        monkeypatch.setattr(general, "inflation_of", lambda reduced, misfits: 1.0)
        model = SimpleNamespace(decides=lambda rows: True, decided=lambda values, rows: ["decided"])
        found = general.fit_campaign(["a recording"], ["bare"], Parameters(), STARTS, 0, lambda word: None, model)
        return found, [n for n in asked if n == STARTS]

    return of


def test_noise_of_the_drivers_is_no_reason_to_search_on(searching):
    found, many = searching(bare=1.5, decided=1.0)
    assert len(many) == 1 and len(found.starts) == STARTS and found.reduced_chi_square == 1.0


def test_what_that_noise_does_not_explain_is(searching):
    found, many = searching(bare=20.0, decided=10.0)
    assert len(many) == 1 + general.DRAWS and len(found.starts) == STARTS + general.DRAWS * (STARTS - 1)


@pytest.mark.parametrize("starts", [1, STARTS])
@pytest.mark.parametrize("left", [1.0, 5.0])
def test_rows_decided_at_the_start_are_fitted_where_later_ones_are_missed(monkeypatch, stated, left, starts):
    """A known model may be right at its start, which undecided rows lead away from. So it stays where it misses, too."""
    made = []

    def fitted(model, recordings, rows, parameters, starts, seed):
        made.append(rows[0])
        reduced, values = (left, {"x": 0.0}) if rows[0] == "right" else (20.0, {"x": 1.0})
        return SimpleNamespace(
            chi_square=100.0 * reduced, reduced_chi_square=reduced, status=Status.CONVERGED, values=values,
            parameters=SimpleNamespace(at=lambda values: Parameters()),
            start_chi_squares=[100.0 * reduced],
        )  # fmt: skip

    monkeypatch.setattr(general, "_fit", fitted)
    monkeypatch.setattr(general, "_misfits", lambda fit: [np.random.default_rng(0).standard_normal(100)])
    monkeypatch.setattr(general, "inflation_of", lambda reduced, misfits: 1.0)
    model = SimpleNamespace(
        decides=lambda rows: True, decided=lambda values, rows: ["wrong" if values.get("x") else "right"]
    )
    words = []
    found = general.fit_campaign(["a recording"], ["bare"], Parameters(), starts, 0, words.append, model)
    assert found.rows == ("right",) and found.reduced_chi_square == left
    assert words[-1] == "from rows that are decided at the start"
    assert made.count("wrong") == 1  # a search that finds nothing lower is not decided again


@pytest.mark.parametrize("bare", [1.0, 2.0, 1.8e5])
def test_a_fit_whose_noise_was_raised_to_its_misfit_is_missed_all_the_same(searching, monkeypatch, bare):
    """The last fit is made at noise that covers the misfit, so its own reduced chi-square is near 1."""
    monkeypatch.setattr(general, "inflated", lambda rows, factor: ["decided"])
    found, _ = searching(bare, bare)
    assert found.misses == (bare > 1.3)
    monkeypatch.setattr(general, "inflation_of", lambda reduced, misfits: 40.0)
    model = SimpleNamespace(decides=lambda rows: False)
    fitted = general._settled(model, ("a recording",), ["bare"], found.result, (1.0,), lambda word: None)
    assert fitted.inflation == 40.0 and fitted.misses == (bare > 1.3)


HELD = ["gR_amplitude", "gR_slope", "gR_shift", "gR_decay"]


def under_load(takes_off):
    """A heating of a new wire under a load, which may be taken off at its end."""
    stress = np.full(60, 200.0)
    stress[-10:] = 0.0 if takes_off else 200.0
    columns = {"time_s": np.arange(60.0), "temperature_degC": np.linspace(20.0, 90.0, 60), "strain": np.linspace(0.05, 0.01, 60)}
    recording = Recording("cycle", None, "wire", geometry={"alloy": "fit"}, columns={**columns, "stress_MPa": stress})
    return Campaign("c", [recording], None)


@pytest.mark.parametrize(("misses", "takes_off", "laws"), [(True, False, 2), (False, False, 1), (True, True, 1)])
def test_a_law_that_misses_recordings_is_fitted_without_the_loop_that_nothing_shows(monkeypatch, misses, takes_off, laws):
    asked = []

    def fitted(campaign, specimen, **options):
        asked.append(options.get("base"))
        return SimpleNamespace(fit=SimpleNamespace(misses=misses))

    monkeypatch.setattr(pipeline, "characterise_general", fitted)
    pipeline.characterise_specimen(under_load(takes_off), WIRE)
    assert len(asked) == laws
    if laws == 2:
        wire = WIRE.rows_for(under_load(takes_off), base=asked[1])[0].base
        assert float(wire["gR_amplitude"]) == 0.0


def test_what_was_held_is_not_said_to_be_missing_for_another_reason():
    entries = [{"kind": "at_start", "parameters": [name], "text": name} for name in [*HELD, "beta_1", "beta_2"]]
    alike, held = grouped_warnings(entries, set(HELD))
    assert alike.startswith("beta_1 and beta_2 are still") and "these recordings do not show them" in alike
    assert held.startswith("gR_amplitude, gR_slope, gR_shift and gR_decay are still")
    assert "only a recording that takes the load off" in held


@pytest.mark.parametrize(("misses", "takes_off", "words"), [(True, False, "may stand in for a hysteresis"), (False, False, "A hysteresis of the phase would look alike"), (False, True, "")])
def test_a_loop_of_the_residual_strain_is_called_one(misses, takes_off, words):
    result = SimpleNamespace(fit=SimpleNamespace(misses=misses), campaign=under_load(takes_off), specimen=WIRE, options={})
    said = wires._loop_means(result)
    assert words in said and bool(words) == bool(said)


@pytest.mark.parametrize(("held", "takes_off"), [(False, False), (True, False), (False, True)])
def test_constants_that_only_loops_show_are_free_with_their_priors(monkeypatch, held, takes_off):
    """The doubt of a constant that is held at its table's value would be missing in every interval."""
    asked = []

    def stopped(recordings, rows, parameters, *rest):
        asked.append(parameters)
        raise InputError("far enough")

    monkeypatch.setattr(pipeline, "fit_campaign", stopped)
    with pytest.raises(InputError, match="far enough"):
        pipeline.characterise_general(under_load(takes_off), WIRE, starts=1, hold_unseen=held)
    known = load_calibration("niti_wire", "alloy").quantities
    assert [name in asked[0] for name in HELD] == [not held] * 4
    for name in HELD if not held else ():
        assert asked[0][name].free and asked[0][name].prior == known[name].prior


@pytest.mark.slow
@pytest.mark.parametrize(("cold", "hot", "width", "stress"), [(80.0, 100.0, 3.0, 200.0), (55.0, 70.0, 4.0, 120.0)])
def test_one_cycle_of_a_wire_with_a_hysteresis_is_drawn_as_one_curve(tmp_path, cold, hot, width, stress):
    temperature = np.concatenate([np.linspace(20.0, 140.0, 60), np.linspace(140.0, 20.0, 60)])
    middle = np.where(np.arange(120) < 60, hot, cold)
    strain = 0.01 + 0.04 / (1.0 + np.exp((temperature - middle) / width))
    columns = {"time_s": np.arange(120.0), "strain": np.round(strain, 5), "stress_MPa": np.full(120, stress), "temperature_degC": temperature}
    write_recording(Recording("thermal", None, "wire", geometry={"alloy": "fit"}, columns=columns, real=False), tmp_path)
    found = characterise(tmp_path, starts=2, profile=0)
    assert found.parameters["gR_amplitude"].value == 0.0
    said = " ".join(text.warnings(found))
    assert "draws a loop" not in said and "fitted without (gR_amplitude = 0) and draws one curve" in said
    assert cold < found.parameters["T_mid"].value < hot or "lies outside" in said
    (score,) = found.scores
    heating, cooling = (np.interp(0.5 * (cold + hot), score.x[part][:: 1 if k == 0 else -1], score.predicted[part][:: 1 if k == 0 else -1])
                        for k, part in enumerate((slice(0, 60), slice(60, 120))))  # fmt: skip
    assert heating == pytest.approx(cooling, abs=2e-4)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_a_hysteresis_of_two_kelvins_is_not_passed_over_in_silence(tmp_path, noise):
    """It is said whether the residual strain, which could take up such a loop, was fitted or left out."""
    wire = load_wire()
    wire = eqx.tree_at(lambda w: w.gR_amplitude, wire, jnp.zeros(()))
    heating = np.linspace(15.0, 90.0, 40)
    temperature = np.concatenate([heating, heating[::-1]])
    lag = np.repeat([-1.0, 1.0], 40)
    random = np.random.default_rng(1)
    for k, stress in enumerate((60.0, 120.0, 200.0)):
        run = simulate_wire(wire, stress=np.full(80, 1e6 * stress), temperature=temperature + lag)
        strain = np.asarray(run.rows.strain) + noise * random.standard_normal(80)
        columns = {"time_s": np.arange(80.0), "strain": strain, "stress_MPa": np.full(80, stress), "temperature_degC": temperature}
        recording = Recording(f"thermal_{k}", None, "wire", geometry={"alloy": "fit"}, columns=columns, noise={"strain": noise}, real=False)
        write_recording(recording, tmp_path)
    found = characterise(tmp_path, starts=3, profile=0)
    said = " ".join(text.warnings(found))
    left_out = "fitted without (gR_amplitude = 0) and draws one curve" in said
    assert left_out or "A hysteresis of the phase would look alike" in said
    assert left_out == (found.parameters["gR_amplitude"].value == 0.0)
    assert found.parameters["T_mid"].value == pytest.approx(45.0, abs=3.0 * found.parameters["T_mid"].sd)
