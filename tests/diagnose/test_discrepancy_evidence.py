"""A correction without a name: found where physics is missing, not where an instrument drifts."""

import numpy as np
import pytest
from diagnosis_coupons import NOISE, course, curve, put, write
from linear_world import tubes

from fitting.data.recordings import read_campaign
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.fit.base_fit import base_fit
from fitting.diagnose.fit.misfit import reduced
from fitting.diagnose.fit.refit import Refitter
from fitting.diagnose.search.steps import Explanation, Named
from fitting.diagnose.settings import DEFAULT
from fitting.diagnose.verdict.discrepancy import fitted_discrepancy
from fitting.diagnose.verdict.discrepancy_evidence import best_discrepancy
from fitting.diagnose.verdict.locate import Place, distinct_drivers, drivers_of, knots_of, like_time
from fitting.diagnose.verdict.unexplained import contradicted
from pneusma_jax.model_discrepancy import unmodelled
from pneusma_jax.silicone import load_silicone
from pneusma_jax.simulate.coupon import simulate_coupon

FEW = "mullins_softening"
"""The effect of programs that are asked for drivers alone: those of all effects compile longer."""


def raced(folder, law):
    program, base = base_fit(Program.of(read_campaign(write(folder, law)), "elastomer"))
    return best_discrepancy(program, base), reduced(program, base, program.fitted)


def drifting(strain):
    """Drift of half the noise, another in every recording, which first-order noise of a long memory makes."""
    rng = np.random.default_rng(int(1e6 * strain.sum()) + 1)
    value, found = rng.normal(), []
    for _ in strain:
        value = 0.97 * value + np.sqrt(1.0 - 0.97**2) * rng.normal()
        found.append(value)
    return 1.02 * curve(strain) + 0.5 * NOISE * np.array(found)


def test_a_small_ripple_is_found_with_what_it_goes_with(tmp_path):
    """Its root mean square is less than that of the noise: no reduced chi-square shows it."""
    found, left = raced(tmp_path / "c", lambda e: 1.02 * curve(e) + NOISE * np.sin(28.0 * e))
    assert left < 1.7
    assert found.bayes > DEFAULT.evidence.minimum_first
    assert (found.quantity, found.driver) == ("stress", "strain")
    assert found.left_out < left


@pytest.mark.parametrize("law", [lambda e: 1.02 * curve(e), drifting])
def test_noise_and_drift_are_no_physics(tmp_path, law):
    found, _ = raced(tmp_path / "c", law)
    assert found.bayes < 0.5 * DEFAULT.evidence.minimum_first


@pytest.mark.parametrize("ripple", [0.0, 1.0])
def test_beside_a_named_effect_only_what_it_leaves_has_evidence(tmp_path, ripple):
    """A force that is off is the effect; a ripple beside it is not."""
    folder = write(tmp_path / "c", lambda e: curve(e) + NOISE * (8.0 + ripple * np.sin(28.0 * e)))
    program, base = base_fit(Program.of(read_campaign(folder), "elastomer"))
    named = Refitter(program).fit(("force_calibration",), start=base)
    beside, about = (best_discrepancy(program, fit) for fit in (named, base))
    assert (beside.bayes > DEFAULT.evidence.minimum_first) is bool(ripple)
    assert about.bayes > beside.bayes


def test_no_correction_bends_within_the_noise_of_a_driver_that_is_held():
    """Held at two values for four fifths of the rows: what a model predicts there follows its driver's noise."""
    rng = np.random.default_rng(1)
    ramp, noise = np.linspace(0.0, 1.0, 40), 1e-4
    holds = [value + noise * rng.standard_normal(80) for value in (0.3, 0.8)]
    knots = knots_of(np.concatenate([ramp, *holds]), 24)
    assert np.diff(knots).min() > 10.0 * noise
    assert len(knots) >= 5
    even = knots_of(np.linspace(0.0, 1.0, 500), 24)
    assert len(even) == 24
    assert knots_of(np.full(50, 0.3), 24) is None


