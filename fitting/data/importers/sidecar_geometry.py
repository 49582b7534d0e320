"""The [geometry] of an imported recording's sidecar: stated sizes, and laws that are to be identified."""

from collections.abc import Mapping

import numpy as np

from ..recordings import Recording, resistance_range, schema
from ..recordings.nominal import nominal_geometry
from ..recordings.sidecar import unusual_size
from .making import Making
from .specimen_sizes import geometry_of_file


def geometry_of_sidecar(of_format: Mapping[str, object], making: Making) -> dict:
    """Content of the sidecar's [geometry]: dimensions of the kind, and a law that is to be identified.

    Args:
        of_format: dimensions that the format found in the preamble; canonical keys.
        making: the recording that is made.
    """
    kind, notices = making.kind, making.notices
    keys = {*nominal_geometry(kind, {}), *(schema.GEOMETRY_NUMBERS if kind == "actuator" else ())}
    stated = {
        key: size
        for key, size in making.options.dimensions.items()
        if key in schema.GEOMETRY_NUMBERS and key in keys
    }
    for key in stated:
        making.use("--dimension", key)
    for key in sorted({*making.options.dimensions} - {*stated}):  # those in the table are asked about there
        if why := unusual_size(key, making.options.dimensions[key], schema.geometry_unit(key)):
            making.warn(f"--dimension {key}: {why}")
    of_file = geometry_of_file(making)
    geometry = {**of_format, **of_file, **stated}
    if kind == "actuator" and "resistance_3" in making.channels and "design" not in geometry:
        geometry["design"] = "triad"
        making.warn(f'design = "triad", since {making.channels["resistance_3"].label!r} is of a third spring')
    fitted = schema.KINDS[kind].identified
    if fitted and fitted not in geometry:
        geometry[fitted] = "fit"
        notices.append(
            f'{fitted} = "fit": its law is to be identified; name a known one in the sidecar instead'
        )
    elif kind in ("spring", "actuator", "tube") and not {**of_file, **stated}:
        making.warn(
            "the sidecar has no [geometry]: state the specimen's with --dimension, or the source's is assumed"
        )
    elif kind == "tube" and "material" not in geometry:
        assumed = nominal_geometry(kind, geometry)["material"]
        notices.append(
            f'material = "{assumed}" is assumed, since nobody states the silicone: name yours under'
            ' [geometry] of the sidecar or of campaign.toml, or write material = "fit" to identify it'
        )
    return geometry


def identify_other_alloy(recording: Recording, making: Making) -> None:
    """State that a spring's alloy is to be identified, where its resistance is not that of the assumed one.

    Without a stated size nobody knows whether the size or the alloy is another one: that is refused later.

    Args:
        recording: recording that was made; its [geometry] is changed.
        making: the recording as it was made.
    """
    sized = any(key in schema.GEOMETRY_NUMBERS for key in recording.geometry)
    if recording.kind != "spring" or "alloy" in recording.geometry or not sized:
        return
    bounds, values = resistance_range(recording), recording.columns.get("resistance_ohm")
    if bounds is None or values is None or not np.any((values < bounds[0]) | (values > bounds[1])):
        return
    assumed = recording.full_geometry()["alloy"]
    least, most = np.nanmin(values), np.nanmax(values)
    recording.geometry["alloy"] = "fit"
    making.warn(
        f"resistance_ohm is from {least:.3g} to {most:.3g}, and a spring of {assumed} of this size has "
        f'{bounds[0]:.3g} to {bounds[1]:.3g}. So alloy = "fit": its law is to be identified. If a size '
        "is wrong, state it with --dimension"
    )
