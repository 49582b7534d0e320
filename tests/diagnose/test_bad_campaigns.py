"""Campaigns that are bad or contradict themselves: a plain sentence each, as a user of the command meets it."""

import html
import json
import shutil

import numpy as np
import pytest
from click.testing import CliRunner
from diagnosis_coupons import NOISE, SIDECAR, course, curve, put, softened, write
from linear_world import CONSTANT, tubes

from fitting.cli import main
from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose as compared
from fitting.diagnose.check import checked
from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict.conclude import conclude
from fitting.diagnose.verdict.text import unstated
from pneusma_jax.errors import InputError


def diagnose(campaign, out, *more):
    return CliRunner().invoke(main, ["diagnose", str(campaign), "--out", str(out), *more])


def refusal(campaign, tmp_path, *more):
    """The one line of what must be refused; nothing is written."""
    run = diagnose(campaign, tmp_path / "out", *more)
    assert run.exit_code == 2, run.output
    lines = run.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("pneusma: ") and run.stdout == ""
    assert not (tmp_path / "out").exists()
    return lines[0]


@pytest.fixture
def pulled():
    strain = course([0.5, 0.5, 0.8])
    return strain, curve(strain) + NOISE * np.random.default_rng(5).standard_normal(strain.size)


def test_nothing_drives_the_model(tmp_path):
    """The machine stood still; only the load cell's noise moves."""
    rng, strain = np.random.default_rng(2), np.full(60, 0.3)
    for name in ("one", "two"):
        put(tmp_path / "still", name, strain + 1e-5 * rng.standard_normal(60), 30.0 + NOISE * rng.standard_normal(60))
    said = refusal(tmp_path / "still", tmp_path)
    assert "nothing that drives the model (strain) varies in the recordings to fit, nor between them" in said
    assert "record at least two levels" in said


def test_an_output_without_a_value(tmp_path, pulled):
    strain, stress = pulled
    said = refusal(put(tmp_path / "gone", "pull", strain, np.full(stress.shape, np.nan)), tmp_path)
    assert "pull.csv" in said and "stress_kPa" in said and "no row has a value here" in said


def test_outputs_only_where_nothing_drives(tmp_path, pulled):
    strain, stress = (x.copy() for x in pulled)
    strain[40:], stress[:40] = np.nan, np.nan
    said = refusal(put(tmp_path / "torn", "pull", strain, stress), tmp_path)
    assert "pull.csv" in said and "no row has both stress and strain" in said


def test_an_instrument_that_was_not_connected(tmp_path, pulled):
    strain, _ = pulled
    quiet = SIDECAR.format(role="fit", noise=NOISE).replace(f"[noise]\nstress_kPa = {NOISE}\n", "")
    said = refusal(put(tmp_path / "loose", "pull", strain, np.full(strain.shape, 0.5), quiet), tmp_path)
    assert "column 'stress_kPa': 0.5 in every row" in said and "not connected" in said


def test_one_specimen_that_is_stated_as_two(tmp_path):
    sidecar = 'kind = "tube"\nreal = false\nspecimen = "T"\n[geometry]\nwall_thickness_mm = {wall}\n'
    pressure = np.linspace(0.0, 20.0, 30)
    folder = tmp_path / "tubes"
    folder.mkdir()
    for name, wall in (("a", 1.0), ("b", 1.4)):
        rows = (f"{t:.1f},{p:.3f},{56.0 + 0.2 * p:.4f}" for t, p in enumerate(pressure))
        (folder / f"{name}.csv").write_text("\n".join(["time_s,pressure_kPa,length_mm", *rows]) + "\n")
        (folder / f"{name}.toml").write_text(sidecar.format(wall=wall))
    said = refusal(folder, tmp_path)
    assert "b.csv: wall_thickness_mm is 1.4 here but 1.0 in" in said and "specimen 'T'" in said


def test_kinds_together(tmp_path, pulled):
    folder = put(tmp_path / "both", "pull", *pulled)
    (folder / "tube.csv").write_text("time_s,pressure_kPa,length_mm\n0,0,56\n1,5,57\n2,10,58\n")
    (folder / "tube.toml").write_text('kind = "tube"\nreal = false\nspecimen = "T"\n')
    said = refusal(folder, tmp_path)
    assert "recordings of kinds elastomer, tube lie here together" in said


def test_nothing_to_fit(tmp_path, pulled):
    folder = put(tmp_path / "judged", "pull", *pulled, SIDECAR.format(role="validation", noise=NOISE))
    assert 'every recording has role = "validation"' in refusal(folder, tmp_path)


def test_too_few_values(tmp_path, pulled):
    strain, stress = (x[::8] for x in pulled)
    assert "12 values to fit are too few to diagnose; 20 are needed" in refusal(
        put(tmp_path / "few", "pull", strain, stress), tmp_path
    )


def test_too_few_values_are_refused_before_a_law_is_fitted(tmp_path, pulled):
    strain, stress = (x[::8] for x in pulled)
    sidecar = SIDECAR.format(role="fit", noise=NOISE) + '[geometry]\nmaterial = "fit"\n'
    campaign, said = read_campaign(put(tmp_path / "few", "pull", strain, stress, sidecar)), []
    with pytest.raises(InputError, match="12 values to fit are too few"):
        compared(campaign, progress=said.append)
    assert said == []