def test_a_chi_square_beyond_chance_contradicts_the_model_only_with_a_signature_and_a_stated_noise():
    def verdict(bound, stated, scored=1.1, noise=1.0):
        world = tubes(rows=125, stated=stated)
        program = world.program(world.truth(np.random.default_rng(2)))
        fit = Refitter(program).fit(())
        explanation = Explanation(program, fit, Named(fit), [], 0.001, bound)
        return contradicted(explanation, [1.3, scored], None, [noise, 1.0])

    assert verdict(True, True)
    assert not verdict(False, True) and not verdict(True, False)
    assert not verdict(True, True, 0.95)  # recordings for validation see nothing of it
    assert not verdict(True, True, noise=1.25)  # it changes from row to row


def test_a_silicone_that_cures_is_a_stiffness_that_goes_with_time(tmp_path):
    """Not a drifting force: where nothing pulls, nothing changes. Its remainder is what was done to it."""
    cured = lambda size: np.linspace(0.0, 120.0, size) / (np.linspace(0.0, 120.0, size) + 60.0)  # noqa: E731
    folder = write(tmp_path / "c", lambda e: curve(e) * (0.9 + 0.3 * cured(e.size)))
    program, base = base_fit(Program.of(read_campaign(folder), "elastomer"))
    found = best_discrepancy(program, base)
    assert (found.quantity, found.driver) == ("silicone_stiffness", "time")
    assert found.bayes > DEFAULT.evidence.minimum_first and found.left_out < 1.3
    rest = fitted_discrepancy(program, base, Place(["time"], {}, [], None), found.quantity)
    assert rest.quantity == "silicone_stiffness"
    stiffness = float(program.unknowns.items[0].value(base.u[0]))
    late = np.array([10.0, 60.0, 110.0])
    told = stiffness * (1.0 + np.interp(late, rest.knots, rest.values))
    assert np.allclose(told, 0.9 + 0.3 * late / (late + 60.0), rtol=0.02)
    effect = unmodelled(rest.knots, rest.values, "silicone", rest.quantity, rest.driver)
    plain = load_silicone("dragon_skin_10_fast")
    seen = simulate_coupon(plain, np.full(3, 0.4), time=late, effects=(effect,)).seen
    change = np.interp(late, rest.knots, rest.values)
    assert np.allclose(seen["stress"], plain(np.full(3, 0.4)) * (1.0 + change), rtol=1e-12)
    assert np.allclose(seen["unmodelled_silicone_stiffness"], change, rtol=1e-12)


@pytest.mark.parametrize(("levels", "rate", "like"), [([], 1.0, "strain"), ([], 2.0, ""), ([0.4], 1.0, "")])
def test_time_is_no_driver_of_its_own_where_strain_says_the_same(tmp_path, levels, rate, like):
    """Steady pulls at one rate. A second rate, or a way back, tells strain from time."""
    rng = np.random.default_rng(3)
    for k in range(2):
        strain = course(levels) if levels else np.linspace(0.0, 0.5, 90)
        time = np.linspace(0.0, 60.0 * (rate if k else 1.0), 90)
        stress = curve(strain) * (1.0 + 2.0 * strain**2) + NOISE * rng.standard_normal(90)
        put(tmp_path / "pulls", f"pull_{k}", strain, stress, time=time)
    program, base = base_fit(Program.of(read_campaign(tmp_path / "pulls"), "elastomer", [FEW]))
    assert like_time(program, drivers_of(program, base)) == like
    assert ("time" in distinct_drivers(program, base)) is (like == "")


@pytest.mark.parametrize("strain", [np.linspace(0.0, 1.0, 22), np.r_[np.linspace(0.0, 0.3, 100), [0.31] * 14, np.linspace(0.32, 1.0, 186)]])
def test_strain_stands_for_time_where_rows_are_few_or_held(tmp_path, strain):
    """Some bins of the strain hold no row then."""
    put(tmp_path / "pull", "pull", strain, curve(strain))
    program, base = base_fit(Program.of(read_campaign(tmp_path / "pull"), "elastomer", [FEW]))
    assert like_time(program, drivers_of(program, base)) == "strain"
