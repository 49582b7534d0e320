"""Reproduction of the source's figures by this model, and check of its statements number by number.

>>> from pneusma_jax import enable_float64
>>> enable_float64()
>>> from validation.reproduction import reproduce
>>> reproduce().save("out/reproduction")
"""

from .bench import Bench
from .entry import Entry
from .expectation import Interval, Near, Verdict, at_least, at_most
from .registry import ENTRIES, statements
from .results import Reproduction
from .run import reproduce
from .statement import Found, Judged, Statement, judge
from .text import one_line, remark, verdict_sentences

__all__ = [
    "ENTRIES", "Bench", "Entry", "Found", "Interval", "Judged", "Near", "Reproduction", "Statement",
    "Verdict",
    "at_least", "at_most", "judge", "one_line", "remark", "reproduce", "statements", "verdict_sentences",
]  # fmt: skip
