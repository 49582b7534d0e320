"""What recordings are compared with: tables that are named, a law that is fitted first, what `characterise` found."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from diagnosis_coupons import NOISE, course, softened, write

from fitting.calibrate import registry
from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.check import with_tables
from fitting.diagnose.evaluate import start
from fitting.diagnose.evaluate.base_tables import base_tables
from fitting.diagnose.evaluate.start import begun_at, characterised, start_of
from fitting.diagnose.fit import base_fit
from fitting.diagnose.run import _made_once
from fitting.specimens.priors import identifies
from fitting.specimens.saved_models import load_model
from pneusma_jax.errors import InputError
from pneusma_jax.silicone import load_silicone


def stiff(strain):
    """A silicone that is none of the source's, kPa: Gent's law, locking near a strain of two."""
    stretch = 1.0 + strain
    first = stretch**2 + 2.0 / stretch
    return 400.0 * (stretch - stretch**-2) * 6.0 / (6.0 - (first - 3.0))


def unknown(folder, law):
    """Coupons of it that say `material = "fit"`."""
    write(folder, law)
    for path in folder.glob("*.toml"):
        text = path.read_text().replace("[tolerance]\nsilicone_stiffness = 0.05\n", '[geometry]\nmaterial = "fit"\n')
        path.write_text(text)
    return folder


@pytest.fixture(scope="module")
def coupons(tmp_path_factory):
    return unknown(tmp_path_factory.mktemp("unknown") / "coupons", stiff)


@pytest.fixture(scope="module")
def begun(coupons):
    return start_of(read_campaign(coupons), "elastomer")


@pytest.mark.slow
def test_an_unknown_silicone_is_compared_with_a_law_that_was_fitted_to_it(coupons, begun, monkeypatch, tmp_path):
    """Five times as stiff as the source's, of another shape: no effect is missing, and none is named."""
    monkeypatch.setattr("fitting.diagnose.run.start_of", lambda *anything: begun)  # once for all tests here
    run = CliRunner().invoke(main, ["diagnose", str(coupons), "--out", str(tmp_path / "out"), "--seed", "1"])
    assert run.exit_code == 0, run.output
    first = run.stdout.splitlines()[0]
    assert "agree with the base model (a law fitted to these recordings: " in first, run.stdout
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Does the base model (a law fitted to these recordings: " in page
    law = load_silicone(tmp_path / "out" / "material.toml")
    strain = course([0.8])
    np.testing.assert_allclose(np.asarray(law(strain)) / 1e3, stiff(strain), atol=4.0 * NOISE)
    assert load_model(tmp_path / "out" / "augmented.toml").tables["material"].endswith("material.toml")


def test_a_law_that_was_fitted_is_as_open_as_one_that_nobody_knows(coupons, monkeypatch):
    monkeypatch.setattr(start, "characterise", lambda campaign: characterise(campaign, law="yeoh"))
    found = start_of(read_campaign(coupons), "elastomer")
    assert found.words == "a law fitted to these recordings: Yeoh" and not found.notes
    table = found.tables["material"]
    constants = [q for name, q in table.quantities.items() if name not in ("strain_min", "strain_max", "silicone_stiffness")]
    assert constants and all(q.prior.sd == pytest.approx(0.4 * abs(q.value)) for q in constants)


@pytest.mark.slow
def test_a_specimen_that_is_only_predicted_is_as_stiff_as_the_fitted_one(tmp_path):
    """With a factor of its own beside the law's, the fitted one took the stiffness: 60 times the noise were left here."""
    folder = unknown(tmp_path / "two", lambda strain: softened(strain, 0.25))
    sidecar = folder / "pull_4.toml"
    sidecar.write_text(sidecar.read_text().replace('specimen = "E"', 'specimen = "F"'))
    found = diagnose(read_campaign(folder), seed=1)
    assert found.found[0].slug == "mullins_softening" and found.before.how == "validation"
    assert found.before.reduced_chi2 > 20.0 and found.after.reduced_chi2 < 3.0


@pytest.mark.parametrize(("specimens", "free"), [(1, set()), (2, {"silicone_stiffness__2"}), (3, {"silicone_stiffness__2", "silicone_stiffness__3"})])
def test_a_fitted_law_is_of_the_first_coupon_and_others_differ_by_a_factor(coupons, monkeypatch, specimens, free):
    """The moduli are as open as the factor on the stress."""
    monkeypatch.setattr(start, "characterise", lambda campaign: characterise(campaign, law="yeoh"))
    campaign = read_campaign(coupons)
    recordings = [replace(r, specimen=f"E{k % specimens}") for k, r in enumerate(campaign.recordings)]
    campaign = replace(campaign, recordings=recordings)
    programs = []

    def refuse(program, *more):
        programs.append(program)
        raise InputError("built")

    monkeypatch.setattr("fitting.diagnose.run._with_turning_points", refuse)
    monkeypatch.setattr("fitting.diagnose.evaluate.program.candidates", lambda kind: ["mullins_softening"])  # compiles sooner
    with pytest.raises(InputError, match="built"):
        diagnose(campaign)
    items = {item.name: item for item in programs[0].unknowns.items if not item.effect}
    assert {"c_10", "c_20", "c_30"} <= set(items)
    assert {name for name in items if name.startswith("silicone_stiffness")} == free


def test_a_law_that_cannot_be_fitted_leaves_the_sources(coupons, monkeypatch):
    def refuse(campaign):
        raise InputError("too few samples")

    monkeypatch.setattr(start, "characterise", refuse)
    found = start_of(read_campaign(coupons), "elastomer")
    assert not found.tables and "source's silicone" in found.words and "too few samples" in found.notes[0]


def test_a_table_on_the_command_line_takes_the_place_of_what_recordings_name(coupons):
    campaign = read_campaign(coupons)
    assert identifies(campaign.recordings, ["material"])
    named = with_tables(campaign, {"material": "dragon_skin_10_fast"})
    assert not identifies(named.recordings, ["material"]) and identifies(campaign.recordings, ["material"])
    assert start_of(named, "elastomer").words == "the published model with dragon_skin_10_fast"
    assert with_tables(campaign, {}) is campaign


@pytest.mark.parametrize(("option", "named"), [("--alloy", "krl35"), ("--material", "no_such_silicone")])
def test_a_table_that_means_nothing_here_is_refused_in_one_line(coupons, tmp_path, option, named):
    run = CliRunner().invoke(main, ["diagnose", str(coupons), "--out", str(tmp_path / "out"), option, named])
    assert run.exit_code == 2 and not (tmp_path / "out").exists()
    said = "alloy means nothing for recordings of kind elastomer" if option == "--alloy" else named
    assert said in run.output and len(run.output.strip().splitlines()) == 1


def test_what_characterise_found_is_a_start_of_the_base_model(monkeypatch):
    """In scaled numbers, within bounds; nothing where all is known."""
    items = [
        SimpleNamespace(name="T_mid", scaled=lambda x: (x - 45.0) / 25.0),
        SimpleNamespace(name="E_m", scaled=lambda x: (x - 30e9) / 7e9),
        SimpleNamespace(name="unheard_of", scaled=None),
    ]
    unknowns = SimpleNamespace(base=np.arange(3), items=items, neutral=np.zeros(3), low=np.full(3, -4.0), high=np.full(3, 4.0))
    estimates = {"T_mid": SimpleNamespace(value=95.0, unit="degC"), "E_m": SimpleNamespace(value=100.0, unit="GPa")}
    fitted = lambda *a, progress, **k: progress("stage 1 of 2") or SimpleNamespace(parameters=estimates)  # noqa: E731
    monkeypatch.setattr(start, "characterise_general", fitted)
    wire = lambda alloy: SimpleNamespace(recordings=[SimpleNamespace(full_geometry=lambda: {"alloy": alloy})])  # noqa: E731
    said: list[str] = []
    (known,) = characterised(wire("fit"), "wire", said.append)
    assert said == ["characterising", "characterising, stage 1 of 2"]
    u = begun_at(known, unknowns)
    np.testing.assert_allclose(u, [2.0, 4.0, 0.0])
    unknowns.items[0] = SimpleNamespace(name="T_mid", scaled=lambda x: (x - 70.0) / 25.0)  # another program's
    other = begun_at(known, unknowns)
    np.testing.assert_allclose(other, [1.0, 4.0, 0.0])
    assert not list(characterised(wire("niti_wire"), "wire", lambda word: None))


def test_a_diagnosis_of_a_spring_takes_constants_one_fit_after_the_other(monkeypatch):
    """All starts were fitted, with zeros and the next test, before any other start of the base fit was tried."""

    def refused(*anything, **more):
        raise AssertionError("a whole characterisation was asked for")

    def fits(campaign, progress):
        for k in (1, 2):
            progress(f"fit {k}")
            yield {"G_m": float(k)}

    monkeypatch.setattr(start, "characterise", refused)
    monkeypatch.setattr(registry, "values_found", fits)
    said: list[str] = []
    campaign = read_campaign(EXAMPLES / "spring")
    unknown = replace(campaign, recordings=[replace(r, geometry={**r.geometry, "alloy": "fit"}) for r in campaign.recordings])
    again = _made_once(characterised(unknown, "spring", said.append))
    assert said == []
    assert next(again()) == {"G_m": 1.0} and said == ["characterising", "characterising, fit 1"]
    assert list(again()) == [{"G_m": 1.0}, {"G_m": 2.0}] == list(again())
    assert said == ["characterising", "characterising, fit 1", "characterising, fit 2"]


@pytest.mark.parametrize(
    ("objectives", "asked", "best"),
    [((99.0, 10.0), 1, 99.0), ((50.0, 49.5, 1.0), 2, 49.5), ((50.0, 40.0), 2, 40.0), ((9.0, 1.0), 1, 9.0)],
)
def test_further_starts_end_with_the_first_that_is_no_better_or_leaves_little(objectives, asked, best, monkeypatch):
    """The fits of all starts of `characterise` took 83 s in a misfit, and ended higher than a start of 0.7 s."""
    monkeypatch.setattr(base_fit, "inflation_of", lambda program, fit: 1.0)
    monkeypatch.setattr(base_fit, "_doubtful", lambda program, fit: fit.objective > 10.0)
    taken = []

    class Refitting:
        def fit(self, slugs, u, complete):
            taken.append(u)
            return SimpleNamespace(objective=objectives[u])

    program = SimpleNamespace(fitted=np.ones(1, bool))
    found = base_fit._from_further(program, Refitting(), SimpleNamespace(objective=100.0), lambda _: range(len(objectives)))
    assert (len(taken), found.objective) == (asked, best)


EXAMPLES = Path(__file__).parents[2] / "calibration_data" / "examples"


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("spring", ["krl35"]), ("wire", ["niti_wire"]), ("tube", ["dragon_skin_10_fast"]),
        ("actuator", ["krl35", "dragon_skin_10_fast"]),
    ],
)  # fmt: skip
def test_the_base_model_names_its_tables_and_their_source(kind, names):
    campaign = read_campaign(EXAMPLES / kind)
    found = base_tables(campaign, kind)
    assert [one.name for one in found] == names and all(one.stated for one in found)
    assert all(one.text.endswith(", as stated.") for one in found if not one.identified)
    assert "(E. A. Allen, " in found[0].text or kind == "wire"


