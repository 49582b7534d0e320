"""A spring that is heated and whose resistance nobody recorded is taken as cold: a report says so."""

from pathlib import Path

import numpy as np
import pytest

from fitting.data.recordings import Campaign, Recording
from fitting.diagnose.check import _heated_unseen


def bent(name, **columns):
    time = np.arange(4.0)
    base = {"time_s": time, "pressure_kPa": 10.0 * time, "curvature_1pm": time}
    return Recording(name, None, "actuator", specimen="A", real=False, columns=base | columns)


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"current_2_A": np.array([0.0, 0.15, -0.15, np.nan])}, True),
        ({"current_2_A": np.array([0.0, 0.15, 0.15, 0.0])}, True),
        ({"current_2_A": np.array([1e-3, -1e-3, 5e-4, 0.0])}, False),  # an instrument's zero
        ({"current_2_A": np.full(4, 0.15), "resistance_2_ohm": np.full(4, 2.4)}, False),
        ({}, False),
    ],
)
def test_a_current_without_a_resistance_is_told(columns, said):
    campaign = Campaign("c", [bent("run_1", **columns), bent("run_2")], Path("c"))
    told = _heated_unseen(campaign)
    expected = "spring 2 carries a current in run_1, but its resistance was not recorded: it is taken as cold"
    assert told == [expected] * said


def test_another_recording_with_the_resistance_tells_the_spring():
    other = bent("run_2", resistance_2_ohm=np.full(4, 2.4))
    heated = bent("run_1", current_2_A=np.full(4, 0.15))
    assert _heated_unseen(Campaign("c", [heated, other], Path("c"))) == []
