"""Assumptions about the specimens of a campaign, and whether the fitted constants contradict them.

Where a campaign does not state a size, the nominal one of the source (the published work) is taken. Where it
does not state a tolerance, a default one is taken.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from fitting.data.recordings import Recording, notices_of_reading, schema
from fitting.inference.chance import chi_square_tail
from fitting.inference.notes import joined, of_several
from fitting.inference.numbers import number
from fitting.inference.parameters import Parameter, Parameters
from fitting.inference.readings import cautions
from fitting.specimens.priors import quantity_of
from fitting.specimens.reduction import reduction_notes
from fitting.specimens.rows import MARK, MOST_ROWS, of_specimen
from pneusma_jax.units import amount, from_si

UNREMARKABLE = ("prestrain", "cycles_before", "attached_length_mm", "free_length_mm", "orientation")
"""Keys of `[geometry]` that may be left out in silence. Their nominal value says that nothing is special, or
follows from others."""
HINTS = {
    "alloy": 'for an alloy of your own write alloy = "fit", or the name of its table',
    "material": "for a silicone of your own write the name of its table",
}
"""What a user with other constants writes, by the key of `[geometry]` that is missing."""
MINIMUM_SHIFT = 2.0
"""Minimum shift of a constant for a warning, in standard deviations of its default tolerance. Chance shifts
one in twenty as far if the tolerance is right."""

MAXIMUM_CHANCE = 1e-3
"""Maximum probability for the shifts of all constants to be called improbable [1].

If priors and law are right, at most one campaign in a thousand is called so. Two tests share it, half each.
One is of the sum of squares, the other of the largest of all shifts (Bonferroni). In six simulated
campaigns of springs the sum of squares of 9 shifts was 4.5 to 14, and 29.7 is allowed. A lead of 0.15 ohm
made it 71 of 13 shifts, and 36.5 is allowed. A largest shift of 4.1 is allowed of 13, and of 4.4 of 40.
"""

MINIMUM_SHIFT_OF_MANY = 1.0
"""Minimum shift that is named where many are improbable together and none reaches `MINIMUM_SHIFT`.

