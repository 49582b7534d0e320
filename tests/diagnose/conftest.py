"""Small campaigns of coupons whose truth is known, written in another form than the candidates'."""

import pytest
from diagnosis_coupons import curve, softened, write

from fitting.data.recordings import read_campaign


@pytest.fixture(scope="session")
def soft_campaign(tmp_path_factory):
    """Recordings that soften after their largest strain."""
    return write(tmp_path_factory.mktemp("soft") / "campaign", lambda e: softened(e, 0.15))


@pytest.fixture(scope="session")
def null_campaign(tmp_path_factory):
    """Recordings of the base model, stiffer by three per cent, within its tolerance."""
    return write(tmp_path_factory.mktemp("null") / "campaign", lambda e: 1.03 * curve(e))


@pytest.fixture(scope="session")
def soft(soft_campaign):
    from fitting.diagnose import diagnose

    return diagnose(read_campaign(soft_campaign), seed=1)


@pytest.fixture(scope="session")
def null(null_campaign):
    from fitting.diagnose import diagnose

    return diagnose(read_campaign(null_campaign), seed=1)
