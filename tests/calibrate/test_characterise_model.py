"""`--model`: numbers and effects of a model on disk are fitted, reported, saved and sampled like any other."""

import dataclasses
import json
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fitting.calibrate.general.fit import GeneralFit, fit_campaign, inflated
from fitting.calibrate.general.information import informed
from fitting.calibrate.general.with_model import characterise_with
from fitting.calibrate.open_constants import open_constants
from fitting.characterise import characterise
from fitting.cli import main
from fitting.data.recordings import Campaign, Recording, read_campaign, write_recording
from fitting.report.general import text
from fitting.report.general.text import about_the_model, verdict, warnings
from fitting.sample.problems import sampling_problem
from fitting.specimens import residual_of, specimen_of, stack
from fitting.specimens.saved_model_notes import absent_effects, notes_on
from fitting.specimens.saved_models import (
    DIAGNOSIS,
    AddedDiscrepancy,
    AugmentedModel,
    add_effect,
    fitted,
    load_model,
    save_model,
)
from fitting.specimens.with_saved_model import Augmented
from fitting.synthesise import synthesise
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.errors import InputError
from pneusma_jax.silicone import load_silicone
from pneusma_jax.simulate.coupon import simulate_coupon

SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"
NOISE = 0.25e3  # Pa
DEPTH, SCALE, FACTOR = 0.25, 0.4, 1.03


def typical(slug, **numbers):
    effect = CATALOGUE[slug]
    return effect(**{name: spec.typical for name, spec in effect.specs.items()} | numbers)


def softening(source="guessed", sd=None, **numbers):
    effect = typical("mullins_softening", **numbers)
    return AugmentedModel(added=(add_effect(effect, source, sd),), name="softening")


@pytest.fixture(scope="module")
def pulls(tmp_path_factory):
    """Cycles of a silicone that softens by the catalogue's own law."""
    folder = tmp_path_factory.mktemp("pulls")
    law, random = load_silicone("dragon_skin_10_fast"), np.random.default_rng(4)
    effect = typical("mullins_softening", depth=DEPTH, scale=SCALE)
    for k, levels in enumerate(([0.5, 0.5, 0.8], [0.3, 0.6, 0.9], [0.4, 0.7, 0.7]), 1):
        corners = np.concatenate([[0.0], *([level, 0.0] for level in levels)])
        strain = np.interp(np.linspace(0, len(corners) - 1, 90), np.arange(len(corners)), corners)
        time = np.linspace(0.0, 120.0, strain.size)
        truth = FACTOR * np.asarray(simulate_coupon(law, strain, time=time, effects=(effect,)).seen["stress"])
        stress = truth + NOISE * random.standard_normal(strain.size)
        recording = Recording(
            name=f"pull_{k}", path=None, kind="elastomer", role="validation" if k == 3 else "fit",
            specimen="E", real=False, noise={"stress_kPa": NOISE / 1e3},
            tolerance={"silicone_stiffness": 0.05},
            columns={"time_s": time, "strain": strain, "stress_kPa": stress / 1e3},
        )  # fmt: skip
        write_recording(recording, folder)
    return folder


@pytest.fixture(scope="module")
def fit(pulls):
    return characterise(pulls, model=softening(), starts=1)


def test_an_effects_parameters_come_out_again(fit):
    for name, truth in (
        ("mullins_softening_depth", DEPTH), ("mullins_softening_scale", SCALE), ("silicone_stiffness", FACTOR)
    ):  # fmt: skip
        found = fit.parameters[name]
        # errors allow for an offset and a drift of the instrument's zero: a fifth more than white noise here
        assert found.unit == "1" and 0.0 < found.sd < 0.12 * truth, name
        assert abs(found.value - truth) < 3.5 * found.sd, name
    assert 0.8 < fit.fit.reduced_chi_square < 1.3 and fit.fit.inflation == 1.0
    held_out = [score for score in fit.scores if score.role == "validation"]
    assert held_out and held_out[0].rms_over_noise < 1.2


def test_what_is_left_at_its_neutral_value_is_called_absent(fit):
    parameters = fit.fitted.copy()
    parameters["mullins_softening_depth"].set(value=0.0)
    assert "where mullins_softening is absent" in absent_effects(fit.model, parameters)["mullins_softening_depth"]
    assert not absent_effects(fit.model, fit.fitted)
    held = np.array([n.endswith("depth") for n in fit.information.names])
    information = dataclasses.replace(fit.information, fixed=held)
    entries = open_constants(information, parameters, fit.start, absent_effects(fit.model, parameters))
    assert [e["kind"] for e in entries if e["parameters"] == ["mullins_softening_depth"]] == ["absent"]


