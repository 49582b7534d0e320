"""Detwinned martensite that stays: part of it throughout, or all of it up to a cap."""

import numpy as np
import pytest
from effect_programs import specimen

from pneusma_jax.effects.electrical import DetwinnedResistivityMemory
from pneusma_jax.pipeline import Known

RESIDUAL = 0.07
STRAINS = np.linspace(0.0, 0.16, 9)


def detwinned(effect, gamma):
    """Detwinned fraction that a cold spring's resistance shows at a strain, and the base law's."""
    spring = specimen("S")
    alloy, length = spring.alloy, spring.geometry.wire_length
    at = Known({"spring": spring, "gamma": gamma, "gamma_R": RESIDUAL, "xi0": 1.0})
    ohms = float(effect.resistance(alloy.resistivity(1.0, gamma) * length, at, None))
    fractions = np.linspace(0.0, 1.0, 2001)
    resistivity = np.array([float(alloy.rho_m_of(x)) for x in (0.0, 1.0)])
    grid = np.asarray(alloy.rho_m_of(fractions))
    order = np.sign(resistivity[1] - resistivity[0])
    return float(np.interp(order * ohms / length, order * grid, fractions)), float(alloy.xi_sm(gamma))


@pytest.mark.parametrize("share", [0.5, 0.75])
def test_up_to_a_cap_nothing_shows_above_it_and_the_cap_below(share):
    effect = DetwinnedResistivityMemory(share=share, capped=1.0)
    cap = share * RESIDUAL / float(specimen("S").alloy.gamma_L)
    for gamma in STRAINS:
        shown, now = detwinned(effect, gamma)
        assert shown == pytest.approx(max(now, cap), abs=5e-3)


def test_a_part_of_it_shows_throughout():
    effect, retained = DetwinnedResistivityMemory(share=0.5), RESIDUAL / float(specimen("S").alloy.gamma_L)
    for gamma in STRAINS:
        shown, now = detwinned(effect, gamma)
        assert shown == pytest.approx(now + 0.5 * max(retained - now, 0.0), abs=5e-3)


def test_both_forms_are_the_same_where_all_of_it_stays():
    for gamma in STRAINS:
        one, other = (detwinned(DetwinnedResistivityMemory(share=1.0, capped=c), gamma)[0] for c in (0.0, 1.0))
        assert one == pytest.approx(other, abs=1e-9)


def test_neither_form_changes_anything_without_a_share():
    for gamma in STRAINS:
        shown, now = detwinned(DetwinnedResistivityMemory(share=0.0, capped=1.0), gamma)
        assert shown == pytest.approx(now, abs=5e-3)
