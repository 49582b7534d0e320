"""What a person sees while chains grow: steps, effective samples, time left; only at a terminal."""

import time
from types import TracebackType

from tqdm import tqdm

from .convergence import BURN_LENGTHS, LENGTHS, Convergence


class SamplingBar:
    """A progress bar over steps whose end moves with what is known of the autocorrelation time.

    Args:
        shown: True or False, or None to show it at a terminal only.
        budget: steps at most.
        done: steps that were there already.
    """

    def __init__(self, shown: bool | None, budget: int, done: int = 0):
        self._budget, self._first, self._began = budget, done, time.monotonic()
        disable = None if shown is None else not shown
        self._bar = tqdm(
            desc="sampling", unit=" steps", total=budget, initial=done, disable=disable, leave=False,
            bar_format="{desc}: {percentage:3.0f}% |{bar}| {n_fmt}/{total_fmt} steps{postfix}",
        )  # fmt: skip

    def __enter__(self) -> "SamplingBar":
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._bar.close()

    def moved(self, steps: int) -> None:
        """All ensembles have made this many steps."""
        self._bar.total = max(self._bar.total, steps)
        self._bar.update(steps - self._bar.n)

    def judged(self, state: Convergence) -> None:
        """Show effective samples and when the chains should be long enough."""
        if self._bar.disable:
            return
        expected = self._budget
        if state.lengths > 0.0:
            expected = min(int((LENGTHS + BURN_LENGTHS) * state.kept / state.lengths) + 1, self._budget)
        self._bar.total = max(expected, state.steps)
        pace = (time.monotonic() - self._began) / max(state.steps - self._first, 1)
        left = pace * max(expected - state.steps, 0)
        self._bar.set_postfix_str(
            f"{state.effective.min():.0f} effective samples, {state.lengths:.0f} of {LENGTHS:.0f} "
            f"autocorrelation times, R-hat {state.r_hat.max():.3f}, about {_duration(left)} left"
        )


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
