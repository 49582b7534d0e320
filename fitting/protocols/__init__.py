"""Protocols as data: what is done to a specimen over time, and what the model says happens."""

from .reading import SCHEMA, load_protocol, protocol_examples
from .run import Course, run_chain_protocol, run_protocol

__all__ = [
    "SCHEMA", "Course", "load_protocol", "protocol_examples", "run_chain_protocol", "run_protocol",
]  # fmt: skip
