"""Slack and the load cell's zero as nuisance numbers of a fit: `[zero]` of a sidecar, `--slack fit` of an import."""

import numpy as np
import pytest

from fitting.calibrate.elastomer.engine import Engine
from fitting.calibrate.elastomer.laws import LAWS
from fitting.calibrate.elastomer.pipeline import characterise_elastomer
from fitting.calibrate.elastomer.samples import stack
from fitting.data.importers import import_file, make_options
from fitting.data.recordings import Campaign, Recording, read_campaign, read_recording, write_recording
from fitting.inference.parameters import Prior
from fitting.sample.elastomer import problem_of
from fitting.specimens import COUPON
from fitting.specimens.zeros import offered, zeros_of
from pneusma_jax.errors import InputError

MU = 120.0
ASKED = {"strain": 0.05, "stress_kPa": 5.0}


def neo_hookean(strain):
    return MU * (1.0 + strain - (1.0 + strain) ** -2)


def read_off(slack, zero, seed, *, pressed=False, rows=80, noise=0.2):
    """Strain and stress as an instrument reads them of a specimen that hangs slack, or is not touched yet."""
    read = np.linspace(0.0, -0.5 if pressed else 1.0, rows)
    taut = (read - slack) / (1.0 + slack)
    taut = np.minimum(taut, 0.0) if pressed else np.maximum(taut, 0.0)
    return read, neo_hookean(taut) + zero + noise * np.random.default_rng(seed).standard_normal(rows)


def coupon(strain, stress, zero=ASKED, name="r", specimen="a"):
    columns = {"strain": strain, "stress_kPa": stress}
    return Recording(name, None, "elastomer", specimen=specimen, columns=columns, zero=dict(zero))


def fitted(recordings, law="neo_hookean"):
    samples = stack(recordings)
    fit = Engine(samples).fit(LAWS[law], samples.fitted, errors=True)
    return fit, {(samples.curves[zero.curve].name, zero.quantity): of for zero, of in fit.zeros.items()}


@pytest.mark.parametrize("pressed", [False, True])
def test_intervals_of_modulus_and_zeros_hold_over_fifty_seeds(pressed):
    """Slack, or a preload (counted from a strained state), and a zero, drawn from their priors."""
    pulls = []
    for seed in range(50):
        rng = np.random.default_rng([1, seed])
        slack, zero = rng.normal(0.0, 0.03), rng.normal(0.0, 4.0)
        fit, zeros = fitted([coupon(*read_off(slack, zero, seed, pressed=pressed))])
        (strain, strain_sd), (stress, stress_sd) = zeros["r", "strain"], zeros["r", "stress"]
        pulls.append([
            (fit.values[0] - 1e3 * MU) / fit.sd[0], (strain - slack) / strain_sd, (stress - 1e3 * zero) / stress_sd
        ])  # fmt: skip
    share = np.mean(np.abs(pulls) < 1.96, axis=0)
    assert np.all(share >= 0.88)  # of 50 at 0.95, fewer come once in 30
    assert np.std(pulls, axis=0) == pytest.approx(1.0, rel=0.35)


def test_without_zeros_the_same_numbers_give_a_wrong_modulus():
    strain, stress = read_off(0.05, 4.0, 1)
    wrong, none = fitted([coupon(strain, stress, {})])
    right, _ = fitted([coupon(strain, stress)])
    assert none == {} and abs(wrong.values[0] / 1e3 - MU) > 1.0 > abs(right.values[0] / 1e3 - MU) / 0.3


def test_fits_offer_to_find_them_where_slack_is_seen():
    slack, none = coupon(*read_off(0.05, 4.0, 1), {}), coupon(*read_off(0.0, 4.0, 2), {}, "s")
    (notice,) = (text for text in stack([slack, none]).notices if "[zero]" in text)
    assert notice.startswith("r: stress is flat at 4") and "(strain = 0.099, stress_kPa = 8)" in notice
    assert offered([coupon(*read_off(0.05, 4.0, 1))]) == []  # it was taken up


def test_each_recording_has_zeros_of_its_own_and_those_that_ask_for_none_have_none():
    first, second = read_off(0.04, -3.0, 1), read_off(0.0, 2.5, 2)
    recordings = [coupon(*first, name="one"), coupon(*second, {"stress_kPa": 4.0}, name="two")]
    recordings.append(coupon(*read_off(0.0, 0.0, 3), {}, name="three"))
    fit, zeros = fitted(recordings)
    assert set(zeros) == {("one", "strain"), ("one", "stress"), ("two", "stress")}
    assert zeros["one", "strain"][0] == pytest.approx(0.04, abs=0.003)
    assert zeros["two", "stress"][0] == pytest.approx(2500.0, abs=150.0)
    left = fit.predict(stack(recordings)) - stack(recordings).stress
    assert np.std(left) == pytest.approx(200.0, rel=0.2)


def test_a_law_with_more_constants_finds_them_too():
    fit, zeros = fitted([coupon(*read_off(0.05, 4.0, 5, rows=200))], "yeoh")
    assert fit.shear_modulus()[0] / 1e3 == pytest.approx(MU, rel=0.02)
    assert zeros["r", "strain"][0] == pytest.approx(0.05, abs=0.002)


