"""What a report says where recordings do not say what their specimens are."""

from dataclasses import replace
from pathlib import Path

import pytest

from fitting.calibrate.assumed import assumed, default_deviations, default_tolerances, far_from_nominal
from fitting.data.recordings import read_campaign
from fitting.specimens import SPRING

EXAMPLES = Path(__file__).parents[2] / "calibration_data" / "examples"


@pytest.fixture(scope="module")
def springs():
    return read_campaign(EXAMPLES / "spring").recordings


@pytest.mark.parametrize("kind", ["spring", "wire", "tube", "actuator"])
def test_the_shipped_campaigns_state_everything(kind):
    assert assumed(read_campaign(EXAMPLES / kind).recordings) == []


def test_an_alloy_that_is_not_stated_is_said_with_what_to_write(springs):
    silent = replace(springs[0], geometry={"wire_diameter_mm": 0.3})
    (sentence,) = assumed([silent, *springs[1:]])
    assert sentence.startswith(f"{springs[0].name}: ") and "alloy = krl35" in sentence
    assert 'alloy = "fit"' in sentence and "wire_diameter_mm" not in sentence


def test_a_silicone_to_be_fitted_takes_no_law_of_the_source():
    """A coupon with a fitted Gent law was told that the law is the source's polynomial."""
    recordings = read_campaign(EXAMPLES / "pulled_silicone").recordings
    of = lambda geometry: assumed([replace(r, geometry=geometry) for r in recordings])  # noqa: E731
    assert of({"material": "fit"}) == []
    assert "law = polynomial" in of({"material": "dragon_skin_10_fast"})[0]


def silent_of_tolerances(campaign):
    return replace(campaign, recordings=[replace(r, tolerance=None) for r in campaign.recordings])


def test_default_tolerances_are_said_by_their_size():
    """The defaults held without a word."""
    campaign = silent_of_tolerances(read_campaign(EXAMPLES / "spring"))
    free = SPRING.parameters_for(campaign)
    (sentence,) = default_tolerances(campaign.recordings, free)
    assert "wire_diameter, mandrel_diameter" in sentence and "initial_pitch" in sentence
    assert "to 2 %" in sentence and "to 5 %" in sentence and sentence.startswith("no [tolerance] is stated")
    (some,) = default_tolerances([*campaign.recordings[:1], *read_campaign(EXAMPLES / "spring").recordings[1:]], free)
    assert some.startswith(f"no [tolerance] of {campaign.recordings[0].name} is stated")


def test_stated_tolerances_are_not_said(springs):
    campaign = read_campaign(EXAMPLES / "spring")
    free = SPRING.parameters_for(campaign)
    assert default_tolerances(springs, free) == [] == far_from_nominal(springs, free, free.valuesdict())


def test_a_prior_of_a_table_is_no_default_tolerance():
    campaign = silent_of_tolerances(read_campaign(EXAMPLES / "spring"))
    campaign = replace(
        campaign, recordings=[replace(r, geometry={**r.geometry, "alloy": "fit"}) for r in campaign.recordings]
    )
    names = default_deviations(campaign.recordings, SPRING.parameters_for(campaign))
    assert "wire_diameter" in names and "G_m" not in names


def test_a_constant_that_moved_far_is_named_with_its_shift():
    """A wire of 0.25 mm became one of 0.268 mm without a word."""
    campaign = silent_of_tolerances(read_campaign(EXAMPLES / "spring"))
    free = SPRING.parameters_for(campaign)
    at = free.valuesdict()
    assert far_from_nominal(campaign.recordings, free, at) == []
    (sentence,) = far_from_nominal(campaign.recordings, free, {**at, "wire_diameter": 0.268e-3, "G_m": 1.05 * at["G_m"]})
    assert "wire_diameter" in sentence and "from 0.25 to 0.268 mm, by 3.6 of these" in sentence
    assert sentence.startswith("No tolerance of wire_diameter is stated, so it was taken as known")
    unstated = [replace(r, geometry={k: v for k, v in r.geometry.items() if k != "wire_diameter_mm"}) for r in campaign.recordings]
    (sentence,) = far_from_nominal(unstated, free, {**at, "wire_diameter": 0.268e-3})
    assert sentence.startswith("wire_diameter is not stated, so the source's was taken as known to 2 %.")
    assert sentence.endswith("Measure it, and state it with its tolerance.")
