import pytest

import fitting.characterise  # noqa: F401  results know how they look
from fitting.calibrate.elastomer.samples import stack
from fitting.characterise import characterise
from fitting.data.recordings import write_recording
from fitting.synthesise.elastomer import PULLS, simulate_pulls, true_law


@pytest.fixture(scope="session")
def campaign(tmp_path_factory):
    """The shipped campaign, made anew."""
    folder = tmp_path_factory.mktemp("stiffening")
    for recording in simulate_pulls(true_law())[0]:
        write_recording(recording, folder)
    return folder


@pytest.fixture(scope="session")
def stiffening(campaign):
    """Five laws fitted to it; one number of Ogden terms keeps it short."""
    return characterise(campaign, terms=2)


@pytest.fixture(scope="session")
def pulled():
    """Samples of simulated pulls of any law."""

    def make(law, pulls=PULLS[:2], **options):
        return stack(simulate_pulls(law, pulls, **{"batch": 0.0, **options})[0])

    return make
