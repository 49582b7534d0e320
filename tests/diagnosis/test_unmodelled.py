"""Physics that no effect of the catalogue describes is called unmodelled, and described by what it goes with."""

import numpy as np
import pytest
from diagnosis_coupons import curve, write

from fitting.diagnosis import diagnose
from fitting.diagnosis.document import report_of
from fitting.recordings import read_campaign


@pytest.fixture(scope="module")
def strange(tmp_path_factory):
    """A stress that ripples with strain, as no rubber's does."""
    folder = tmp_path_factory.mktemp("strange") / "campaign"
    return diagnose(read_campaign(write(folder, lambda e: 1.02 * curve(e) + 4.0 * np.sin(28.0 * e))), seed=1)


def test_it_is_not_given_a_name(strange):
    assert strange.mismatch
    assert strange.found[0].slug == "unmodelled" and strange.unknown > 0.5
    assert "unmodelled" in strange.explanation_set
    named = [f for f in strange.found if f.slug != "unmodelled"]
    assert all(f.probability < 0.8 for f in named)


def test_it_is_described_by_what_it_goes_with(strange):
    report = report_of(strange)
    assert report["remainder"]["driver"] in ("strain", "max_strain", "strain_rate", "time")
    assert report["remainder"]["reduced_chi2"]["after"] < report["remainder"]["reduced_chi2"]["before"]
