"""Free parameters of a campaign's model and their priors.

A stated `[tolerance]` is complete. Without one, the defaults of the recording format hold. An alloy or
material that is to be identified (`"fit"`) has the priors of its calibration table instead.
"""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from fitting.data.recordings import Campaign, Recording, schema
from fitting.inference.parameters import Parameter, Parameters, Prior
from pneusma_jax.calibration import Calibration, load_calibration, unknown
from pneusma_jax.calibration.keys import POSITIVE
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.nitinol.geometry import OVERLAP
from pneusma_jax.units import amount, constant_from_si

from .rows import MARK

CUT = 4.0
"""Number of standard deviations at which a tolerance's prior is truncated."""
WIDE = 0.15
"""Minimum relative standard deviation from which a positive parameter is fitted by its logarithm."""
NEW_ALLOY = "new_nitinol"
"""Default table that an alloy starts from when it is to be identified."""
REFERENCE_WIRE = 0.25e-3
"""Wire diameter that the resistivities of `NEW_ALLOY` refer to [m]."""
PER_LENGTH = ("rho_mean", "rho_span", "alpha_1", "alpha_2")
"""Resistances per length of wire; they scale with the inverse of its cross-section."""
FIT = "fit"


def identifies(recordings: Iterable[Recording], keys: Iterable[str] = ("alloy", "material")) -> bool:
    """True if a recording asks for its alloy or material to be identified.

    Args:
        recordings: recordings of any kinds.
        keys: keys of `[geometry]` that may ask for it.
    """
    return any(str(recording.full_geometry().get(key)) == FIT for recording in recordings for key in keys)


def table_of(campaign: Campaign, key: str, base: str | Path | None = None) -> tuple[Calibration, bool]:
    """The one alloy or material of a campaign, and a flag that is true if it is to be identified.

    Args:
        campaign: recordings of one kind.
        key: `"alloy"` or `"material"`.
        base: table that the identification starts from; None takes `new_nitinol` for alloys.

    Raises:
        InputError: if the recordings name several, or a material is to be identified without a base.
    """
    named = {str(recording.table(key)): recording for recording in campaign.recordings}
    if len(named) > 1:
        words = " and ".join(f"{name!r} ({r.name})" for name, r in list(named.items())[:2])
        raise InputError(
            f"{campaign.path}: recordings name different tables as {key}: {words}; fit one at a time"
        )
    recording = next(iter(named.values()))
    name, identify = recording.table(key), str(recording.table(key)) == FIT
    kind = "alloy" if key == "alloy" else "silicone"
    if not identify:
        return load_calibration(base or name, kind), False
    if base is None and kind == "silicone":
        raise InputError(
            f"{campaign.path}: the material is to be fitted, but no table to start from is named"
        )
    return load_calibration(base or NEW_ALLOY, kind), True


def alloy_quantities(
    campaign: Campaign, names: Iterable[str], base: str | Path | None = None
) -> tuple[dict[str, Quantity], bool]:
    """Constants of a campaign's alloy with their priors, and a flag that is true if it is to be identified.

    Resistivities of an uncharacterised alloy are scaled to the thinnest wire of the campaign.
    """
    table, identify = table_of(campaign, "alloy", base)
    table.require(names)
    quantities = {name: table.quantities[name] for name in names}
    if identify and (base is None or str(base) in unknown()):
        wire = min(r.full_geometry().get("wire_diameter_mm", 0.25) for r in campaign.recordings) * 1e-3
        factor = (REFERENCE_WIRE / wire) ** 2
        quantities |= {name: _scaled(quantities[name], factor) for name in PER_LENGTH if name in quantities}
    return quantities, identify


def _scaled(quantity: Quantity, factor: float) -> Quantity:
    prior = quantity.prior
    if prior is not None:
        prior = Prior(*(factor * x for x in (prior.mean, prior.sd, prior.min, prior.max)))
    return Quantity(
        quantity.name, factor * quantity.value, quantity.unit, quantity.status, quantity.source, prior
    )


def tolerances(recordings: Iterable[Recording], known: Iterable[str]) -> dict[str, float]:
    """Relative standard deviation of each parameter, by the model's name; the largest of all recordings.

    Args:
        recordings: recordings of one specimen, or of all.
        known: names of the model's parameters; other tolerances are ignored.
    """
    known = set(known)
    found: dict[str, float] = {}
    for recording in recordings:
        for key, sd in recording.full_tolerance().items():
            name = quantity_of(key)
            if name in known and sd > 0.0:
                found[name] = max(found.get(name, 0.0), sd)
    return found


def quantity_of(key: str) -> str:
    """Model parameter of a key of `[geometry]` or `[tolerance]`: the key without its unit."""
    if key in schema.GEOMETRY_NUMBERS and key not in schema.GEOMETRY_WITHOUT_UNIT:
        return schema.quantity_and_unit(key)[0]
    return key


def toleranced(name: str, value: float, relative: float, unit: str = "1") -> Parameter:
    """A parameter with a Gaussian prior of given relative standard deviation, truncated at four of them."""
    sd = relative * abs(value)
    low, high = value - CUT * sd, value + CUT * sd
    if name.partition(MARK)[0] in POSITIVE:
        low = max(low, 1e-3 * value)
    prior = Prior(value, sd, low, high)
    return Parameter(name, value=value, unit=unit, prior=prior)


