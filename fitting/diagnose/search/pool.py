"""Fitted sets of effects, each by its best fit, and their evidence over the base model."""

from collections.abc import Iterable

from ..evaluate.program import Program
from ..fit.evidence import effective_degrees_of_freedom, evidence, inflation_of
from ..fit.refit import Fit, Refitter


class Pool:
    """The best fit of every set of effects that was tried.

    Args:
        program: program of the campaign.
        base: the base model refitted, which is the empty set.
    """

    def __init__(self, program: Program, base: Fit):
        self.program, self._fits, self._fair = program, {frozenset(): base}, set()

    @property
    def base(self) -> Fit:
        """The best fit of the base model."""
        return self._fits[frozenset()]

    def add(self, fits: Iterable[Fit]) -> None:
        """Take fits in, where they are better than what there is."""
        for fit in fits:
            held = self.get(fit.slugs)
            if held is None or fit.objective < held.objective:
                self._fits[frozenset(fit.slugs)] = fit

    def get(self, slugs: Iterable[str]) -> Fit | None:
        """The best fit of a set."""
        return self._fits.get(frozenset(slugs))

    def of_size(self, size: int) -> list[Fit]:
        """Fits of all sets of a size, the best first."""
        return sorted((f for s, f in self._fits.items() if len(s) == size), key=lambda fit: fit.objective)

    @property
    def nearest(self) -> Fit:
        """The fit of least objective, whatever its effects."""
        return min(self._fits.values(), key=lambda fit: fit.objective)

    def without(self, fit: Fit, slug: str) -> Fit:
        """The best fit of a set without one of its effects, begun from the set's own numbers as well."""
        rest = tuple(s for s in fit.slugs if s != slug)
        if rest and (id(fit), slug) not in self._fair:  # a fit of the pool keeps its id
            self._fair.add((id(fit), slug))
            self.add([without(self.program, fit, slug)])
        return self.get(rest)

    def ranked(self) -> list[tuple[Fit, float]]:
        """All sets with effects and their log evidence over the base, deflated alike, the best first."""
        fits = [fit for slugs, fit in self._fits.items() if slugs]
        if not fits:
            return []
        inflation = inflation_of(self.program, min(fits, key=lambda fit: fit.objective))
        followed = effective_degrees_of_freedom(self.program, self.base)
        worth = [(f, evidence(self.program, self.base, f, inflation, followed)) for f in fits]
        return sorted(worth, key=lambda one: -one[1])


def without(program: Program, fit: Fit, slug: str) -> Fit:
    """A model refitted without one of its effects."""
    start, own = fit.u.copy(), program.unknowns.of([slug])
    start[own] = program.unknowns.neutral[own]
    rest = tuple(s for s in fit.slugs if s != slug)
    return Refitter(program).fit(rest, start, near=fit.evaluation)
