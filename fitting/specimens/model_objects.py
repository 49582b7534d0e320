"""Objects of the physics (alloy, law, spring, actuator) from the statements of a recording."""

from pathlib import Path
from typing import Any

import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording, schema
from pneusma_jax.actuator.designs import GEOMETRY_KEYS, design_gravity, design_loads
from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.silicone import SiliconeLaw
from pneusma_jax.units import to_si

from .saved_models import AugmentedModel

BASE = AugmentedModel()
"""The base model, which changes no constant and adds no effect."""
_SPRING_CONSTANTS = ("G_m", "G_a", "gamma_L", "rho_mean")


def place(recording: Recording) -> str:
    """Name of a recording in error messages."""
    return str(recording.path or recording.name)


def geometry_of(recording: Recording, model: AugmentedModel = BASE) -> pj.Geometry:
    """Dimensions of a recording's specimen, SI. Dimensions that its kind does not have keep the source's
    value."""
    return pj.Geometry(**dimensions_of(recording, model))


def dimensions_of(recording: Recording, model: AugmentedModel = BASE) -> dict[str, float]:
    """Dimensions that a recording's specimen has, by their names in `pneusma_jax.Geometry`, SI."""
    values = {}
    for key, value in full_geometry(recording, model).items():
        if key in schema.GEOMETRY_NUMBERS:
            plain = key in schema.GEOMETRY_WITHOUT_UNIT
            quantity, unit = (key, "1") if plain else schema.quantity_and_unit(key)
            if quantity in GEOMETRY_KEYS:
                values[quantity] = to_si(value, unit)
    return values


def full_geometry(recording: Recording, model: AugmentedModel = BASE) -> dict[str, Any]:
    """Dimensions from a recording and from a model. The model was fitted, so its values win."""
    return recording.full_geometry() | model.geometry(recording.specimen)


def gravity_of(recording: Recording) -> np.ndarray:
    """Acceleration of gravity in the base frame [m/s2], for effects.

    An orientation that the recording states comes first, then that of its design's table.
    """
    stated = recording.geometry.get("orientation")
    if stated is not None:
        return pj.gravity_vector(stated)
    return design_gravity(recording.full_geometry()["design"])


def alloy_of(recording: Recording, model: AugmentedModel = BASE) -> pj.Alloy:
    """Alloy that a recording names, with the model's constants.

    Raises:
        InputError: if it is to be fitted, cannot be loaded, or lacks constants of a spring.
    """
    table = model.table("alloy", named_table(recording, "alloy"), recording.specimen)
    table.require(_SPRING_CONSTANTS)
    return pj.load_alloy(table)


def material_of(recording: Recording, model: AugmentedModel = BASE) -> Calibration:
    """Table of a recording's silicone, with the model's constants.

    Raises:
        InputError: if it is to be fitted or cannot be loaded.
    """
    return model.table("silicone", named_table(recording, "material"), recording.specimen)


def law_of(recording: Recording, model: AugmentedModel = BASE) -> SiliconeLaw:
    """Silicone law of a recording: the `law` that it states, else the table's own.

    A table whose own law is `regularised` consists of order-4 polynomials. There, `polynomial` names the same
    law.

    Raises:
        InputError: if the material is to be fitted, cannot be loaded, or has no numbers for the law.
    """
    table = material_of(recording, model)
    stated = recording.geometry.get("law")
    if stated is None or (stated == "polynomial" and table.text["law"] == "regularised"):
        return pj.load_silicone(table)
    return pj.load_silicone(table, stated)


def actuator_of(recording: Recording, model: AugmentedModel = BASE) -> pj.Actuator:
    """Actuator of a recording, with the section, spring positions and loads of its design.

    Raises:
        InputError: for impossible dimensions, springs that overlap, or tables that cannot be used.
    """
    design = load_calibration(recording.full_geometry()["design"], "actuator")
    _check_dimensions(recording, design)
    alloy = alloy_of(recording, model) if pj.layout(design).spring_numbers else None
    law = law_of(recording, model)
    try:
        body = pj.make_actuator(design, alloy, law, geometry_of(recording, model))
        if body.loads:  # the weight is that of the silicone that the recording names, not of the design's own
            body = body.with_loads(
                *design_loads(design, body, material_of(recording, model).values().get("density"))
            )
    except ValueError as error:
        shown = (
            design.path if str(recording.full_geometry()["design"]).endswith(".toml") else place(recording)
        )
        raise pj.InputError(f"{shown}: {error}") from None
    return body


def _check_dimensions(recording: Recording, design: Calibration) -> None:
    """Refuse dimensions of a tube that the design's section does not have."""
    for key in ("outer_diameter_mm", "wall_thickness_mm"):
        if key in recording.geometry and key.removesuffix("_mm") not in design.quantities:
            section = design.text.get("section", "annulus")
            raise pj.InputError(
                f"{place(recording)}: [geometry] {key} is no dimension of {design.name!r}, whose section is a"
                f" {section}; change it in {design.path}"
            )


def spring_of(recording: Recording, model: AugmentedModel = BASE) -> pj.Spring:
    """Spring on a test stand. Its elongation counts from the free length.

    Raises:
        InputError: for impossible dimensions or an alloy that cannot be used.
    """
    g = geometry_of(recording, model)
    alloy = alloy_of(recording, model)
    try:
        dimensions = pj.SpringGeometry(
            g.wire_diameter, g.mandrel_diameter, g.initial_pitch, g.active_coils, g.free_length
        )
    except ValueError as error:
        raise pj.InputError(f"{place(recording)}: {error}") from None
    return pj.Spring(dimensions, alloy, g.free_length)


def named_table(recording: Recording, key: str) -> str | Path:
    """Alloy or material that a recording names for its prediction.

    Raises:
        InputError: if it is to be fitted.
    """
    name = recording.table(key)
    if name == "fit":
        raise pj.InputError(
            f"{place(recording)}: [geometry] {key} is to be fitted, so there is nothing to predict with; "
            f"name one with --{key}"
        )
    return name
