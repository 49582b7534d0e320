"""What the commands share: getting ready to compute, results on disk, words on the terminal."""

import csv
import difflib
import io
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np

DESIGNS = ("pneusma1", "pneusma2", "pneuflex_s", "pneuflex_t", "pneuflex_w", "triad")


def prepare() -> None:
    """Float64 and the compilation cache, before any model is built."""
    from pneusma_jax import enable_float64

    enable_float64()


def notice(text: str) -> None:
    """Say something beside the result, on stderr."""
    click.echo(f"note: {' '.join(text.split())}", err=True)


def csv_text(columns: Mapping[str, Sequence], comments: Sequence[str] = ()) -> str:
    """Columns of equal length as CSV; numbers with the digits that read back equal, nothing for NaN.

    Args:
        columns: by name, in order.
        comments: lines before the header, without `#`.
    """
    stream = io.StringIO()
    stream.writelines(f"# {comment}\n" for comment in comments)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*([_cell(value) for value in column] for column in columns.values()), strict=True))
    return stream.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if math.isnan(value) else repr(float(value)).removesuffix(".0")
    return str(value)


def words_table(header: Sequence[str], rows: Sequence[Sequence[str]], indent: int = 0) -> str:
    """Texts in aligned columns, the first to the left, the others to the right."""
    widths = [max(len(row[i]) for row in (header, *rows)) for i in range(len(header))]
    lines = []
    for row in (header, *rows):
        first, *others = (
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        lines.append(" " * indent + "  ".join([first, *others]).rstrip())
    return "\n".join(line for line in lines if line.strip())


def done(paths: Sequence[Path]) -> None:
    """Tell where the results are."""
    for path in paths:
        click.echo(f"wrote {path}")


def one_of(option: str, given: str, known: Sequence[str]) -> str:
    """A word that must be one of several.

    Raises:
        click.UsageError: if it is not; names the nearest.
    """
    if given not in known:
        close = difflib.get_close_matches(given, known, n=1, cutoff=0.5)
        hint = f"did you mean {close[0]!r}?" if close else "known: " + ", ".join(known)
        raise click.UsageError(f"{option} {given!r} is not known, {hint}")
    return given


def table_argument(given: str) -> str:
    """Name or path of a table as the command line means it: a path counts from the working folder."""
    is_path = given.endswith(".toml") or "/" in given or "\\" in given
    return str(Path(given).resolve()) if is_path else given


def design_argument(given: str) -> str:
    """Name or path of an actuator or a chain as the command line means it.

    Raises:
        click.UsageError: if it is neither a known name nor the path of a TOML file; names the nearest.
    """
    if given.endswith(".toml"):
        return table_argument(given)
    from importlib import resources

    names = []
    for folder in (("examples", "designs"), ("examples", "chains")):
        entries = resources.files("calibration_data").joinpath(*folder).iterdir()
        names += sorted(e.name.removesuffix(".toml") for e in entries if e.name.endswith(".toml"))
    return one_of("--design", given, (*DESIGNS, *names))
