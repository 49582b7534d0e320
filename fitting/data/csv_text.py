"""Writers of CSV text for recordings, report tables and simulation columns."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np


def csv_text(columns: Mapping[str, Sequence], comments: Sequence[str] = ()) -> str:
    """Columns of equal length as CSV. Numbers have the digits that read back equal; NaN gives an empty field.

    Args:
        columns: columns by name, in order.
        comments: lines before the header, without `#`.
    """
    return csv_rows(list(columns), zip(*columns.values(), strict=True), comments)


def csv_rows(
    header: Sequence[str],
    rows: Iterable[Sequence[object]],
    comments: Sequence[str] = (),
    digits: int | None = None,
) -> str:
    """Rows as CSV.

    Args:
        header: names of the columns.
        rows: cells of each row; None and NaN give an empty field.
        comments: lines before the header, without `#`.
        digits: number of significant digits; None for as many as read back equal. A rounded infinite number
            gives an empty field.
    """
    stream = io.StringIO()
    stream.writelines(f"# {comment}\n" for comment in comments)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([_cell(value, digits) for value in row] for row in rows)
    return stream.getvalue()


def _cell(value: object, digits: int | None) -> str:
    if value is None:
        return ""
    if not isinstance(value, float | np.floating):
        return str(value)
    if math.isnan(value):
        return ""
    if digits is None:
        return repr(float(value)).removesuffix(".0")
    return f"{float(value):.{digits}g}" if math.isfinite(value) else ""
