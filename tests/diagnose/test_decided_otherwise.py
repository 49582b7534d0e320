"""Decisions of a spring's memory that are all but otherwise: the better ones are taken at the end of a fit."""

import numpy as np
import pytest

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.refit import Refitter
from fitting.specimens.spring import MARGIN, TRIED_MARGIN
from fitting.synthesise import synthesise, write_synthetic

SEED, NAME = 941, "isoresistive_3"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """One test of a simulated spring, its trajectory as the true constants have it.

    The true fraction renews the memory a last time while the wire is let go, which a steady course just misses.
    """
    folder = tmp_path_factory.mktemp("spring")
    made = synthesise("spring", seed=SEED)
    write_synthetic(made, folder, force=True)
    (folder / "truth.json").unlink()
    campaign = read_campaign(folder)
    campaign.recordings = [one for one in campaign.recordings if one.name == NAME]
    program = Program.of(campaign, "spring", slugs=[])
    u, truth = program.unknowns.neutral.copy(), made.truth["parameters"]
    for k in program.unknowns.base:
        item = program.unknowns.items[k]
        value = truth[item.name]["value"] * (1e9 if item.unit == "GPa" else 1.0)
        u[k] = (value - item.reference) / item.scale
    for _ in range(2):
        program = program.prepared(u)
    return program, u


def _decided(program, u, here):
    return Refitter(program)._decided(u, program.unknowns.base, here, np.ones(1, bool))


def test_the_decision_that_explains_more_is_taken(program):
    program, u = program
    here = program.evaluate(u, program.unknowns.base)
    found = _decided(program, u, here)
    assert np.all(np.abs(found.drivers[MARGIN][0]) == pytest.approx(TRIED_MARGIN))
    observations = program.count(0) - program.freedom_of_trajectories(found)[0]
    before, after = (float(one.misfit[0] @ one.misfit[0]) for one in (here, found))
    sd = np.sqrt(2.0 * observations)
    assert before > observations + 2.0 * sd
    assert after < observations + 1.5 * sd


def test_a_decision_that_explains_enough_is_kept(program):
    program, u = program
    found = _decided(program, u, program.evaluate(u, program.unknowns.base))
    assert _decided(program, u, found) is found
