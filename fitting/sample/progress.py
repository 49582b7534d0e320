"""Progress display of sampling: steps, effective samples, time left."""

import time

from tqdm import tqdm

from fitting.inference.progress import Display, Moving, PlainLines, columns, duration

from .convergence import BURN_LENGTHS, EFFECTIVE, LENGTHS, Convergence


class SamplingBar(Display):
    """A progress bar over steps. Its end moves with the estimate of the autocorrelation time.

    Short chains underestimate that time, so what is left is told as a minimum.

    Args:
        shown: true or false, or None to show it at a terminal, and occasional plain lines elsewhere.
        budget: maximum number of steps.
        done: number of stored steps.
    """

    def __init__(self, shown: bool | None, budget: int, done: int = 0):
        self._budget, self._first, self._began = budget, done, time.monotonic()
        self._judged = ""
        disable = None if shown is None else not shown
        self._lines = PlainLines("sampling", None if shown is None else False)
        self._bar = tqdm(
            desc="sampling", unit=" steps", total=budget, initial=done, disable=disable, leave=False,
            bar_format="{desc}: {percentage:3.0f}% |{bar}| {n_fmt}/{total_fmt} steps{postfix}",
            ncols=columns(),
        )  # fmt: skip
        self._moving = Moving(self._bar, "sampling")

    def advance_to(self, steps: int) -> None:
        """Record the number of steps of all ensembles."""
        self._lines.say(f"{steps} steps of at most {self._budget}{self._judged}")
        self._bar.total = max(self._bar.total, steps)
        self._bar.update(steps - self._bar.n)

    def judged(self, state: Convergence) -> None:
        """Show effective samples and the predicted end."""
        if self._bar.disable and not self._lines.shown:
            return
        expected = self._budget
        if state.lengths > 0.0:
            long_enough = (LENGTHS + BURN_LENGTHS) * state.kept / state.lengths
            many_enough = state.burn_in + state.kept * EFFECTIVE / max(state.effective.min(), 1.0)
            expected = min(int(max(long_enough, many_enough)) + 1, self._budget)
        self._bar.total = max(expected, state.steps)
        pace = (time.monotonic() - self._began) / max(state.steps - self._first, 1)
        remaining = pace * max(expected - state.steps, 0)
        status = (
            f"{state.effective.min():.0f} effective samples, {state.lengths:.0f} of {LENGTHS:.0f} "
            f"autocorrelation times, R-hat {state.r_hat.max():.3f}, at least {duration(remaining)} left"
        )
        self._judged = f"; when last judged: {status}"
        self._bar.set_postfix_str(status)
