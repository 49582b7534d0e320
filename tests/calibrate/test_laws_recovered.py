"""Every law, fitted to its own simulated data, gives back the constants it was made with, and honest errors."""

import numpy as np
import pytest

from fitting.calibrate.elastomer.engine import Engine
from fitting.calibrate.elastomer.laws import LAWS
from fitting.synthesise.elastomer import Pull
from pneusma_jax.silicone import Gent, NeoHookean, Ogden, PolynomialFit, Yeoh

POLYNOMIAL = [-60e3, 240e3, -260e3, 235e3, -0.4e3]
CASES = {
    "polynomial": (lambda: PolynomialFit(POLYNOMIAL, 0.0, 1.5), POLYNOMIAL, 2.5),
    "neo_hookean": (lambda: NeoHookean(85e3), [85e3], 2.0),
    "yeoh": (lambda: Yeoh(20e3, 0.8e3, 30.0), [20e3, 0.8e3, 30.0], 4.0),
    "gent": (lambda: Gent(45e3, 30.0), [45e3, 30.0], 4.5),
    "ogden_1": (lambda: Ogden([25e3], [3.2]), [25e3, 3.2], 4.0),
    "ogden_2": (lambda: Ogden([45e3, 1.2e3], [1.7, 5.0]), [45e3, 1.7, 1.2e3, 5.0], 4.0),
    "ogden_3": (
        lambda: Ogden([-6e3, 40e3, 0.05e3], [-3.0, 1.8, 8.0]),
        [-6e3, -3.0, 40e3, 1.8, 0.05e3, 8.0],
        4.0,
    ),
}
QUICK = ("polynomial", "yeoh", "ogden_2")


@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n in QUICK else pytest.mark.slow) for n in CASES])
def test_constants_are_recovered_within_three_standard_errors(name, pulled):
    law, truth, stretch = CASES[name]
    low = 0.45 if name == "ogden_3" else 1.0  # its negative exponent shows in compression alone
    pulls = (Pull("A", stretch, 0.1), Pull("A", low, 0.1)) if low < 1.0 else (Pull("A", stretch, 0.1),) * 2
    samples = pulled(law(), pulls, noise=300.0, seed=4)
    fit = Engine(samples).fit(LAWS[name], samples.fitted, errors=True)
    assert fit.result.success
    assert not fit.at_bound
    np.testing.assert_array_less(np.abs(fit.values - truth), 3.0 * fit.sd)
    assert np.all(fit.sd < 0.5 * np.abs(truth) + 1e3)


def test_standard_errors_are_those_of_repeated_campaigns_with_correlated_noise(pulled):
    law, truth = Yeoh(20e3, 0.8e3, 30.0), np.array([20e3, 0.8e3, 30.0])
    found, claimed = [], []
    for seed in range(40):
        samples = pulled(law, (Pull("A", 4.0, 0.1),), seed=seed, memory=0.8)
        fit = Engine(samples).fit(LAWS["yeoh"], samples.fitted, errors=True)
        found.append(fit.values)
        claimed.append(fit.sd)
    scatter = np.std(found, axis=0)
    ratio = scatter / np.mean(claimed, axis=0)
    assert np.all((ratio > 0.65) & (ratio < 1.45)), ratio
    assert np.all(np.abs(np.mean(found, axis=0) - truth) < 3.5 * scatter / np.sqrt(40))
    # Without regard to the correlation they would be about three times too small.
    assert np.mean([s[0] for s in claimed]) > 2.0 * scatter[0] / 3.0


def test_specimens_get_their_own_factor(pulled):
    pulls = (Pull("A", 4.0, 0.1), Pull("B", 4.0, 0.1), Pull("C", 4.0, 0.1))
    samples = pulled(Yeoh(20e3, 0.8e3, 30.0), pulls, batch=0.05, seed=7)
    fit = Engine(samples).fit(LAWS["yeoh"], samples.fitted, errors=True)
    random = np.random.default_rng(7)
    truth = {name: 1.0 + 0.05 * random.standard_normal() for name in "ABC"}
    mean = np.mean(list(truth.values()))
    for name, (factor, sd) in fit.factors.items():
        assert factor / np.mean([f for f, _ in fit.factors.values()]) == pytest.approx(truth[name] / mean, abs=0.004)
        assert 0.02 < sd < 0.05  # the common level is known from the prior alone
    assert abs(fit.values[0] - 20e3) < 3.0 * fit.sd[0]
    assert fit.sd[0] > 0.02 * fit.values[0] > 3.0 * fit.sd_within[0] * 0.5


def test_shear_modulus_is_that_of_the_law(pulled):
    samples = pulled(NeoHookean(85e3))
    engine = Engine(samples)
    for name in ("neo_hookean", "yeoh", "gent"):
        fit = engine.fit(LAWS[name], samples.fitted, errors=True)
        by_hand = 2.0 * fit.values[0] if name == "yeoh" else fit.values[0]
        modulus, sd = fit.shear_modulus()
        assert modulus == pytest.approx(by_hand, rel=1e-9)
        assert sd == pytest.approx((2.0 if name == "yeoh" else 1.0) * fit.sd[0], rel=1e-6)


def test_constants_can_be_fixed_bounded_and_tied(pulled):
    law = PolynomialFit(POLYNOMIAL, 0.0, 1.5)
    samples = pulled(law, (Pull("A", 2.5, 0.1),), noise=300.0)
    adjust = {
        "p_5": {"value": 0.0, "vary": False},
        "p_4": {"min": 240.0, "max": 300.0},
        "p_3": {"tie": "-p_4"},
    }
    fit = Engine(samples, adjust).fit(LAWS["polynomial"], samples.fitted, errors=True)
    assert fit.values[4] == 0.0 and fit.sd[4] == 0.0
    assert fit.values[3] >= 240e3
    assert fit.values[2] == -fit.values[3]


def test_a_constant_at_its_bound_says_so(pulled):
    """A neo-Hookean material has no chain limit: Gent's law runs to the end of its search."""
    samples = pulled(NeoHookean(85e3), (Pull("A", 3.0, 0.1),), noise=10.0, seed=3)
    fits = [Engine(samples).fit(LAWS[name], samples.fitted, errors=True) for name in ("gent", "ogden_2")]
    assert any("bound" in text for fit in fits for text in fit.at_bound.values())
    for fit in fits:
        for name in fit.at_bound:
            assert np.isnan(fit.sd[fit.law.names.index(name)])


def test_starts_lie_within_their_bounds():
    strain = np.linspace(-0.4, 2.0, 60)
    stress = 40e3 * ((1 + strain) - (1 + strain) ** -2.0)
    for law in LAWS.values():
        starts = law.starts(strain, stress, np.full(60, 100.0), seed=5)
        assert starts
        for start in starts:
            assert np.all((start.lower <= start.values) & (start.values <= start.upper))
