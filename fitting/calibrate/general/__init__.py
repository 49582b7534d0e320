"""Wires, tubes and whole actuators: one pipeline for every kind that `fitting.specimens` can predict."""

from .pipeline import (
    GeneralCharacterisation,
    characterise_general,
    characterise_specimen,
)

__all__ = [
    "GeneralCharacterisation",
    "characterise_general",
    "characterise_specimen",
]
