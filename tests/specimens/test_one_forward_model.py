"""What is simulated is what is fitted: one forward model of every kind, its base law without effects."""

import dataclasses
from importlib import resources
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording, read_campaign
from fitting.simulate.recording import predict
from fitting.specimens import SPECIMENS, WIRE, Specimen, specimen_of, stack
from fitting.specimens.saved_models import AugmentedModel, add_effect, fitted
from fitting.specimens.simulation import simulated
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.calibration import load_calibration, write_calibration
from pneusma_jax.effects import CATALOGUE, specs_of
from pneusma_jax.units import from_si

SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"
TABLES = {"alloy": "niti_wire", "material": "dragon_skin_10_fast"}


def shipped(kind):
    """The shipped campaign with tables where it is to be identified."""
    campaign = read_campaign(SHIPPED / kind)
    named = lambda r: {k: TABLES[k] if v == "fit" else v for k, v in r.geometry.items()}  # noqa: E731
    return dataclasses.replace(
        campaign, recordings=[dataclasses.replace(r, geometry=named(r)) for r in campaign.recordings]
    )


def absent(slug, letter):
    effect = CATALOGUE[slug]
    return effect(**{name: spec.neutral for name, spec in specs_of(effect, letter).items()})


def test_every_specimen_answers_every_question():
    for kind, specimen in SPECIMENS.items():
        assert isinstance(specimen, Specimen) and specimen.kind == kind
        for name in ("outputs", "letter", "noun", "law", "element", "tables", "options", "latent", "explained"):
            assert getattr(specimen, name) is not None, (kind, name)
        assert not specimen.__abstractmethods__


@pytest.mark.parametrize(
    ("kind", "slug"),
    [
        ("elastomer", "mullins_softening"),
        ("wire", "transformation_hysteresis"),
        pytest.param("tube", "wrap_friction", marks=pytest.mark.slow),
    ],
)
def test_the_base_model_is_the_model_with_an_absent_effect(kind, slug):
    specimen = specimen_of(kind)
    rows = stack(specimen.rows_for(shipped(kind))[:1])
    answer = lambda effects: jax.jit(jax.vmap(lambda r: specimen.answer({}, r, effects)[0]))(rows)  # noqa: E731
    plain, same = answer(()), answer((absent(slug, specimen.letter),))
    for name in specimen.outputs:
        np.testing.assert_allclose(same[name], plain[name], rtol=1e-8, atol=1e-12 * float(jnp.max(jnp.abs(plain[name]))))


@pytest.mark.parametrize(
    ("kind", "slug"),
    [
        ("elastomer", "mullins_softening"),
        ("wire", "transformation_hysteresis"),
        pytest.param("tube", "wrap_friction", marks=pytest.mark.slow),
    ],
)
def test_a_simulation_is_the_prediction_of_a_fit(kind, slug):
    """With noisy drivers and an effect with a memory, row by row."""
    effect = CATALOGUE[slug]
    known = {name: spec.typical for name, spec in specs_of(effect, specimen_of(kind).letter).items()}
    model = AugmentedModel(added=(add_effect(effect(**known), "known"),))
    campaign, augmented = shipped(kind), Augmented(kind, model)
    recording = campaign.recordings[0]
    rows = augmented.rows_for(dataclasses.replace(campaign, recordings=[recording]))
    found = jax.jit(jax.vmap(lambda r: augmented.predict({}, r)))(stack(rows))
    shown = predict(recording, model=model).outputs
    for column, told in shown.items():
        quantity, unit = column.rpartition("_")[0] or column, column.rpartition("_")[2]
        unit = "1" if column == "strain" else unit
        quantity = "strain" if column == "strain" else quantity
        expected = from_si(np.asarray(found[quantity])[0, : len(rows[0].mask)], unit)
        np.testing.assert_allclose(told, expected, rtol=1e-9)


def test_what_drives_a_wire_is_its_own_in_a_campaign_of_both_ways():
    """Drivers of a recording under stress were those of the run under strain, where a campaign had both."""
    T = np.concatenate([np.linspace(20.0, 110.0, 40), np.linspace(110.0, 20.0, 40)])
    clock = {"time_s": np.arange(80.0), "temperature_degC": T}
    wire = pj.nitinol.load_wire("niti_wire")
    held = pj.nitinol.simulate_wire(wire, stress=np.full(80, 150e6), temperature=T)
    pulled = pj.nitinol.simulate_wire(wire, strain=np.linspace(0.0, 0.03, 80), temperature=np.full(80, 100.0))
    both = [
        Recording("held", None, "wire", specimen="W", columns=clock | {"stress_MPa": np.full(80, 150.0), "strain": np.asarray(held.rows.strain)}),
        Recording("pulled", None, "wire", specimen="W", columns={
            "time_s": np.arange(80.0), "temperature_degC": np.full(80, 100.0),
            "strain": np.linspace(0.0, 0.03, 80), "stress_MPa": np.asarray(pulled.rows.stress) / 1e6,
        }),
    ]  # fmt: skip
    campaign = Campaign("both", both, Path("both"))
    rows = WIRE.rows_for(campaign)
    alone = WIRE.rows_for(dataclasses.replace(campaign, recordings=both[:1]))
    (_, together), (_, own) = (WIRE.answer({}, r[0]) for r in (rows, alone))
    for name in ("stress", "strain", "xi0"):
        np.testing.assert_allclose(together[name], own[name], rtol=1e-12)
    assert float(np.max(np.abs(together["stress"]))) == pytest.approx(150e6, rel=1e-6)


def test_a_wire_of_no_named_alloy_is_one_that_has_a_wires_constants():
    columns = {"time_s": np.arange(5.0), "temperature_degC": np.linspace(20, 90, 5), "stress_MPa": np.full(5, 100.0), "strain": np.linspace(0.01, 0.02, 5)}
    recording = Recording("w", None, "wire", columns=columns)
    assert recording.full_geometry()["alloy"] == "niti_wire"
    (rows,) = WIRE.rows_for(Campaign("w", [recording], Path("w")))
    assert float(rows.base["E_m"]) == pytest.approx(load_calibration("niti_wire", "alloy").values()["E_m"])


def test_a_factor_on_a_silicone_multiplies_that_of_its_table_everywhere(tmp_path):
    table = load_calibration("dragon_skin_10_fast", "silicone")
    own = fitted("silicone", "silicone_stiffness", 1.2, "an earlier fit")
    path = tmp_path / "soft.toml"
    write_calibration(dataclasses.replace(table, quantities={**table.quantities, "silicone_stiffness": own}), path)
    model = AugmentedModel(base={"silicone": {"silicone_stiffness": fitted("silicone", "silicone_stiffness", 1.1, "a fit")}})
    columns = {"strain": np.array([0.1, 0.5]), "stress_kPa": np.array([np.nan, np.nan])}
    recording = Recording("pull", None, "elastomer", geometry={"material": str(path)}, columns=columns)
    plain = Recording("pull", None, "elastomer", geometry={"material": "dragon_skin_10_fast"}, columns=columns)
    specimen = specimen_of("elastomer")
    expected = 1.2 * 1.1 * simulated(specimen, plain).outputs["stress"]
    np.testing.assert_allclose(simulated(specimen, recording, model).outputs["stress"], expected, rtol=1e-12)
    np.testing.assert_allclose(model.table("silicone", path).values()["silicone_stiffness"], 1.32)
