"""The catalogue of physics that the published model leaves out.

An effect with its parameters at their neutral values changes nothing; `CATALOGUE` finds one by its slug. To add
one, write a module like those here with its `specs` and slots, and list its class below.
"""

from ..chain import Effect
from ..errors import InputError, nearest
from ._spec import Spec
from .body import RadialExpansion, TipContact, WallEccentricity, WrapFriction
from .sensors import (
    CameraCalibration,
    ForceCalibration,
    PressureCalibration,
    PressureLag,
    SeriesResistance,
)
from .spring import (
    CoilContact,
    InactiveCoils,
    LargeHelixAngle,
    OpposingSpringHeating,
    PrestrainError,
    TransformationHysteresis,
    UnevenHeating,
)
from .wall import MullinsSoftening, PermanentSet, StrainStiffening, ThickWall, ViscoelasticRelaxation

CATALOGUE: dict[str, type[Effect]] = {
    effect.slug: effect
    for effect in (
        CameraCalibration, CoilContact, ForceCalibration, InactiveCoils, LargeHelixAngle, MullinsSoftening,
        OpposingSpringHeating, PermanentSet, PressureCalibration, PressureLag, PrestrainError, RadialExpansion,
        SeriesResistance, StrainStiffening, ThickWall, TipContact, TransformationHysteresis, UnevenHeating,
        ViscoelasticRelaxation, WallEccentricity, WrapFriction,
    )
}  # fmt: skip


def find_effect(slug: str) -> type[Effect]:
    """Class of an effect by its name in the catalogue.

    Raises:
        InputError: if there is none; names the nearest.
    """
    if slug not in CATALOGUE:
        raise InputError(f"there is no effect {slug!r}, {nearest(slug, CATALOGUE)}")
    return CATALOGUE[slug]


__all__ = ["CATALOGUE", "Effect", "Spec", "find_effect"]
