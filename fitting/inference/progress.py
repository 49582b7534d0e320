"""Progress display of long computations: a moving line at a terminal, else occasional plain lines."""

import itertools
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Any, Self

from jax import monitoring
from tqdm import tqdm

from pneusma_jax.errors import counted

EVERY_S = 30.0
"""Seconds between plain lines, often enough to show progress and seldom enough for a log."""
_LOOKS = 6
"""Number of times in this interval at which a long step is looked at."""

REFRESH_S = 1.0
"""Seconds between two drawings of a moving line, so that its time moves while a step lasts."""
COLUMNS = 80
"""Columns of a moving line at a terminal that does not know its width."""

PREPARING = "preparing"
"""Words before the first step, while nothing is compiled."""
COMPILING = "compiling (once per version and shape)"
"""Words of all commands while a program is traced or compiled."""
MADE = (
    "/jax/core/compile/jaxpr_trace_duration",
    "/jax/core/compile/jaxpr_to_mlir_module_duration",
    "/jax/core/compile/backend_compile_duration",
)
"""Events of JAX: a scalar where it begins to trace, to lower or to compile, a duration where it ends."""


class _Compiling:
    """Counts what JAX traces and compiles at this moment, in all threads of this process."""

    def __init__(self) -> None:
        self._running, self._lock = 0, threading.Lock()

    def listen(self) -> None:
        """Begin to listen. JAX has no end of it but with the process."""
        monitoring.register_scalar_listener(self._begins)
        monitoring.register_event_duration_secs_listener(self._ends)

    def _begins(self, event: str, value: float | int, **more: Any) -> None:
        self._count(event, 1)

    def _ends(self, event: str, seconds: float, **more: Any) -> None:
        self._count(event, -1)

    def _count(self, event: str, change: int) -> None:
        if event in MADE:
            with self._lock:
                self._running = max(self._running + change, 0)

    @property
    def now(self) -> bool:
        """True while anything is traced or compiled."""
        return self._running > 0


_compiling = _Compiling()
_compiling.listen()


def with_compiling(text: str) -> str:
    """A text and, while JAX compiles, the words that say so, unless the text says which program it is."""
    if not _compiling.now or "once per version and shape" in text:
        return text
    return f"{text}; {COMPILING}" if text else COMPILING


def columns() -> int | None:
    """Columns of a moving line; None where it has those of the terminal.

    A terminal may say that it has no columns, as one in `script` or in a container does. A line would then
    have no place.
    """
    try:
        return None if os.get_terminal_size(sys.stderr.fileno()).columns > 0 else COLUMNS
    except (OSError, ValueError):  # no terminal, or a stream without a file
        return None


class PlainLines:
    """Plain lines on stderr where it is no terminal, in a log for example.

    In a `with` block, work that goes on without a new line for longer than the interval is said again.

    Args:
        subject: beginning of every line.
        shown: true to write; None only where stderr is no terminal.
        every: seconds between lines.
    """

    def __init__(self, subject: str, shown: bool | None = None, every: float = EVERY_S):
        self._subject, self._every = subject, every
        self.shown = not sys.stderr.isatty() if shown is None else shown
        self._began = self._last = self._since = time.monotonic()
        self._text = ""
        self._lock, self._ended = threading.Lock(), threading.Event()

    def __enter__(self) -> "PlainLines":
        if self.shown:
            threading.Thread(target=self._watch, name="progress", daemon=True).start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        with self._lock:  # so that no line is on its way
            self._ended.set()

    def say(self, text: str) -> None:
        """Write a line, unless one was written within the interval."""
        self._text, self._since = text, time.monotonic()
        self._write(text)

    def _write(self, text: str, again: bool = False) -> None:
        """Write a line unless it is too early, or, of one that is said again, too late."""
        text = with_compiling(text)
        with self._lock:
            now = time.monotonic()
            if not self.shown or now - self._last < self._every or (again and self._ended.is_set()):
                return
            self._last = now
            print(f"{self._subject}, {elapsed(now - self._began)}: {text}", file=sys.stderr, flush=True)

    def _watch(self) -> None:
        """Write the last text again, and how long ago it was said, where none follows for an interval."""
        while not self._ended.wait(self._every / _LOOKS):
            lasts = time.monotonic() - self._since
            if lasts >= self._every:
                text = self._text or with_compiling("") or PREPARING
                self._write(f"{text}, for {elapsed(lasts)}", again=True)


