"""Parameters of a named effect at an end of their range, as the page tells them."""

from types import SimpleNamespace

import pytest

from fitting.report.diagnosis import tables


@pytest.mark.parametrize(
    ("ends", "begins"),
    [
        ([2], "Parameter g_3 is at an end of its range. The other errors leave it open."),
        ([1, 2], "Parameters g_2 and g_3 are at ends of their ranges. The other errors leave them open."),
    ],
)
def test_a_parameter_keeps_its_name_at_the_beginning_of_a_sentence(monkeypatch, ends, begins):
    """`G_3 is at an end` had named a number that no table has."""
    items = [SimpleNamespace(name=name) for name in ("g_1", "g_2", "g_3")]
    program = SimpleNamespace(unknowns=SimpleNamespace(items=items))
    monkeypatch.setattr(tables, "at_an_end", lambda unknowns, fit, slug: ends)
    found = SimpleNamespace(slug="viscoelastic_relaxation", parameters=dict.fromkeys("abc"))
    assert tables.text_of_ends(SimpleNamespace(model=(program, None)), found).startswith(begins)
