"""Simulated campaigns: shipped ones come out again, seeds repeat, noise is what it says, truths are what was simulated."""

import dataclasses
import json
from importlib import resources
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.data.recordings import check_recording, read_campaign
from fitting.inference.latent_trajectory.denoise import denoised
from fitting.synthesise import makers, synthesise, write_synthetic
from fitting.synthesise.instruments import correlated, random_walk
from fitting.synthesise.spring import CONSTANTS
from fitting.synthesise.truth import Truth
from fitting.synthesise.wishes import Wishes
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import WireAlloy, simulate_wire
from pneusma_jax.units import to_si

MADE_WITH = {
    "spring": {"seed": 1, "interval_s": 2.0},
    "wire": {"seed": 1, "interval_s": 8.0},
    "tube": {"seed": 1},
    "actuator": {"seed": 1, "interval_s": 1.0},
    "elastomer": {"seed": 20240611},
}
"""Options of `pneusma synthesise KIND` that made the campaigns in `calibration_data/examples`."""
SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"
ALMOST_ALL = 0.99  # of the numbers must be the same text; on other processors the last digit may differ here and there


def documents(made, folder):
    return {p.name: p.read_bytes() for p in write_synthetic(made, folder)}


@pytest.mark.parametrize("kind", [pytest.param(k, marks=pytest.mark.slow if k == "actuator" else ()) for k in makers()])
def test_the_shipped_campaign_comes_out_again(kind, tmp_path):
    made = documents(synthesise(kind, **MADE_WITH[kind]), tmp_path / "again")
    shipped = {p.name: p.read_bytes() for p in (SHIPPED / kind).iterdir()}
    if kind == "elastomer":
        assert "truth.json" not in shipped  # its truth is in `fitting.synthesise.elastomer`
        made.pop("truth.json")
    assert made.keys() == shipped.keys()
    for name in made:
        if not name.endswith(".csv"):
            assert made[name] == shipped[name], name
        elif made[name] != shipped[name]:
            ours, theirs = (text.decode().splitlines() for text in (made[name], shipped[name]))
            assert ours[:2] == theirs[:2] and len(ours) == len(theirs)
            a, b = (np.array([row.split(",") for row in rows[2:]]) for rows in (ours, theirs))
            assert np.mean(a == b) > ALMOST_ALL
            last = 10.0 ** -np.array([[len(x.partition(".")[2]) for x in row] for row in b])
            assert np.all(np.abs(a.astype(float) - b.astype(float)) < 1.5 * last)


def test_shipped_campaigns_are_small_and_say_that_they_are_simulated():
    for kind in makers():
        files = list((SHIPPED / kind).iterdir())
        campaign = read_campaign(SHIPPED / kind)
        assert campaign.kinds == [kind] and not campaign.notices and "imulated" in campaign.title
        assert {r.role for r in campaign.recordings} == {"fit", "validation"}
        assert sum(map(len, campaign.recordings)) < 1000
        assert all(r.real is False and "simulated" in r.source["citation"] for r in campaign.recordings)
        assert sum(p.stat().st_size for p in files) < 60_000


@pytest.mark.parametrize("kind", [pytest.param(k, marks=pytest.mark.slow if k == "actuator" else ()) for k in makers()])
def test_a_seed_repeats_and_another_does_not(kind, tmp_path):
    interval = {"elastomer": {}, "actuator": {"interval_s": 1.0}}.get(kind, {"interval_s": 5.0})
    wishes = dict(noise_time_s=3.0, drift=0.5, **interval)
    first = documents(synthesise(kind, seed=3, **wishes), tmp_path / "a")
    assert documents(synthesise(kind, seed=3, **wishes), tmp_path / "b") == first
    other = documents(synthesise(kind, seed=4, **wishes), tmp_path / "c")
    assert all(other[name] != first[name] for name in first if name.endswith((".csv", "truth.json")))
    made = synthesise(kind, seed=3, **wishes)
    read = {r.name: r for r in read_campaign(tmp_path / "a").recordings}
    for recording in made.campaign.recordings:
        check_recording(recording)
        assert read[recording.name].real is False
        for name, values in recording.columns.items():
            np.testing.assert_array_equal(read[recording.name].columns[name], values)
    assert json.loads(first["truth.json"]) == made.truth


