"""An alloy whose phases' resistances mix otherwise than nitinol's (Section 2.4.6), from tests on a stand."""

from dataclasses import replace

import pytest

from fitting.characterise import characterise
from fitting.synthesise import synthesise

TRUTH = {"a": 2.0, "c": 3.0}


@pytest.mark.slow
def test_the_rule_of_another_alloy_is_found():
    campaign = synthesise("spring", seed=3, alloy="krl35", spread="none", truth=TRUTH).campaign
    recordings = [replace(r, geometry={**r.geometry, "alloy": "fit"}) for r in campaign.recordings]
    campaign = replace(campaign, recordings=recordings)
    other = characterise(campaign, base="new_sma", starts=1, profile=0)
    for name, true in TRUTH.items():
        entry = other.parameters[name]
        assert abs(entry.value - true) < 4.0 * entry.sd < 0.5 * true
    assert other.joint.reduced_chi_square < 1.2
