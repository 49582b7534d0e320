"""Models on disk: what is written reads back equal and acts; what cannot be is refused in one line."""

from dataclasses import replace
from types import SimpleNamespace

import jax.numpy as jnp
import pytest

import pneusma_jax as pj
from fitting.specimens import specimen_of
from fitting.specimens.saved_models import (
    DIAGNOSIS,
    AugmentedModel,
    add_effect,
    fitted,
    load_model,
    save_model,
)
from fitting.specimens.saved_models.files import render_model
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.effects import CATALOGUE
from pneusma_jax.pipeline import Known

SOURCE = "Fitted to a campaign"


@pytest.fixture(scope="module")
def model() -> AugmentedModel:
    """Changed numbers of all three kinds of table, one specimen's own, and every effect of the catalogue."""
    typical = {
        slug: effect(**{name: spec.typical for name, spec in effect.specs.items()})
        for slug, effect in CATALOGUE.items()
    }
    return AugmentedModel(
        base={
            "alloy": {
                "G_m": fitted("alloy", "G_m", 3.1e9, SOURCE, 0.05e9, "GPa"),
                "T_width": fitted("alloy", "T_width", 2.2, SOURCE, 0.1),
                "density": fitted("alloy", "density", 6400.0, SOURCE),
                "alpha_1": fitted("alloy", "alpha_1", 1.7, SOURCE),
            },
            "silicone": {
                "silicone_stiffness": fitted("silicone", "silicone_stiffness", 1.07, SOURCE, 0.01),
                "density": fitted("silicone", "density", 1080.0, SOURCE),
                "standard_tension.p_1": fitted("silicone", "standard_tension.p_1", -63e3, SOURCE),
            },
            "actuator": {"wall_thickness": fitted("actuator", "wall_thickness", 1.02e-3, SOURCE, 1e-5)},
        },
        added=tuple(
            add_effect(effect, SOURCE, {name: 1e-3 for name in effect.specs}) for effect in typical.values()
        ),
        tables={"design": "pneusma2", "alloy": "krl35", "material": "dragon_skin_10_fast"},
        specimens={"PneuSMA2-B": {"actuator": {"length": fitted("actuator", "length", 55.5e-3, SOURCE)}}},
        name="a model",
        description="with everything",
    )


def test_a_model_reads_back_equal(model: AugmentedModel, tmp_path) -> None:
    path = save_model(model, tmp_path / "augmented.toml")
    again = load_model(path)
    assert again == model
    assert [type(effect).slug for effect in again.effects] == list(CATALOGUE)
    assert [p.name for p in tmp_path.iterdir()] == ["augmented.toml"], "a draft was left behind"


def test_numbers_go_to_the_tables_that_have_them(model: AugmentedModel) -> None:
    alloy = pj.load_alloy(model.table("alloy", "krl35"))
    nominal = pj.load_alloy("krl35")
    assert float(alloy.G_m) == 3.1e9
    assert float(alloy.G_a) == float(nominal.G_a)
    silicone, usual = pj.load_silicone(model.table("silicone", "dragon_skin_10_fast")), pj.load_silicone()
    assert float(silicone.stiffness) == 1.07
    assert float(usual.stiffness) == 1.0
    assert pj.load_alloy("krl35").G_m == nominal.G_m, "the shipped table must stay as it is"
    design = model.table("actuator", "pneusma2")
    assert float(pj.design_geometry(design).wall_thickness) == 1.02e-3
    assert model.geometry() == {"wall_thickness_mm": pytest.approx(1.02, rel=1e-15)}
    assert model.geometry("PneuSMA2-B")["length_mm"] == pytest.approx(55.5, rel=1e-15)


@pytest.mark.parametrize("law", ["neo_hookean", "regularised"])
def test_silicone_stiffness_multiplies_the_stress_of_any_law(law: str) -> None:
    stiff = AugmentedModel(
        base={"silicone": {"silicone_stiffness": fitted("silicone", "silicone_stiffness", 1.5, SOURCE)}}
    )
    table = stiff.table("silicone", "dragon_skin_10_fast")
    ratio = float(pj.load_silicone(table, law)(0.3) / pj.load_silicone(law=law)(0.3))
    assert ratio == pytest.approx(1.5, rel=1e-12)


