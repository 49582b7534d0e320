"""Choice, drift, stability, identifiability and expected information, each on a case whose answer is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from fitting.calibrate.elastomer.analysis import analyse
from fitting.calibrate.elastomer.choice import _reason
from fitting.calibrate.elastomer.engine import Engine
from fitting.calibrate.elastomer.laws import LAWS
from fitting.calibrate.elastomer.pipeline import characterise_elastomer
from fitting.calibrate.elastomer.stability import stability
from fitting.calibrate.elastomer.unknowns import updated
from fitting.calibrate.identifiability import identifiability
from fitting.data.recordings import Campaign
from fitting.synthesise.elastomer import Pull, simulate_pulls
from pneusma_jax.silicone import NeoHookean, Ogden, PolynomialFit, Yeoh


def test_a_material_of_one_constant_shows_no_drift_and_gets_the_law_of_one_constant(pulled):
    samples = pulled(NeoHookean(85e3), seed=11)
    laws = [LAWS[name] for name in ("neo_hookean", "yeoh")]
    analysis = analyse(Engine(samples), laws, samples.fitted, for_actuator=False)
    assert not analysis.drifts["neo_hookean"][0].drifts
    assert analysis.choice.chosen == "neo_hookean"


def test_information_criteria_agree_with_their_formulas_for_white_noise(pulled):
    samples = pulled(Yeoh(20e3, 0.8e3, 30.0), memory=0.0, seed=2)
    laws = [LAWS[name] for name in ("neo_hookean", "yeoh", "polynomial")]
    analysis = analyse(Engine(samples), laws, samples.fitted, for_actuator=False)
    count = max(fit.independent for fit in analysis.fits.values())
    assert count > 0.85 * len(samples)
    ranked = {entry.name: entry for entry in analysis.choice.ranked}
    difference = analysis.fits["polynomial"].mean_square / analysis.fits["yeoh"].mean_square
    by_hand = count * np.log(difference) + (6 - 4) * np.log(count)
    assert ranked["polynomial"].bic - ranked["yeoh"].bic == pytest.approx(by_hand, rel=1e-9)
    assert ranked["yeoh"].bic == 0.0 and ranked["neo_hookean"].bic > 100.0
    assert sum(entry.weight for entry in ranked.values()) == pytest.approx(1.0)


def test_a_law_that_turns_back_is_found_out_and_passed_over(pulled):
    """A cubic material bends over past strain 1.2; the polynomial follows it, and is no law for a solid."""
    falling = PolynomialFit([0.0, -20e3, 0.0, 90e3, 0.0], 0.0, 1.5)
    samples = pulled(falling, (Pull("A", 2.6, 0.1),), noise=100.0, memory=0.0)
    laws = [LAWS[name] for name in ("polynomial", "neo_hookean")]
    analysis = analyse(Engine(samples), laws, samples.fitted, for_actuator=False)
    assert analysis.choice.ranked[0].name == "polynomial" and not analysis.choice.ranked[0].usable
    assert analysis.tested["polynomial"].falls_from == pytest.approx(np.sqrt(1.5), abs=0.02)
    assert analysis.choice.chosen == "neo_hookean"
    assert "falls from strain 1.2" in analysis.choice.reason


def test_stability_of_a_law_that_only_rises(pulled):
    samples = pulled(NeoHookean(85e3))
    fit = Engine(samples).fit(LAWS["neo_hookean"], samples.fitted)
    check = stability(fit, -0.5, 1.5)
    assert check.monotone and not check.locks(check)
    assert check.greatest_tangent == pytest.approx(fit.values[0] * 17.0, rel=0.05)


def test_identifiability_names_what_moves_together():
    names, values = ["mu", "j_m", "c"], np.array([10.0, 30.0, 1.0])
    spread = np.array([8.0, 24.0, 0.01])
    correlation = np.array([[1.0, -0.999, 0.0], [-0.999, 1.0, 0.0], [0.0, 0.0, 1.0]])
    found = identifiability(names, values, correlation * np.outer(spread, spread), {"c": "its lower bound 1"})
    kinds = [entry["kind"] for entry in found]
    assert kinds == ["at_bound", "correlation", "loose_direction"]
    assert found[1]["parameters"] == ["mu", "j_m"] and "one rises as the other falls" in found[1]["text"]
    assert set(found[2]["parameters"]) == {"mu", "j_m"}
    assert found[2]["relative_uncertainty"] == pytest.approx(0.8 * np.sqrt(1.999), rel=1e-6)
    sentences = found[2]["text"]
    assert "+10 %" in sentences and "-10 %" in sentences


def test_well_determined_parameters_raise_no_remark():
    assert identifiability(["a", "b"], np.array([1.0, 2.0]), np.diag([1e-4, 1e-4])) == []


def test_expected_information_agrees_with_the_precision_form():
    random = np.random.default_rng(0)
    root = random.standard_normal((4, 4))
    before, design = root @ root.T, random.standard_normal((6, 4))
    common = 0.3 * np.ones(6)
    after, information = updated(before, design, 0.5, common)
    errors = 0.25 * np.eye(6) + np.outer(common, common)
    precision = np.linalg.inv(before) + design.T @ np.linalg.solve(errors, design)
    np.testing.assert_allclose(after, np.linalg.inv(precision), rtol=1e-9, atol=1e-12)
    by_hand = 0.5 * (np.linalg.slogdet(before)[1] + np.linalg.slogdet(precision)[1])
    assert information == pytest.approx(by_hand, rel=1e-9)


@pytest.fixture(scope="module")
def compressed_too():
    pulls = (Pull("A", 2.6, 0.01), Pull("A", 0.45, 0.01))
    recordings, _ = simulate_pulls(Yeoh(20e3, 0.8e3, 30.0), pulls, batch=0.05, seed=9)
    return characterise_elastomer(Campaign("both ways", recordings, "memory"), law="yeoh")


def test_tests_that_were_made_are_not_proposed_again(compressed_too):
    names = [candidate.name for candidate in compressed_too.next_test.candidates]
    assert "compression" not in names and "larger_stretch" not in names
    assert names[0] == "another_specimen"  # already slow, already both ways: the batch is what is left
    assert compressed_too.next_test.before["rate"] == pytest.approx(0.0, abs=1.0)


def test_one_more_specimen_shrinks_the_batch_error_by_root_two(compressed_too):
    test = compressed_too.next_test
    after = next(c for c in test.candidates if c.name == "another_specimen").after["specimen"]
    assert after / test.before["specimen"] == pytest.approx(1.0 / np.sqrt(2.0), rel=0.05)


def test_a_pull_that_stops_short_is_to_be_pulled_further(pulled):
    recordings, _ = simulate_pulls(Yeoh(20e3, 0.8e3, 30.0), (Pull("A", 1.6, 0.01),), batch=0.0, seed=9)
    result = characterise_elastomer(Campaign("short", recordings, "memory"), law="yeoh")
    names = [candidate.name for candidate in result.next_test.candidates]
    assert {"larger_stretch", "compression"} <= set(names)
    assert names[0] in ("larger_stretch", "compression")
    assert result.actuator is result.whole


@pytest.mark.slow
def test_more_ogden_terms_never_fit_worse(pulled):
    """Exponents of -22 and 19, as of brain tissue in compression and of an isotropic gel, lie past the grid of starts."""
    for exponent, stretch in ((-22.0, 0.9), (19.0, 1.4), (-22.0, 1.15)):
        law = Ogden(np.array([2.0e4 / exponent]), np.array([exponent]))
        samples = pulled(law, (Pull("A", stretch, 0.1),), noise=1.0, memory=0.0)
        analysis = analyse(Engine(samples), [LAWS[f"ogden_{k}"] for k in (1, 2, 3)], samples.fitted, for_actuator=False)
        fits = {name: fit.mean_square for name, fit in analysis.fits.items()}
        assert fits["ogden_2"] <= 1.01 * fits["ogden_1"] and fits["ogden_3"] <= 1.01 * fits["ogden_1"]


def test_every_better_law_that_was_passed_over_is_named_with_its_reason(pulled):
    falling = PolynomialFit([0.0, -20e3, 0.0, 90e3, 0.0], 0.0, 1.5)
    samples = pulled(falling, (Pull("A", 2.6, 0.1),), noise=100.0, memory=0.0)
    analysis = analyse(Engine(samples), [LAWS[n] for n in ("polynomial", "yeoh", "neo_hookean")], samples.fitted,
                       for_actuator=False)  # fmt: skip
    choice = analysis.choice
    ranks = [entry.name for entry in choice.ranked]
    passed = ranks[: ranks.index(choice.chosen)]
    assert passed == ["polynomial", "yeoh"]
    for name in passed:
        assert f"{analysis.fits[name].law.label[1:]}, which {choice.unfit[name]}" in choice.reason


def test_a_law_that_was_passed_over_is_told_in_a_sentence_of_its_own():
    """It read "predicts gaps in the curve best, apart from polynomial of order 4, which falls"."""
    names = ["polynomial_4", "yeoh"]
    fits = {name: SimpleNamespace(law=SimpleNamespace(label=name.replace("_", " "))) for name in names}
    said = _reason("yeoh", "yeoh", names, fits, {"polynomial_4": "falls where it was tested"})
    assert said == (
        "Yeoh predicts gaps in the curve best of the laws without fault."
        " A law that predicts gaps better was not taken: polynomial 4, which falls where it was tested."
    )
    assert _reason("yeoh", "yeoh", ["yeoh", "polynomial_4"], fits, {}) == "Yeoh predicts gaps in the curve best."