def test_of_a_model_of_a_diagnosis_no_diagnosis_is_asked_for(fit, monkeypatch):
    """After a diagnosis its own model was said to need one."""
    monkeypatch.setattr(text, "far_from_nominal", lambda *_: ["G_m moved far.", "G_a moved far."])
    description = f"{DIAGNOSIS} {fit.model.title}, seed 0"
    diagnosed = dataclasses.replace(fit.model, model=dataclasses.replace(fit.model.model, description=description))
    results = [dataclasses.replace(fit, model=model) for model in (diagnosed, fit.model, None)]
    asked = [any("`pneusma diagnose" in said for said in warnings(one)) for one in results]
    beside = [any("--model" in said for said in warnings(one)) for one in results]
    assert asked == [False, True, True] and beside == [False, True, False] and fit.model.title


def test_a_shape_at_an_end_of_its_range_is_no_warning(fit):
    natural = fit.model.natural_ends()
    assert "mullins_softening_scale" in natural and "mullins_softening_depth" not in natural
    held = np.array([n.endswith("scale") for n in fit.information.names])
    information = dataclasses.replace(fit.information, fixed=held)
    [entry] = open_constants(information, fit.fitted, fit.start, natural_ends=natural)[:1]
    assert entry["kind"] == "end_of_range" and "an end of its range" in entry["text"]
    relaxing = Augmented("elastomer", AugmentedModel(added=(add_effect(typical("viscoelastic_relaxation"), "g"),)))
    assert not relaxing.natural_ends()  # a relaxation time at its bound is a warning
    told = dataclasses.replace(fit, identifiability=[entry])
    assert not any("mullins_softening_scale" in sentence for sentence in warnings(told))
    assert not any("end of its range" in sentence for sentence in verdict(told))


def test_the_model_found_is_written_and_fits_the_next_campaign(fit, tmp_path):
    fit.save(tmp_path / "out")
    again = load_model(tmp_path / "out" / "augmented.toml")
    depth = again.added[0].parameters["depth"]
    assert depth.value == pytest.approx(fit.parameters["mullins_softening_depth"].value)
    assert depth.prior.sd == pytest.approx(fit.parameters["mullins_softening_depth"].sd)
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["model"]["effects"][0]["name"] == "mullins_softening"
    assert {"value", "sd", "unit", "at_bound"} <= set(report["parameters"]["mullins_softening_depth"])
    # its priors come from these recordings, so they do not count again for them, but for others
    same = Augmented("elastomer", again, fit.title)
    assert "mullins_softening_depth" in same.spent(fit.campaign)
    assert same.parameters_for(fit.campaign)["mullins_softening_depth"].prior is None
    assert not any("narrow" in said for said in notes_on(same, fit.campaign))
    for title in ("another stand", fit.title[:-1]):  # which the longer name does not name
        other = Augmented("elastomer", again, title)
        prior = other.parameters_for(fit.campaign)["mullins_softening_depth"].prior
        assert prior.sd == pytest.approx(depth.prior.sd) and prior.max == 0.7
        assert other.spent(fit.campaign) == []
        assert any("narrow those of silicone_stiffness by a factor of" in said for said in notes_on(other, fit.campaign))
        assert other.parameters_for(fit.campaign)["silicone_stiffness"].prior.mean == pytest.approx(
            fit.parameters["silicone_stiffness"].value
        )


@pytest.mark.parametrize(("source", "knots"), [("diagnosis of {title}, seed 1", 3), ("diagnosis of {title}2", 0)])
def test_a_discrepancy_of_the_same_recordings_counts_as_fitted_and_that_is_said(fit, source, knots):
    """It was made of their misfit, and used again without a word."""
    numbers = [Quantity(f"x_{k}", float(k), "1", "fitted", source.format(title=fit.title)) for k in range(1, 4)]
    ripple = AddedDiscrepancy("elastomer", "stress", "strain", tuple(numbers), tuple(numbers))
    foreign = AddedDiscrepancy("tube", "length", "pressure", tuple(numbers), tuple(numbers))
    model = dataclasses.replace(softening(), added=(*softening().added, ripple, foreign))
    augmented = Augmented("elastomer", model, fit.title)
    count = sum(rows.observations for rows in fit.fit.rows)
    assert augmented.observations(fit.fit.result.values, fit.fit.rows) == count - knots
    notes = about_the_model(dataclasses.replace(fit, model=augmented))
    (said,) = [note for note in notes if note.startswith("The model discrepancy of stress")]
    assert ("comes from these recordings: its 3 knots count" in said) is (knots > 0)
    assert any("discrepancy of length" in note and "does not act in recordings of kind elastomer" in note for note in notes)
    posterior = sampling_problem(dataclasses.replace(fit, model=augmented))
    assert said in posterior.notes  # whose draws hold this discrepancy, too