It is in standard deviations of the prior. A prior that is right leaves no larger root mean square.
"""


def notices_of(recordings: Sequence[Recording], free: Parameters, most: int = MOST_ROWS) -> list[str]:
    """Cautions: assumptions, rows that are no measurements, recordings that were reduced, and the notices of
    each reading.

    Args:
        recordings: the recordings as read.
        free: free parameters of their model, with priors.
        most: number of rows to which longer recordings were reduced.
    """
    notes = [
        *assumed(recordings), *default_tolerances(recordings, free), *cautions(recordings),
        *reduction_notes(recordings, most), *notices_of_reading(recordings),
    ]  # fmt: skip
    return of_several(notes, [recording.name for recording in recordings])


def assumed(recordings: Sequence[Recording]) -> list[str]:
    """A sentence where recordings leave out what their specimens are; nothing where all is stated.

    A `design` states everything that its table holds. A silicone to be fitted has no law of the source.
    """
    missing: dict[str, str] = {}
    silent = []
    for recording in recordings:
        unstated = _unstated(recording)
        missing |= {key: str(value) for key, value in unstated.items()}
        silent += [recording.name] if unstated else []
    if not missing:
        return []
    taken = ", ".join(f"{key} = {value}" for key, value in missing.items())
    hints = "".join(f"; {hint}" for key, hint in HINTS.items() if key in missing)
    return [f"{', '.join(silent)}: not stated in [geometry], so the source's are taken: {taken}{hints}"]


def _unstated(recording: Recording) -> dict[str, Any]:
    """Nominal values of the keys of `[geometry]` that a recording leaves out and a user should know of."""
    if "design" in recording.geometry:
        return {}
    silent = (*UNREMARKABLE, "law") if recording.geometry.get("material") == "fit" else UNREMARKABLE
    nominal = recording.full_geometry()
    return {k: value for k, value in nominal.items() if k not in recording.geometry and k not in silent}


def default_deviations(recordings: Sequence[Recording], free: Parameters) -> dict[str, float]:
    """Relative standard deviations [1] of free constants whose prior is a default tolerance, by name.

    Args:
        recordings: recordings of one kind.
        free: free parameters of their model. One whose prior comes from a table is left out.

    Returns:
        Nothing if every recording has a table `[tolerance]`.
    """
    if all(recording.tolerance is not None for recording in recordings):
        return {}
    defaults = {quantity_of(key): sd for key, sd in schema.TOLERANCE_DEFAULTS.items()}
    found = {name: defaults.get(name.partition(MARK)[0]) for name in free}
    return {name: sd for name, sd in found.items() if sd is not None and _prior_is_tolerance(free[name], sd)}


def _prior_is_tolerance(entry: Parameter, relative: float) -> bool:
    """True if the prior of a parameter is that of a relative tolerance [1]."""
    prior = entry.prior
    return prior is not None and math.isclose(prior.sd, relative * abs(prior.mean), rel_tol=1e-6)


def default_tolerances(recordings: Sequence[Recording], free: Parameters) -> list[str]:
    """A sentence on the tolerances that were assumed; nothing where all are stated.

    Args:
        recordings, free: as in `default_deviations`.
    """
    names_by_sd: dict[float, dict[str, None]] = {}
    for name, sd in default_deviations(recordings, free).items():
        names_by_sd.setdefault(sd, {})[name.partition(MARK)[0]] = None
    if not names_by_sd:
        return []
    each = "; ".join(f"{joined(names)} to {number(100.0 * sd, '.2g')} %" for sd, names in names_by_sd.items())
    silent = [recording.name for recording in recordings if recording.tolerance is None]
    whose = f" of {joined(silent)}" if len(silent) < len(recordings) else ""
    return [
        f"no [tolerance]{whose} is stated, so constants were taken as known by default, to one standard "
        f"deviation: {each}. State your own under [tolerance]; what that table leaves out is exact"
    ]


def improbable_shifts(free: Parameters, values: Mapping[str, float]) -> dict[str, float]:
    """Shifts of constants from their priors where chance hardly makes such shifts, by name.

    A shift is in standard deviations of the prior. If priors and law are right, the sum of squares of all
    shifts is at most distributed like chi-square. It has one degree of freedom for each prior. Where
    recordings tell little the sum is smaller, and hides a single constant that moved far. So the largest
    shift is tested, too.

    Args:
        free: free parameters, with priors or without.
        values: values found, by name, SI. One without a finite shift does not count.

    Returns:
        Shifts of at least `MINIMUM_SHIFT`, or of at least `MINIMUM_SHIFT_OF_MANY` if none is so large. Empty
        where chance explains all.
    """
    entries = {name: entry for name, entry in free.items() if entry.free and entry.prior is not None}
    shifts = {name: float((values[name] - e.prior.mean) / e.prior.sd) for name, e in entries.items()}
    shifts = {name: shift for name, shift in shifts.items() if math.isfinite(shift)}
    if not shifts:
        return {}
    largest, square = max(map(abs, shifts.values())), sum(shift**2 for shift in shifts.values())
    chance_of_sum = chi_square_tail(square, len(shifts))
    chance_of_largest = len(shifts) * chi_square_tail(largest**2, 1)
    if min(chance_of_sum, chance_of_largest) > 0.5 * MAXIMUM_CHANCE:
        return {}
    least = MINIMUM_SHIFT if largest >= MINIMUM_SHIFT else MINIMUM_SHIFT_OF_MANY
    return {name: shift for name, shift in shifts.items() if abs(shift) >= least}


def far_from_nominal(
    recordings: Sequence[Recording], free: Parameters, values: Mapping[str, float]
) -> list[str]:
    """Sentences on constants that a fit moved far from their nominal values.

    Far is at least `MINIMUM_SHIFT` default tolerances.

    Args:
        recordings, free: as in `default_deviations`.
        values: values found, by name, SI.
    """
    sentences: list[str] = []
    unstated = {quantity_of(key) for recording in recordings for key in _unstated(recording)}
    for name, relative in default_deviations(recordings, free).items():
        entry, prior = free[name], free[name].prior
        shift = (values[name] - prior.mean) / prior.sd
        if abs(shift) < MINIMUM_SHIFT:
            continue
        first, now = (number(float(from_si(x, entry.unit)), ".4g") for x in (prior.mean, values[name]))
        share = number(100.0 * relative, ".2g")
        constant = of_specimen(name, (recording.specimen for recording in recordings))
        reason, advice = f"No tolerance of {constant} is stated, so it", "Measure it again, and state"
        if name.partition(MARK)[0] in unstated:
            reason, advice = f"{constant} is not stated, so the source's", "Measure it, and state it with"
        sentences.append(
            f"{reason} was taken as known to {share} %. The fit moved it from {first} to "
            f"{amount(now, entry.unit)}, by {abs(shift):.1f} of these standard deviations. "
            f"{advice} its tolerance."
        )
    return sentences
