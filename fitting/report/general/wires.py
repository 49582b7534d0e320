"""Sentences about a characterised wire: transformation temperature, excluded rows, loops of the law."""

import numpy as np

from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import Score
from fitting.specimens.thermal_runs import runs_of
from fitting.specimens.wire import AMPLITUDE, bracket, set_apart

LOOP = 1.0
"""Minimum distance of the model's heating and cooling branch at half of its range for a loop [K]."""


def warnings(result: GeneralCharacterisation) -> list[str]:
    """Sentences about a characterised wire."""
    first = [
        f"{begun.text(r.name)}." for r in result.fit.recordings if (begun := set_apart(r)) is not None
    ]
    return [*first, *_residual_strain_note(result), *_middle_outside_note(result), *_loops(result)]


def middle(result: GeneralCharacterisation) -> dict[str, float]:
    """Temperatures [degC] at which recordings, and the fitted law, are half transformed, by name; empty where
    the recordings do not show it."""
    between, half = bracket(result.campaign), _half_way(result)
    if between is None:
        return {}
    found = {"recorded_lowest_degC": between[0], "recorded_highest_degC": between[1]}
    return found | ({} if half is None else {"fitted_law_degC": half})


def verdict(result: GeneralCharacterisation) -> list[str]:
    """Sentence on the transformation temperature, if the recordings show it."""
    found = middle(result)
    if not found:
        return []
    low, high = found["recorded_lowest_degC"], found["recorded_highest_degC"]
    at = f"{low:.1f} degC" if high - low < LOOP else f"{low:.1f} (cooling) to {high:.1f} degC (heating)"
    law = f", the fitted law at {found['fitted_law_degC']:.1f} degC" if "fitted_law_degC" in found else ""
    return [f"The recordings are half-way through their transformation at {at}{law}."]


def _without_residual_strain(result: GeneralCharacterisation) -> bool:
    """True if the law was fitted without residual strain."""
    held = result.unseen.get(AMPLITUDE)
    return held is not None and held.value == 0.0


def _residual_strain_note(result: GeneralCharacterisation) -> list[str]:
    """Sentence on the omission of the residual strain, with its reason."""
    if not _without_residual_strain(result):
        return []
    return [
        "No recording takes the load off. With a residual strain the law drew a loop between heating and "
        f"cooling, but another than the recorded one. So it was fitted without ({AMPLITUDE} = 0) and draws "
        "one curve. `pneusma diagnose` looks for the cause of the loop."
    ]


def _middle_outside_note(result: GeneralCharacterisation) -> list[str]:
    """Sentence where `T_mid` is not between the temperatures at which recordings are half transformed."""
    between, found = bracket(result.campaign), result.parameters.get("T_mid")
    if between is None or found is None or between[0] <= found.value <= between[1]:
        return []
    low, high = between
    over = "" if high - low < LOOP else f" ({high - low:.3g} K apart on cooling and heating)"
    half = _half_way(result)
    says = "" if half is None else f" The fitted law is half-way at {half:.1f} degC."
    return [
        f"T_mid = {found.value:.1f} degC lies outside the {low:.1f} to {high:.1f} degC in which the "
        f"recordings are half-way through their transformation{over}.{says} By this law half of the metal is "
        "martensite at T_mid, and the stiffer austenite counts for more. Do not read T_mid as the "
        "temperature at which half of the strain has come back."
    ]


def _half_way(result: GeneralCharacterisation) -> float | None:
    """Mean temperature [degC] at which the fitted law passes the middle of its range."""
    found = [T for score in _over_temperature(result) for _, T in _crossings(score)]
    return float(np.mean(found)) if found else None


def _loops(result: GeneralCharacterisation) -> list[str]:
    """Recordings with a loop of the law, although its phase has one curve. The residual strain causes it.

    A law without residual strain has no loop of its own: it follows that of the recorded strain.
    """
    if result.model is not None or _without_residual_strain(result):
        return []
    sentences = []
    for score in _over_temperature(result):
        found = _crossings(score)
        up, down = ([T for heating, T in found if heating is way] for way in (True, False))
        if up and down and abs(np.mean(up) - np.mean(down)) > LOOP:
            sentences.append(
                f"In {score.name} the fitted law draws a loop of {abs(np.mean(up) - np.mean(down)):.2g} K "
                "between heating and cooling, although its phase has one curve. Heating takes the residual "
                f"strain (gR_*) away, and cooling under load sets it again.{_loop_means(result)}"
            )
    return sentences


def _loop_means(result: GeneralCharacterisation) -> str:
    """Sentence on the constants of the residual strain that follow from a loop."""
    if result.fit.misses:
        return (
            " The recordings are missed all the same, so it may stand in for a hysteresis of the phase; then "
            "its constants mean little."
        )
    if result.specimen.unseen(result.campaign, **result.options):
        return (
            " No recording takes the load off, so only such loops tell these constants. A hysteresis of the "
            "phase would look alike."
        )
    return ""


def _over_temperature(result: GeneralCharacterisation) -> list[Score]:
    return [s for s in result.scores if s.role == "fit" and s.x_column == "temperature_degC"]


def _crossings(score: Score) -> list[tuple[bool, float]]:
    """Temperature and direction of every pass of a prediction through the middle of its range."""
    y, found = score.predicted, []
    middle = 0.5 * (y.max() + y.min())
    for run in runs_of(score.x):
        T, part = score.x[run.rows], y[run.rows]
        at = np.flatnonzero((part[1:] > middle) != (part[:-1] > middle))
        if at.size:
            share = (middle - part[at]) / (part[at + 1] - part[at])
            found.append((run.heating, float(np.mean(T[at] + share * (T[at + 1] - T[at])))))
    return found
