"""Reports of shipped examples and sealed cases are the golden ones, within tolerances that are stated there."""

import copy

import pytest
from golden_reports import differences, essence, kept, make, names


@pytest.fixture(scope="session")
def campaigns(tmp_path_factory):
    return tmp_path_factory.mktemp("campaigns")


@pytest.mark.slow
@pytest.mark.parametrize("name", names())
def test_the_report_is_the_golden_one(name, campaigns, tmp_path):
    assert not list(differences(kept()[name], make(name, tmp_path, campaigns)))


def test_every_report_has_its_golden_numbers():
    assert sorted(kept()) == sorted(names())


@pytest.mark.parametrize(
    ("place", "change"),
    [
        (("verdict",), lambda _: "other"),
        (("no_effect_probability",), lambda p: p + 0.02),
        (("fit", "before", "reduced_chi2"), lambda x: 1.01 * x),
        (("where", "drivers"), lambda drivers: [*drivers, "other"]),
        (("candidates",), lambda found: dict(list(found.items())[1:])),
    ],
)
def test_a_report_that_changed_is_seen(place, change):
    old = kept()["diagnose/actuator"]
    new = copy.deepcopy(old)
    inner = new
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = change(inner[place[-1]])
    assert not list(differences(old, copy.deepcopy(old)))
    assert [line for line in differences(old, new) if line.startswith(place[0])]


def test_an_estimate_may_move_by_a_small_part_of_its_error():
    old = {"E": {"value": 1.0, "sd": 0.5, "unit": "1"}}
    assert not list(differences(old, {"E": {"value": 1.009, "sd": 0.5, "unit": "1"}}))
    assert list(differences(old, {"E": {"value": 1.02, "sd": 0.5, "unit": "1"}})) == ["E.value: 1 -> 1.02"]


def test_ends_of_an_interval_may_move_in_their_last_digits():
    assert not list(differences({"interval90": [71.4166, 73.537]}, {"interval90": [71.4166, 73.5371]}))
    assert list(differences({"interval90": [71.4, 73.5]}, {"interval90": [71.4, 74.5]})) == [
        "interval90[1]: 73.5 -> 74.5"
    ]
    assert list(differences({"where": ["time"]}, {"where": ["strain"]}))


def test_the_essence_rounds_and_keeps_what_decides():
    report = {"schema": "pneusma-characterisation/1", "parameters": {"mu": {"value": 1.23456789}}, "metrics": {}, "more": 1}
    assert essence(report) == {"parameters": {"mu": {"value": 1.23457}}, "metrics": {}}
