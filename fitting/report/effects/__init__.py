"""Presentation of the catalogue of missing physics: each effect, and its influence on a recording."""

from fitting.simulate.effect_signature import Signature, chosen, signature

from .text import catalogue_table, described

__all__ = ["Signature", "catalogue_table", "chosen", "described", "signature"]