def test_one_more_test_does_not_change_the_others():
    few, more = (synthesise("tube", seed=5, tests=n) for n in (1, 3))
    np.testing.assert_array_equal(few.recordings[0].columns["length_mm"], more.recordings[0].columns["length_mm"])


# --- the truth is what was simulated ------------------------------------------------------------------------


def true_alloy(truth, module):
    values = {name: to_si(p["value"], p["unit"], difference=name == "T_width") for name, p in truth["parameters"].items()}
    return module(**values)


def reduced(residual, sigma):
    return float(np.mean((np.asarray(residual) / sigma) ** 2))


def true_spring(made):
    g = made.recordings[0].full_geometry()
    lengths = [1e-3 * g[k] for k in ("wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm")]
    free = 1e-3 * g["free_length_mm"]
    return pj.Spring(pj.SpringGeometry(*lengths, g["active_coils"], free), true_alloy(made.truth, pj.Alloy), free)


@pytest.fixture(scope="module")
def campaign():
    return synthesise("spring", seed=11)


@pytest.mark.parametrize(("name", "xi0"), [("cold", 1.0), ("hot", 0.0)])
def test_the_true_spring_explains_the_isothermal_tests_to_within_their_noise(campaign, name, xi0):
    recording = next(r for r in campaign.recordings if r.name == name)
    rows = pj.simulate_spring(true_spring(campaign), recording.si("elongation"), pj.MartensiteFraction(xi0)).rows
    n = len(recording)
    for quantity, model in (("force", rows.force), ("resistance", rows.resistance)):
        chi2 = reduced(recording.si(quantity) - model, recording.noise_si(quantity))
        print(f"{name}: reduced chi2 of {quantity} {chi2:.3f}")
        assert abs(chi2 - 1.0) < 5.0 * np.sqrt(2.0 / n)


def test_the_true_fractions_of_a_spring_that_no_file_has_explain_a_held_test(campaign):
    assert list(campaign.fractions) == [r.name for r in campaign.recordings]
    recording = next(r for r in campaign.recordings if r.name == "isoresistive_check")
    xi0 = campaign.fractions[recording.name]
    assert len(xi0) == len(recording) and np.ptp(xi0) > 0.05
    rows = pj.simulate_spring(true_spring(campaign), recording.si("elongation"), pj.MartensiteFraction(xi0)).rows
    for quantity, model in (("force", rows.force), ("resistance", rows.resistance)):
        chi2 = reduced(recording.si(quantity) - model, recording.noise_si(quantity))
        assert abs(chi2 - 1.0) < 5.0 * np.sqrt(2.0 / len(recording))
    assert not any("xi0" in name for r in campaign.recordings for name in r.columns)


def test_the_true_spring_explains_the_held_tests_where_resistance_is_exact():
    """Resistance written to a nano-ohm gives the phase back wherever it is informative, and so the force."""
    made = synthesise("spring", seed=11, noise={"resistance_ohm": 1e-9, "force_N": 1e-6}, tests=3, interval_s=2.0)
    spring = true_spring(made)
    for recording in (r for r in made.recordings if r.name.startswith("iso")):
        resistance = pj.Resistance(jnp.asarray(recording.si("resistance")))
        rows = pj.simulate_spring(spring, recording.si("elongation"), resistance).rows
        informative = ~np.asarray(rows.clipped)
        before = np.cumsum(~informative) == 0  # a clipped sample spoils the memory of all that follow
        assert before.sum() > 20
        np.testing.assert_allclose(rows.force[before], recording.si("force")[before], atol=1e-4)


