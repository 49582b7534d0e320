"""What long commands say: nothing but the bar at a terminal, a plain line now and then in a log."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
import threading
import time

import jax
import numpy as np
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
    assert lines == ["fitting, 31 s: errors (step 3)", "fitting, 3 min 20 s: profiles (step 5)"]


def test_a_log_says_how_many_steps_there_are_where_that_is_known(clock, capsys):
    with told.Steps("planning", total=2, unit="figure") as progress:
        for at, word in ((31.0, "rates"), (62.0, "choice")):
            clock[0] = at
            progress(word)
    assert capsys.readouterr().err.splitlines() == ["planning, 31 s: rates (figure 1 of 2)", "planning, 1 min 2 s: choice (figure 2 of 2)"]


def test_later_lines_of_a_log_have_other_times():
    """Minutes were rounded, so that lines half a minute apart both said `for 2 min`."""
    assert [told.elapsed(s) for s in (0.2, 40.0, 59.6, 90.0, 120.0, 150.4)] == ["0 s", "40 s", "1 min", "1 min 30 s", "2 min", "2 min 30 s"]
    assert told.elapsed(3720.0) == "1 h 2 min" and told.elapsed(5431.0) == "1 h 30 min 31 s"
    times = [told.elapsed(told.EVERY_S * k) for k in range(400)]
    assert len(set(times)) == len(times)


@pytest.mark.parametrize(("total", "line"), [(3, "2 of 3 campaigns done; fit"), (None, "fit")])
def test_a_word_of_a_running_step_does_not_count_it(clock, capsys, total, line):
    with told.Steps("diagnosing", total=total, unit="campaign") as campaigns:
        campaigns.done(2)
        clock[0] = 31.0
        campaigns.say("fit")
    assert capsys.readouterr().err.splitlines() == [f"diagnosing, 31 s: {line}"]


def test_a_long_step_is_said_again_in_a_log(capsys):
    """A log is silent for not much longer than the interval between lines."""
    with told.Steps("fitting", every=0.1) as progress:
        progress("joint fit")
        time.sleep(0.75)
    lines = capsys.readouterr().err.splitlines()
    assert 3 <= len(lines) <= 8 and all(line.startswith("fitting, ") for line in lines)
    assert lines[0].endswith("joint fit (step 1), for 0 s")
    time.sleep(0.3)
    assert capsys.readouterr().err == ""  # nothing once it has ended


def test_no_line_is_written_once_the_work_has_ended(capsys):
    """Not even by a watch that had found a step too long just before."""
    with told.PlainLines("fitting", shown=True, every=0.0) as lines:
        pass
    capsys.readouterr()
    lines._write("joint fit, for 31 s", again=True)
    assert capsys.readouterr().err == ""
    lines.say("done")
    assert capsys.readouterr().err.endswith("done\n")


def test_the_watch_ends_with_the_work_even_where_that_fails():
    watching = {thread for thread in threading.enumerate() if thread.name == "progress"}
    with pytest.raises(ZeroDivisionError), told.Steps("fitting", every=0.05):
        raise ZeroDivisionError
    for thread in {thread for thread in threading.enumerate() if thread.name == "progress"} - watching:
        thread.join(5.0)
        assert not thread.is_alive()


def test_work_before_the_first_step_is_said_in_a_log(capsys):
    with told.Steps("diagnosing", every=0.05):
        time.sleep(0.3)
    assert "preparing, for 0 s" in capsys.readouterr().err


def test_a_long_step_at_a_terminal_says_nothing_more(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    with told.Steps("fitting", every=0.05) as progress:
        progress("joint fit")
        time.sleep(0.3)
    assert "for 0 s" not in capsys.readouterr().err


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


@pytest.mark.parametrize(
    ("tau", "effective", "lengths", "left"),
    [
        (np.full((2, 1), 10.0), 250, 10, "2 min"),  # of 551 steps
        (np.full((2, 1), np.inf), 250, 0, "3 min"),  # of the budget
        (np.full((2, 1), 10.0), 105, 10, "3 min"),  # of 953 steps, for 1,000 effective samples
    ],
)
def test_sampling_says_in_a_log_what_was_judged(clock, capsys, tau, effective, lengths, left):
    from fitting.sample.convergence import Convergence
    from fitting.sample.progress import SamplingBar

    state = Convergence(100, 0, tau, np.array([1.02]), np.array([float(effective)]))
    with SamplingBar(None, 1000) as bar:
        clock[0] = 20.0
        bar.judged(state)
        clock[0] = 40.0
        bar.advance_to(200)
    judged = f"{effective} effective samples, {lengths} of 50 autocorrelation times, R-hat 1.020, at least {left} left"
    line = f"sampling, 40 s: 200 steps of at most 1000; when last judged: {judged}"
    assert capsys.readouterr().err.splitlines() == [line]


def test_stages_say_which_of_how_many_runs_and_which_part_of_it_begins():
    lines = []
    stages = told.Stages(lines.append, ("fit", "profile"))
    fits, profiles = stages.of("fit"), stages.of("profile", 22)
    for progress, word in ((fits, "from the table"), (fits, "from draw 1"), (profiles, "G_m"), (stages.of("profile", 22), "G_m")):
        progress(word)
    assert lines == [
        "stage 1 of 2, fit 1: from the table", "stage 1 of 2, fit 2: from draw 1",
        "stage 2 of 2, profile 1 of 22: G_m", "stage 2 of 2, profile 1 of 22: G_m",
    ]  # fmt: skip
    with pytest.raises(ValueError, match="not in tuple"):
        stages.of("law")
    stages.of("fit")("from a profile")
    assert lines[-1] == "stage 2 of 2, fit again 1: from a profile"


def test_plain_steps_have_no_count_of_their_own_in_a_log(clock, capsys):
    with told.Steps("fitting", plain=True) as progress:
        clock[0] = 31.0
        progress("stage 2 of 4, profile 3 of 22: G_m")
    assert capsys.readouterr().err.splitlines() == ["fitting, 31 s: stage 2 of 4, profile 3 of 22: G_m"]


def at_a_terminal(columns, code):
    """What a process writes to a terminal of so many columns."""
    main, end = pty.openpty()
    fcntl.ioctl(end, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    try:
        subprocess.run([sys.executable, "-c", code], stdin=end, stderr=end, stdout=subprocess.DEVNULL, check=True)
        return os.read(main, 65536).decode()
    finally:
        os.close(main)
        os.close(end)


@pytest.mark.parametrize("columns", [0, 100])
@pytest.mark.parametrize(
    ("form", "said"),
    [("Steps('fitting', plain=True)", "stage 2 of 4, profile 3 of 22: G_m"), ("Steps('fitting')", "stage 2 of 4, profile 3 of 22: G_m")],
)
def test_a_terminal_shows_the_step_even_if_it_does_not_know_its_width(columns, form, said):
    """At a terminal without columns minutes of fitting passed without a word."""
    code = f"from fitting.inference.progress import Steps\nwith {form} as progress:\n    progress({said!r})"
    assert said in at_a_terminal(columns, code)


def test_the_time_of_a_long_step_moves_at_a_terminal():
    code = (
        "import time\nfrom fitting.inference import progress as told\ntold.REFRESH_S = 0.02\n"
        "with told.Steps('fitting', plain=True) as progress:\n    progress('profile 3 of 22'); time.sleep(0.6)"
    )
    assert at_a_terminal(100, code).count("profile 3 of 22") > 10


def test_the_words_for_compiling_follow_what_jax_tells():
    """While a program is traced they stand there, and no longer once it has run."""
    seen = []

    def traced(x):
        seen.append(told.with_compiling("a step"))
        return x + 1.0

    jax.jit(traced)(1.0)
    assert seen == [f"a step; {told.COMPILING}"]
    assert told.with_compiling("a step") == "a step" and told.with_compiling("") == ""


def test_a_program_that_fails_while_it_is_traced_ends_the_words():
    def traced(x):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        jax.jit(traced)(1.0)
    assert told.with_compiling("") == ""


@pytest.fixture
def compiling(monkeypatch):
    """A program that is compiled all the time."""
    monkeypatch.setattr(told._compiling, "_running", 1)


@pytest.mark.parametrize(
    ("word", "line"),
    [
        ("", told.COMPILING),
        ("area", f"area (step 1), for 0 s; {told.COMPILING}"),
        ("compiling the laws (program 1, once per version and shape)", "compiling the laws (program 1, once per version and shape) (step 1), for 0 s"),
    ],
)
def test_every_command_says_in_the_same_words_that_it_compiles(compiling, capsys, word, line):
    """`design` said that it was preparing."""
    with told.Steps("design", every=0.05) as progress:
        if word:
            progress(word)
        time.sleep(0.3)
    lines = capsys.readouterr().err.splitlines()
    assert lines and all("preparing" not in one for one in lines)
    assert lines[0].partition(": ")[2].startswith(line)


@pytest.mark.parametrize(
    ("made", "form"),
    [
        ("fitting.inference.progress", "Steps('design')"), ("fitting.inference.progress", "Steps('design', plain=True)"),
        ("fitting.engine.progress", "Rate('rows', 10)"), ("fitting.sample.progress", "SamplingBar(None, 10)"),
    ],
)  # fmt: skip
def test_every_moving_line_says_that_it_compiles(made, form):
    code = (
        f"import time\nfrom fitting.inference import progress as told\nfrom {made} import *\ntold.REFRESH_S = 0.02\n"
        f"told._compiling._running = 1\nwith {form}:\n    time.sleep(0.3)"
    )
    assert told.COMPILING in at_a_terminal(160, code)
