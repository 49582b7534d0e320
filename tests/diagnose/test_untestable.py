"""Effects that recordings cannot show are told with the reason, and how to ask about one."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from linear_world import ANOTHER, CONSTANT, DELAY, World, tubes

import fitting.diagnose.batch
from fitting.cli import main
from fitting.diagnose.check import answers
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.fit.score_test import ABSORBED, UNSEEN, UNTIMED, score_effects
from fitting.diagnose.search.explain import explain
from fitting.diagnose.verdict.conclude import conclude
from fitting.report.diagnosis import text
from fitting.report.diagnosis.payload import content

TUBES = Path(__file__).parents[2] / "calibration_data" / "examples" / "tube"


@pytest.fixture(scope="module")
def program():
    """A world without misfit: one effect changes no output, a loose constant absorbs another."""
    world = tubes(effects=(CONSTANT, ANOTHER, DELAY), constants=1)
    seen = world.effects[CONSTANT]
    world = World(np.concatenate([world.base, 1e9 * seen], axis=2), {**world.effects, ANOTHER: 0.0 * world.effects[ANOTHER]})
    found = world.program(world.truth(np.random.default_rng(2)))
    return dataclasses.replace(found, untimed=("channel_lag_2",))


def test_every_reason_is_told(program):
    found = score_effects(Refitter(program), Refitter(program).fit(()), program.unknowns.slugs, np.random.default_rng(0))
    assert found.untestable == {CONSTANT: ABSORBED, ANOTHER: UNSEEN, "channel_lag_2": UNTIMED}


@pytest.fixture(scope="module")
def conclusion(program):
    return conclude(explain(program, np.random.default_rng(1), lambda _: None))


def test_the_command_says_how_to_ask_where_nothing_is_named(conclusion, monkeypatch, tmp_path):
    monkeypatch.setattr(fitting.diagnose.batch, "diagnose", lambda *_: conclusion)
    done = CliRunner().invoke(main, ["diagnose", str(TUBES), "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert text.ask(conclusion) in done.stdout and text.untestable(conclusion) in done.stdout
    page = (tmp_path / "out" / "report.html").read_text()
    assert "asks about one effect" in page and UNSEEN in page


def test_a_report_says_what_cannot_be_tested_and_how_to_ask(conclusion):
    assert not conclusion.named
    assert text.untestable(conclusion) == (
        f"Not testable with these recordings: {CONSTANT} ({ABSORBED}); {ANOTHER} ({UNSEEN}); channel_lag_2 ({UNTIMED})."
    )
    assert "`--effect NAME` asks about one effect" in text.ask(conclusion) and "kind tube have 3 candidates" in text.ask(conclusion)
    assert content(conclusion)["not_testable_because"][ANOTHER] == UNSEEN
    assert content(conclusion)["not_testable_here"] == [CONSTANT, ANOTHER, "channel_lag_2"]
    (answer,) = answers([ANOTHER], conclusion)
    assert answer["text"].startswith(f"{ANOTHER} cannot be tested with these recordings: {UNSEEN}. To test it: ")


def test_where_all_can_be_tested_only_the_way_to_ask_is_told():
    world, rng = tubes(effects=(CONSTANT,)), np.random.default_rng(5)
    conclusion = conclude(explain(world.program(world.truth(rng, **{CONSTANT: 3.0})), rng, lambda _: None))
    assert conclusion.named and text.untestable(conclusion) == "" and text.ask(conclusion)
