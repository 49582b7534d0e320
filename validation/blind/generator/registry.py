"""Registry of effects by kind and name."""

from . import (
    effects_body,
    effects_metal,
    effects_pressure,
    effects_sensor,
    effects_silicone,
    effects_wire,
    outside,
)

MODULES = (effects_silicone, effects_pressure, effects_body, effects_metal, effects_wire, effects_sensor)
NAMED = {(kind, cls.slug): cls for module in MODULES for cls in module.EFFECTS for kind in cls.kinds}
"""Class by (kind, slug), for effects of the catalogue."""
OUTSIDE = {(kind, cls.slug): cls for cls in outside.OUTSIDE for kind in cls.kinds}
"""Class by (kind, name), for physics outside the catalogue."""


def effect_class(kind, name):
    """Class of an effect, in the catalogue or outside it."""
    return NAMED.get((kind, name)) or OUTSIDE[kind, name]
