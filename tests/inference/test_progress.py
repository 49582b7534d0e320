"""What long commands say: nothing but the bar at a terminal, a plain line now and then in a log."""

import pytest

from fitting.inference import progress as told


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""
    now = [0.0]
    monkeypatch.setattr(told.time, "monotonic", lambda: now[0])
    return now


def test_a_log_gets_a_line_now_and_then(clock, capsys):
    with told.Steps("fitting") as progress:
        for at, word in ((1.0, "stages"), (29.0, "joint fit"), (31.0, "errors"), (59.0, "others"), (200.0, "profiles")):
            clock[0] = at
            progress(word)
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["fitting, 31 s: errors (step 3)", "fitting, 3 min: profiles (step 5)"]


def test_a_terminal_gets_no_plain_lines(clock, capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    lines = told.PlainLines("fitting")
    clock[0] = 100.0
    lines.say("joint fit")
    assert capsys.readouterr().err == ""


def test_sampling_says_in_a_log_how_far_it_is(clock, capsys):
    from fitting.sample.progress import SamplingBar

    for shown, said in ((None, "sampling, 40 s: 200 steps of at most 1000\n"), (False, "")):
        clock[0] = 0.0
        with SamplingBar(shown, 1000) as bar:
            clock[0] = 40.0
            bar.advance_to(200)
        assert capsys.readouterr().err == said