def test_a_held_parameter_and_a_foreign_effect_are_said(pulls):
    gravity = add_effect(typical("gravity"), "guessed")
    model = dataclasses.replace(softening(), added=(*softening().added, gravity))
    fixed = {"mullins_softening_scale": {"value": SCALE, "vary": False}}
    found = characterise(pulls, model=model, adjust=fixed, starts=1)
    held = {one.name: one for one in found.held()}
    assert held["mullins_softening_scale"].value == pytest.approx(SCALE)
    assert "does not act in recordings of kind elastomer" in held["gravity_mass"].why
    assert "gravity_mass" not in found.parameters
    assert "Numbers that were held" in found.documents()["report.html"]
    assert found.augmented().added[1] == gravity  # kept as it was


def test_the_posterior_samples_the_effect_too(fit):
    problem = sampling_problem(fit)
    assert {"mullins_softening_depth", "silicone_stiffness"} <= set(problem.target.names)
    here = problem.target.pack(problem.parameters)
    k = problem.target.names.index("mullins_softening_depth")
    away = here.at[k].add(5.0 * problem.parameters["mullins_softening_depth"].standard_error)
    density = jax.jit(lambda x: problem.target.log_probability(x))
    best, worse = float(density(here)), float(density(away))
    assert np.isfinite(best) and best - worse > 5.0


@pytest.mark.slow
def test_the_commands_take_a_model(pulls, tmp_path, capsys):
    path = save_model(softening(), tmp_path / "model.toml")
    with pytest.raises(SystemExit) as left:
        main(["characterise", str(pulls), "--model", str(path), "--out", str(tmp_path / "out"), "--starts", "1"])
    assert not left.value.code and "mullins_softening_depth" in capsys.readouterr().out
    assert (tmp_path / "out" / "augmented.toml").exists()
    sampled = ["posterior", str(pulls), "--model", str(path), "--out", str(tmp_path / "draws"), "--max-steps", "20"]
    with pytest.raises(SystemExit) as left:
        main(sampled)
    assert not left.value.code and "mullins_softening_depth" in capsys.readouterr().out
    for extra in (["--model", str(path), "--law", "yeoh"], ["--model", str(tmp_path / "nothing.toml")]):
        with pytest.raises(SystemExit) as left:
            main(["characterise", str(pulls), *extra, "--out", str(tmp_path / "no")])
        assert left.value.code == 2 and not (tmp_path / "no").exists()
        assert len([line for line in capsys.readouterr().err.splitlines() if line.strip()]) == 1


def test_a_model_that_says_nothing_of_a_kind_is_refused(pulls):
    model = AugmentedModel(added=(add_effect(typical("gravity"), "guessed"),), name="heavy")
    with pytest.raises(InputError, match="heavy: nothing in this model acts in recordings of kind elastomer"):
        characterise(pulls, model=model)


