"""Checks of a campaign before anything is fitted: nothing happens in it, or it contradicts itself.

Unusable campaigns are refused. What needs care becomes a note in the report.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from fitting.data.recordings import Campaign, Recording, questions_of_reading, schema
from fitting.inference.readings import noise_of
from fitting.specimens import SPECIMENS, specimen_of
from fitting.specimens.registry import named_by
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError, counted
from pneusma_jax.units import from_si

from .settings import DEFAULT
from .verdict.conclusion import Conclusion
from .verdict.separating import to_separate

CHANCE = DEFAULT.chance
INSTRUMENTS = DEFAULT.instruments
LISTS = DEFAULT.lists
SHARE = DEFAULT.share
VALUES = DEFAULT.values

BODY = (
    "design", "alloy", "material", "outer_diameter_mm", "wall_thickness_mm", "length_mm", "wire_diameter_mm",
    "mandrel_diameter_mm", "active_coils",
)  # fmt: skip
"""Geometry that one specimen has once."""
OPTION_OF = {"alloy": "base", "material": "material"}
"""Option of `Specimen.rows_for` by the key of `[geometry]` that names its table."""


def checked(campaign: Campaign) -> list[str]:
    """Refuse a campaign that cannot be diagnosed.

    Returns:
        Sentences about what is to be read with care.

    Raises:
        InputError: if nothing drives the model anywhere, an output reads the same in every row, or one
            specimen is stated as two.
    """
    for recording in campaign.recordings:
        specimen_of(recording.kind).check_diagnosable(recording)
        _check_outputs(recording)
    _check_bodies(campaign)
    asked = questions_of_reading(campaign.recordings)
    return [*asked, *_still(campaign), *_contradictions(campaign.recordings)]


def with_tables(campaign: Campaign, tables: Mapping[str, str]) -> Campaign:
    """A campaign of another alloy or material than its recordings name.

    Args:
        campaign: left alone.
        tables: names or paths by `alloy` and `material`; "fit" for one that is to be identified.

    Raises:
        InputError: for one that recordings of their kind do not have.
    """
    for key in tables:
        for kind in campaign.kinds:
            have = [name for name, one in SPECIMENS.items() if OPTION_OF[key] in one.options]
            if kind not in have:
                raise InputError(
                    f"{campaign.path}: option {key} means nothing for recordings of kind {kind}, which have "
                    f"no {key}; it is for {', '.join(have)}"
                )
    recordings = [replace(r, geometry={**r.geometry, **tables}) for r in campaign.recordings]
    return replace(campaign, recordings=recordings) if tables else campaign


def asked_effects(slugs: Sequence[str], kind: str) -> list[str]:
    """Effects that are asked for by name, each once.

    Raises:
        InputError: for one that is not in the catalogue, or that recordings of the kind cannot show.
    """
    for slug in slugs:
        effect = find_effect(slug)
        if specimen_of(kind).letter not in effect.kinds:
            shown = ", ".join(named_by(effect.kinds))
            raise InputError(
                f"effect {slug!r} cannot be tested with recordings of kind {kind}; it shows in: {shown}"
            )
    return list(dict.fromkeys(slugs))


def drivers_in(recording: Recording) -> list[str]:
    """Quantities of a recording that drive the model, time left out."""
    return list(specimen_of(recording.kind).influences(recording))


def _place(recording: Recording) -> str:
    return str(recording.path or recording.name)


def _clock(recording: Recording) -> np.ndarray:
    """Time from the first row [s], or the number of the row."""
    if not recording.has("time"):
        return np.arange(len(recording)) * 1.0
    time = recording.si("time")
    return time - time[np.isfinite(time)][0]


def _check_outputs(recording: Recording) -> None:
    """Refuse what was not connected, and recordings in which nothing happens at all."""
    values = {name: recording.columns[name] for name in recording.known_columns if name != "time_s"}
    values = {name: x[np.isfinite(x)] for name, x in values.items()}
    if all(x.size < 2 or np.ptp(x) == 0.0 for x in values.values()):
        raise InputError(
            f"{_place(recording)}: nothing varies in this recording, so there is nothing to explain"
        )
    driven = set(drivers_in(recording))
    for name in recording.outputs:
        quantity, x = schema.quantity_and_unit(name)[0], values[name]
        if quantity in driven or name in recording.noise or x.size < 2 or np.ptp(x) > 0.0:
            continue
        raise InputError(
            f"{_place(recording)}: column {name!r}: {x[0]:g} in every row, as of an instrument that was not "
            "connected; remove the column, or state its noise in [noise] if that was measured"
        )


def _check_bodies(campaign: Campaign) -> None:
    """Refuse one specimen that is stated as two."""
    for specimen, members in campaign.specimens().items():
        first = members[0]
        stated = first.full_geometry()
        for other in members[1:]:
            for key, value in other.full_geometry().items():
                if key in BODY and value != stated.get(key, value):
                    raise InputError(
                        f"{_place(other)}: {key} is {value} here but {stated[key]} in {_place(first)}, and "
                        f"both are said to be of specimen {specimen!r}; correct one, or give each its own "
                        "specimen"
                    )


def _still(campaign: Campaign) -> list[str]:
    """Note recordings in which nothing drives the model; refuse a campaign of them."""
    still = [recording for recording in campaign.recordings if not _driven(recording)]
    fitted = [recording for recording in campaign.recordings if recording.role == "fit"]
    names = ", ".join(drivers_in(campaign.recordings[0]))
    if fitted and all(recording in still for recording in fitted) and _alike(fitted):
        raise InputError(
            f"{campaign.path}: nothing that drives the model ({names}) varies in the recordings to fit, nor "
            "between them; record at least two levels"
        )
    return [
        f"{recording.name}: nothing that drives the model ({names}) varies here; it can only show what "
        "changes by itself"
        for recording in still
    ]


def _driven(recording: Recording) -> bool:
    """True if any driver varies by more than its noise."""
    for name in drivers_in(recording):
        values = recording.si(name)
        values = values[np.isfinite(values)]
        if values.size < 2 or not np.ptp(values) > 0.0:
            continue
        small = dict(INSTRUMENTS.still_ranges).get(name.partition("_")[0])
        least = float(np.max(np.abs(values))) * SHARE.same if small is None else small
        unknown = recording.noise_si(name) is None  # coarse samples of a ramp look like noise, too
        if (unknown and np.ptp(values) > least) or np.std(values) > CHANCE.scatter_ratio * noise_of(
            recording, name
        ):
            return True
    return False


def _alike(recordings: Sequence[Recording]) -> bool:
    """True if still recordings were all made at one level of every driver."""
    for name in drivers_in(recordings[0]):
        held = [r for r in recordings if r.has(name)]
        means = np.array([np.nanmean(r.si(name)) for r in held])
        noise = max(noise_of(r, name) for r in held)
        if np.ptp(means) > max(CHANCE.deviations * noise, SHARE.same * float(np.max(np.abs(means)))):
            return False
    return True


def _contradictions(recordings: Sequence[Recording]) -> list[str]:
    """Pairs of recordings that answered the same input differently, in words."""
    found = [said for a, b in combinations(recordings, 2) if (said := _contradiction(a, b))]
    more = len(found) - LISTS.told
    pairs = "more pair of recordings contradicts", "more pairs of recordings contradict"
    rest = [f"{counted(more, *pairs)} each other"] if more > 0 else []
    return found[: LISTS.told] + rest


def _contradiction(a: Recording, b: Recording) -> str | None:
    if a.full_geometry() != b.full_geometry() or set(drivers_in(a)) != set(drivers_in(b)):
        return None
    time = _common(a, b)
    if time is None:
        return None
    own = a.specimen == b.specimen
    spread = SHARE.small + (0.0 if own else CHANCE.deviations * np.sqrt(2.0) * _tolerance(a))
    for column in a.outputs:
        quantity, unit = schema.quantity_and_unit(column)
        if quantity in drivers_in(a) or column not in b.outputs:
            continue
        x, y = _at(a, quantity, time), _at(b, quantity, time)
        there = np.isfinite(x) & np.isfinite(y)
        if there.sum() < VALUES.minimum:
            continue
        apart = np.abs(x - y)[there]
        noise = float(np.hypot(noise_of(a, quantity), noise_of(b, quantity)))
        reach = max(float(np.ptp(x[there])), float(np.ptp(y[there])))
        if np.median(apart) > CHANCE.deviations * noise + spread * reach:
            most = float(np.max(apart))
            times = f" ({most / noise:.0f} times their noise)" if noise > 0.0 else ""
            whose = (
                f"both of specimen {a.specimen!r}: one is mislabelled, or was in another state than is stated"
                if own
                else f"of specimens {a.specimen!r} and {b.specimen!r}, more than tolerances allow"
            )
            said = (
                f"{a.name} and {b.name} contradict each other: {column} differs by up to "
                f"{_in_unit(most, unit):.3g} {unit}{times} under the same input; {whose}. "
            )
            if any(name.startswith("resistance") for name in drivers_in(a)):
                return f"{said}Or one was hotter: near full heat a resistance hardly tells how hot a wire is"
            return f"{said}No one model explains both"
    return None


def _in_unit(value: float, unit: str) -> float:
    return float(from_si(value, unit, difference=True))


def _tolerance(recording: Recording) -> float:
    """Relative 1-sigma that specimens may differ by in all, roughly: the tolerances in squares."""
    return float(np.sqrt(sum(value**2 for value in recording.full_tolerance().values())))


def _common(a: Recording, b: Recording) -> np.ndarray | None:
    """Times from the start over which two recordings were driven alike; None if these are too short."""
    end = min(np.nanmax(_clock(a)), np.nanmax(_clock(b)))
    count = min(len(a), len(b), LISTS.compared_rows)
    if not end > 0.0 or count < VALUES.minimum:
        return None
    time = np.linspace(0.0, end, count)
    alike, moved = np.ones(count, bool), np.zeros(count, bool)
    for name in drivers_in(a):
        x, y = _at(a, name, time), _at(b, name, time)
        reach = max(float(np.nanmax(x) - np.nanmin(x)), float(np.nanmax(y) - np.nanmin(y)))
        noise = min(float(np.hypot(noise_of(a, name), noise_of(b, name))), SHARE.same * reach)
        alike &= np.abs(x - y) <= CHANCE.outlier * noise + SHARE.same * reach
        moved |= np.abs(x - x[0]) > CHANCE.outlier * noise + SHARE.minor * reach
    apart = np.flatnonzero(~alike)
    count = int(apart[0]) if apart.size else count
    return time[:count] if count >= SHARE.most * len(time) and moved[:count].any() else None


def _at(recording: Recording, quantity: str, time: np.ndarray) -> np.ndarray:
    """A column at times from the start, SI; NaN where nothing was recorded."""
    clock, values = _clock(recording), recording.si(quantity)
    there = np.isfinite(clock) & np.isfinite(values)
    if there.sum() < 2:
        return np.full(len(time), np.nan)
    return np.interp(time, clock[there], values[there])


def answers(asked: Sequence[str], conclusion: Conclusion) -> list[dict]:
    """Answers of the recordings about effects that were asked for.

    Returns:
        For each its name, whether it could be tested, and a sentence.
    """
    named = {f.slug: f for f in conclusion.reported}
    letter = conclusion.explanation.program.specimen.letter
    untestable = conclusion.untestable
    found = []
    for slug in asked:
        if slug in named:
            perhaps = "perhaps " if named[slug].tentative else ""
            text = f"{slug} was {perhaps}found, with a probability of {named[slug].probability:.2f}."
        elif slug in untestable:
            text = (
                f"{slug} cannot be tested with these recordings: {untestable[slug]}. To test it: "
                f"{to_separate(slug, letter, 'vary what drives it')}."
            )
        elif slug in conclusion.candidates and conclusion.within_accuracy:
            text = (
                f"{slug} is not named: the base model misses less than instruments of unstated noise do. "
                "State the noise, under [noise], to have it tested."
            )
        elif slug in conclusion.candidates and slug not in conclusion.explanation.tried:
            text = f"{slug} is not named: its score did not stand out enough for it to be fitted."
        elif slug in conclusion.candidates:
            probability, bayes = conclusion.candidates[slug]
            text = (
                f"{slug} was tried and is not named: its probability of being the strongest explanation is "
                f"{probability:.2g} (log Bayes factor {bayes:.3g})."
            )
        else:
            text = f"{slug} is part of the model that the diagnosis started from."
        found.append({"name": slug, "testable": slug not in untestable, "text": text})
    return found