def tabulated(quantity: Quantity) -> Parameter:
    """A parameter with the prior of its table."""
    prior = quantity.prior
    positive = prior.min > 0.0 and prior.sd > WIDE * prior.mean
    value = min(max(quantity.value, prior.min), prior.max)
    return Parameter(
        quantity.name, value=value, unit=quantity.unit, prior=prior, scale="log" if positive else "linear"
    )


def alloy_parameters(
    campaign: Campaign, names: Iterable[str], fixed: Iterable[str], base: str | Path | None = None
) -> tuple[Parameters, dict[str, float]]:
    """Free constants of a campaign's alloy, and the values of all its constants by name, SI.

    Args:
        campaign: recordings of one kind.
        names: constants that the model needs.
        fixed: constants that this kind of test does not identify.
        base: table that an alloy starts from when it is to be identified.
    """
    names = tuple(names)
    quantities, identify = alloy_quantities(campaign, names, base)
    values = {name: quantity.value for name, quantity in quantities.items()}
    parameters = Parameters()
    if identify:
        for name, quantity in quantities.items():
            if quantity.prior is not None and name not in set(fixed):
                parameters.add(tabulated(quantity))
        return parameters, values
    for name, relative in tolerances(campaign.recordings, names).items():
        parameters.add(toleranced(name, values[name], relative, quantities[name].unit))
    return parameters, values


def geometry_parameters(
    campaign: Campaign,
    dimensions: Callable[[Recording], Mapping[str, Any]],
    units: Mapping[str, str] | None = None,
    wide: Mapping[str, float] | None = None,
) -> Parameters:
    """Free dimensions. Every specimen has its own, since each was made and measured separately.

    Args:
        campaign: recordings of one kind.
        dimensions: function from a recording to the dimensions that may be free, by name, SI.
        units: display units by name; millimetres by default, none for plain numbers.
        wide: relative standard deviation of parameters that stay free, whatever tolerance the recordings
            state.
    """
    specimens = campaign.specimens()
    parameters = Parameters()
    for number, recordings in enumerate(specimens.values(), start=1):
        known = {name: float(value) for name, value in dimensions(recordings[0]).items()}
        stated = tolerances(recordings, known) | dict(wide or {})
        for name, relative in stated.items():
            label = name if len(specimens) == 1 else f"{name}{MARK}{number}"
            unit = (units or {}).get(name, "1" if name in schema.GEOMETRY_WITHOUT_UNIT else "mm")
            if known[name] != 0.0:
                parameters.add(toleranced(label, known[name], relative, unit))
        _keep_coils_apart(parameters, known, "" if len(specimens) == 1 else f"{MARK}{number}")
    return parameters


def _keep_coils_apart(parameters: Parameters, known: Mapping[str, float], end: str) -> None:
    """Bound wire diameter and pitch of a spring where they would meet: no fit tries coils that overlap.

    The bounds meet where both are as many standard deviations from what is stated.

    Args:
        parameters: free parameters; their bounds are changed.
        known: stated dimensions of the specimen, SI.
        end: end of the specimen's names.
    """
    if not {"wire_diameter", "initial_pitch"} <= known.keys():
        return
    least = (1.0 - OVERLAP) * known["wire_diameter"]  # pitch at which the coils would overlap
    pitch = known["initial_pitch"]
    wire, gap = parameters.get(f"wire_diameter{end}"), parameters.get(f"initial_pitch{end}")
    spreads = [one.prior.sd if one is not None else 0.0 for one in (wire, gap)]
    of_wire = (1.0 - OVERLAP) * spreads[0]
    if pitch < least or of_wire + spreads[1] == 0.0:
        return
    limit = least + (pitch - least) * of_wire / (of_wire + spreads[1])
    if wire is not None:
        wire.set(max=min(wire.max, limit / (1.0 - OVERLAP)))
    if gap is not None:
        gap.set(min=max(gap.min, limit))


def adjusted(parameters: Parameters, changes: Mapping[str, Mapping]) -> Parameters:
    """Parameters with changes by the user: any of `value`, `min`, `max`, `vary`, `tie`, in SI.

    Raises:
        InputError: if there is no such parameter, or the change is impossible.
    """
    result = parameters.copy()
    for name, change in changes.items():
        if name not in result:
            raise InputError(f"there is no free parameter {name!r}, {nearest(name, result)}")
        wanted = dict(change)
        value = wanted.get("value")
        if value is not None and not math.isfinite(float(value)):
            raise InputError(f"parameter {name!r}: value must be a finite number, not {value}")
        _check_bounds(result[name], wanted)
        result[name].set(**wanted)
    return result


def _check_bounds(entry: Parameter, wanted: Mapping[str, Any]) -> None:
    """Refuse a value outside of its bounds; both are told in the unit of files."""
    value = wanted.get("value")
    ends = [wanted.get(key, getattr(entry, key)) for key in ("min", "max")]
    if value is None or ends[0] <= value <= ends[1]:
        return
    told, low, high = (f"{float(constant_from_si(x, entry.unit)):.6g}" for x in (value, *ends))
    if math.isinf(ends[1]):
        bounds = f"must be at least {amount(low, entry.unit)}"
    elif math.isinf(ends[0]):
        bounds = f"must be at most {amount(high, entry.unit)}"
    else:
        bounds = f"must lie in {amount(f'{low} to {high}', entry.unit)}"
    raise InputError(f"parameter {entry.name!r}: {amount(told, entry.unit)} is out of bounds; it {bounds}")
