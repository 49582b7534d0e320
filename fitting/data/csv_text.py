"""Columns as CSV text."""

import csv
import io
import math
from collections.abc import Mapping, Sequence

import numpy as np


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
