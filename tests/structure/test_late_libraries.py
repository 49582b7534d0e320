"""Libraries that most runs do without are loaded when they are first used, and not with the modules that may use them."""

import copy
import math
import pickle
import subprocess
import sys

import pytest

from pneusma_jax.late import Late

LATE = {
    "fitting.simulate.state": ("optimistix", "lineax", "scipy.optimize", "scipy.stats"),
    "fitting.calibrate": ("optimistix", "scipy.optimize", "scipy.stats"),
    "fitting.diagnose": ("optimistix", "scipy.optimize", "scipy.sparse.linalg", "scipy.stats"),
    "fitting.data.importers": ("h5py", "scipy.io"),
    "fitting.sample": ("optimistix", "blackjax"),
    "fitting.report": ("matplotlib", "optimistix"),
}
"""Modules of commands, and what loading them must leave alone. emcee loads `scipy.stats` itself."""


@pytest.mark.parametrize("module", LATE)
def test_what_a_run_may_do_without_is_loaded_late(module):
    code = f"import sys, {module}; print(*({{*sys.modules}} & {set(LATE[module])!r}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == ""


def test_a_late_library_can_be_copied_and_pickled():
    late = Late("math")
    assert copy.deepcopy(late).pi == pickle.loads(pickle.dumps(late)).pi == math.pi