def test_the_set_point_is_held_at_low_strain_and_lost_at_high_strain(campaign):
    """Section 2.4.5: at high strain no heating or cooling moves the resistance back to its set-point."""
    spring = true_spring(campaign)
    held = [r for r in campaign.recordings if "setpoint_ohm" in r.columns]
    assert len(held) == 6 and [r.role for r in held].count("validation") == 1
    lost = 0
    for recording in held:
        error = np.abs(recording.si("resistance") - recording.si("setpoint"))
        strain = recording.si("elongation") / float(spring.geometry.free_length)
        assert error[strain < 1.0].mean() < 0.01
        hot = recording.name in ("isoresistive_1", "isoresistive_2")
        assert strain.max() == pytest.approx(3.45 if hot else 5.75, abs=1e-3)
        current = recording.si("current")
        assert current.max() > 0.2
        if strain.max() > 5.0 and error[strain > 5.0].mean() > 0.05:
            lost += 1
            assert current.min() < 0.1 * current.max()  # the heater sits at its stop
    assert lost >= 2  # those nearest the cold end


@pytest.mark.parametrize("seed", range(6))
def test_cycles_of_a_wire_go_through_its_transformation(seed):
    made = synthesise("wire", seed=seed, spread="prior", tests=1, interval_s=20.0)
    wire = true_alloy(made.truth, WireAlloy)
    for recording in made.recordings:
        temperature = recording.si("temperature")
        for end, side in ((temperature.max(), 1.0), (temperature.min(), -1.0)):
            assert side * (end - float(wire.T_mid)) > 4.5 * float(wire.T_width)


def test_the_true_wire_explains_its_cycles():
    made = synthesise("wire", seed=2, noise={"temperature_degC": 0.0})
    wire = true_alloy(made.truth, WireAlloy)
    for recording in made.recordings:
        assert np.array_equal(denoised(recording.si("time"), recording.si("stress")), recording.si("stress"))
        rows = simulate_wire(wire, stress=recording.si("stress"), temperature=recording.si("temperature")).rows
        chi2 = reduced(recording.si("strain") - rows.strain, recording.noise_si("strain"))
        assert abs(chi2 - 1.0) < 5.0 * np.sqrt(2.0 / len(recording)), recording.name


