"""Chains on disk: killed and resumed, refused where they are of something else, readable by emcee."""

import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import emcee
import h5py
import numpy as np
import pytest
from posterior_cases import line, line_data, line_parameters

from fitting.sample import Settings, Target, sample
from pneusma_jax.errors import InputError

SETTINGS = Settings(sampler="emcee", walkers=16, ensembles=2, max_steps=400, seed=7, chunk=10)
CHILD = """
import sys
from pneusma_jax.precision import enable_float64
enable_float64()
sys.path.insert(0, sys.argv[2])
from posterior_cases import line, line_data, line_parameters
from fitting.sample import Settings, Target, sample
settings = Settings(sampler="emcee", walkers=16, ensembles=2, max_steps=400, seed=7, chunk=10)
sample(Target.from_residual(line, line_parameters(), line_data()), line_parameters(), settings, file=sys.argv[1])
"""


def steps_in(path) -> int:
    try:
        with h5py.File(path, "r") as file:
            return int(file["ensemble_2"].attrs["iteration"])
    except (OSError, KeyError):
        return 0


def run(file=None, resume=False, settings=SETTINGS, data=None, residual=line):
    target = Target.from_residual(residual, line_parameters(), line_data() if data is None else data)
    return sample(target, line_parameters(), settings, file=file, resume=resume)


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was_and_ends_as_if_nothing_had_happened(tmp_path):
    path = tmp_path / "chain.h5"
    child = subprocess.Popen([sys.executable, "-c", CHILD, str(path), str(Path(__file__).parent)])
    deadline = time.monotonic() + 120.0
    while steps_in(path) < 30 and child.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    child.send_signal(signal.SIGKILL)
    child.wait()
    killed_at = steps_in(path)
    assert killed_at >= 30 and killed_at % SETTINGS.chunk == 0
    with h5py.File(path, "r") as file:
        before = file["ensemble_1/chain"][...]
    resumed, whole = run(path, resume=True), run()
    assert killed_at < resumed.convergence.steps
    np.testing.assert_array_equal(resumed.chains[0, :killed_at], before)
    np.testing.assert_array_equal(resumed.chains, whole.chains)
    np.testing.assert_array_equal(resumed.log_probabilities, whole.log_probabilities)
    assert resumed.evaluations == whole.evaluations
    assert resumed.summary == whole.summary and resumed.why == whole.why


@pytest.mark.slow
def test_why_a_pilot_chose_the_sampler_is_told_after_a_resume_too(tmp_path):
    auto = replace(SETTINGS, sampler="auto")
    first = run(tmp_path / "chain.h5", settings=replace(auto, max_steps=SETTINGS.chunk))
    resumed = run(tmp_path / "chain.h5", resume=True, settings=auto)
    assert "pilot" in first.why and resumed.why == first.why


def test_a_finished_chain_is_not_run_further(tmp_path):
    path = tmp_path / "chain.h5"
    settings = Settings(walkers=16, ensembles=2, max_steps=2000, seed=7)
    first = run(path, settings=settings)
    again = run(path, resume=True, settings=settings)
    assert first.converged and again.convergence.steps == first.convergence.steps


def test_a_larger_budget_continues_the_same_chain(tmp_path):
    path = tmp_path / "chain.h5"
    short = run(path, settings=Settings(walkers=16, ensembles=2, max_steps=35, seed=7, chunk=10))
    longer = run(path, resume=True)
    np.testing.assert_array_equal(longer.chains[:, :35], short.chains)
    steps = longer.chains.shape[1]  # without the pilot's 200 steps it has converged before
    assert steps > 35
    np.testing.assert_array_equal(longer.chains, run().chains[:, :steps])


def test_emcee_reads_the_file(tmp_path):
    path = tmp_path / "chain.h5"
    posterior = run(path, settings=Settings(walkers=16, ensembles=2, max_steps=30, seed=7, chunk=10))
    backend = emcee.backends.HDFBackend(str(path), name="ensemble_1", read_only=True)
    np.testing.assert_array_equal(backend.get_chain(), posterior.chains[0])
    np.testing.assert_array_equal(backend.get_log_prob(), posterior.log_probabilities[0])
    assert list(tmp_path.iterdir()) == [path]  # no draft is left


def test_chains_of_something_else_are_not_continued(tmp_path):
    path = tmp_path / "chain.h5"
    run(path, settings=Settings(walkers=16, ensembles=2, max_steps=20, seed=7, chunk=10))

    def crooked(values, data):
        return line(values, data) + 0.1 * values["slope"] ** 2

    with pytest.raises(InputError, match="sampled from other data"):
        run(path, resume=True, data=line_data(seed=5))
    with pytest.raises(InputError, match="sampled with another model"):
        run(path, resume=True, residual=crooked)
    with pytest.raises(InputError, match="run with seed = 7, not 8"):
        run(path, resume=True, settings=Settings(walkers=16, ensembles=2, max_steps=40, seed=8, chunk=10))
    with pytest.raises(InputError, match="there is no chain to resume"):
        run(tmp_path / "other.h5", resume=True)
    (tmp_path / "text.h5").write_text("no chain")
    with pytest.raises(InputError, match="cannot be read as a chain"):
        run(tmp_path / "text.h5", resume=True)


def test_a_chain_without_counters_or_a_state_of_its_random_numbers_is_refused(tmp_path):
    path = tmp_path / "chain.h5"
    run(path, settings=Settings(walkers=16, ensembles=2, max_steps=20, seed=7, chunk=10))
    with h5py.File(path, "r+") as file:
        whole, file.attrs["counters"] = file.attrs["counters"], '{"evaluations": 3, "fa9lures": 0}'
    with pytest.raises(InputError, match="chain.h5: damaged, its counters have no 'failures'"):
        run(path, resume=True)
    with h5py.File(path, "r+") as file:
        file.attrs["counters"] = whole
        there, file["ensemble_1/chain"][3, 2, 1] = file["ensemble_1/chain"][3, 2, 1], np.inf
    with pytest.raises(InputError, match="some walkers or their log-densities are not finite"):
        run(path, resume=True)
    with h5py.File(path, "r+") as file:
        file["ensemble_1/chain"][3, 2, 1] = there
        file["ensemble_1"].attrs["random_state_1"] = np.zeros(0, np.uint32)
    with pytest.raises(InputError, match="cannot be read as a chain"):
        run(path, resume=True)


def test_the_seed_decides():
    settings = Settings(walkers=16, ensembles=2, max_steps=20, chunk=10)
    first, same = run(settings=settings), run(settings=settings)
    other = run(settings=Settings(walkers=16, ensembles=2, max_steps=20, chunk=10, seed=1))
    np.testing.assert_array_equal(first.chains, same.chains)
    assert not np.array_equal(first.chains, other.chains)
    assert not np.array_equal(first.chains[0], first.chains[1])
