"""Texts in aligned columns."""

from collections.abc import Sequence


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
