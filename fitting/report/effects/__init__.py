"""The catalogue of missing physics, told and drawn: what an effect is, and what it does to a recording."""

from fitting.simulate.effect_signature import Signature, chosen, signature

from .text import catalogue_table, described

__all__ = ["Signature", "catalogue_table", "chosen", "described", "signature"]
