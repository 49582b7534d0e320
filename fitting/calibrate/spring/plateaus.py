"""Quantities that tests of a spring determine best: resistivities of both phases, and stresses at strains
they reached."""

from collections.abc import Callable, Mapping, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from fitting.calibrate.combinations import Combination, propagated
from fitting.calibrate.profile_likelihood import Profile
from fitting.specimens.spring_rows import ALLOY
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.nitinol import Alloy
from pneusma_jax.units import from_si

from .joint import Joint
from .stand_tests import StandTest

SHARES = (0.25, 0.5, 1.0)
"""Shares of the largest shear strain of a phase's tests at which its stress is quoted."""
ROUND = 0.001
"""Shear strains are rounded to."""


def plateaus(
    joint: Joint,
    base: Mapping[str, Quantity],
    tests: Sequence[StandTest],
    profiles: Mapping[str, Profile],
    covariance: np.ndarray,
) -> list[Combination]:
    """Resistivities of both phases at rest and stretched, and their stresses, each with its 90 % interval.

    Args:
        joint: the fit, with the errors of the best start alone.
        base: constants of the alloy that it started from.
        tests: the fitted tests; a phase that no test shows is left out.
        profiles: profiles of the constants.
        covariance: covariance of the constants that the fit's uncertainty names, which counts zeros.
    """
    labels, law = shown_by(base, tests)
    return propagated(labels, law, joint.values, joint.result.uncertainty, profiles, covariance)


def shown_by(
    base: Mapping[str, Quantity], tests: Sequence[StandTest]
) -> tuple[list[tuple[str, str]], Callable[[Mapping[str, Array]], Array]]:
    """Names and units of what tests show, and the quantities in those units at constants by name, SI."""
    labels: list[tuple[str, str]] = []
    laws: list[Callable[[Alloy], Array]] = []
    for phase, word, xi0 in (("cold", "martensite", 1.0), ("hot", "austenite", 0.0)):
        mine = [test for test in tests if test.phase == phase]
        if not mine:
            continue
        far = _rounded(max(test.gamma for test in mine))
        if any(np.isfinite(test.resistivity) for test in mine):
            for gamma in (0.0, far):
                labels.append((f"resistivity of {word} at shear strain {gamma:.3g}", "ohm/m"))
                laws.append(lambda a, g=gamma, x=xi0: a.resistivity(jnp.asarray(x), jnp.asarray(g)))
        for share in SHARES:
            gamma = _rounded(share * far)
            labels.append((f"stress of {word} at shear strain {gamma:.3g}", "MPa"))
            laws.append(lambda a, g=gamma, x=xi0: _stress(a, g, x))
    fixed = {name: jnp.asarray(float(base[name].value)) for name in ALLOY}
    units = [unit for _, unit in labels]

    def law(values: Mapping[str, Array]) -> Array:
        alloy = Alloy(**{**fixed, **{n: v for n, v in values.items() if n in ALLOY}})
        found = [from_si(one(alloy), unit) for one, unit in zip(laws, units, strict=True)]
        return jnp.stack([jnp.asarray(x) for x in found])

    return labels, law


def _rounded(gamma: float) -> float:
    return float(np.round(gamma / ROUND) * ROUND)


def _stress(alloy: Alloy, gamma: float, xi0: float) -> Array:
    """Shear stress of a first pull [Pa]."""
    return alloy.shear_stress(jnp.asarray(gamma), jnp.asarray(xi0), jnp.asarray(0.0))