def test_the_true_tube_explains_its_inflations():
    made = synthesise("tube", seed=2, noise={"pressure_kPa": 0.0})
    for recording in made.recordings:
        specimen = made.truth["specimens"][recording.specimen]
        g = {key: 1e-3 * pair["value"] for key, pair in specimen["geometry"].items()}
        law = pj.load_silicone()
        law = dataclasses.replace(law, stiffness=specimen["silicone_stiffness"]["value"])
        sizes = g["length_mm"], g["outer_diameter_mm"], g["wall_thickness_mm"]
        rows = [0, len(recording) // 4, len(recording) // 2]
        model = [float(pj.tube_length(recording.si("pressure")[i], *sizes, law)) for i in rows]
        np.testing.assert_allclose(recording.si("length")[rows], model, atol=4.5 * 0.05e-3)


@pytest.mark.slow
def test_the_true_actuator_explains_its_runs():
    made = synthesise("actuator", seed=2, noise={"resistance_2_ohm": 0.0, "pressure_kPa": 0.0}, interval_s=1.0)
    recording = made.recordings[2]
    alloy, factor = true_alloy(made.truth, pj.Alloy), made.truth["silicone_stiffness"]["value"]
    law = dataclasses.replace(pj.load_silicone(), stiffness=factor)
    wall = 1e-3 * made.truth["geometry"]["wall_thickness_mm"]["value"]
    body = pj.make_actuator("pneusma2", alloy, law, wall_thickness=wall)
    ambient = jnp.asarray(made.truth["ambient_degC"])
    drive = (pj.MartensiteFraction(1.0), pj.Heating(jnp.asarray(recording.si("current_2")), ambient))
    history = pj.simulate_history(body, recording.si("pressure"), drive, time=jnp.asarray(recording.si("time")))
    chi2 = reduced(recording.si("curvature") - history.rows.curvature, recording.noise_si("curvature"))
    assert abs(chi2 - 1.0) < 5.0 * np.sqrt(2.0 / len(recording))
    np.testing.assert_allclose(history.rows.springs[1].resistance, recording.si("resistance_2"), atol=5e-4)


@pytest.mark.slow
@pytest.mark.parametrize("design", ["pneuflex_w", "triad"])
def test_every_arrangement_can_be_simulated(design):
    made = synthesise("actuator", design=design, tests=1, interval_s=3.0, spread="none")
    for recording in made.recordings:
        check_recording(recording)
        assert recording.geometry["design"] == design
        assert recording.has("resistance_2") == (design != "pneuflex_w")
        assert recording.has("bend_direction") == (design == "triad")


# --- instruments and draws ----------------------------------------------------------------------------------


def test_noise_has_the_stated_size_and_memory():
    random, time = np.random.default_rng(0), np.arange(200_000) * 0.5
    for memory in (0.0, 1.5):
        noise = correlated(random, time, memory)
        expected = np.exp(-0.5 / memory) if memory else 0.0
        assert noise.std() == pytest.approx(1.0, abs=0.02)
        assert np.corrcoef(noise[1:], noise[:-1])[0, 1] == pytest.approx(expected, abs=0.02)
    ends = [random_walk(random, time[:100]) for _ in range(4000)]
    assert np.std([w[-1] for w in ends]) == pytest.approx(1.0, abs=0.05)
    assert np.std([w[50] for w in ends]) == pytest.approx(np.sqrt(0.5), abs=0.05)
    assert all(w[0] == 0.0 for w in ends)


def drawn(seed, **wishes):
    table = load_calibration("krl35")
    truth = Truth(Wishes(seed=seed, **wishes), {"G_m": 0.05, "G_a": 0.05, "a": 0.02})
    return truth.alloy(table, CONSTANTS, lambda values: True)


@pytest.mark.slow
def test_draws_within_tolerance_share_the_scatter_of_the_moduli():
    many = [drawn(seed) for seed in range(1500)]
    z = {k: np.array([m[k] / v - 1.0 for m in many]) / s for k, v, s in (("G_m", 3e9, 0.05), ("G_a", 8.25e9, 0.05), ("a", 7.8613, 0.02))}
    for series in z.values():
        assert series.mean() == pytest.approx(0.0, abs=0.1) and series.std() == pytest.approx(1.0, abs=0.07)
        assert np.abs(series).max() <= 4.0
    assert np.corrcoef(z["G_m"], z["G_a"])[0, 1] == pytest.approx(0.9, abs=0.02)
    assert np.corrcoef(z["G_m"], z["a"])[0, 1] == pytest.approx(0.0, abs=0.1)
    assert {m["beta_1"] for m in many} == {21.9987}


def test_draws_from_the_priors_stay_inside_them():
    table = load_calibration("krl35")
    many = [drawn(seed, spread="prior") for seed in range(200)]
    for name, quantity in table.quantities.items():
        series = np.array([m[name] for m in many if name in m])
        if quantity.prior is None or not series.size:
            continue
        assert series.min() >= quantity.prior.min and series.max() <= quantity.prior.max
        assert series.std() == pytest.approx(quantity.prior.sd, rel=0.15)


def test_truth_can_be_set_or_nominal():
    made = synthesise("spring", seed=1, truth={"G_m": 3.3, "T_width": 2.0}, interval_s=8.0, tests=1)
    assert made.truth["parameters"]["G_m"] == {"value": 3.3, "nominal": 3.0, "unit": "GPa"}
    assert made.truth["parameters"]["T_width"]["value"] == 2.0
    assert made.truth["parameters"]["a"]["value"] != 7.8613
    nominal = synthesise("spring", seed=1, spread="none", interval_s=8.0, tests=1)
    assert all(p["value"] == p["nominal"] for p in nominal.truth["parameters"].values())
    new = synthesise("spring", seed=1, spread="prior", interval_s=8.0, tests=1)
    assert new.recordings[0].geometry["alloy"] == "fit" and new.recordings[0].tolerance == {}
    assert new.truth["alloy"] == "new_nitinol" and new.truth["parameters"]["beta_1"]["value"] != 20.5


def test_impossible_alloys_are_drawn_again_and_given_up_in_words():
    for seed in range(4):
        made = synthesise("wire", seed=seed, tolerance={"beta_1": 0.1}, tests=1, interval_s=20.0)
        strain = np.linspace(0.0, 0.1, 400)
        assert np.all(np.diff(true_alloy(made.truth, WireAlloy).axial_stress(jnp.asarray(strain), 1.0, 0.0)) > 0.0)
    with pytest.raises(InputError, match="stress that rises with strain"):
        synthesise("wire", truth={"beta_1": 150.0})


def test_a_blind_campaign_tells_nothing(tmp_path):
    made = synthesise("wire", seed=77123, reveal=False, tests=1, interval_s=20.0)
    files = write_synthetic(made, tmp_path / "blind", reveal=False)
    assert "truth.json" not in {p.name for p in files}
    assert not any(b"77123" in p.read_bytes() for p in files)


@pytest.mark.parametrize(
    ("kind", "wishes", "what"),
    [
        ("coil", {}, "no campaign of kind 'coil'"),
        ("spring", {"truth": {"Gm": 3.0}}, "did you mean 'G_m'"),
        ("tube", {"truth": {"silicone_stiffness": 1e-4}}, "cannot balance 20 kPa"),
        ("tube", {"truth": {"wall_thickness": 1.0}}, "did you mean 'wall_thickness_mm'"),
        ("elastomer", {"truth": {"mu": 1.0}}, "no such number"),
        ("spring", {"tolerance": {"g_m": 0.1}}, "no such parameter"),
        ("spring", {"noise": {"force": 0.1}}, "did you mean 'force_N'"),
        ("spring", {"noise": {"force_N": 0.0}}, "an output needs noise"),
        ("spring", {"noise": {"time_s": 0.1}}, "here noise can be given to force_N, resistance_ohm"),
        ("spring", {"tests": 0}, "must be 1 to 30"),
        ("tube", {"interval_s": -1.0}, "more than 0"),
        ("tube", {"ambient_degC": 5.0}, "only for spring, actuator"),
        ("elastomer", {"interval_s": 5.0}, "--interval means nothing for kind elastomer"),
        ("spring", {"spread": "wide"}, "no such spread"),
        ("spring", {"alloy": "niti_wire"}, "an alloy of straight wires, but one of springs is needed here"),
        ("wire", {"alloy": "krl35"}, "an alloy of springs, but one of straight wires is needed here"),
        ("actuator", {"design": "pneusma3"}, "pneusma2"),
        ("tube", {"drift": float("nan")}, "must be 0 or more"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(kind, wishes, what):
    with pytest.raises(InputError, match=what) as error:
        synthesise(kind, **wishes)
    assert "\n" not in str(error.value)


def test_a_folder_with_other_files_is_not_touched(tmp_path):
    made = synthesise("tube", tests=1)
    (tmp_path / "mine.csv").write_text("1")
    with pytest.raises(InputError, match="mine.csv is here already, and is not of this run"):
        write_synthetic(made, tmp_path)
    with pytest.raises(InputError, match="mine.csv is of another campaign"):
        write_synthetic(made, tmp_path, force=True)
    assert [p.name for p in tmp_path.iterdir()] == ["mine.csv"]
