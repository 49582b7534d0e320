"""Silicone: the source's mechanical tests, hyperelastic laws, the regularised law, the tube."""

from .laws import Gent, NeoHookean, Ogden, SiliconeLaw, Yeoh
from .load import load_silicone, load_silicone_test
from .polynomial import PolynomialFit
from .regularised import RegularisedSilicone
from .tube import tube_length, tube_strain

__all__ = [
    "Gent",
    "NeoHookean",
    "Ogden",
    "PolynomialFit",
    "RegularisedSilicone",
    "SiliconeLaw",
    "Yeoh",
    "load_silicone",
    "load_silicone_test",
    "tube_length",
    "tube_strain",
]
