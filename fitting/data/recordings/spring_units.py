"""Questions about a spring whose stiffness and resistance do not go together.

A coil of n turns, diameter D, of a wire d has the stiffness k = G d / (8 c^3 n) and the resistance
R = 4 rho c n / d, with the index c = D / d. So k R = rho G / (2 c^2), which no size of the wire and no number
of coils changes. It mostly is impossible where force and elongation are swapped, or a unit is wrong.
"""

import numpy as np

from .recording import Recording
from .unit_question import Question, largest

RESISTIVITY = (3e-7, 3e-6)
"""Resistivities of nitinol, with a wide margin [ohm m]. It has 5e-7 to 1.1e-6."""
SHEAR_PA = (3e8, 3e10)
"""Secant moduli of a spring's wire in shear [Pa]. Martensite that yields has some 1e9, austenite 2.5e10."""
INDEX = (2.5, 30.0)
"""Indices of springs, the coil's diameter over the wire's [1]. Below 3 no wire is wound."""
MOST_OHM_N_PER_M = RESISTIVITY[1] * SHEAR_PA[1] / (2.0 * INDEX[0] ** 2)
LEAST_OHM_N_PER_M = RESISTIVITY[0] * SHEAR_PA[0] / (2.0 * INDEX[1] ** 2)
"""Ends of the product of stiffness and resistance [ohm N/m]; the springs of the source have 50 to 200."""


def spring_questions(recording: Recording) -> list[Question]:
    """Ask about a spring whose stiffness times resistance no nitinol has, with the swap that would fit."""
    needed = ("elongation_mm", "force_N", "resistance_ohm")
    if not all(name in recording.columns for name in needed):
        return []
    pulled, force, ohm = (largest(recording.columns[name]) for name in needed)
    resistance = float(np.nanmedian(recording.columns["resistance_ohm"]))
    if min(pulled, force, ohm) <= 0.0:
        return []
    product = 1e3 * force / pulled * resistance
    if LEAST_OHM_N_PER_M <= product <= MOST_OHM_N_PER_M:
        return []
    swapped = 1e3 * pulled / force * resistance
    would_fit = LEAST_OHM_N_PER_M <= swapped <= MOST_OHM_N_PER_M
    said = (
        f"{force:.4g} N at {pulled:.4g} mm and {resistance:.4g} ohm: no nitinol coil has this stiffness"
        " beside this resistance, whatever its sizes. "
    )
    if would_fit:
        said += (
            "Are the columns of force and elongation swapped? (on import: --map force=... --map"
            " elongation=... and --unit force=N --unit elongation=mm) Or is a unit wrong?"
        )
    else:
        said += "Are the units of force, elongation and resistance right? (on import: --unit ...)"
    return [Question("", said)]
