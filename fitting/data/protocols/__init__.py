"""Protocols as data: the prescribed inputs of a specimen over time."""

from .reading import SCHEMA, load_protocol, protocol_examples

__all__ = ["SCHEMA", "load_protocol", "protocol_examples"]