def test_an_assumed_alloy_is_said_to_be_assumed():
    """A diagnosis did not name the alloy that it took for one that nobody stated."""
    campaign = read_campaign(EXAMPLES / "spring")
    silent = [{k: v for k, v in r.geometry.items() if k != "alloy"} for r in campaign.recordings]
    recordings = [replace(r, geometry=g) for r, g in zip(campaign.recordings, silent, strict=True)]
    (table,) = base_tables(replace(campaign, recordings=recordings), "spring")
    assert not table.stated and "krl35" in table.text and "No recording states its alloy" in table.text


def test_an_alloy_to_be_identified_begins_at_a_named_table(coupons):
    campaign = read_campaign(EXAMPLES / "spring")
    recordings = [replace(r, geometry={**r.geometry, "alloy": "fit"}) for r in campaign.recordings]
    (table,) = base_tables(replace(campaign, recordings=recordings), "spring")
    assert table.identified and "begins at the table new_nitinol" in table.text
    assert base_tables(read_campaign(coupons), "elastomer", {"material": None}) == ()


def test_an_actuator_whose_alloy_is_to_be_identified_is_not_called_published():
    """`Specimen.identified` was empty for it. Its report named a table, and the model of a table's name."""
    campaign = read_campaign(EXAMPLES / "actuator")
    recordings = [replace(r, geometry={**r.geometry, "alloy": "fit"}) for r in campaign.recordings]
    begun = start_of(replace(campaign, recordings=recordings), "actuator")
    assert begun.words == "the published model, its alloy identified from these recordings"
    assert not list(characterised(replace(campaign, recordings=recordings), "actuator", lambda _: None))
