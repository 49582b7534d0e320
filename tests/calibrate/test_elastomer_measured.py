"""Real tension of Dragon Skin 10: the published drift of the neo-Hookean modulus, found by the general rule."""

import pytest

from fitting.characterise import characterise
from fitting.data.importers import import_file
from fitting.data.recordings import Campaign


@pytest.fixture
def dragon_skin(measured):
    file = measured("soft_robotics_materials/Dragon Skin 10 MEDIUM.csv")
    return Campaign("Dragon Skin 10", [import_file(file)], file)


def test_neo_hookean_modulus_drifts_as_published(dragon_skin):
    """Plain least squares of engineering stress, every row alike, through the origin: 56, 79, 109, 151 kPa."""
    result = characterise(dragon_skin, law="neo_hookean")
    entry = result.whole.drifts["neo_hookean"][0]
    found = dict(zip((round(reach, 1) for reach in entry.reaches), entry.values / 1e3, strict=True))
    assert found[2.0] == pytest.approx(56.0, abs=0.5)
    assert found[3.0] == pytest.approx(79.0, abs=0.5)
    assert found[5.0] == pytest.approx(109.0, abs=0.5)
    assert found[11.4] == pytest.approx(151.0, abs=0.5)
    assert entry.drifts and entry.errors > 5.0
    sentence = next(s for s in result.verdict if s.startswith("One constant cannot describe this material"))
    for text in ("56.4 kPa to stretch 2,", "78.6 kPa to stretch 3,", "109 kPa to stretch 5,", "151 kPa to stretch 11.4"):
        assert text in sentence


def test_smooth_measured_curve_has_misfit_not_noise(dragon_skin):
    result = characterise(dragon_skin, law="ogden", terms=1)
    fit = result.best
    assert fit.lag_one > 0.95 and fit.independent < 40 and fit.inflation > 50.0
    assert "shape of the law, not noise" in " ".join(result.report().split())
    assert result.samples.real is True
