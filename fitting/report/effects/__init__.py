"""The catalogue of missing physics, told and drawn: what an effect is, and what it does to a recording."""

from fitting.simulate.effect_signature import KINDS, Signature, chosen, signature

from .text import catalogue_table, described

__all__ = ["KINDS", "Signature", "catalogue_table", "chosen", "described", "signature"]
