"""Specimens that are only predicted: what is said of their constants is said once."""

import dataclasses
from importlib import resources
from pathlib import Path

import pytest

from fitting.calibrate.open_constants import of_unfitted
from fitting.characterise import characterise
from fitting.data.recordings import Recording, read_campaign

TUBES = Path(str(resources.files("calibration_data"))) / "examples" / "tube"


def recording(name, specimen, role):
    return Recording(name, None, "tube", role, specimen, columns={})


def test_constants_of_specimens_of_which_nothing_is_fitted_are_told_by_their_number():
    recordings = [recording("a", "A", "fit"), recording("b", "B", "validation"), recording("c", "A", "validation"), recording("d", "C", "fit")]
    names = ["length__1", "length__2", "wall_thickness__2", "length__3", "silicone_stiffness"]
    assert of_unfitted(names, recordings) == {"B": ["length__2", "wall_thickness__2"]}


@pytest.fixture(scope="module")
def tube():
    """The shipped tubes, of which all but the first specimen are kept for validation."""
    campaign = read_campaign(TUBES)
    first = campaign.recordings[0].specimen
    recordings = [
        dataclasses.replace(r, role="fit" if r.specimen == first else "validation") for r in campaign.recordings
    ]
    return characterise(dataclasses.replace(campaign, recordings=recordings), starts=1, profile=0)


def test_the_report_says_once_that_a_validation_specimen_was_not_fitted(tube):
    """It said three times that its constants are not shown, in the verdict, in the warnings and as merely their priors."""
    said = " ".join(tube.report().split())
    (entry,) = [e for e in tube.identifiability if e["kind"] == "not_fitted"]
    assert all(name.endswith("__2") for name in entry["parameters"]) and len(entry["parameters"]) > 1
    assert said.count("of which no recording was fitted") == 1
    prose = said.partition(" Parameters ")[0]
    assert "__2" not in prose
    others = [name for e in tube.identifiability if e is not entry for name in e["parameters"]]
    assert not set(others) & set(entry["parameters"])


def test_a_repeat_of_a_validation_specimen_is_not_the_next_test(tube):
    fitted = {r.name for r in tube.fit.recordings if r.role == "fit"}
    assert fitted and {repeat.name for repeat in tube.repeats} == fitted
