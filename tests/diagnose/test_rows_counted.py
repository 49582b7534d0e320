"""Effects that only a clock tells apart, where recordings have none of their own."""

import shutil
from pathlib import Path

import pytest

from fitting.data.recordings import read_campaign
from fitting.specimens.registry import candidates, without_clock

BY_RATE = {"self_heating_rate", "channel_lag", "viscoelastic_relaxation", "pressure_lag"}
EXAMPLES = Path(__file__).resolve().parents[2] / "calibration_data" / "examples"


@pytest.fixture
def counted(tmp_path):
    """A copy of a shipped campaign, whose sidecars say that the clock counts rows, but for some."""

    def of(name, timed=()):
        folder = tmp_path / name
        shutil.copytree(EXAMPLES / name, folder)
        for path in folder.glob("*.toml"):
            text = path.read_text()
            if "kind = " in text and path.stem not in timed:
                assert "[source]\n" in text
                path.write_text(text.replace("[source]\n", '[source]\nclock = "rows counted"\n'))
        return read_campaign(folder)

    return of


@pytest.mark.parametrize("name", ["wire", "elastomer", "tube", "spring"])
def test_effects_of_rate_are_not_tried_where_the_clock_counts_rows(counted, name):
    campaign = counted(name)
    slugs = candidates(campaign.recordings[0].kind)
    left_out = without_clock(campaign, slugs)
    assert set(left_out) == BY_RATE & set(slugs) and left_out
    assert "transformation_hysteresis" not in left_out and "mullins_softening" not in left_out


def test_one_recording_with_a_clock_is_enough(counted):
    one = read_campaign(EXAMPLES / "wire").recordings[0].path.stem
    campaign = counted("wire", timed=(one,))
    assert without_clock(campaign, candidates("wire")) == []
    assert without_clock(read_campaign(EXAMPLES / "wire"), candidates("wire")) == []