class Moving:
    """A moving line at a terminal: drawn again and again, with the words for compiling while JAX does.

    Args:
        bar: line of tqdm; a disabled one is never drawn.
        text: its beginning.
    """

    def __init__(self, bar: tqdm, text: str):
        self._bar, self._text, self._ended = bar, text, threading.Event()

    def __enter__(self) -> "Moving":
        if not self._bar.disable:
            threading.Thread(target=self._move, name="moving line", daemon=True).start()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._ended.set()
        self._bar.close()

    def named(self, text: str) -> None:
        """Begin the line with another text."""
        self._text = text
        self._bar.set_description_str(with_compiling(text))

    def _move(self) -> None:
        """Draw the moving line again and again; a closed one is not drawn."""
        while not self._ended.wait(REFRESH_S):
            self._bar.set_description_str(with_compiling(self._text), refresh=False)
            self._bar.refresh()


class Display:
    """A moving line at a terminal, and plain ones elsewhere, for the time of a `with` block."""

    _lines: PlainLines
    _moving: Moving

    def __enter__(self) -> Self:
        self._lines.__enter__()
        self._moving.__enter__()
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._lines.__exit__(kind, error, trace)
        self._moving.__exit__(kind, error, trace)


class Steps(Display):
    """Steps of a computation: a moving line, or an occasional plain one.

    Call it with a word for each step that begins. Where steps end one by one, `say` and `done` tell it apart.
    In a log, a step that lasts longer than the interval is said again.

    Args:
        subject: name of the computation.
        plain: true to show the time and the word alone, not the count.
        every: seconds between plain lines.
        total: number of steps; None where it is unknown.
        unit: name of one step.
    """

    def __init__(
        self,
        subject: str,
        plain: bool = False,
        every: float = EVERY_S,
        total: int | None = None,
        unit: str = "step",
    ):
        self._lines, self._count, self._total, self._unit = PlainLines(subject, every=every), 0, total, unit
        self._plain, form = plain, "{elapsed}  {desc}" if plain else None
        self._bar = tqdm(
            desc=subject, total=total, unit=f" {unit}s", bar_format=form, leave=False, disable=None,
            ncols=columns(),
        )  # fmt: skip
        self._moving = Moving(self._bar, subject)
        self._show = self._moving.named if plain else self._bar.set_postfix_str

    def __call__(self, text: str) -> None:
        """Show the step that begins."""
        self.done()
        self._show(text)
        of_all = "" if self._total is None else f" of {self._total}"
        self._lines.say(text if self._plain else f"{text} ({self._unit} {self._count}{of_all})")

    def say(self, text: str) -> None:
        """Show a word of the running step, and how many are done where their number is known."""
        self._show(text)
        if self._total is not None:
            text = f"{self._count} of {counted(self._total, self._unit)} done; {text}"
        self._lines.say(text)

    def done(self, count: int = 1) -> None:
        """Some more steps are done."""
        self._count += count
        self._bar.update(count)


class Stages:
    """Words of work in stages: which of how many runs, and which of its parts begins.

    A stage never goes back. Where a later one finds that an earlier one must go on, its parts count as the
    later one's and are told as `again`: `stage 3 of 4, fit again 1`.

    Args:
        progress: called with the words, as `Steps` is.
        units: what is counted in each stage, in the order of the stages: `"fit"`, `"profile"`.
    """

    def __init__(self, progress: Callable[[str], None], units: Sequence[str]):
        self._progress, self._units = progress, tuple(units)
        self._reached = 0

    def of(self, unit: str, total: int | None = None) -> Callable[[str], None]:
        """What a stage calls with a word for each part that begins.

        Args:
            unit: one of the stages, by what is counted in it.
            total: number of its parts; None where it is unknown.

        Raises:
            ValueError: if there is no such stage.
        """
        own, begun = self._units.index(unit), itertools.count(1)
        of_all = "" if total is None else f" of {total}"

        def told(word: str) -> None:
            again = " again" if own < self._reached else ""
            self._reached = max(self._reached, own)
            stage = f"stage {self._reached + 1} of {len(self._units)}"
            self._progress(f"{stage}, {unit}{again} {next(begun)}{of_all}: {word}")

        return told


def duration(seconds: float) -> str:
    """`40 s`, `12 min` or `2.5 h`."""
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


def elapsed(seconds: float) -> str:
    """`40 s`, `2 min 30 s` or `1 h 2 min`: to the second, so that later lines of a log have other times."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    parts = [f"{size} {unit}" for size, unit in ((hours, "h"), (minutes, "min"), (rest, "s")) if size]
    return " ".join(parts) or "0 s"
