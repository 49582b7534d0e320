"""Detection of a test in compression, from the words of its file and the shape of its curve."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..slack import Slack
from .making import Making
from .slack_treatment import largest
from .words import COMPRESS

FITS_BETTER = 0.5
"""Maximum ratio of misfits, pressed over pulled neo-Hookean law, at which the user is asked which it was."""
FLATTENED = 0.95
"""Minimum strain of a specimen that was not pressed; little would be left of its height."""
_WAYS = r"compress\w*|druck\w*|stauch\w*"
# A line that names a test: `Compression test`, `uniaxial compression`, `tested in compression`.
_TEST = re.compile(
    rf"(?:{_WAYS})[\s_-]*(?:test|versuch|prüf|experiment|trial|mode|loading\b)|druckversuch|druckprüf|stauchversuch"
    r"|(?:uniaxial|unconfined|plane strain)[\s_-]+compress|\b(?:in|under|en)\s+(?:uniaxial\s+)?compress"
    r"|essai\s+de\s+compress",
    re.IGNORECASE,
)
# A label that stands before the name of a test: `Test type: ...`, `Method; ...`.
_LABEL = re.compile(
    r"^\W*(?:test(?:\s*(?:type|method|mode|name|kind|procedure|direction))?|type(?:\s+of\s+test)?|method|mode"
    r"|load(?:ing)?(?:\s+(?:type|mode|direction|case))?|direction|experiment|procedure|protocol|standard|norm"
    r"|prüf\w*|versuch\w*|belastung\w*|essai|type\s+d'essai)\s*[:;=,|\t]\s*(?P<value>.+)$",
    re.IGNORECASE,
)
# Words of a line that is about something else, or about what a machine could do.
_PULLED = re.compile(r"tensi|tensile|\bpull|\bzug|traction|stretch", re.IGNORECASE)
_DENIED = re.compile(
    r"\b(?:no|not|non|without|ohne|kein\w*|sans)[\s-]*compress|compress\w*\s*[:;=,]?\s*(?:none|no|not|off|aus|n/a|false|0)\b",
    re.IGNORECASE,
)
_APART = re.compile(
    r"compressed\s+(?:air|gas)|compression\s+(?:set|format|level|ratio)|(?:file|data|image|log)\s+compress"
    r"|machine|\bcell|frame|sensor|transducer|\bgrips?\b|platen|fixture|compressor",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class About:
    """Texts of a file that may mention how the specimen was loaded.

    Attributes:
        headings: headings of strain and stress, or of the columns that they were made from.
        lines: lines above the table, with their cells separated by semicolons.
        titles: names of the test and of its sheet.
    """

    headings: Sequence[str] = ()
    lines: Sequence[str] = ()
    titles: Sequence[str] = ()

    def in_heading(self) -> str:
        """Heading that says compression; empty if none does."""
        return next((text for text in self.headings if _says(text)), "")

    def in_text(self) -> str:
        """Title or line that names a compression test; empty if none does, or one names a pull."""
        if self._names_a_pull():
            return ""
        titles = [text for text in self.titles if _says(text)]
        return next(iter([*titles, *(line for line in self.lines if _names_the_test(line))]), "")

    def mentioned(self) -> str:
        """Line that mentions compression and may mean the test; empty if none does, or one names a pull."""
        return "" if self._names_a_pull() else next((line for line in self.lines if _says(line)), "")

    def _names_a_pull(self) -> bool:
        return any(_named(line, _PULLED) for line in self.lines)


def _says(text: str) -> bool:
    """True for a text that mentions compression, and neither denies it nor is about something else."""
    return bool(COMPRESS.search(text)) and not any(w.search(text) for w in (_PULLED, _DENIED, _APART))


def _names_the_test(line: str) -> bool:
    """True for a line that says that the test was one of compression."""
    return _says(line) and (bool(_TEST.search(line)) or _named(line, COMPRESS))


def _named(line: str, way: re.Pattern[str]) -> bool:
    """True for a label of a test's kind with a value that names one way of loading."""
    found = _LABEL.match(line)
    return bool(found and way.search(found["value"]) and not _DENIED.search(found["value"]))