def test_a_posterior_has_them_too(tmp_path):
    recording = coupon(*read_off(0.05, 4.0, 1))
    result = characterise_elastomer(Campaign("c", [recording], tmp_path), law="neo_hookean")
    problem = problem_of(result)
    values = {name: float(result.best.result.values[name]) for name in ("mu", "strain_zero_1", "stress_zero_1")}
    assert set(problem.parameters) == set(values) and problem.parameters["strain_zero_1"].prior is not None
    predicted = np.asarray(problem.predict(values, problem.data))
    assert predicted == pytest.approx(result.best.predict(result.samples) / 1e3, abs=1e-6)
    assert np.std(predicted - problem.data["stress"] / 1e3) == pytest.approx(0.2, rel=0.25)


def test_diagnosis_has_them_in_its_base_model(tmp_path):
    recordings = [coupon(*read_off(0.05, 4.0, 1), specimen="a"), coupon(*read_off(0.0, 0.0, 2), {}, "s", "b")]
    for recording in recordings:
        recording.noise, recording.geometry = {"stress_kPa": 0.2}, {"material": "dragon_skin_10_fast", "law": "neo_hookean"}
    campaign = Campaign("c", recordings, tmp_path)
    parameters = COUPON.parameters_for(campaign)
    assert parameters["strain_zero__1"].prior == Prior(0.0, 0.05, -0.2, 0.2) and "strain_zero__2" not in parameters
    assert parameters["strain_zero__1"].value == pytest.approx(0.05, abs=0.01)  # the slack that is seen
    rows = COUPON.rows_for(campaign)
    mu = float(rows[0].base["mu"]) / 1e3
    values = {"strain_zero__1": 0.05, "stress_zero__1": 4e3, "silicone_stiffness": MU / mu}
    for one in rows:
        assert np.sqrt(np.mean(np.asarray(COUPON.residual(values, one)) ** 2)) == pytest.approx(1.0, abs=0.3)
    without = COUPON.residual({"silicone_stiffness": MU / mu}, rows[0])
    assert np.sqrt(np.mean(np.asarray(without) ** 2)) > 20.0


def test_a_sidecar_states_them_in_any_unit_and_a_campaign_for_all(tmp_path):
    path = write_recording(coupon(*read_off(0.05, 4.0, 1), {"stress_kPa": 3.0}), tmp_path)
    assert read_recording(path).zero == {"stress_kPa": 3.0}
    (tmp_path / "campaign.toml").write_text("[zero]\nstrain_percent = 2\nstress_Pa = 900\n")
    (recording,) = read_campaign(tmp_path).recordings
    assert recording.zero == {"strain": pytest.approx(0.02), "stress_kPa": 3.0}
    assert zeros_of(recording).sd == {"strain": pytest.approx(0.02), "stress": pytest.approx(3000.0)}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("stress_kPa = 0", "must be more than 0"),
        ("stress_kPa = -1", "must be more than 0"),
        ('stress_kPa = "a"', "must be a finite number"),
        ("strss_kPa = 1", "did you mean 'stress_kPa'"),
        ("time_s = 1", "unknown column 'time_s' in"),
        ("strain = 0.1\nstrain_percent = 10", "twice"),
    ],
)
def test_a_zero_that_cannot_be_is_refused(tmp_path, table, said):
    path = write_recording(coupon(*read_off(0.0, 0.0, 1), {}), tmp_path)
    beside = path.with_suffix(".toml")
    beside.write_text(beside.read_text() + f"\n[zero]\n{table}\n")
    with pytest.raises(InputError, match=said) as error:
        read_recording(path)
    assert str(beside) in str(error.value) and "[zero]" in str(error.value)


def test_a_kind_whose_fits_find_no_zeros_says_so(tmp_path):
    (tmp_path / "t.csv").write_text("time_s,pressure_kPa,length_mm\n" + "".join(f"{k},{k},{50 + k}\n" for k in range(20)))
    (tmp_path / "t.toml").write_text('kind = "tube"\n[zero]\nlength_mm = 1\n')
    with pytest.raises(InputError, match=r"\[zero\] is for recordings of kind elastomer; of kind tube"):
        read_recording(tmp_path / "t.csv")


def test_an_import_leaves_them_to_the_fits(tmp_path):
    strain, stress = read_off(0.05, 4.0, 1, rows=200)
    raw = tmp_path / "a.csv"
    raw.write_text("Strain (-),Stress (kPa)\n" + "".join(f"{e:.5f},{s:.3f}\n" for e, s in zip(strain, stress, strict=True)))
    offered = import_file(raw)
    assert any("--slack fit leaves both to the fits" in note for note in offered.notices) and offered.zero == {}
    recording = import_file(raw, make_options(slack="fit"))
    assert recording.zero["strain"] == pytest.approx(0.1, rel=0.1) and recording.zero["stress_kPa"] == pytest.approx(8.0, rel=0.1)
    assert len(recording) == 200 and any("both zeros are left to every fit" in note for note in recording.notices)
    again = read_recording(write_recording(recording, tmp_path / "out"))
    fit, _ = fitted([again])
    assert fit.values[0] / 1e3 == pytest.approx(MU, rel=0.003)


@pytest.mark.parametrize("law", ["yeoh", pytest.param("all", marks=pytest.mark.slow)])
def test_exact_curves_of_three_specimens_are_fitted_although_nothing_tells_their_factors(law):
    """Numbers without noise leave no covariance of the factors, which once was a singular matrix."""
    strain = np.linspace(0.0, 0.8, 33)
    pulls = [(1.0, "a"), (1.2, "b"), (1.1, "c")]
    recordings = [coupon(strain, f * neo_hookean(strain), {}, name, name) for f, name in pulls]
    result = characterise_elastomer(Campaign("exact", recordings, None), law=law)
    assert all(np.isfinite(fit.values).all() for fit in result.whole.fits.values())
