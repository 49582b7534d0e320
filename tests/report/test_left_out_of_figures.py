"""Figures that have no room for everything say what they leave out."""

from types import SimpleNamespace

import pytest

from fitting.report import profile_likelihood
from fitting.report.diagnosis.figures import MOST_BARS, probability_figure


def bars(count):
    pool = {f"effect_{k}": (0.6 / count, 1.0) for k in range(count)}
    (axes,) = probability_figure(SimpleNamespace(candidates=pool, unknown=0.3, nothing=0.1)).axes
    return [text.get_text() for text in axes.get_yticklabels()], [bar.get_width() for bar in axes.patches]


def test_candidates_beyond_the_room_of_the_figure_share_a_bar():
    """Fourteen candidates were eight bars, and nothing said so."""
    names, widths = bars(14)
    assert names[MOST_BARS:] == ["6 further candidates together", "unmodelled: none of these", "nothing is missing"]
    assert widths[MOST_BARS] == pytest.approx(6 * 0.6 / 14) and sum(widths) == pytest.approx(1.0)


def test_as_many_candidates_as_have_room_have_no_shared_bar():
    names, widths = bars(MOST_BARS)
    assert "further" not in " ".join(names) and sum(widths) == pytest.approx(1.0)


def result(count, curved=()):
    names = [f"wall_thickness__{k}" for k in range(count)]
    estimates = {name: SimpleNamespace(curved=name in curved, unit="mm") for name in [*names, "not_profiled"]}
    return SimpleNamespace(parameters=estimates, profiles=dict.fromkeys(reversed(names)))


def test_every_profile_is_drawn_in_the_order_of_the_table():
    """Four of them were drawn, which may all have been of held-out specimens."""
    six = result(6)
    assert profile_likelihood.shown(six) == [f"wall_thickness__{k}" for k in range(6)]
    assert profile_likelihood.caption(six).endswith("Every parameter that was profiled is drawn.")


def test_profiles_without_room_are_named_and_those_that_are_no_parabolas_come_first():
    many = result(profile_likelihood.MOST_DRAWN + 2, {"wall_thickness__13"})
    assert profile_likelihood.shown(many)[0] == "wall_thickness__13"
    assert profile_likelihood.caption(many).endswith("Not drawn for want of room: wall_thickness__11 and wall_thickness__12.")
