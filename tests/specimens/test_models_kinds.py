"""Models of each kind as fits see them: free numbers from the format's tolerances, predictions at a known truth."""

import json
from importlib import resources
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.data.recordings import read_campaign
from fitting.inference.driven import by_stress
from fitting.specimens import predictor_of, residual_of, specimen_of, stack
from pneusma_jax.calibration import load_calibration
from pneusma_jax.errors import InputError
from pneusma_jax.units import to_si

SHIPPED = Path(str(resources.files("calibration_data"))) / "examples"


def truth_of(kind, names):
    """True values of free parameters, SI; those of specimens by their number."""
    truth = json.loads((SHIPPED / kind / "truth.json").read_text())
    specimens = list(truth.get("specimens", {"": truth}).values())
    found = {}
    for name in names:
        stem, _, number = name.partition("__")
        own = specimens[int(number or 1) - 1]
        if stem in truth.get("parameters", {}):
            entry = truth["parameters"][stem]
            found[name] = float(to_si(entry["value"], entry["unit"], entry["unit"] == "K"))
        elif stem in own:
            found[name] = own[stem]["value"]
        else:
            found[name] = 1e-3 * own["geometry"][f"{stem}_mm"]["value"]
    return found


def reduced(kind, values, rows):
    """Chi-square of each recording per measured value, at values."""
    arrays = {name: jnp.asarray(value) for name, value in values.items()}
    left = np.asarray(residual_of(kind)(arrays, stack(rows)))[: len(rows)]
    return (left**2).sum(axis=1) / [r.observations for r in rows]


@pytest.mark.parametrize("kind", ["tube", "wire"])
def test_at_the_truth_only_noise_is_left(kind):
    campaign, model = read_campaign(SHIPPED / kind), specimen_of(kind)
    parameters, rows = model.parameters_for(campaign), model.rows_for(campaign)
    found = reduced(kind, truth_of(kind, parameters), rows)
    assert np.all(found < 1.6) and np.all(found > 0.6)
    nominal = {name: entry.value for name, entry in parameters.items()}
    assert np.all(reduced(kind, nominal, rows) > 5.0)


@pytest.mark.slow
def test_an_actuators_phases_are_read_from_resistance_near_full_heat_too():
    campaign, model = read_campaign(SHIPPED / "actuator"), specimen_of("actuator")
    parameters = model.parameters_for(campaign)
    assert set(parameters) == {"G_m", "G_a", "wall_thickness", "silicone_stiffness"}
    truth = truth_of("actuator", parameters)
    rows = model.decided(truth, model.rows_for(campaign))
    arrays = {name: jnp.asarray(value) for name, value in truth.items()}
    found = predictor_of("actuator")(arrays, stack(rows))
    for k, one in enumerate(rows):
        for name in ("curvature", "length"):
            misfit = one.weight[name] * (np.asarray(found[name][k])[: len(one.mask)] - one.measured[name])
            assert 0.5 < np.sqrt(np.mean(misfit**2)) < 1.3
    hot = np.asarray(rows[1].extra["xi0"][1]).min()  # cycle_2 is heated two widths past the middle: 0.12
    assert 0.05 < hot < 0.2
    assert np.asarray(rows[1].extra["sd"][1]).max() > 0.05  # and the resistance says so only roughly
    assert np.all(rows[3].extra["sd"][0] == 0.0) and np.all(rows[3].extra["xi0"][0] == 1.0)  # not measured


def test_free_numbers_and_priors_follow_the_tolerances():
    campaign = read_campaign(SHIPPED / "tube")
    parameters = specimen_of("tube").parameters_for(campaign)
    assert list(parameters) == [
        "wall_thickness__1", "silicone_stiffness__1", "wall_thickness__2", "silicone_stiffness__2",
    ]  # fmt: skip
    wall = parameters["wall_thickness__2"]
    assert wall.prior.mean == pytest.approx(1e-3) and wall.prior.sd == pytest.approx(3e-5)
    assert wall.min == pytest.approx(0.88e-3)
    for recording in campaign.recordings:
        recording.tolerance = None  # the format's defaults
    every = specimen_of("tube").parameters_for(campaign)
    assert every["length__1"].prior.sd == pytest.approx(0.02 * 56e-3)


def test_a_wire_that_is_to_be_identified_takes_the_priors_of_its_table():
    campaign = read_campaign(SHIPPED / "wire")
    parameters = specimen_of("wire").parameters_for(campaign)
    table = load_calibration("niti_wire", "alloy").quantities
    assert parameters["E_m"].prior == table["E_m"].prior and parameters["T_mid"].unit == "degC"
    assert all(by_stress(recording) for recording in campaign.recordings)


def test_a_wire_without_temperature_is_refused_in_one_line():
    campaign = read_campaign(SHIPPED / "wire")
    del campaign.recordings[0].columns["temperature_degC"]
    with pytest.raises(InputError, match="no temperature_degC"):
        specimen_of("wire").rows_for(campaign)


def test_several_designs_are_not_fitted_together():
    campaign = read_campaign(SHIPPED / "actuator")
    campaign.recordings[0].geometry = {"design": "pneusma1"}
    with pytest.raises(InputError, match="different designs"):
        specimen_of("actuator").rows_for(campaign)


def test_coupons_of_a_named_law_are_linear_in_their_factor():
    campaign = read_campaign(SHIPPED / "elastomer")
    model = specimen_of("elastomer")
    for recording in campaign.recordings:
        recording.geometry = {"material": "dragon_skin_10_fast"}
        recording.tolerance = {"silicone_stiffness": 0.05}
    rows = model.rows_for(campaign)
    once, twice = (
        model.predict({"silicone_stiffness__1": jnp.asarray(x)}, rows[0])["stress"] for x in (1.0, 2.0)
    )
    np.testing.assert_allclose(twice, 2.0 * once)
