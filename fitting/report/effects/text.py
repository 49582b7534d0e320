"""The catalogue and its entries in words, for a terminal."""

import inspect
import math
import textwrap

from fitting.specimens import SPECIMENS
from fitting.specimens.registry import named_by
from pneusma_jax.effects import CATALOGUE, Effect, find_effect, specs_of

from ..table import WIDTH, Table, table_text


def catalogue_table() -> str:
    """Table of every effect: name, kinds of recording that can show it, place in a report, description."""
    rows = [(slug, effect.kinds, effect.component, effect.sentence) for slug, effect in CATALOGUE.items()]
    table = Table(("effect", "kinds", "where", "what was left out"), rows)
    letters = ", ".join(f"{one.letter} {one.kind}" for one in SPECIMENS.values())
    return f"{table_text(table, indent=0, width=math.inf)}\n\nkinds: {letters}"


def _only(kinds: str) -> str:
    """Kinds of recordings to which a sentence is limited, in brackets; nothing for all."""
    return f" (only: {', '.join(named_by(kinds))})" if kinds else ""


def _lookalike(effect: type[Effect]) -> str:
    return f"Looks the same{_only(effect.lookalike_kinds)}: {effect.lookalike}."


def described(slug: str) -> str:
    """One effect: description, law, source, and parameters with their ranges.

    Raises:
        InputError: if there is none; names the nearest.
    """
    effect = find_effect(slug)
    law = " ".join(inspect.getdoc(effect).split())
    lines = [
        slug,
        *_filled(effect.sentence),
        *(line for kind, text in effect.sentences.items() for line in _filled(f"{text[:-1]}{_only(kind)}.")),
        *(_filled(_lookalike(effect)) if effect.lookalike else ()),
        "",
        *_filled(f"Law: {law}"),
        *_filled(f"Source: {effect.literature}."),
        *_filled(f"Reported as: {effect.component}; in: {', '.join(named_by(effect.kinds))}."),
        *_filled(f"Acts at: {', '.join(acts_at(effect))}."),
        "",
    ]
    for name, spec in effect.specs.items():
        absent = "shape" if spec.shape else f"absent at {spec.neutral:g}"
        numbers = f"{spec.low:g} to {spec.high:g} {spec.unit}, typically {spec.typical:g}; {absent}"
        lines.append(f"  {name:18} {spec.text}{_only(spec.kinds)}: {numbers}")
        own = {k: s[name].text for k in effect.kinds if name in (s := specs_of(effect, k))}
        for text in dict.fromkeys(own.values()):
            if text != spec.text:
                lines.append(f"  {'':18} {text}{_only(''.join(k for k in own if own[k] == text))}")
    return "\n".join(lines)


def acts_at(effect: type[Effect]) -> list[str]:
    """Slots of a row that an effect overrides, in the order of `Effect`."""
    housekeeping = {"begin", "remember"}
    slots = [n for n, f in vars(Effect).items() if inspect.isfunction(f) and not n.startswith("_")]
    return [n for n in slots if n not in housekeeping and getattr(effect, n) is not getattr(Effect, n)]


def _filled(text: str) -> list[str]:
    return textwrap.wrap(text, WIDTH, initial_indent="  ", subsequent_indent="  ")
