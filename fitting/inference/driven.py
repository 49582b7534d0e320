"""Division of a recording's columns into predicted ones and drivers of the model."""

import numpy as np

from fitting.data.recordings import Recording, schema

STEADIER = 0.5
"""Maximum ratio of the relative ranges of stress and strain for a prescribed stress."""


def by_stress(recording: Recording) -> bool:
    """True if stress drives the wire and strain is predicted."""
    sizes = []
    for name in ("stress", "strain"):
        if not recording.has(name):
            sizes.append(np.inf)  # an unmeasured column is no driver
            continue
        values = recording.si(name)
        values = values[np.isfinite(values)]
        most = float(np.max(np.abs(values))) if values.size else 0.0
        low, high = np.percentile(values, [2.0, 98.0]) if values.size else (0.0, 0.0)
        sizes.append((high - low) / most if most > 0.0 else 0.0)
    return sizes[0] < STEADIER * sizes[1]


def predicted(recording: Recording) -> list[str]:
    """Columns that the model predicts. Of a wire's stress and strain it is the one that is not prescribed."""
    either = schema.KINDS[recording.kind].either
    if either and all(name in recording.columns for name in either):
        return [either[1] if by_stress(recording) else either[0]]
    return recording.outputs


def measured(recording: Recording) -> list[str]:
    """Columns that instruments read from a specimen: predicted ones and resistances. Others are prescribed,
    and so are constant or piecewise linear."""
    read = [n for n in recording.known_columns if schema.quantity_and_unit(n)[0].startswith("resistance")]
    return list(dict.fromkeys([*predicted(recording), *read]))


def driver_and_output(recording: Recording) -> tuple[str, str] | None:
    """Quantities of a wire of which the steadier one drives the model, and the other one is predicted.

    None where a kind has no such pair, or the recording lacks one of them.
    """
    either = schema.KINDS[recording.kind].either
    if not either or not all(name in recording.columns for name in either):
        return None
    (output,) = predicted(recording)
    driver = either[0] if output == either[1] else either[1]
    return schema.quantity_and_unit(driver)[0], schema.quantity_and_unit(output)[0]
