"""Which effects there are, by kind and name."""

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
"""(kind, slug) -> class, effects of the catalogue."""
OUTSIDE = {(kind, cls.slug): cls for cls in outside.OUTSIDE for kind in cls.kinds}
"""(kind, name) -> class, physics that the catalogue does not hold."""


def effect_class(kind, name):
    """The class of an effect, named in the catalogue or not."""
    return NAMED.get((kind, name)) or OUTSIDE[kind, name]