@pytest.mark.parametrize(
    ("slug", "says"),
    [
        ("tip_contact", "cannot be tested with recordings of kind elastomer; it shows in: actuator"),
        ("mulins_softening", "did you mean 'mullins_softening'?"),
    ],
)
def test_an_effect_that_such_recordings_never_show(soft_campaign, slug, says, tmp_path):
    assert says in refusal(soft_campaign, tmp_path, "--effect", slug)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """One recording again, a fifth stiffer, under the same specimen's name; and one that was held still."""
    folder = write(tmp_path_factory.mktemp("mixed") / "campaign", lambda e: softened(e, 0.15))
    head, *rows = (folder / "pull_1.csv").read_text().splitlines()
    parts = [row.split(",") for row in rows]
    text = "\n".join([head, *(f"{t},{e},{1.2 * float(s):.5f}" for t, e, s in parts)])
    (folder / "pull_5.csv").write_text(text + "\n")
    shutil.copy(folder / "pull_1.toml", folder / "pull_5.toml")
    rng = np.random.default_rng(4)
    put(folder, "held", np.full(60, 0.2), curve(np.full(60, 0.2)) + NOISE * rng.standard_normal(60))
    return folder


def test_specimens_that_were_mixed_are_said(mixed):
    still, contradiction = checked(read_campaign(mixed))
    assert still.startswith("held: nothing that drives the model (strain) varies here")
    assert contradiction.startswith("pull_1 and pull_5 contradict each other: stress_kPa differs by up to 2")
    assert "times their noise) under the same input; both of specimen 'E'" in contradiction


@pytest.mark.slow
def test_specimens_that_were_mixed_are_told_from_each_other(mixed, tmp_path):
    run = diagnose(mixed, tmp_path / "out", "--effect", "mullins_softening")
    assert run.exit_code == 0, run.output
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    still, contradiction = report["notes"]
    assert still.startswith("held: nothing that drives the model (strain) varies here")
    assert contradiction.startswith("pull_1 and pull_5 contradict each other: stress_kPa differs by up to 2")
    assert "times their noise) under the same input; both of specimen 'E'" in contradiction
    for note in report["notes"]:
        assert f"note: {note}" in run.stderr
        assert note in html.unescape((tmp_path / "out" / "report.html").read_text())
    named = [e for e in report["effects"] if e["name"] != "unmodelled"]
    assert all(e["probability"] < 0.8 for e in named)
    assert report["asked"][0]["testable"] and "mullins_softening was" in run.stdout


def test_two_hot_springs_of_one_resistance_need_not_contradict_each_other(tmp_path):
    """From 0.3 to 0.05 of martensite a resistance changes by less than its noise, and the force by a quarter."""
    sides = 'kind = "spring"\nspecimen = "S"\nreal = false\n[noise]\nforce_N = 0.004\nresistance_ohm = 0.0002\n'
    pull = np.concatenate([np.linspace(0.0, 40.0, 60), np.linspace(40.0, 5.0, 50)])
    for name, stiffness in (("warm", 0.03), ("hot", 0.04)):
        table = np.stack([np.arange(110.0), pull, stiffness * pull, 3.25 + 2e-3 * pull], axis=1)
        header = "time_s,elongation_mm,force_N,resistance_ohm"
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header=header, comments="", fmt="%.6g")
        (tmp_path / f"{name}.toml").write_text(sides)
    (said,) = checked(read_campaign(tmp_path))
    assert "hot and warm contradict each other: force_N differs by up to 0.4 N" in said
    assert said.endswith("Or one was hotter: near full heat a resistance hardly tells how hot a wire is")
    assert "No one model" not in said


def test_repeats_and_other_courses_are_no_contradiction(soft_campaign):
    campaign = read_campaign(soft_campaign)
    again = next(r for r in read_campaign(soft_campaign).recordings if r.name == "pull_2")
    rng = np.random.default_rng(8)
    again.columns["stress_kPa"] = again.columns["stress_kPa"] + NOISE * rng.standard_normal(len(again))
    campaign.recordings.append(again)
    assert checked(campaign) == []


def test_an_effect_that_these_recordings_do_not_show(tmp_path):
    """On first loading nothing has softened yet."""
    rng = np.random.default_rng(6)
    for k, most in enumerate((0.4, 0.6, 0.8), 1):
        strain = np.linspace(0.0, most, 90)
        put(tmp_path / "up", f"pull_{k}", strain, 1.02 * curve(strain) + NOISE * rng.standard_normal(90))
    run = diagnose(tmp_path / "up", tmp_path / "out", "--effect", "mullins_softening", "--seed", "1")
    assert run.exit_code == 0, run.output
    assert "mullins_softening cannot be tested with these recordings" in run.stdout
    assert "To test it: exceed the previous largest strain once" in run.stdout
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert not report["asked"][0]["testable"] and "mullins_softening" in report["not_testable_here"]
    assert "--effect mullins_softening" in (tmp_path / "out" / "report.html").read_text()


def test_recordings_that_say_nothing_of_their_specimen_are_not_blamed_on_physics_alone():
    rng, world = np.random.default_rng(3), tubes()
    conclusion = conclude(explain(world.program(world.truth(rng, **{CONSTANT: 2.0})), rng))
    recordings = conclusion.explanation.program.recordings
    for recording in recordings[1:]:
        recording.geometry["length_mm"] = 50.0
    assert unstated(conclusion) == ["r0"]
    conclusion.mismatch = False
    assert unstated(conclusion) == []
