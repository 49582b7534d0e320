"""Name and options of the command that runs, for the record that it leaves beside its results."""

import functools
import os
from pathlib import Path
from typing import Any

import click

WITHOUT_EFFECT = ("out", "force", "resume", "workers", "cluster", "devices", "as_json")
"""Options that change no result."""


def with_record(command: click.Command, name: str) -> click.Command:
    """The command, whose name and options `fitting.data.publish` records in every folder that it writes.

    Args:
        command: a command of `pneusma`.
        name: its name.
    """
    call = command.callback
    if call is None or getattr(call, "has_record", False):
        return command

    @functools.wraps(call)
    def telling(*arguments: Any, **options: Any) -> Any:
        if options.get("hide_truth"):  # the seed would tell it
            return call(*arguments, **options)
        from fitting.data.publish import running

        given = {key: value for key, value in options.items() if value not in (None, False, ())}
        out = Path(options.get("out") or ".")
        stated = {key: _text(value, out) for key, value in given.items() if key not in WITHOUT_EFFECT}
        with running(f"pneusma {name}", stated):
            return call(*arguments, **options)

    telling.has_record = True
    command.callback = telling
    return command


def _text(value: Any, out: Path) -> str:
    """An option's value as text.

    A file is named from the folder of results. So one name from two working folders is told apart, and both
    may be moved together.
    """
    if isinstance(value, tuple):
        return f"({', '.join(_text(one, out) for one in value)})"
    is_text = isinstance(value, str)  # of which a folder may have the name by chance
    there = os.path.isfile(value) if is_text else isinstance(value, Path) and os.path.exists(value)
    if not there:  # such as the name of a shipped study
        return str(value)
    place = os.path.realpath(value)
    try:
        return Path(os.path.relpath(place, os.path.realpath(out))).as_posix()
    except ValueError:  # another drive of Windows
        return place
