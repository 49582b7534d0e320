"""Sentences about several recordings: one for all that share it, no recording forgotten."""

import pytest

from fitting.inference.notes import ended, joined, of_several


def test_what_several_recordings_share_is_said_once():
    notes = ["a: reduced from 9 rows to 4", "the law is Yeoh", "b: reduced from 9 rows to 4", "b: its clock stops"]
    assert of_several(notes, ["a", "b"]) == ["a, b: reduced from 9 rows to 4", "the law is Yeoh", "b: its clock stops"]


def test_many_recordings_are_counted():
    names = [f"r{k}" for k in range(5)]
    assert of_several([f"{name}: no noise" for name in names], names) == ["r0, r1, r2, ... (5 recordings): no noise"]


def test_a_recording_is_named_once_and_what_is_said_of_all_stays():
    assert of_several(["a: no noise", "a: no noise", "no noise"], ["a"]) == ["a: no noise", "no noise"]


def test_a_colon_in_a_name_does_not_hide_it():
    assert of_several(["a: b: no noise", "a: no noise"], ["a: b", "a"]) == ["a: b, a: no noise"]


def test_a_colon_does_not_make_a_recording():
    assert of_several(["check: two clocks", "check: two clocks"], ["a"]) == ["check: two clocks"]


@pytest.mark.parametrize("kind", [list, tuple, dict.fromkeys, iter])
def test_names_of_any_collection_are_listed(kind):
    assert [joined(kind(names)) for names in ([], ["a"], ["a", "b", "c"])] == ["", "a", "a, b and c"]


@pytest.mark.parametrize(("text", "said"), [("no noise", "no noise."), ("No noise. It is estimated.", "No noise. It is estimated."), ("why?", "why?")])
def test_a_sentence_ends_in_one_stop(text, said):
    assert ended(text) == said
