"""Lists of names in sentences, and sentences that several recordings share."""

from collections.abc import Sequence

MOST_NAMES = 3
"""Maximum number of recordings that a sentence names."""


def joined(names: Sequence[str], last: str = "and") -> str:
    """Names as a sentence lists them: `a, b and c`."""
    return "".join(names[:1]) if len(names) < 2 else f"{', '.join(names[:-1])} {last} {names[-1]}"


def of_several(notes: Sequence[str], names: Sequence[str]) -> list[str]:
    """Sentences in their order; those that say the same of several recordings become one.

    Args:
        notes: sentences. One about a recording begins with its name and a colon.
        names: names of the recordings.
    """
    named, whose = set(names), {}
    for note in notes:
        name, _, said = note.partition(": ")
        whose.setdefault(said if name in named else note, []).append(name if name in named else "")
    return [_of(owners, said) for said, owners in whose.items()]


def _of(owners: Sequence[str], said: str) -> str:
    """A sentence after the names of the recordings that it is about; none for a sentence about all."""
    names = [name for name in owners if name]
    if not names:
        return said
    more = f", ... ({len(names)} recordings)" if len(names) > MOST_NAMES else ""
    return f"{', '.join(names[:MOST_NAMES])}{more}: {said}"
