"""Commands over many campaigns: the store of an earlier run, and a bar that shows how many are done."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from fitting.data.publish import MARK
from fitting.engine import Store
from fitting.inference.progress import Steps

Watch = tuple[Callable[[str], None], Callable[[Any], None], Callable[[Any], None]]


def check_campaigns(paths: Sequence[Path]) -> None:
    """Refuse campaigns none of which exists. One that is missing beside others is reported with the results.

    Raises:
        click.UsageError: if there is none.
    """
    if not any(path.exists() for path in paths):
        raise click.UsageError(f"{paths[0]}: there is no such file or folder")


def free_store(folder: Path, what: str, force: bool, resume: bool) -> Store:
    """The store of a run's results.

    Raises:
        click.UsageError: if it holds results of an earlier run, and neither `force` nor `resume` is given.
    """
    store = Store(folder)
    if store.holds_any and not (force or resume):
        raise click.UsageError(f"{folder} has {what} of an earlier run; go on with --resume, or --force")
    return store


@contextmanager
def watched(label: str, count: int, out: Path, write: Callable[[Any], None]) -> Iterator[Watch]:
    """Progress of many campaigns: `progress`, `finished` and `kept` for `engine.members.run_members`.

    Args:
        label: name of the work.
        count: number of campaigns.
        out: folder of all results.
        write: function that writes the files of a member. Members from the store are written only if their
            files are missing.
    """
    with Steps(label, total=count, unit="campaign") as campaigns:

        def finished(member: Any) -> None:
            campaigns.done()
            write(member)

        def kept(member: Any) -> None:
            if (out / member.name / MARK).exists():
                campaigns.done()
            else:
                finished(member)

        yield campaigns.say, finished, kept
