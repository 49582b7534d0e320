"""Lists of names in sentences, and sentences that several recordings share."""

from collections.abc import Iterable, Sequence

MOST_NAMES = 3
"""Maximum number of recordings that a sentence names."""


def joined(names: Iterable[str], last: str = "and") -> str:
    """Names as a sentence lists them: `a, b and c`."""
    names = list(names)
    return "".join(names[:1]) if len(names) < 2 else f"{', '.join(names[:-1])} {last} {names[-1]}"


def capital(text: str) -> str:
    """The text with a capital first letter, as a sentence begins."""
    return text[:1].upper() + text[1:]


def ended(text: str) -> str:
    """The text with one stop at its end."""
    return text if text.endswith((".", "?", "!")) else f"{text}."


def of_several(notes: Sequence[str], names: Sequence[str]) -> list[str]:
    """Sentences in their order; those that say the same of several recordings become one.

    Args:
        notes: sentences. One about a recording begins with its name and a colon.
        names: names of the recordings.
    """
    longest, whose = sorted(names, key=len, reverse=True), {}
    for note in notes:
        name = next((name for name in longest if note.startswith(f"{name}: ")), "")
        said = note[len(name) + 2 :] if name else note
        whose.setdefault((bool(name), said), {})[name] = None
    return [_of([*owners], said) if about else said for (about, said), owners in whose.items()]


def _of(names: Sequence[str], said: str) -> str:
    """A sentence after the names of the recordings that it is about."""
    more = f", ... ({len(names)} recordings)" if len(names) > MOST_NAMES else ""
    return f"{', '.join(names[:MOST_NAMES])}{more}: {said}"
