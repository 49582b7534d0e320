"""Files of tasks in a folder: there whole or not at all."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pneusma_jax.errors import InputError
from pneusma_jax.files import DRAFT, write_durably


@dataclass(frozen=True)
class Task:
    """One piece of work.

    Attributes:
        name: name of its file, which may be in a folder of its own: `case/report.json`.
        size: its share in the progress, such as its number of rows.
    """

    name: str
    size: int = 1


class Store:
    """The folder in which each finished task has a file.

    Args:
        folder: made with the first file.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)

    def path(self, task: Task) -> Path:
        """Path of a task's file, present or not."""
        return self.folder / task.name

    def missing(self, tasks: Sequence[Task]) -> list[int]:
        """Numbers of tasks whose file is not there."""
        folders = {self.path(task).parent for task in tasks}
        there = {path for folder in folders if folder.is_dir() for path in folder.iterdir()}
        return [number for number, task in enumerate(tasks) if self.path(task) not in there]

    def read(self, task: Task) -> bytes:
        """Content of a task's file.

        Raises:
            InputError: if it cannot be read.
        """
        try:
            return self.path(task).read_bytes()
        except OSError as error:
            raise InputError(f"{self.path(task)}: cannot be read ({error.strerror})") from None

    def write(self, task: Task, content: bytes) -> None:
        """Write a task's file; it is on the disk when this returns.

        Raises:
            OSError: if the disk refuses; no part of the file is left.
        """
        path = self.path(task)
        path.parent.mkdir(parents=True, exist_ok=True)
        write_durably(path, content)

    @property
    def holds_any(self) -> bool:
        """True if any task has a file."""
        return self.folder.is_dir() and any(not p.name.startswith(".") for p in self.folder.iterdir())

    def clear(self) -> None:
        """Remove every finished file: what was computed counts no more."""
        for path in self.folder.iterdir() if self.folder.is_dir() else ():
            _forget(path)

    def clear_drafts(self) -> None:
        """Remove what killed runs left half-written."""
        for draft in self.folder.rglob(f".*{DRAFT}") if self.folder.is_dir() else ():
            _forget(draft)


def _forget(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError:
        pass  # a folder that cannot be written to keeps it; it is never read
