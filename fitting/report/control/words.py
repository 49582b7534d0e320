"""Sentences and tables of closed loops."""

import numpy as np

from fitting.control.loop import Run
from fitting.control.sweep import BAND, HOLD, SINCE, STEP, Case, Sweep

from ..table import Table

MEASURES = ("RMSE [1/m]", "settles in [s]", "observer [1/m]")


def verdict(result: Sweep) -> list[str]:
    """Sentences on a step that is out of reach, on the largest degradation of the curvature, and on the
    largest benefit of modelling its cause."""
    known = [case for case in result.cases if case.known is not None]
    told = [case for case in known if np.isfinite([_spoilt(case), _left(case)]).all()]
    if not told:
        names = " and ".join(_named(case) for case in known)
        return [
            *_out_of_reach(result),
            f"With {names} concealed the plant has no equilibrium to be judged by.",
        ]
    if len(known) == 1:
        return [
            *_out_of_reach(result),
            f"With {_named(told[0])} concealed the curvature errs by {_spoilt(told[0]):.2f} 1/m "
            f"(root mean square); with it in the controller, by {_left(told[0]):.2f} 1/m.",
        ]
    worst, gain = max(told, key=_spoilt), max(told, key=lambda case: _spoilt(case) - _left(case))
    return [
        *_out_of_reach(result),
        f"Curvature is spoilt most by {_named(worst)}: {_spoilt(worst):.2f} 1/m root mean square.",
        f"Knowing it gives back most for {_named(gain)}: {_left(gain):.2f} instead of "
        f"{_spoilt(gain):.2f} 1/m.",
    ]


def _spoilt(case: Case) -> float:
    return case.without.rmse(SINCE)


def _left(case: Case) -> float:
    return float("nan") if case.known is None else case.known.rmse(SINCE)


def _out_of_reach(result: Sweep) -> list[str]:
    """Sentence on a step that even the controller's own model does not follow up to the end of its hold."""
    if result.in_reach:
        return []
    wanted, reached = result.step
    came = f"it comes to {reached:.2f} 1/m" if np.isfinite(reached) else "it has no equilibrium"
    return [f"A curvature of {wanted:g} 1/m is out of reach of the controller's own model: {came}."]


def about_the_step(result: Sweep) -> list[str]:
    """Sentences on a curvature that jumps past the wanted one after the step; none where it does not."""
    case, (level, _) = result.cases[0], result.step
    run = case.without
    held = run.good & (run.time >= STEP) & (run.time < HOLD)
    if not held.any() or not level:
        return []
    curvature = run.curvature[held]
    peak = float(curvature[np.argmax(np.sign(level) * curvature)])
    beyond = (peak - level) / level
    if not beyond > BAND:
        return []
    return [
        f"After the step at {STEP:g} s the curvature with {_named(case)} jumps to {peak:.3g} 1/m, "
        f"{100.0 * beyond:.0f} % past the wanted {level:g} 1/m. The controller plans with an integral, which "
        f"does not know the height of the step beforehand. Errors count from {SINCE:g} s on, after this jump."
    ]


def warnings(result: Sweep) -> list[str]:
    """What keeps a loop from being what it looks like: no equilibrium, or a course that heaters cannot do."""
    found = []
    for case in result.cases:
        for run, told in ((case.without, ""), (case.known, ", told")):
            lost = 0 if run is None else int(np.sum(~run.good))
            if lost:
                first, last = run.time[np.flatnonzero(~run.good)[[0, -1]]]
                found.append(
                    f"{_named(case)}{told}: in {lost} of {run.time.size} rows, from {first:g} to {last:g} s, "
                    "the plant has no equilibrium; the curvature there is that of the row before"
                )
    run = result.cases[0].without
    late = run.time >= SINCE
    missed = float(np.max(np.abs(run.wanted - run.planned)[late]))
    limit = float(result.loop.converter.current)
    full = float(np.mean(np.max(run.currents[late], axis=1) >= (1.0 - 1e-9) * limit))
    if full > 0.0 and missed > BAND * abs(run.wanted[run.time < HOLD][-1]):
        found.append(
            f"the controller's own model misses the wanted curvature by up to {missed:.2f} 1/m; "
            f"a heater is at its limit of {limit:g} A for {100.0 * full:.0f} % of the time"
        )
    return found


def _named(case: Case) -> str:
    return case.name.replace("_", " ")


def case_table(result: Sweep) -> Table:
    """Table of every case: errors, settling times, and the observer's errors, without and with the effect in
    the model."""
    rows = [[_named(case), *_measures(case.without), *_measures(case.known)] for case in result.cases]
    header = ["concealed", *MEASURES, *(f"told: {measure}" for measure in MEASURES)]
    note = (
        f"Errors are root mean squares from {SINCE:g} s on. Settled is within 5 % of the step's height. "
        "The observer's error is that of its curvature."
    )
    return Table(header, rows, note)


def _measures(run: Run | None) -> list[str]:
    if run is None:
        return [""] * len(MEASURES)
    settling = run.settling(STEP, HOLD)
    errors = [run.rmse(SINCE), run.rmse(SINCE, observer=True)]
    error, observer = (f"{x:.2f}" if np.isfinite(x) else "no equilibrium" for x in errors)
    return [error, f"{settling:.2f}" if np.isfinite(settling) else "does not", observer]
