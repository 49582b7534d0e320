"""One run at a time into one folder of results: a lock that the system releases when a run ends."""

import contextlib
import functools
import hashlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

SHARED = ("import", "synthesise")
"""Commands whose folder may be filled by several runs at once: each recording appears whole or not at all."""


@contextlib.contextmanager
def held(folder: Path) -> Iterator[None]:
    """Hold the folder while results for it are made.

    The lock lies in the system's folder for temporary files, so that nothing appears beside the results. It
    holds between processes of one machine; where the system has no such locks, nothing is held.

    Raises:
        click.ClickException: if another process holds it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    with contextlib.ExitStack() as stack:
        try:
            place = Path(tempfile.gettempdir()) / f"pneusma-locks-{os.getuid()}"
            place.mkdir(mode=0o700, exist_ok=True)
            name = hashlib.sha256(os.fsencode(folder.resolve())).hexdigest()[:32]
            file = stack.enter_context(open(place / f"{name}.lock", "a+"))
        except OSError:  # a full or read-only disk is no reason not to try
            yield
            return
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            file.seek(0)
            other = file.read().strip()
            who = f" (process {other})" if other else ""
            raise click.ClickException(
                f"{folder}: another run is writing results here{who}; wait for it, or choose another folder"
            ) from None
        with contextlib.suppress(OSError):
            file.truncate(0)
            file.write(str(os.getpid()))
            file.flush()
        yield


def locked(command: click.Command, name: str) -> click.Command:
    """The command, which holds the folder of its `--out` while it runs."""
    call = command.callback
    takes_folder = any(parameter.name == "out" for parameter in command.params)
    if call is None or not takes_folder or name in SHARED or getattr(call, "holds_folder", False):
        return command

    @functools.wraps(call)
    def with_lock(*arguments: Any, **options: Any) -> Any:
        folder = options.get("out")
        if folder is None:
            return call(*arguments, **options)
        with held(Path(folder)):
            return call(*arguments, **options)

    with_lock.holds_folder = True
    command.callback = with_lock
    return command
