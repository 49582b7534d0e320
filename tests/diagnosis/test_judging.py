"""How what is left is judged: recordings that a fit has not seen, slow drift, and which effects a run holds."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.diagnosis.conclude import MOST_DRIFT, _steady
from fitting.diagnosis.generic import Generic
from fitting.diagnosis.side_by_side import THREADS, Tally, side_by_side
from fitting.diagnosis.trials import foretold, reduced
from fitting.diagnosis.unknowns import Unknowns
from fitting.parameters import Parameters

ROWS = 200


def judged(shift, sd, noise=0.0):
    """Reduced chi-square of an unseen recording that is off as a constant would shift it, that is known to `sd`."""
    A = np.ones((ROWS, 1))
    r = shift + noise * np.random.default_rng(1).standard_normal(ROWS)
    evaluation = SimpleNamespace(joined=lambda weight: (r * weight[1], A * weight[1]), chi2=lambda weight: float(r @ r))
    fit = SimpleNamespace(evaluation=evaluation, covariance=np.array([[sd**2]]), u=np.zeros(1), free=np.array([0]))
    program = SimpleNamespace(
        fitted=np.array([True, False]),
        unknowns=SimpleNamespace(low=np.array([-4.0]), high=np.array([4.0])),
        observations=lambda chosen: ROWS,
    )
    return [f(program, fit, np.array([False, True])) for f in (foretold, reduced)]


def test_an_open_constant_is_no_misfit_of_recordings_that_need_it():
    allowed, plain = judged(2.0, 1.0, 1.0)
    assert plain > 4.0
    assert allowed == pytest.approx(1.0, abs=0.2)


def test_a_constant_that_the_fit_knows_is_none_that_others_may_move():
    allowed, plain = judged(2.0, 0.01)
    assert allowed == pytest.approx(plain, rel=0.05)


def test_no_constant_leaves_its_bounds_to_excuse_a_recording():
    allowed, plain = judged(20.0, 1.0)
    assert allowed > 16.0**2
    assert allowed < plain


def test_drift_excuses_what_passes_for_noise_and_no_more():
    generic = Generic("stress", "time", 3.0, 1.0, 1.05)
    assert _steady(1.5, generic) == pytest.approx(1.05)
    assert _steady(3.9, generic) == pytest.approx(3.9 - MOST_DRIFT)
    assert _steady(3.9, None) == 3.9


@pytest.mark.parametrize("threads", ["1", "3"])
def test_jobs_side_by_side_keep_their_order_and_are_all_counted(monkeypatch, threads):
    monkeypatch.setenv(THREADS, threads)
    tally = Tally()

    def job(k):
        for _ in range(200):
            tally.count("runs")
        return k * k

    assert side_by_side(job, range(20)) == [k * k for k in range(20)]
    assert tally["runs"] == 4000
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda k: 1 // k, range(3))


def test_an_effect_is_present_where_it_acts_or_is_asked_for():
    unknowns = Unknowns(Parameters(), ["mullins_softening", "viscoelastic_relaxation", "permanent_set"], "E")
    u = unknowns.neutral.copy()
    assert not unknowns.present(u).any()
    shapes = unknowns.shapes("mullins_softening")
    u[shapes] += 0.3
    assert not unknowns.present(u).any()  # shapes of what is absent change nothing
    assert unknowns.present(u, shapes[:1]).tolist() == [True, False, False]
    u[unknowns.amplitudes("permanent_set")[0]] = 0.1
    assert unknowns.present(u).tolist() == [False, False, True]
