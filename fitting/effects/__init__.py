"""The catalogue of missing physics, told and drawn: what an effect is, and what it does to a recording."""

from .signature import KINDS, Signature, chosen, signature
from .words import catalogue_table, described

__all__ = ["KINDS", "Signature", "catalogue_table", "chosen", "described", "signature"]
