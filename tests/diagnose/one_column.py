"""A recording that is nothing but one column."""

from fitting.data.recordings import Recording

NAMES = {"strain": "strain", "temperature": "temperature_degC"}


def Column(name, values, noise):  # noqa: N802
    """A recording of one quantity of a wire, with its stated noise, or None."""
    column = NAMES[name]
    return Recording(name, None, "wire", columns={column: values}, noise={} if noise is None else {column: noise})
