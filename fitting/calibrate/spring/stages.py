"""The source's stages (Section 2.4): each looks at the tests and branches that its constants show up in.

1. Cold and hot tests, loading: moduli, gamma_L, both detwinning curves, both resistivities.
2. Tests at intermediate fractions, loading: the interpolation of the resistivity, a, b and c.
3. Unloading: residual strain.

The loading stages give starts for the joint fit, which fits everything to everything. The unloading stage is
only reported: its numbers mislead while a and b are rough.
"""

from dataclasses import dataclass

import numpy as np

from fitting.inference.least_squares import FitResult
from fitting.specimens.spring_rows import dimensions, stated_strain_and_stress
from pneusma_jax.calibration import available, load_calibration

from .problem import Problem
from .stand_tests import StandTest

COLD = ("G_m", "gamma_L", "beta_1", "beta_2", "beta_3", "rho_mean", "rho_span", "km_1", "km_2", "km_3")
HOT = ("G_a", "ka_1", "ka_2", "ka_3", "alpha_1", "alpha_2")
BETWEEN = ("a", "b", "c")
SHAPES = ("ka_1", "ka_2", "ka_3", "alpha_2")
"""Shape of the hot curve, which a fit does not always find from one start."""
UNLOADING = ("gR_amplitude", "gR_slope", "gR_shift", "gR_decay")


@dataclass(frozen=True)
class Stage:
    """One stage and what it found.

    Attributes:
        name: name in words.
        tests: names of the recordings it looked at.
        parameters: names of what it found.
        result: result of its fit; None if there was nothing to fit.
        skipped: why there was nothing to look at; empty otherwise.
    """

    name: str
    tests: tuple[str, ...]
    parameters: tuple[str, ...]
    result: FitResult | None
    skipped: str = ""


def run_stages(problem: Problem, progress=lambda _: None) -> tuple[dict[str, float], list[Stage]]:
    """Values to start the joint fit from, and what each stage found.

    Args:
        problem: problem of an alloy that is to be identified.
        progress: called with the name of each stage that begins.
    """
    values = {name: p.value for name, p in problem.parameters.items()} | rough_values(problem)
    stages = []
    plan = [
        ("cold and hot tests, loading", ("cold", "hot"), True, (*COLD, *HOT)),
        ("tests at intermediate fractions, loading", ("intermediate",), True, BETWEEN),
        ("unloading", ("cold", "hot", "intermediate"), False, UNLOADING),
    ]
    for name, phases, loading, wanted in plan:
        progress(name)
        stage = _run(problem.at(values), name, phases, loading, wanted)
        if stage.result is not None and loading:
            values |= {k: stage.result.values[k] for k in stage.parameters}
        stages.append(stage)
    return values, stages


def _run(
    problem: Problem, name: str, phases: tuple[str, ...], loading: bool, wanted: tuple[str, ...]
) -> Stage:
    tests = [k for k in problem.fitted if problem.tests[k].phase in phases]
    if not loading:
        tests = [k for k in tests if problem.tests[k].unloads]
    there = {problem.tests[k].phase for k in tests}
    if not tests:
        what = "unloads" if not loading else "is " + " or ".join(phases)
        return Stage(name, (), (), None, f"no test {what}")
    if loading and "cold" in phases:
        wanted = (*(COLD if "cold" in there else ()), *(HOT if "hot" in there else ()))
    free = problem.parameters.layout().free
    found = tuple(n for n in wanted if n in free)
    names = tuple(problem.tests[k].name for k in tests)
    if not found:
        return Stage(name, names, (), None, "its constants are not free")
    constraints = problem.held([n for n in free if n not in found])
    result = problem.fit(tests=tests, loading=loading, constraints=constraints)
    for other in _other_shapes(found):
        again = problem.at(other).fit(tests=tests, loading=loading, constraints=constraints)
        if _better(again, result):
            result = again
    return Stage(name, names, found, result)


def _better(one: FitResult, other: FitResult) -> bool:
    return one.chi_square is not None and (other.chi_square is None or one.chi_square < other.chi_square)


def _other_shapes(found: tuple[str, ...]) -> list[dict[str, float]]:
    """Curves of the published alloys to start from too: no fit recovers from a curve far from the data."""
    wanted = [name for name in SHAPES if name in found]
    tables = [load_calibration(name, "alloy").values() for name in available("alloy")] if wanted else []
    return [{n: table[n] for n in wanted} for table in tables if set(found) <= set(table)]


def rough_values(problem: Problem) -> dict[str, float]:
    """Moduli and resistivities read off the recordings, to start the first stage from.

    Austenite's modulus is the slope of the hot test at its beginning. Martensite's is the slope of a cold
    unloading, which is elastic; without one it is the slope at the beginning. Resistivities are those at rest
    and at the largest strain.
    """
    fitted = [problem.tests[k] for k in problem.fitted]
    found: dict[str, float] = {}
    cold = [test for test in fitted if test.phase == "cold"]
    hot = [test for test in fitted if test.phase == "hot"]
    slopes = [s for s in (_unloading_slope(test) for test in cold) if np.isfinite(s)]
    slopes = slopes or [test.slope for test in cold if np.isfinite(test.slope)]
    if slopes:
        found["G_m"] = float(np.median(slopes))
    hot_slopes = [test.slope for test in hot if np.isfinite(test.slope)]
    hot_resistivities = [test.resistivity for test in hot if np.isfinite(test.resistivity)]
    if hot_slopes:
        found["G_a"] = float(np.median(hot_slopes))
    if hot_resistivities:
        found["alpha_1"] = float(np.median(hot_resistivities))
    furthest = max(cold, key=lambda test: test.gamma, default=None)
    if furthest is not None and np.isfinite(furthest.resistivity):
        rest, stretched = furthest.resistivity, _stretched_resistivity(furthest)
        found["rho_span"] = abs(rest - stretched) or problem.parameters["rho_span"].value
        found["rho_mean"] = rest - 0.5 * found["rho_span"] * np.sign(rest - stretched or 1.0)
    return {name: value for name, value in found.items() if name in problem.parameters}


def _unloading_slope(test: StandTest) -> float:
    """Median slope of stress over strain on the way back [Pa], one slope for each way."""
    gamma, stress = stated_strain_and_stress(test.recording)
    down = np.flatnonzero((np.diff(gamma) < 0.0) & np.isfinite(np.diff(stress)))
    if len(down) < 10:
        return float("nan")
    ways = np.split(down, np.flatnonzero(np.diff(down) > 1) + 1)
    slopes = [np.polyfit(gamma[way], stress[way], 1)[0] for way in ways if len(way) >= 8]
    return float(np.median(slopes)) if slopes else float("nan")


def _stretched_resistivity(test: StandTest) -> float:
    """Resistance per length of wire at the largest strain [ohm/m], which the source calls resistivity."""
    gamma, _ = stated_strain_and_stress(test.recording)
    resistance = test.recording.si("resistance")
    known = np.isfinite(gamma) & np.isfinite(resistance)
    far = known & (gamma >= 0.97 * gamma[known].max())
    return float(np.median(resistance[far]) / float(dimensions(test.recording).wire_length))
