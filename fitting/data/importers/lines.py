"""A page as rows of fields, between its text and its tables."""

from dataclasses import dataclass

from .headers import Parsed, Rows
from .raw import Page


@dataclass
class Lines:
    """A page as rows of fields, with the numbers in them.

    Attributes:
        page: the page.
        delimiter: character between the fields.
        decimal: decimal mark.
        fields: fields of each row; none of a row of statistics.
        parsed: numbers of each row; None where it is no row of numbers.
        statistics: fields of the rows of statistics, by index.
    """

    page: Page
    delimiter: str
    decimal: str
    fields: Rows
    parsed: Parsed
    statistics: dict[int, list[str]]
