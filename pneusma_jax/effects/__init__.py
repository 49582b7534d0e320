"""The catalogue of physics that the published model leaves out.

An effect with its parameters at their neutral values changes nothing. `CATALOGUE` finds one by its slug. A
module in this folder joins the catalogue automatically: every `Effect` in it that has a slug. `register` adds
one from elsewhere.
"""

import importlib
import pkgutil

from ..errors import InputError, nearest
from ..pipeline import Effect
from ._spec import Spec, specs_of

CATALOGUE: dict[str, type[Effect]] = {}


def register(effect: type[Effect]) -> type[Effect]:
    """Add an effect to the catalogue; also as a decorator.

    Raises:
        ValueError: if its slug is taken by another class, or it lacks one of its class attributes.
    """
    for name in ("slug", "component", "kinds", "sentence", "literature", "specs"):
        if not getattr(effect, name, None):
            raise ValueError(f"Effect {effect.__name__} must state its `{name}`, but does not.")
    if CATALOGUE.setdefault(effect.slug, effect) is not effect:
        raise ValueError(f"The slug {effect.slug!r} is taken by {CATALOGUE[effect.slug].__name__}.")
    return effect


def find_effect(slug: str) -> type[Effect]:
    """Class of an effect by its name in the catalogue.

    Raises:
        InputError: if there is none; names the nearest.
    """
    if slug not in CATALOGUE:
        raise InputError(f"there is no effect {slug!r}, {nearest(slug, CATALOGUE)}")
    return CATALOGUE[slug]


def _collect() -> None:
    """Fill the catalogue, in alphabetical order, from the modules of this folder."""
    found = {}
    for module in pkgutil.iter_modules(__path__):
        if not module.name.startswith("_"):
            for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
                if isinstance(value, type) and issubclass(value, Effect) and value.slug:
                    found[value.slug] = value
    for slug in sorted(found):
        register(found[slug])


_collect()

__all__ = ["CATALOGUE", "Effect", "Spec", "find_effect", "register", "specs_of"]
