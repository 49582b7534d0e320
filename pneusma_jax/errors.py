"""The one error and the warnings that a user's input can cause, and the grammar of their sentences."""

import difflib
import re
import warnings
from collections.abc import Iterable


class InputError(ValueError):
    """Input that cannot be used; the message is one line with the place and what would be right.

    The command line prints the message alone, without a traceback, and exits with code 2.
    """


class Distrusted(UserWarning):
    """Numbers of a file are used that the file itself says are not to be trusted.

    The command line tells the message as a note, once.
    """


class Implausible(UserWarning):
    """A number of a Python call is possible, and rather in another unit than that of its argument.

    A sensor's reading of few digits that is given alone looks like a number that a person wrote. Give its
    readings as one array, or filter this warning.
    """


DISTRUSTED = "do not trust its numbers"
"""Words after the name of the file in every message of `Distrusted`."""


def distrusted(path: object, caution: str) -> str:
    """Sentences on a file's numbers, by its name and what it says of them."""
    return f"{path}: {DISTRUSTED}. {caution}"


def warn_of(path: object, caution: str) -> None:
    """Warn of numbers that are used; nothing without a caution."""
    if caution:
        warnings.warn(distrusted(path, caution), Distrusted, stacklevel=3)


MOST_LISTED = 48
"""Maximum of names that a message lists in full: more do not fit on a screen's two or three lines."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Sentence fragment that offers the known names closest to a mistyped one.

    Args:
        name: the given name.
        known: the names that exist.

    Returns:
        `"did you mean 'x'?"`, or a list of known names if none is close.
    """
    known = sorted(set(known))
    beginnings = {one[: len(name) + 1]: one for one in known}  # of a name that is only begun
    close = [one for one in known if one.casefold() == name.casefold()]
    close += difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    close += [beginnings[x] for x in difflib.get_close_matches(name, beginnings, n=1, cutoff=0.8)]
    if close:
        return f"did you mean {close[0]!r}?"
    if len(known) > MOST_LISTED:
        some = difflib.get_close_matches(name, known, n=MOST_LISTED // 3, cutoff=0.0)
        return f"known are {len(known)} names, such as {', '.join(sorted(some))}"
    return "known: " + ", ".join(known)


LONGEST_REASON = 200
"""Maximum number of characters of another library's message that ours quote: two lines of a screen."""


def reason_of(error: BaseException) -> str:
    """Message of another library's error in one line, cut where it is long."""
    words = " ".join(str(error).split()) or type(error).__name__
    return words if len(words) <= LONGEST_REASON else words[: LONGEST_REASON - 4] + " ..."


_LONG_WORD = re.compile(r"\S{400,}")
"""Words that a message tells by their ends; the names of most file systems have at most 255 letters."""


def shortened(line: str) -> str:
    """A line in which a word that would fill the screen is told by its ends."""
    return _LONG_WORD.sub(lambda word: f"{word[0][:100]}[...]{word[0][-100:]}", line)


def counted(count: int, noun: str, plural: str = "") -> str:
    """A count with its noun: `1 row`, `3 rows`.

    Args:
        count: the number.
        noun: the noun for one.
        plural: the noun for several; with an s by default.
    """
    return f"{count:d} {noun if count == 1 else plural or noun + 's'}"
