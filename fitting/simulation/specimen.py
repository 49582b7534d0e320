"""From what a recording states about its specimen to the model's objects."""

import pneusma_jax as pj
from fitting.recordings import Recording, schema
from pneusma_jax.calibration import load_calibration
from pneusma_jax.designs import GEOMETRY_KEYS
from pneusma_jax.silicone import SiliconeLaw
from pneusma_jax.units import to_si

_SPRING_CONSTANTS = ("G_m", "G_a", "gamma_L", "rho_mean")


def place(recording: Recording) -> str:
    """The name by which messages call a recording."""
    return str(recording.path or recording.name)


def geometry_of(recording: Recording) -> pj.Geometry:
    """Dimensions of a recording's specimen, in SI; what its kind does not have keeps the source's value."""
    values = {}
    for key, value in recording.full_geometry().items():
        if key in schema.GEOMETRY_NUMBERS:
            plain = key in schema.GEOMETRY_WITHOUT_UNIT
            quantity, unit = (key, "1") if plain else schema.quantity_and_unit(key)
            if quantity in GEOMETRY_KEYS:
                values[quantity] = to_si(value, unit)
    return pj.Geometry(**values)


def alloy_of(recording: Recording) -> pj.Alloy:
    """Alloy that a recording names.

    Raises:
        InputError: if it is to be fitted, cannot be loaded, or has not a spring's constants.
    """
    name = _named_table(recording, "alloy")
    load_calibration(name, "alloy").require(_SPRING_CONSTANTS)
    return pj.load_alloy(name)


def law_of(recording: Recording) -> SiliconeLaw:
    """Silicone law of a recording: the table's own, or the `law` that the recording states.

    A table whose own law is `regularised` is made of order-4 polynomials, so a stated `polynomial` is that.

    Raises:
        InputError: if the material is to be fitted, cannot be loaded, or has no numbers for the law.
    """
    name = _named_table(recording, "material")
    stated = recording.geometry.get("law")
    own = load_calibration(name, "silicone").text["law"]
    if stated is None or (stated == "polynomial" and own == "regularised"):
        return pj.load_silicone(name)
    return pj.load_silicone(name, stated)


def actuator_of(recording: Recording) -> pj.Actuator:
    """Actuator of a recording.

    Raises:
        InputError: for impossible dimensions or tables that cannot be used.
    """
    arrangement = pj.layout(recording.full_geometry()["design"])
    alloy = alloy_of(recording) if arrangement.spring_numbers else None
    law = law_of(recording)
    try:
        return pj.round_actuator(arrangement, geometry_of(recording), alloy, law)
    except ValueError as error:
        raise pj.InputError(f"{place(recording)}: {error}") from None


def spring_of(recording: Recording) -> pj.Spring:
    """Spring on a test stand: its elongation counts from the free length.

    Raises:
        InputError: for impossible dimensions or an alloy that cannot be used.
    """
    g = geometry_of(recording)
    alloy = alloy_of(recording)
    try:
        dimensions = pj.SpringGeometry(
            g.wire_diameter, g.mandrel_diameter, g.initial_pitch, g.active_coils, g.free_length
        )
    except ValueError as error:
        raise pj.InputError(f"{place(recording)}: {error}") from None
    return pj.Spring(dimensions, alloy, g.free_length)


def _named_table(recording: Recording, key: str):
    name = recording.table(key)
    if name == "fit":
        raise pj.InputError(
            f"{place(recording)}: [geometry] {key} is to be fitted, so there is nothing to predict with; "
            f"name one with --{key}"
        )
    return name