def _changed(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('schema = "pneusma-model/1"', 'schema = "pneusma-model/9"', "pneusma-model/9"),
        ("G_m = ", "G_n = ", "did you mean 'G_m'?"),
        ('unit = "GPa"', 'unit = "mm"', "measures a length"),
        ('slug = "tip_contact"', 'slug = "tip_contacts"', "did you mean 'tip_contact'?"),
        ("exponent = ", "exponents = ", "did you mean 'exponent'?"),
        ('unit = "N m/rad"', 'unit = "N m"', "is needed, for example in 'N m/rad'"),
        ("number = 2", "number = 2.5", "must be like 2"),
        ("gain = {value = 0.15", "gain = {value = 7.0", "share of its martensite that lasting full heat takes is 0 to 0.98"),
        ('design = "pneusma2"', "design = 2", "name or path of a table"),
        ('"silicone.density" = ', "density = ", "write '\"alloy.density\"' or"),
        ("wall_thickness = {value = 1.02", "wall_thickness = {value = -1.0", "must be positive"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(model, old: str, new: str, says: str, tmp_path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(_changed(render_model(model), old, new))
    with pytest.raises(pj.InputError) as refused:
        load_model(path)
    assert says in str(refused.value)
    assert str(path) in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_missing_model_is_named(tmp_path) -> None:
    with pytest.raises(pj.InputError, match="there is no such file"):
        load_model(tmp_path / "none.toml")


def test_a_fitted_number_must_be_one_that_tables_have() -> None:
    with pytest.raises(pj.InputError, match="did you mean 'gamma_L'"):
        fitted("alloy", "gammaL", 0.1, SOURCE)


def test_an_effect_beyond_its_bounds_is_not_written() -> None:
    effect = CATALOGUE["series_resistance"](ohms=-2.0)
    with pytest.raises(pj.InputError, match="cannot be"):
        add_effect(effect, SOURCE)


def test_a_misfit_is_counted_as_without_a_model() -> None:
    """Bend directions that differ by nearly a turn are near each other. Lines of profiles took them as far apart."""
    rows = SimpleNamespace(
        weight={"bend_direction": jnp.full(2, 10.0)}, measured={"bend_direction": jnp.array([-3.1, 0.5])}, extra={}
    )
    found = {"bend_direction": jnp.array([3.1, 0.6])}
    one, other = (x.misfit(found, rows) for x in (specimen_of("actuator"), Augmented("actuator", AugmentedModel())))
    assert other == pytest.approx(one) and other[0] == pytest.approx(10.0 * (6.2 - 2.0 * jnp.pi))


def test_terms_of_a_sum_are_counted(tmp_path) -> None:
    relaxing = CATALOGUE["viscoelastic_relaxation"](g_1=0.1, g_2=0.05, tau_1=1.0, tau_2=30.0)
    path = save_model(AugmentedModel(added=(add_effect(relaxing, SOURCE),)), tmp_path / "two_terms.toml")
    assert "g_2" in path.read_text()
    (again,) = load_model(path).effects
    assert (again.g_1, again.g_2, again.g_3) == (0.1, 0.05, 0.0)
    assert (again.tau_1, again.tau_2) == (1.0, 30.0)


def test_effects_act_as_they_were_written(model: AugmentedModel, tmp_path) -> None:
    ohms = CATALOGUE["series_resistance"](ohms=0.05)
    path = save_model(AugmentedModel(added=(add_effect(ohms, SOURCE),)), tmp_path / "leads.toml")
    (again,) = load_model(path).effects
    assert float(again.resistance(jnp.asarray(3.0), Known(), None)) == pytest.approx(3.05, rel=1e-15)
    assert model.effects[0].slug == next(iter(CATALOGUE))


@pytest.mark.parametrize(("title", "source", "is_from"), [
    ("S1", "Fitted to S1", True), ("S1", "Fitted to S10", False), ("1", "Fitted on 2026-11-28", False), ("a.b", "Fitted to aXb", False),
    ("", "Fitted to S1", False),
    ("A, B", "pneusma diagnose of A, B, seed 0", True), ("A", "pneusma diagnose of A, B, seed 0", False),
    ("B", "pneusma diagnose of A, B, seed 0", False), ("A, seed 1", "pneusma diagnose of A, seed 1, seed 0", True),
])  # fmt: skip
def test_a_number_is_of_the_campaign_that_its_source_names(title, source, is_from):
    """Not of one whose name is a part of that."""
    number = fitted("silicone", "silicone_stiffness", 1.1, source)
    assert Augmented("elastomer", AugmentedModel(), title).is_from_here(number) is is_from
    if source.startswith(DIAGNOSIS):
        model = AugmentedModel(description=source)
        assert Augmented("elastomer", model, title).diagnosed_here is is_from


def test_the_error_of_a_factor_goes_with_the_factor_of_its_table() -> None:
    """Draws of a design study or of a propagation are about the value that a simulation has."""
    table = pj.load_calibration("dragon_skin_10_fast", "silicone")
    softer = replace(table.quantities["silicone_stiffness"], value=0.8)
    own = replace(fitted("silicone", "silicone_stiffness", 1.1, SOURCE, 0.02), interval90=(1.05, 1.2))
    model = AugmentedModel(base={"silicone": {"silicone_stiffness": own}})
    found = model.table("silicone", replace(table, quantities={**table.quantities, softer.name: softer}))
    number = found.quantities["silicone_stiffness"]
    assert number.value == pytest.approx(0.88) and number.interval90 == pytest.approx((0.84, 0.96))
    assert number.prior.mean == pytest.approx(0.88) and number.prior.sd == pytest.approx(0.016)


def test_a_design_of_the_same_file_name_in_another_folder_is_another_design(tmp_path) -> None:
    """Every design study writes `design.toml`, and a model beside it."""
    model = AugmentedModel(tables={"design": str(tmp_path / "first" / "design.toml")})
    (said,) = model.remarks({"design": str(tmp_path / "second" / "design.toml")})
    assert "was made with the design" in said
    assert model.remarks({"design": str(tmp_path / "second" / ".." / "first" / "design.toml")}) == []


def test_sizes_of_a_model_that_go_before_those_of_another_design_are_named() -> None:
    sizes = {"wall_thickness": fitted("actuator", "wall_thickness", 1e-3, SOURCE)}
    model = AugmentedModel(base={"actuator": sizes}, tables={"design": "pneusma1"})
    (said,) = model.remarks({"design": "pneusma2"})
    assert said.endswith("used with pneusma2 here: wall_thickness of the model, not of the design")
    assert model.remarks({"design": "pneusma1"}) == []
