"""Campaigns as tasks: each ends as a member, which holds a result or the reason why there is none."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

from pneusma_jax.errors import InputError

from .results import run_results
from .run import Scheduler
from .store import Store, Task


class MemberJob(Protocol):
    """Computes members by number; small enough to be sent to any worker, who must see the same paths.

    A member is a dataclass with `name`, `path`, `problem` and `done`, which is true if it has a result.

    Attributes:
        names, paths: names and paths of the campaigns.
    """

    names: tuple[str, ...]
    paths: tuple[Path, ...]

    def __call__(self, number: int) -> bytes:
        """A member as bytes."""

    def tasks(self) -> list[Task]:
        """A file for each campaign."""

    def member(self, number: int, progress: Callable[[str], None]) -> Any:
        """A member; every error becomes its problem. Words for `progress` begin with the member's name."""

    def packed(self, member: Any) -> bytes:
        """A member as bytes of `objects.dump`."""


def run_members(
    job: MemberJob,
    store: Store,
    scheduler: Scheduler,
    finished: Callable[[Any], None],
    kept: Callable[[Any], None],
    progress: Callable[[str], None],
) -> list[Any]:
    """Members that are in the store, and the others as they are done; those that failed are tried again.

    Args:
        job: job that computes the members.
        store: store of the members' files.
        scheduler: scheduler that computes them.
        finished: called with each member as it is done, such as to write its files.
        kept: called in place of `finished` with members that come from the store.
        progress: called with a word for each step of each member that is computed in this process.
    """

    def here(number: int) -> tuple[Any, bytes]:
        member = job.member(number, progress)
        return member, job.packed(member)

    def was_there(number: int, member: Any) -> Any:
        return handed(kept, replace(member, name=job.names[number], path=job.paths[number]))

    def is_done(number: int, member: Any) -> Any:
        own = handed(finished, member)
        progress(f"{job.names[number]} done")
        return own

    return run_results(job, job.tasks(), store, scheduler, here, was_there, is_done, _is_done)


def _is_done(stored: Any) -> bool:
    """True if a stored object is a member with a result. A file without a digest may hold any object."""
    try:
        return bool(replace(stored).done)
    except (TypeError, AttributeError):  # no dataclass, or a field of it is not there
        return False


def handed(to: Callable[[Any], None], member: Any) -> Any:
    """A member after a function got it; an error there becomes the member's problem and stops no other."""
    try:
        to(member)
    except Exception as error:  # noqa: BLE001  any error of one member
        return replace(member, problem=f"its files could not be written: {line_of(error)}")
    return member


def line_of(error: Exception) -> str:
    """An error in one line, with its type if it is no `InputError`."""
    words = " ".join(str(error).split()) or type(error).__name__
    return words if isinstance(error, InputError) else f"{type(error).__name__}: {words}"
