"""The catalogue of physics that the published model leaves out.

An effect with its parameters at their neutral values changes nothing. `CATALOGUE` finds one by its slug. A
module in this folder joins the catalogue automatically: every `Effect` in it that has a slug. `register` adds
one from elsewhere.
"""

import functools
import importlib
import pkgutil
from collections.abc import Iterator, MutableMapping

from ..errors import InputError, nearest
from ..pipeline import Effect
from ._spec import Spec, specs_of


class _Catalogue(MutableMapping[str, type[Effect]]):
    """Effects by slug, those of this folder in alphabetical order.

    Their modules are loaded at the first look, since a state without effects does without them.
    """

    @functools.cached_property
    def _effects(self) -> dict[str, type[Effect]]:
        found = {}
        for module in pkgutil.iter_modules(__path__):
            if not module.name.startswith("_"):
                for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
                    if isinstance(value, type) and issubclass(value, Effect) and value.slug:
                        found[value.slug] = _complete(value)
        return {slug: found[slug] for slug in sorted(found)}

    def __getitem__(self, slug: str) -> type[Effect]:
        return self._effects[slug]

    def __setitem__(self, slug: str, effect: type[Effect]) -> None:
        self._effects[slug] = effect

    def __delitem__(self, slug: str) -> None:
        del self._effects[slug]

    def __iter__(self) -> Iterator[str]:
        return iter(self._effects)

    def __len__(self) -> int:
        return len(self._effects)


CATALOGUE = _Catalogue()


def register(effect: type[Effect]) -> type[Effect]:
    """Add an effect to the catalogue; also as a decorator.

    Raises:
        ValueError: if its slug is taken by another class, or it lacks one of its class attributes.
    """
    if CATALOGUE.setdefault(_complete(effect).slug, effect) is not effect:
        raise ValueError(f"The slug {effect.slug!r} is taken by {CATALOGUE[effect.slug].__name__}.")
    return effect


def _complete(effect: type[Effect]) -> type[Effect]:
    """The effect, if it states all that an effect must state.

    Raises:
        ValueError: if it lacks one of its class attributes.
    """
    for name in ("slug", "component", "kinds", "sentence", "literature", "specs"):
        if not getattr(effect, name, None):
            raise ValueError(f"Effect {effect.__name__} must state its `{name}`, but does not.")
    return effect


def find_effect(slug: str) -> type[Effect]:
    """Class of an effect by its name in the catalogue.

    Raises:
        InputError: if there is none; names the nearest.
    """
    if slug not in CATALOGUE:
        raise InputError(f"there is no effect {slug!r}, {nearest(slug, CATALOGUE)}")
    return CATALOGUE[slug]


__all__ = ["CATALOGUE", "Effect", "Spec", "find_effect", "register", "specs_of"]
