"""The base model refitted, with the noise that recordings show about it: what every search begins with."""

import numpy as np

from ..evaluate.program import Program
from ..evaluate.side_by_side import side_by_side
from .apart import without_apart
from .campaign_noise import with_noise_of
from .evidence import inflation_of
from .misfit import reduced
from .refit import Fit, Refitter

POOR = 1.2
"""Reduced chi-square of the base model from which its fit is tried from the other side of nominal, too."""
SCATTERED = 7
"""Further starts of the same, beside hidden courses; two of five found the better of two optima."""
MIRRORED, CLEARLY = 2.0, 5.0
"""Standard deviations from nominal at which those begin at most; and the log-likelihood, deflated as evidence
is, by which it must be better."""
SETTLING = 2
"""Rounds in which noise is told from what a base model leaves, and the base model fitted with it."""


def settled_fit(program: Program, start: np.ndarray | None = None) -> tuple[Program, Fit]:
    """The base model refitted, and the program with the noise and the hidden courses that it shows.

    Where much is left the fit is made again from the other side of nominal, and beside hidden courses from
    places all about it: fractions at their limits, and rows that a metal remembers, shut in false optima that
    would pass for missing physics.
    """
    program, fit = _settled(program, Refitter(program).fit((), start))
    if reduced(program, fit, program.fitted) > POOR:
        others = side_by_side(lambda u: Refitter(program).fit((), u), _elsewhere(program, fit))
        other = min(others, key=lambda f: f.objective)
        if (fit.objective - other.objective) / inflation_of(program, fit) > CLEARLY:
            program, fit = _settled(program, other)
    return program, fit


def _elsewhere(program: Program, fit: Fit) -> list[np.ndarray]:
    """Starts far from where a fit of the base model ended, scaled."""
    starts, rng = [np.clip(-fit.u, -MIRRORED, MIRRORED)], np.random.default_rng(0)
    for _ in range(SCATTERED if program.hidden else 0):
        starts.append(fit.u.copy())
        base = program.unknowns.base
        starts[-1][base] = np.clip(rng.standard_normal(len(base)), -MIRRORED, MIRRORED)
    return starts


def _settled(program: Program, fit: Fit) -> tuple[Program, Fit]:
    """The program with the noise that a base model shows, and its fit there; without readings that stand
    apart from what the model leaves."""
    program = without_apart(program, fit.evaluation)
    for _ in range(SETTLING):
        program = with_noise_of(program, fit.evaluation).prepared(fit.u, fit.evaluation)
        if program.pace.shape[1]:
            program.count_input_noise(fit.u)
        fit = Refitter(program).fit((), fit.u)
    return program, fit
