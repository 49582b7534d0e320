"""Sentences about effects that explain something and are not named."""

from collections.abc import Sequence

from fitting.inference.notes import joined
from fitting.inference.numbers import number

from ..settings import DEFAULT
from .misfit_text import not_fitted, went

SHARE = DEFAULT.share


def needless(sized: Sequence[str]) -> str:
    """A sentence about effects, with their sizes, that explain less than the accuracy of instruments of
    unstated noise."""
    it = "explains" if len(sized) == 1 else "explain"
    return (
        f"{joined(sized)} {it} some of what the base model misses, which is less than instruments of "
        "unstated noise do: not accepted"
    )


def refused(slugs: Sequence[str], how: str, before: float, after: float) -> str:
    """A sentence about effects that fit better and predict worse."""
    it = "it" if len(slugs) == 1 else "them"
    return (
        f"{joined(slugs)} would fit the recordings better, but with {it} the misfit of "
        f"{not_fitted(how)} {went(before, after)}: not accepted"
    )


def contended(slugs: tuple[str, ...], named: bool) -> str:
    """A sentence about effects that explain more than the model does, but no more than instruments do.

    Args:
        slugs: the effects.
        named: the model has effects.
    """
    explain = "together explain and predict" if len(slugs) > 1 else "explains and predicts"
    less = "what is named" if named else "the base model"
    return (
        f"{joined(slugs)} {explain} the recordings better than {less}, "
        "but drift or noise of the instruments explains the difference as well"
    )


def beyond_form(slug: str, named: Sequence[str]) -> str:
    """A sentence about an effect that explains less beside others than their forms are known by."""
    they = "it explains" if len(named) == 1 else "they explain"
    return (
        f"{slug} beside {joined(named)} would explain less than "
        f"{number(100.0 * SHARE.small**2)} % of what {they}, and no form is known so well: not "
        "accepted"
    )


def small_share(slug: str, named: Sequence[str]) -> str:
    """A sentence about an effect that would remove most of what others leave, and little of the whole."""
    whose = "its form" if len(named) == 1 else "their forms"
    return (
        f"{slug} beside {joined(named)} would explain most of what is left, which is less than "
        f"{number(100.0 * SHARE.small)} % of the whole misfit. So little may also be left by {whose}: not "
        "accepted, but it may act as well"
    )
