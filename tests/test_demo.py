"""The campaign of `make demo`: made again byte for byte, with its truth apart, and the tool finds what it conceals."""

import json
from pathlib import Path

import pytest

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from validation.examples import pulled_silicone

FOLDER = Path(__file__).resolve().parents[1] / "calibration_data" / "examples" / "pulled_silicone"


def test_the_shipped_campaign_is_what_its_script_writes():
    written = pulled_silicone.documents()
    assert {path.name for path in FOLDER.iterdir()} == set(written)
    for name, text in written.items():
        assert (FOLDER / name).read_text() == text, name


def test_the_truth_lies_apart_and_the_campaign_does_not_tell_it():
    truth = FOLDER.with_name("pulled_silicone_truth.json")
    assert json.loads(truth.read_text()) == pulled_silicone.truth()
    for path in FOLDER.iterdir():
        assert "mullins" not in path.read_text() and "softening" not in path.read_text()


@pytest.mark.slow
def test_the_diagnosis_finds_what_the_campaign_conceals():
    conclusion = diagnose(read_campaign(FOLDER), seed=0)
    [found] = conclusion.found
    assert found.slug == "mullins_softening" and found.probability > 0.9
    assert conclusion.mismatch and not conclusion.asked
    concealed = pulled_silicone.truth()["concealed"]
    depth = next(entry for name, entry in found.parameters.items() if name.endswith("depth"))
    assert abs(depth["value"] - concealed["depth"]) < 3.0 * depth["sd"]
