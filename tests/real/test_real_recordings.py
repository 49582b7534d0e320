"""Other laboratories' recordings, names hidden: the tool says what the tests' design makes true.

The fast part is one pull and one set of rates; the whole table is `make real-proof`.
"""

import numpy as np
import pytest
from real_campaigns import available, loading_unloading, tension, thermal_cycles, two_laboratories
from real_studies import STUDIES, answer

from fitting.data.recordings import read_campaign

needs_recordings = pytest.mark.skipif(
    not available(), reason="measured recordings are not here (PNEUSMA_RECORDINGS, or ../shared/recordings)"
)


def study(letter):
    return next(s for s in STUDIES if s.letter == letter)


SHORT = {
    ("b", "ecoflex_30_200"): pytest.mark.xfail(
        reason="named, but held-out error -44 %, not by half; Yeoh's law fitted by SciPy to the same rows: -41 %"
    )
}


def cases():
    for s in STUDIES:
        for name in s.cases:
            marks = [SHORT[s.letter, name]] if (s.letter, name) in SHORT else []
            yield pytest.param(s.letter, name, id=f"{s.letter}.{name}", marks=marks)


@needs_recordings
def test_a_campaign_tells_nothing_of_its_origin(tmp_path):
    secrets = ("shore", "dragon", "ecoflex", "skin", "niti", "react", "vhb", "0d0", "ef30", "phantom", "mpa kept", "rate")
    for number, case in enumerate((loading_unloading("03"), tension("Dragon Skin 30", 2.0), two_laboratories(), thermal_cycles(50))):
        seen, whole = case.write(tmp_path / str(number))
        for file in [*seen.iterdir(), *whole.iterdir()]:
            head = file.read_text().split("\n", 1)[0] if file.suffix == ".csv" else file.read_text()
            told = (file.name + head).lower().replace('alloy = "niti_wire"', "")
            assert not [word for word in secrets if word in told], file


@needs_recordings
def test_what_is_kept_out_is_not_in_the_campaign(tmp_path):
    seen, whole = tension("Dragon Skin 30", 2.0).write(tmp_path)
    (fitted,) = read_campaign(seen).recordings
    first, kept = read_campaign(whole).recordings
    there, out = np.isfinite(first.columns["stress_kPa"]), np.isfinite(kept.columns["stress_kPa"])
    assert kept.role == "validation" and not (there & out).any() and (there | out).all()
    np.testing.assert_array_equal(first.columns["strain"], kept.columns["strain"])
    np.testing.assert_array_equal(first.columns["stress_kPa"], fitted.columns["stress_kPa"])
    assert out[-1] and not there[-1]  # the largest stretch is predicted, not fitted
    seen, whole = thermal_cycles(50).write(tmp_path / "wire")
    stresses = [float(np.median(r.columns["stress_MPa"])) for r in read_campaign(seen).recordings]
    assert len(stresses) == 3 and not any(45 < stress < 55 for stress in stresses)
    assert len(read_campaign(whole).recordings) == 4


@pytest.mark.slow
@needs_recordings
@pytest.mark.parametrize(("letter", "name"), [("a", "03"), ("b", "dragon_skin_10_200")])
def test_a_part_of_the_table(letter, name, tmp_path):
    s = study(letter)
    found = answer(s, s.cases[name](), tmp_path)
    assert found.right, found
    assert found.cut >= s.cut


@needs_recordings
@pytest.mark.slow
@pytest.mark.parametrize(("letter", "name"), list(cases()))
def test_the_table(letter, name, tmp_path):
    s = study(letter)
    found = answer(s, s.cases[name](), tmp_path)
    assert found.right, found
    if s.cut is not None:
        assert found.cut >= s.cut


def test_without_recordings_it_says_where_to_get_them(monkeypatch, capsys):
    import real_campaigns
    import real_proof

    monkeypatch.setattr(real_campaigns, "available", lambda: False)
    assert real_proof.main([]) == 0
    assert "https://github.com/" in capsys.readouterr().out
