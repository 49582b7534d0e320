"""Words of a program that is being built: which stage of how many runs, and which program is compiled."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from pneusma_jax.errors import counted
from pneusma_jax.program_cache import COMPILING, LOADING, TRACING, made_ready

DIAGNOSIS = "diagnosis of"
"""Beginning of the name of a campaign's own program."""
STAGES = (
    "arranging the rows of the recordings",
    "first answers of the model",
    "noise of the measured inputs",
    "answers with that noise",
    "misfit of the nominal model",
)
"""Stages of the building of a program, in their order."""
OFTEN = {
    TRACING: "once per version and shape",
    COMPILING: "once per version and shape",
    LOADING: "from disk, or compiling it where the disk lacks it",
}
"""How often each step is made."""


class Building:
    """Says what the building of a program does.

    Args:
        progress: called with the words, as `inference.progress.Steps` is.
        kind: kind of the recordings.
        effects: number of candidate effects.
        again: with what a model is built once more, in words; empty for the first one.
    """

    def __init__(self, progress: Callable[[str], None], kind: str, effects: int, again: str = ""):
        self._building = f"building the model again, {again}" if again else "building the model"
        self._progress, self._stage, self._ready = progress, 0, list[int]()
        self._own = f"the laws of kind {kind} and {counted(effects, 'effect')}"

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Say which programs are traced, compiled or loaded meanwhile."""
        with made_ready(self._made_ready):
            yield

    def begins(self) -> None:
        """Say that the next stage begins."""
        self._stage += 1
        self._progress(f"{self._place}: {STAGES[self._stage - 1]}")

    @property
    def _place(self) -> str:
        """The stage that runs, of how many."""
        return f"{self._building}, stage {self._stage} of {len(STAGES)}"

    def _made_ready(self, number: int, name: str, step: str) -> None:
        """Say how a program is made ready."""
        if number not in self._ready:
            self._ready.append(number)
        what = self._own if name.startswith(DIAGNOSIS) else name.partition("|")[0].partition(":")[0]
        self._progress(
            f"{self._place}: {step} {what} (program {self._ready.index(number) + 1}, {OFTEN[step]})"
        )
