"""Writing of a set of result files: in a new folder they appear together or not at all.

In a folder that is there already they are moved one by one, the file that marks results last. Until then the
folder does not count as results.

A command replaces what it wrote itself with the same options, and nothing else. `RECORD` beside the files
says which command wrote them, with their digests.
"""

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import asdict, dataclass, field
from pathlib import Path, PurePosixPath, PureWindowsPath

from pneusma_jax.errors import InputError

from .files import check_folder

MARK = "report.json"
"""Name of the file that marks a folder as results."""
RECORD = ".made_by.json"
"""Name of the file that says which command wrote the files beside it."""
ENDINGS = (".csv", ".toml", ".json", ".html", ".png", ".gif", ".nc")
"""Endings of the files that commands write. Another file of them in a folder may be replaced unseen."""
INSTEAD = "choose another folder, or replace them with --force"


@dataclass(frozen=True)
class Record:
    """What wrote the files of a folder.

    Attributes:
        command: name of the command, such as `pneusma simulate`; empty for none.
        options: its options as text, by name, without those that change no result.
        files: SHA-256 of each file by name.
    """

    command: str = ""
    options: Mapping[str, str] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    def wrote(self, file: Path) -> bool:
        """True for a file that this command wrote, and that nobody changed since."""
        return file.name in self.files and self.files[file.name] == _digest(file.read_bytes())


_RUNNING: ContextVar[Record] = ContextVar("running", default=Record())  # noqa: B039 (it is frozen)


@contextmanager
def running(command: str, options: Mapping[str, str]) -> Iterator[None]:
    """Say which command writes files in this block; without, they are nobody's and are not replaced."""
    token = _RUNNING.set(Record(command, dict(options)))
    try:
        yield
    finally:
        _RUNNING.reset(token)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _recorded(folder: Path) -> Record:
    """The record of a folder; an empty one where there is none that can be read."""
    try:
        return Record(**json.loads((folder / RECORD).read_text("utf-8")))
    except (OSError, ValueError, TypeError):
        return Record()


def is_own(folder: Path) -> bool:
    """True if the running command wrote the files of a folder, with the same options."""
    made, now = _recorded(folder), _RUNNING.get()
    return bool(now.command) and (made.command, made.options) == (now.command, now.options)


def check_free(folder: str | Path, force: bool = False, goes_on: bool = False) -> Path:
    """Refuse a folder that cannot take results, before any computation.

    Args:
        folder: folder for the results; it need not exist.
        force: true to allow replacing existing results.
        goes_on: true for a run that goes on with parts of an earlier one, which are in the folder. It may
            replace what any run of its command wrote, and what no command is known to have written.

    Raises:
        InputError: if it is a file, holds anything that the running command did not write itself with the
            same options, or no folder can be made there. Other files than those of `ENDINGS` may stay.
    """
    folder = Path(folder)
    may_go_on = goes_on and _recorded(folder).command in ("", _RUNNING.get().command)
    if folder.is_dir() and not force and not may_go_on:
        _check_contents(folder)
    check_folder(folder)
    return folder


def _check_contents(folder: Path) -> None:
    made, now, own = _recorded(folder), _RUNNING.get(), is_own(folder)
    if not own and (made.command or (folder / MARK).exists()):
        other = " with other options" if made.command == now.command else ""
        of = f", of `{made.command}`{other}" if made.command else ""
        raise InputError(f"{folder}: results are here already{of}; {INSTEAD}")
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() not in ENDINGS or file.name == RECORD or not file.is_file():
            continue
        if not own or not made.wrote(file):
            why = "is here already, and is not of this run"
            if own and file.name in made.files:
                why = "was changed since it was written"
            raise InputError(
                f"{folder}: {file.name} {why}; choose another folder, or write here all the same with --force"
            )


def publish(
    folder: str | Path,
    documents: Mapping[str, str | bytes] | Callable[[], Mapping[str, str | bytes]],
    force: bool,
) -> list[Path]:
    """Write files into a draft folder and move them into place once all of them are there.

    Args:
        folder: folder for the results; made if it does not exist.
        documents: content by file name, or a function that makes it; text is written as UTF-8.
        force: true to replace existing results.

    Returns:
        Paths of the files.

    Raises:
        InputError: as `check_free`, if the disk refuses, or if a name is not that of a file in this folder.
    """
    folder, now = check_free(folder, force), _RUNNING.get()
    content = documents() if callable(documents) else documents
    for name in content:
        if name in ("", ".", "..") or PurePosixPath(name).name != name or PureWindowsPath(name).name != name:
            raise InputError(f"{folder}: {name!r} cannot be the name of a file in this folder")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        try:
            bodies = {n: body.encode() if isinstance(body, str) else body for n, body in content.items()}
            if now.command:
                before = _recorded(folder)
                kept = before.files if before.command == now.command else {}
                digests = {name: _digest(body) for name, body in bodies.items()}
                written = Record(now.command, now.options, {**kept, **digests})
                bodies[RECORD] = json.dumps(asdict(written), indent=1, ensure_ascii=False).encode() + b"\n"
            for name, body in bodies.items():
                (draft / name).write_bytes(body)
            if folder.exists() and MARK in content:
                (folder / MARK).unlink(missing_ok=True)  # a kill after this leaves no results, not a mixture
            if not folder.exists():
                os.chmod(draft, 0o777 & ~_umask())
                os.rename(draft, folder)
            for name in (
                sorted(bodies, key=lambda name: (name == RECORD, name == MARK)) if draft.exists() else ()
            ):  # the mark last, and then the record
                os.replace(draft / name, folder / name)
        finally:
            shutil.rmtree(draft, ignore_errors=True)
    except OSError as error:
        raise InputError(f"{folder}: results cannot be written here ({error.strerror})") from None
    return [folder / name for name in content]


def _umask() -> int:
    """Current umask. A temporary folder is private; results should be as readable as any other folder."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
