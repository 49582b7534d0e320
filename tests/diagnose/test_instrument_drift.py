"""What slow drift of the instruments explains as well is no evidence for an effect."""

import numpy as np
import pytest
from diagnosis_coupons import NOISE, curve, softened, write

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.instrument_drift import drift_columns, drift_gain, explained_by_drift
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.explain import explain
from fitting.diagnose.settings import DEFAULT


def fitted(folder, law, slug):
    program, base = base_fit(Program.of(read_campaign(write(folder, law)), "elastomer"))
    start = base.u.copy()
    own = program.unknowns.of([slug])
    start[own] = [program.unknowns.items[k].start for k in own]
    return program, base, Refitter(program).fit((slug,), start)


def drifting(strain):
    """A zero that drifts by 0.6 of the noise, to another place in every recording."""
    rng = np.random.default_rng(int(1e6 * strain.sum()))
    t = np.linspace(0.0, 1.0, strain.size)
    courses = [np.cos(np.pi * k * t) * rng.normal() / (1.0 + k) for k in range(5)]
    drift = np.sum(courses, axis=0)
    return 1.02 * curve(strain) + 0.6 * NOISE * drift / np.sqrt(np.mean(drift**2))


def test_evidence_is_that_of_the_whole_gaussian_model(tmp_path):
    """The closed form against the marginal likelihoods of all values, constants and drift integrated out."""
    program, base, _ = fitted(tmp_path / "c", drifting, "mullins_softening")
    here = base.evaluation
    counts = [np.full(len(m), float(f)) for m, f in zip(here.misfit, program.fitted, strict=True)]
    r, A = here.joined(counts)
    D = drift_columns(program, here) * np.concatenate(counts)[:, None]
    prior = np.linalg.inv(np.linalg.inv(base.covariance) - A.T @ A)
    mean = r - A @ base.u[base.free]  # misfit of nominal constants, to first order

    def evidence(size):
        V = np.eye(len(r)) + A @ prior @ A.T + size**2 * D @ D.T
        return -0.5 * (mean @ np.linalg.solve(V, mean) + np.linalg.slogdet(V)[1])

    gains = np.array([evidence(size) - evidence(0.0) for size in DEFAULT.drift.sizes])
    assert drift_gain(program, base)[0] == pytest.approx(np.log(np.mean(np.exp(gains))), rel=5e-3, abs=1e-3)


def test_a_drifting_zero_is_as_good_as_an_effect_that_follows_it(tmp_path):
    program, base, candidate = fitted(tmp_path / "c", drifting, "force_calibration")
    followed = base.objective - candidate.objective
    assert followed > 10.0
    assert explained_by_drift(program, base, candidate) > 0.5 * followed
    assert explain(program, np.random.default_rng(1)).final.slugs == ()


def test_an_effect_larger_than_drift_loses_only_what_drift_could_be(tmp_path):
    program, base, candidate = fitted(tmp_path / "c", lambda e: softened(e, 0.3), "mullins_softening")
    gained = base.objective - candidate.objective
    gain, most = drift_gain(program, base)
    assert gain > most  # a misfit that is much too large for drift
    assert explained_by_drift(program, base, candidate) == pytest.approx(most)
    assert most < 0.1 * gained
    assert explain(program, np.random.default_rng(1)).final.slugs == ("mullins_softening",)
