"""Hyperelastic laws of elastomers, fitted to pulls and presses, and which of them to believe."""

from .laws import LAWS
from .pipeline import ElastomerCharacterisation, characterise_elastomer, estimates

__all__ = ["LAWS", "ElastomerCharacterisation", "characterise_elastomer", "estimates"]
