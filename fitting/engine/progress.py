"""Progress of a run: rows a second and the time left, at a terminal or as lines of a log."""

import time

from tqdm import tqdm

from fitting.inference.progress import Display, Moving, PlainLines, columns, duration


class Rate(Display):
    """Progress of tasks that are counted in rows.

    Args:
        subject: name of the work.
        total: rows in all.
        before: number of these rows that were done in an earlier run.
        unit: name of the counted things.
        shown: true to show the progress.
    """

    def __init__(self, subject: str, total: int, before: int = 0, unit: str = "rows", shown: bool = True):
        self._total, self._before, self._now, self._unit = total, before, 0, unit
        self._began = time.monotonic()
        self._lines = PlainLines(subject, shown=None if shown else False)
        self._bar = tqdm(
            total=total, initial=before, desc=subject, unit=f" {unit}", unit_scale=True, leave=False,
            disable=None if shown else True, ncols=columns(),
        )  # fmt: skip
        self._moving = Moving(self._bar, subject)

    @property
    def rate(self) -> float:
        """Rows a second of this run, compiling included; 0 before the first."""
        return self._now / max(time.monotonic() - self._began, 1e-9)

    @property
    def left(self) -> float:
        """Seconds that the rest takes at this rate; infinite before the first row."""
        rest = self._total - self._before - self._now
        return rest / self.rate if self._now else float("inf")

    def done(self, rows: int) -> None:
        """Some more rows are done."""
        self._now += rows
        self._bar.update(rows)
        self._lines.say(
            f"{self._before + self._now:,} of {self._total:,} {self._unit}, {self.rate:,.0f} a second, "
            f"{duration(self.left)} left"
        )
