"""What a report says where recordings do not say what their specimens are."""

from dataclasses import replace
from pathlib import Path

import pytest

from fitting.calibrate.assumed import assumed
from fitting.data.recordings import read_campaign

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
