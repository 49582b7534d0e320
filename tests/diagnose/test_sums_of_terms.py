"""Terms of one form share a size: their sum is quoted where it is told better than each of them."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnose.evaluate.unknowns import Unknowns
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.probabilities import Found, sum_of_terms
from fitting.diagnose.verdict.proposal import _enough
from fitting.inference.parameters import Parameters
from fitting.report.diagnosis import batch, text

SLUG = "viscoelastic_relaxation"


def shared(sizes, correlation=-0.99, sd=0.24):
    """Sum of the first and the third term of a relaxation, whose errors nearly cancel."""
    unknowns = Unknowns(Parameters(), [SLUG], "T")
    names = [item.name for item in unknowns.items]
    u, covariance, own = np.zeros(len(names)), np.zeros((len(names),) * 2), [names.index("g_1"), names.index("g_3")]
    scale = unknowns.items[own[0]].scale
    u[own] = np.array(sizes) / scale
    covariance[np.ix_(own, own)] = (sd / scale) ** 2 * np.array([[1.0, correlation], [correlation, 1.0]])
    return sum_of_terms(SimpleNamespace(unknowns=unknowns), SimpleNamespace(u=u), covariance, SLUG)


def test_a_sum_has_the_error_of_a_sum():
    found = shared([0.19, 0.12])
    assert found.names == ("g_1", "g_3") and found.value == pytest.approx(0.31)
    assert found.sd == pytest.approx(0.24 * np.sqrt(2.0 - 2.0 * 0.99))
    assert found.words == "g_1 + g_3 = 0.310 ± 0.034"
    assert shared([0.29, 0.0]) is None  # one term has no partner


def test_the_sum_is_told_instead_of_a_term_that_is_as_large_as_its_error():
    """A relaxation with probability 0.98 was quoted as `perhaps`, with g_1 = 0.19 ± 0.24."""
    sizes = {"g_1": {"value": 0.19, "sd": 0.24, "unit": "1"}}
    found = Found(SLUG, 0.98, 5e4, sizes, [], "It relaxes.", {}, "g_1", 0.8)
    assert found.tentative and "g_1 = 0.19 ± 0.24" in found.words
    together = shared([0.19, 0.12])
    summed = replace(found, together=together, errors=together.value / together.sd)
    assert not summed.tentative and summed.words == f"{SLUG} (g_1 + g_3 = 0.310 ± 0.034)"
    said = text.effect(summed)
    assert "hardly tell the terms of g_1 and g_3 apart" in said and "log Bayes factor 50000." in said
    entry = {"name": SLUG, "probability": 0.98, "tentative": False, "strength": "g_1", "parameters": sizes}
    entry["together"] = {"names": ["g_1", "g_3"], "value": 0.31, "sd": 0.034, "unit": "1"}
    assert "(g_1 + g_3 = 0.310 ± 0.034)" in batch._name(entry)


def test_a_repetition_tells_what_it_is_worth_beside_what_is_enough():
    settles = DEFAULT.evidence.minimum_settled
    assert f"of about 45000, where {settles:g} are enough, it is expected to settle that." in _enough(45_012.3)
    assert "alone it is not expected to settle that" in _enough(0.5 * settles)