@pytest.mark.parametrize(
    ("kind", "slug", "number"),
    [
        pytest.param("tube", "wrap_friction", "wall_thickness", marks=pytest.mark.slow),
        ("wire", "transformation_hysteresis", "T_width"),
        pytest.param("spring", "series_resistance", "G_m", marks=pytest.mark.slow),
    ],
)
def test_every_kind_runs_through_its_effects(kind, slug, number):
    campaign = read_campaign(SHIPPED / kind)
    table, unit = ("actuator", "mm") if kind == "tube" else ("alloy", None)
    nominal = float(np.asarray(specimen_of(kind).rows_for(campaign)[0].base[number]))
    base = {table: {number: fitted(table, number, 1.01 * nominal, "guessed", 0.01 * nominal, unit)}}
    absent = CATALOGUE[slug](**{name: spec.neutral for name, spec in CATALOGUE[slug].specs.items()})
    augmented = Augmented(kind, AugmentedModel(base=base, added=(add_effect(absent, "absent"),)))
    parameters = augmented.parameters_for(campaign)
    free = parameters.layout().free
    own = [name for name in free if name.startswith(slug)]
    assert own and all(np.isfinite([parameters[n].min, parameters[n].max]).all() for n in own)
    assert any(
        name.startswith(number) and parameters[name].value == pytest.approx(1.01 * nominal) for name in free
    )
    rows = augmented.rows_for(campaign)
    assert all(float(r.base[number]) == pytest.approx(1.01 * nominal) for r in rows)
    rows = augmented.prepared(parameters.valuesdict(), rows[:1])
    values = {name: jnp.asarray(value) for name, value in parameters.valuesdict().items()}
    residual = jax.jit(jax.vmap(augmented.residual, (None, 0)))(values, stack(rows))
    assert np.isfinite(np.asarray(residual)).all()
    plain = {name: value for name, value in values.items() if name not in own}
    found = jax.jit(jax.vmap(augmented.predict, (None, 0)))(values, stack(rows))
    base_law = jax.jit(jax.vmap(specimen_of(kind).predict, (None, 0)))(plain, stack(rows))
    for name, column in found.items():
        told = np.asarray(rows[0].weight[name]) > 0.0
        pair = [np.asarray(x)[0, : len(told)][told] for x in (column, base_law[name])]
        apart = np.abs(pair[0] - pair[1])
        if kind == "spring":  # the base fit reads the phase from force, too, and its memory may turn elsewhere
            assert np.median(apart) < 0.02 * np.max(np.abs(pair[1])), name
        elif told.any():
            assert apart.max() < 1e-5 * np.max(np.abs(pair[1])), name


@pytest.fixture(scope="module")
def cold_and_moving():
    """Two tests of a spring, and a model with an effect that is absent."""
    cold, _, moving, *_ = synthesise("spring", seed=1, spread="none").recordings
    absent = add_effect(typical("series_resistance", ohms=0.0), "absent")
    return Campaign("c", [cold, moving], False), Augmented("spring", AugmentedModel(added=(absent,)))


@pytest.mark.slow
def test_the_information_of_a_spring_with_effects_is_that_of_its_residuals(cold_and_moving):
    """Its trajectory ends within a tolerance, so differences of predictions tell far too much (errors 50 times too
    small in one campaign, where the truth was 60 of them off)."""
    campaign, augmented = cold_and_moving
    parameters = augmented.parameters_for(campaign)
    parameters["series_resistance_ohms"].set(value=CATALOGUE["series_resistance"].specs["ohms"].typical)
    names = parameters.layout().free
    rows = augmented.prepared(parameters.valuesdict(), augmented.rows_for(campaign))
    result = SimpleNamespace(values=parameters.valuesdict(), parameters=parameters)
    fit = GeneralFit(tuple(campaign.recordings), tuple(rows), augmented, result, (), 1.0, 1.0, 1.0)
    fisher, *_ = informed(fit)
    values = {name: jnp.asarray(value) for name, value in result.values.items()}
    stacked = stack(rows)

    def residual(x):
        return residual_of(augmented)({**values, **dict(zip(names, x, strict=True))}, stacked).ravel()

    slopes = np.asarray(jax.jit(jax.jacfwd(residual))(jnp.stack([values[name] for name in names]))) * fisher.scale
    np.testing.assert_allclose(fisher.matrix * np.outer(fisher.scale, fisher.scale), slopes.T @ slopes, rtol=1e-6, atol=1e-6)


def test_a_steady_fraction_takes_few_degrees_of_freedom_and_a_moving_one_all(cold_and_moving):
    """One for every resistance made a reduced chi-square of 2 of what a cold spring left, which was noise."""
    campaign, augmented = cold_and_moving
    values = augmented.parameters_for(campaign).valuesdict()
    rows = augmented.prepared(values, augmented.rows_for(campaign))
    taken = augmented.taken(values, rows)
    steady, free = taken / [np.sum(np.asarray(one.weight["resistance"]) > 0.0) for one in rows]
    assert 0.0 <= steady < 0.02 and 0.95 < free <= 1.0
    assert augmented.observations(values, rows) == sum(one.observations for one in rows) - round(taken.sum())


