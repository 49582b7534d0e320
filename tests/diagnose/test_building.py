"""The building of a program says which stage runs, and what is compiled in it."""

from pathlib import Path

import pytest

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.building import DIAGNOSIS, STAGES, Building
from fitting.diagnose.evaluate.program import Program
from pneusma_jax import program_cache
from pneusma_jax.program_cache import COMPILING, LOADING, TRACING, _tell

COUPONS = Path(__file__).parents[2] / "calibration_data" / "examples" / "elastomer"
FEW = ["load_train_compliance"]
"""Stages are the same with all effects, whose program compiles longer."""


def test_all_stages_are_told_in_their_order():
    said = []
    program = Program.of(read_campaign(COUPONS), "elastomer", FEW, progress=said.append)
    begun = [text for text in said if text.endswith(STAGES)]
    assert [text.partition(":")[0] for text in begun] == [
        f"building the model, stage {k + 1} of {len(STAGES)}" for k in range(len(STAGES))
    ]
    assert not program_cache._listeners
    again = []
    Program.of(read_campaign(COUPONS), "elastomer", FEW, like=program, progress=again.append)  # whose program is ready
    assert len(again) == len(STAGES)


def test_a_campaign_of_the_same_shapes_compiles_nothing():
    """A check in the root of a load train called back into Python, which kept every program from being stored."""
    campaign, said = read_campaign(COUPONS), []
    first = Program.of(campaign, "elastomer", FEW)
    Program.of(campaign, "elastomer", FEW, progress=said.append)
    assert first and said and all(text.endswith(STAGES) for text in said)  # this process has the program while it has the first


def test_a_second_program_is_said_to_be_one():
    """Stages had gone from 5 of 5 back to 1 of 5 without a word."""
    said = []
    Building(said.append, "actuator", 3, "with turning points between rows").begins()
    assert said == [f"building the model again, with turning points between rows, stage 1 of 5: {STAGES[0]}"]


@pytest.mark.parametrize(
    ("step", "words"), [(TRACING, "once per version"), (COMPILING, "once per version"), (LOADING, "from disk")]
)
def test_a_program_is_told_with_what_is_in_it(step, words):
    said = []
    building = Building(said.append, "tube", 11)
    building.begins()
    with building.listening():
        _tell(7, "best trajectories: Numbers(1, 2)|()", step)
        _tell(9, f"{DIAGNOSIS} Tube(): a b", step)
        _tell(9, f"{DIAGNOSIS} Tube(): a b", COMPILING)
    assert said[1].startswith(f"building the model, stage 1 of 5: {step} best trajectories (program 1, ") and words in said[1]
    assert f"{step} the laws of kind tube and 11 effects (program 2, " in said[2] and words in said[2]
    assert f"{COMPILING} the laws of kind tube and 11 effects (program 2, " in said[3]
