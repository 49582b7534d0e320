"""Recordings of which the model has no answer are refused; noise that is far too large is told."""

import dataclasses

import numpy as np
import pytest

from fitting.diagnose import diagnose
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.standard_errors import stated_too_large
from fitting.synthesise import synthesise
from pneusma_jax.errors import InputError


@pytest.fixture(scope="module")
def tube():
    return synthesise("tube", seed=3).campaign


def changed(campaign, **fields):
    """The campaign with other fields of every recording."""
    made = [dataclasses.replace(r, **{k: of(r) for k, of in fields.items()}) for r in campaign.recordings]
    return dataclasses.replace(campaign, recordings=made)


def test_a_vacuum_in_every_row_is_refused_with_the_inputs(tube, monkeypatch):
    vacuum = lambda r: np.linspace(-99.0, -98.0, len(r.columns["time_s"]))  # noqa: E731
    emptied = changed(tube, columns=lambda r: {**r.columns, "pressure_kPa": vacuum(r)})
    monkeypatch.setattr("fitting.diagnose.evaluate.program.candidates", lambda kind: [])  # they compile, and are not asked
    with pytest.raises(InputError, match="has no answer in any row .* pressure_kPa from -99 to -98"):
        diagnose(emptied)


@pytest.mark.parametrize("times", [1.0, 20.0])
def test_noise_that_is_far_larger_than_the_scatter_is_told(tube, times):
    louder = changed(tube, noise=lambda r: {name: times * sd for name, sd in r.noise.items()})
    program, fit = base_fit(Program.of(louder, "tube", slugs=[]))
    told = stated_too_large(program, fit)
    assert bool(told) == (times > 1.0)
    assert all("noise is too large" in sentence for sentence in told)
