"""Backward elimination: effects that further ones make redundant are removed."""

from fitting.inference.parallel import run_parallel

from ..evaluate.program import Program
from ..fit.evidence import evidence, inflation_of
from ..fit.refit import Fit, Refitter
from ..settings import DEFAULT

OPTIMISER = DEFAULT.optimiser
EVIDENCE = DEFAULT.evidence


def polished(program: Program, fit: Fit) -> Fit:
    """A chosen model fitted once more, from its own numbers and from nominal base constants."""
    home = program.unknowns.at_nominal(fit.u)
    again = lambda start: Refitter(program).fit(fit.slugs, start, OPTIMISER.final_steps)  # noqa: E731
    options = run_parallel(again, (fit, home))
    return min([fit, *options], key=lambda f: f.objective)


def eliminated(program: Program, fit: Fit) -> Fit:
    """The model without a redundant effect, if there is one; the last effect has just entered and stays."""
    for slug in fit.slugs[:-1]:
        rest = without(program, fit, slug)
        if redundant(program, rest, fit):
            return rest
    return fit


def redundant(program: Program, rest: Fit, fit: Fit) -> bool:
    """Whether a model has less evidence over the rest of it than a further effect needs."""
    return evidence(program, rest, fit, inflation_of(program, fit)) < EVIDENCE.minimum_further


def without(program: Program, fit: Fit, slug: str) -> Fit:
    """A model refitted without one of its effects."""
    start, own = fit.u.copy(), program.unknowns.of([slug])
    start[own] = program.unknowns.neutral[own]
    rest = tuple(s for s in fit.slugs if s != slug)
    return Refitter(program).fit(rest, start, near=fit.evaluation)
