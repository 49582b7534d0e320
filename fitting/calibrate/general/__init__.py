"""Wires, tubes and whole actuators: one pipeline for every kind that `fitting.specimens` can predict."""

from .pipeline import (
    GeneralCharacterisation,
    characterise_actuator,
    characterise_general,
    characterise_spring_by_temperature,
    characterise_tube,
    characterise_wire,
)

__all__ = [
    "GeneralCharacterisation",
    "characterise_actuator",
    "characterise_general",
    "characterise_spring_by_temperature",
    "characterise_tube",
    "characterise_wire",
]