def make_compression_negative(
    columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making, about: About
) -> str:
    """Make strain and stress negative for a pressed specimen, and positive for one that the user says was
    pulled.

    Headings that say compression decide. So does a line or title that names a compression test, which is
    reported to be checked. A line that mentions compression in another way is a question only.

    Returns:
        Source of the decision: `"stated"` by the user or a heading, `"line"`, or empty if there is none.
    """
    stated = making.options.compression
    if stated is not None:
        option = "--compression" if stated else "--tension"
        making.use(option)
        _turned(columns, pair, making, stated, f"as stated with {option}", False)
        return "stated"
    heading, text, mentioned = about.in_heading(), about.in_text(), about.mentioned()
    because = "because the file speaks of compression ({!r}; --tension if it was pulled)"
    if heading:
        _turned(columns, pair, making, True, because.format(heading[:60]), False)
        return "stated"
    if text and largest(columns["strain"]) < FLATTENED:
        _turned(columns, pair, making, True, because.format(text[:60]), True)
        return "line"
    if (text or mentioned) and largest(columns["strain"]) > 0.0:
        far = ", but strain reaches more than can be pressed" if text else ""
        making.warn(
            f"a line speaks of compression ({(text or mentioned)[:60]!r}){far}: the specimen was taken as"
            " pulled. If it was pressed: --compression. If it was pulled, --tension says so, and this line"
            " goes"
        )
    return ""


def _turned(
    columns: dict[str, np.ndarray], pair: tuple[str, str], making: Making, pressed: bool, why: str, ask: bool
) -> None:
    """Turn the columns of a pair that point the other way, and report it."""
    sign, word = (-1.0, "negative") if pressed else (1.0, "positive")
    found = [name for name in pair if sign * largest(columns[name]) < 0.0]
    for name in found:
        columns[name] = -columns[name] + 0.0
    if found:
        (making.warn if ask else making.say)(f"{' and '.join(found)} turned {word}, {why}")
    elif making.options.compression is not None:
        option = "--compression" if pressed else "--tension"
        making.say(f"strain and stress were {word} already: nothing to turn for {option}")
    if pressed and making.kind == "wire":
        making.warn(
            "the wire was pressed, and the law of a wire is that of one in tension: characterise and diagnose"
            " say little about it. If tension and compression are alike to you, --tension reads it as a pull"
        )


def source_quantity(making: Making, quantity: str) -> str:
    """Quantity whose sign must be turned for strain or stress: its source column if it was derived."""
    if not making.channels[quantity].made:
        return quantity
    return next(
        (
            name
            for name in ("elongation", "force")
            if name in making.sources and (name == "force") == (quantity == "stress")
        ),
        quantity,
    )


def ask_about_compression(
    strain: np.ndarray, stress: np.ndarray, slack: Slack | None, making: Making, by_line: bool
) -> None:
    """Ask if a test that only stiffens was in compression, and if one of negative strain that softens was in
    tension. A pulled rubber softens first; a pressed one stiffens."""
    finite = np.isfinite(strain) & np.isfinite(stress)
    x, y = strain[finite], stress[finite]
    way = 1.0 if x.size and x.max() >= -x.min() else -1.0
    x, y = way * x, way * y
    if (
        x.size < 8
        or not x.max() > 0.0
        or x.min() < -0.02 * x.max()
        or x.max() >= FLATTENED
        or y[int(np.argmax(x))] <= 0.0
    ):
        return
    if slack is not None and making.options.slack is None:
        begun, zero = way * slack.start, way * slack.zero
        x, y = x[x >= begun] - begun, y[x >= begun] - zero
    rising = slice(0, int(np.argmax(x)) + 1)
    x, y = x[rising], y[rising]
    if x.size < 8 or x.max() < 0.05:
        return
    misfits = []
    for stretch in (1.0 + way * x, 1.0 - way * x):
        shape = np.abs(stretch - stretch**-2)
        columns = np.stack([shape, np.ones_like(shape)], axis=1)
        rest = y - columns @ np.linalg.lstsq(columns, y, rcond=None)[0]
        misfits.append(float(np.sqrt(np.mean(rest**2))))
    if misfits[1] >= FITS_BETTER * misfits[0]:
        return
    if way > 0.0:
        making.warn(
            "stress only stiffens over strain, as a pressed rubber does and a pulled one does not at first."
            " If the specimen was pressed, turn it with --compression. If it was pulled, --tension says so,"
            " and this line goes"
        )
        return
    turned = " ".join(f"--scale {source_quantity(making, name)}=-1" for name in ("strain", "stress"))
    turned = "--tension" if by_line else turned
    making.warn(
        "strain and stress are negative, but stress softens over strain, as a pulled rubber does and a"
        f" pressed one does not. If the specimen was pulled: {turned}. If it was pressed, --compression says"
        " so, and this line goes"
    )
