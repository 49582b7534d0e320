"""Alloys from springs on a stand: the source's stages, a joint fit, and what it leaves open."""

from .pipeline import SpringCharacterisation, characterise_spring, values_found

__all__ = ["SpringCharacterisation", "characterise_spring", "values_found"]