@pytest.mark.slow
def test_degrees_of_freedom_are_those_at_the_constants_that_were_found(cold_and_moving):
    """From a start half a percent off, half of a cold spring's readings were not counted, even where the fit left it."""
    campaign, augmented = cold_and_moving
    parameters = augmented.parameters_for(campaign)
    true = parameters.valuesdict()
    parameters["rho_mean"].set(value=1.005 * true["rho_mean"])
    start = parameters.valuesdict()
    rows = augmented.prepared(start, augmented.rows_for(campaign))
    before = augmented.taken(start, rows)[0]
    fit = fit_campaign(campaign.recordings, rows, parameters, 1, 0, lambda word: None, augmented)
    weighed, found = inflated(fit.rows, fit.inflation), fit.result.values
    priors = sum(p.prior is not None for p in parameters.values())
    assert fit.result.observations == augmented.observations(found, weighed) + priors
    assert augmented.taken(found, weighed)[0] < 0.05 * before  # a cold spring's fraction rests


def test_a_spring_without_effects_goes_through_its_stages(monkeypatch):
    campaign = read_campaign(SHIPPED / "spring")
    fixed = AugmentedModel(base={"alloy": {"G_m": fitted("alloy", "G_m", 3.0e9, "guessed")}}, name="numbers")
    seen = {}
    monkeypatch.setattr(
        "fitting.calibrate.general.with_model.characterise_spring",
        lambda campaign, **options: seen.update(options, campaign=campaign),
    )
    characterise_with(campaign, model=fixed)
    named = str(campaign.recordings[0].table("alloy"))
    if named == "fit":
        assert seen["base"] is None and seen["adjust"]["G_m"]["value"] == pytest.approx(3.0)
    else:
        assert seen["base"].values()["G_m"] == pytest.approx(3.0e9)


@pytest.mark.parametrize(
    ("source", "specimens", "material", "held"),
    [("{title}", 1, "fit", True), ("other recordings", 1, "fit", False), ("{title}", 2, "fit", False), ("{title}", 1, "ecoflex", False)],
)
def test_a_factor_that_multiplies_fitted_constants_is_held_and_that_is_said(pulls, tmp_path, source, specimens, material, held):
    """Of one specimen the law's constants and a factor on its stress cannot be told apart."""
    table = tmp_path / "law.toml"
    table.write_text(
        'schema = "pneusma-calibration/1"\nname = "law"\nkind = "silicone"\ndescription = "a law"\nlaw = "yeoh"\n'
        + "".join(
            f'{name} = {{value = {value}, unit = "kPa", status = "fitted", source = "s", prior = {{mean = {value}, sd = 9}}}}\n'
            for name, value in (("c_10", 20.0), ("c_20", 2.0), ("c_30", 0.1))
        )
    )
    campaign = read_campaign(pulls)
    named = {"ecoflex": str(table)}.get(material, material)
    recordings = [
        dataclasses.replace(r, specimen=f"s{k % specimens}", geometry={**r.geometry, "material": named})
        for k, r in enumerate(campaign.recordings)
    ]
    campaign = dataclasses.replace(campaign, recordings=recordings)
    said = source.format(title=campaign.title)
    numbers = {
        name: fitted("silicone", name, value, said, 0.1 * value)
        for name, value in (("c_10", 2.0e4), ("c_20", 2.0e3), ("c_30", 1.0e2), ("silicone_stiffness", 1.3))
    }
    model = AugmentedModel(base={"silicone": numbers}, tables={"material": str(table)}, name="a model")
    augmented = Augmented("elastomer", model, campaign.title)
    parameters = augmented.parameters_for(campaign)
    free = {name.partition("__")[0] for name in parameters.layout().free}
    assert ("silicone_stiffness" not in free) == held
    assert (material != "fit") or {"c_10", "c_20", "c_30"} <= free
    why = {one.name: one.why for one in augmented.held(campaign, parameters)}
    assert ("multiplies the law" in why.get("silicone_stiffness", "")) == held
    if held:
        assert parameters["silicone_stiffness"].value == pytest.approx(1.3)
    del numbers["silicone_stiffness"]  # as a diagnosis of one coupon leaves it
    without = AugmentedModel(base={"silicone": numbers}, tables={"material": str(table)}, name="a model")
    layout = Augmented("elastomer", without, campaign.title).parameters_for(campaign).layout()
    assert ("silicone_stiffness" not in {name.partition("__")[0] for name in layout.free}) == held
