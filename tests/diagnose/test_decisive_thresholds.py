"""The count of decisive thresholds: a comparison is turned where the relaxed value says otherwise."""

import json

import numpy as np
import pytest

from benchmarks.decisive_thresholds import COMPARED, TURNED, Probe, names_of, probe, table
from fitting.diagnose.settings import Settings
from fitting.diagnose.settings.decisions import Chance


@pytest.fixture(autouse=True)
def counts():
    COMPARED.clear()
    TURNED.clear()


@pytest.mark.parametrize(("value", "result", "turned"), [(10.0, True, 0), (3.0, False, 1)])
def test_a_comparison_says_what_the_own_value_says_and_notes_the_other(value, result, turned):
    least = Probe(8.0, -1e9, {"evidence.minimum_first"})
    assert (value > least) is result and (least < value) is result
    assert (COMPARED["evidence.minimum_first"], TURNED["evidence.minimum_first"]) == (2, 2 * turned)
    assert (np.float64(value) > least) == result and TURNED["evidence.minimum_first"] == 3 * turned


def test_arithmetic_carries_both_values_and_all_names():
    share, most = Probe(0.5, 0.0, {"a"}), Probe(4.0, 1e9, {"b"})
    made = 1.0 + share * 10.0
    assert (made, made.relaxed, made.names) == (6.0, 1.0, {"a"})
    assert names_of([made, most]) == {"a", "b"}
    TURNED.clear()
    largest = max(most, made)  # 6 is more than 4, and 1 is not more than 1e9
    assert (TURNED["a"], TURNED["b"]) == (1, 1) and largest is made
    assert -share == -0.5 and abs(-share).relaxed == 0.0
    assert np.isnan((1.0 / share).relaxed)


def test_arrays_are_compared_as_they_would_be():
    values = np.array([1.0, 5.0])
    assert list(values > Probe(4.0, 0.0, {"a"})) == [False, True] and TURNED["a"] == 1
    assert list(np.minimum(values, Probe(9.0, 1e9, {"b"}))) == [1.0, 5.0] and TURNED["b"] == 0


def test_comparisons_between_two_values_are_counted():
    """With another value given, that threshold alone is a probe."""
    settings = Settings(chance=Chance())  # its own, for the default ones are shared
    assert probe(settings, {"chance.deviations": 4.0}) == ["chance.deviations"]
    limit = 1.0 + 0.1 * settings.chance.deviations
    assert [1.35 > limit, 1.2 > limit, 1.5 > limit] == [True, False, True]
    assert (COMPARED["chance.deviations"], TURNED["chance.deviations"]) == (3, 1)
    assert not isinstance(settings.chance.outlier, Probe)


def test_the_table_counts_campaigns(tmp_path):
    for k, turned in enumerate((0, 3)):
        path = tmp_path / f"c{k}.json"
        path.write_text(json.dumps({"named": [], "compared": {"a": 4, "b": 1}, "turned": {"a": turned}}))
    found = table(tmp_path)
    assert found.startswith("2 campaigns") and "| `a` | 8 | 3 | 1 |" in found and "| `b` | 2 | 0 | 0 |" in found
