"""Classification of a spring's tests on a stand: cold, hot or between, largest strain, with unloading or not.

The recordings themselves decide. Resistance tells cold wire apart sharply, but hot wire hardly: the law has
an exponent near eight. Stiffness tells hot wire apart, because austenite is the stiffer phase, unless
somebody says otherwise. So the stiffest test is the hot end. The cold end is the test whose resistance at
rest is farthest from that of the hot one.

Cold nitinol resists more than hot nitinol. Where a classification contradicts this, `contradicts` says so.
Then either phase may be the softer one. All tests may be equally stiff and differ in resistance. Then they
are of one phase, or both phases are equally stiff; `equally_stiff` says so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import equinox as eqx
import numpy as np
from jaxtyping import Array

from fitting.data.recordings import Recording
from fitting.specimens.spring_rows import dimensions, stated_strain_and_stress
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.nitinol import Alloy, Spring

Phase = Literal["cold", "hot", "intermediate"]
PHASES: tuple[Phase, ...] = ("cold", "hot", "intermediate")
Softer = Literal["martensite", "austenite", "neither"]
SOFTER: tuple[Softer, ...] = ("martensite", "austenite", "neither")
SIGN: dict[Softer, float] = {"martensite": 1.0, "austenite": -1.0, "neither": 0.0}
"""Sign of the stiffness of hot wire over that of cold wire; 0 where stiffness does not tell them apart."""
ALIKE = "all tests are alike in stiffness; taken as cold"
"""Reason for a phase that nothing tells apart."""
STATED = "stated"
"""Reason for a phase that somebody knows better."""
BY_FIT = "with the fitted constants a martensite fraction that is free explains no more than noise"
"""Reason for a phase that a fit decided."""
LEVEL: dict[Phase, float | None] = {"cold": 1.0, "hot": 0.0, "intermediate": None}
"""Martensite fraction that a test is held at, where the alloy is to be identified or the phase is stated."""
ELASTIC_STRAIN = 0.02
"""Shear strain up to which the first pull is taken as elastic [1]."""
ELASTIC_SHARE = 0.3
"""Share of a test's largest shear strain up to which a short first pull is taken as elastic [1]."""
LEAST_CONTRAST = 0.001
"""Least relative difference of the resistances at rest that tells phases apart whose stiffness differs."""
LEAST_STIFFNESS_RATIO = 1.2
"""Least ratio of the stiffest test's slope to the softest's for one of them to be hot and the other cold."""
SAME_RESISTANCE = 0.02
"""Share of the phases' contrast within which a test is as cold as the coldest, as hot as the hottest."""
ROUNDING = 1e-9
"""Share of the phases' contrast that may be a rounding error."""
SAME_STIFFNESS = 0.03
"""Relative difference of slopes within which a test is as hot as the stiffest one."""
COMES_BACK = 0.1
"""Share of the largest elongation by which a test must come down to count as unloading."""
HELD_RESISTANCE = 0.002
"""Relative interquartile range of the resistance below which it was held: an isoresistive test."""
COLD, HOT = 0.98, 0.4
"""Martensite fractions at rest from which, and to which, a test of a known alloy is called cold and hot."""
MAYBE_HOT = 0.5
"""Martensite fraction at rest below which a test may be fully hot, since its resistance hardly tells."""


@dataclass(frozen=True)
class StandTest:
    """One recording of a spring on a stand.

    Attributes:
        recording: the data.
        phase: phase of its wire at rest.
        reason: why, in words.
        strain: largest spring strain [1].
        gamma: largest shear strain [1].
        slope: slope of shear stress over shear strain at the beginning [Pa]; NaN where it cannot be told.
        resistivity: resistance per length of wire at rest [ohm/m]; NaN where it was not measured.
        unloads: the spring comes back.
        isoresistive: the resistance was held, as far as it could be.
    """

    recording: Recording
    phase: Phase
    reason: str
    strain: float
    gamma: float
    slope: float
    resistivity: float
    unloads: bool
    isoresistive: bool

    @property
    def name(self) -> str:
        """Name of the recording."""
        return self.recording.name

    @property
    def fitted(self) -> bool:
        """True if it may be fitted."""
        return self.recording.role == "fit"

    def held(self, level: float) -> "StandTest":
        """The same test, known to be at full cold (1) or full heat (0) from a fit of all constants."""
        phase = next((phase for phase, of in LEVEL.items() if of == level), self.phase)
        if phase == self.phase:
            return self
        return replace(self, phase=phase, reason=f"{BY_FIT} (before the fit {self.reason})")

    @property
    def words(self) -> str:
        """Phase and kind of test: `cold, unloading, to 575 % spring strain`."""
        kinds = [self.phase]
        kinds += ["isoresistive"] if self.isoresistive and self.phase == "intermediate" else []
        kinds += ["with unloading"] if self.unloads else ["loading only"]
        return f"{', '.join(kinds)}, to {100.0 * self.strain:.0f} % spring strain"


@dataclass(frozen=True)
class _Reading:
    """What a recording is classified by; see `StandTest` for the attributes."""

    strain: float
    gamma: float
    slope: float
    resistivity: float
    unloads: bool
    isoresistive: bool


def classify(
    recordings: Sequence[Recording],
    stated: Mapping[str, Phase] | None = None,
    alloy: Alloy | None = None,
    softer: Softer = "martensite",
) -> list[StandTest]:
    """Class of each recording of a spring.

    Args:
        recordings: recordings of kind spring, of one alloy.
        stated: phase of recordings, by name, that somebody knows better.
        alloy: the alloy if it is known, whose reading of the resistance at rest then decides; otherwise the
            tests are compared with each other.
        softer: the phase whose wire is the softer one at the beginning of a pull. If neither is, the test
            that resists most at rest is cold, and the one that resists least is hot.

    Raises:
        InputError: if a stated name or phase is unknown.
    """
    stated = dict(stated or {})
    if softer not in SOFTER:
        raise InputError(f"no phase {softer!r} can be the softer one, {nearest(softer, SOFTER)}")
    names = [recording.name for recording in recordings]
    for name, phase in stated.items():
        if name not in names:
            raise InputError(f"no recording is called {name!r}, {nearest(name, names)}")
        if phase not in PHASES:
            raise InputError(f"{name}: there is no phase {phase!r}, {nearest(phase, PHASES)}")
    readings = [_read(recording) for recording in recordings]
    phases = _phases(readings, softer) if alloy is None else [_by_alloy(alloy, r) for r in readings]
    tests = []
    for recording, reading, (phase, reason) in zip(recordings, readings, phases, strict=True):
        if recording.name in stated:
            phase, reason = stated[recording.name], STATED
        tests.append(StandTest(recording, phase, reason, **vars(reading)))
    return tests


def _read(recording: Recording) -> _Reading:
    """What a recording is classified by. Its beginning are the first rows of loading."""
    elongation = recording.si("elongation")
    known, geometry = np.isfinite(elongation), dimensions(recording)
    gamma, stress = stated_strain_and_stress(recording)
    reached = np.fmax.accumulate(np.where(known, elongation, -np.inf))
    before = np.concatenate([[-np.inf], reached[:-1]])
    loading = known & (elongation > before)
    most = float(np.nanmax(elongation))
    peak = int(np.nanargmax(elongation))
    resistance = recording.si("resistance")
    start = loading & (gamma <= min(ELASTIC_STRAIN, ELASTIC_SHARE * np.nanmax(gamma)))
    held = resistance[np.isfinite(resistance)]
    return _Reading(
        strain=most / float(geometry.free_length),
        gamma=float(np.nanmax(gamma)),
        slope=_slope(gamma[start], stress[start]),
        resistivity=_median(resistance[start]) / float(geometry.wire_length),
        unloads=bool(np.nanmin(elongation[peak:]) < (1.0 - COMES_BACK) * most),
        isoresistive=recording.has("setpoint") or _relative_range(held) < HELD_RESISTANCE,
    )


def _relative_range(values: np.ndarray) -> float:
    """Interquartile range over the median; infinite where nothing was measured."""
    if values.size == 0:
        return float("inf")
    low, middle, high = np.percentile(values, [25.0, 50.0, 75.0])
    return float((high - low) / middle)


def _slope(gamma: np.ndarray, stress: np.ndarray) -> float:
    """Slope of shear stress over shear strain [Pa], by a line; NaN of fewer than three rows."""
    known = np.isfinite(gamma) & np.isfinite(stress)
    if known.sum() < 3 or np.ptp(gamma[known]) == 0.0:
        return float("nan")
    return float(np.polyfit(gamma[known], stress[known], 1)[0])


def _median(values: np.ndarray) -> float:
    """Median of what was measured; NaN where nothing was."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if known.size else float("nan")


def contradicts(tests: Sequence[StandTest]) -> bool:
    """True if tests that were taken as hot resist more at rest than the cold ones, which no nitinol does.

    Args:
        tests: classified by comparison with each other.
    """
    rest = {p: [t.resistivity for t in tests if t.phase == p and t.reason != STATED] for p in ("cold", "hot")}
    known = {phase: np.array(values)[np.isfinite(values)] for phase, values in rest.items()}
    if not (known["cold"].size and known["hot"].size):
        return False
    return bool(np.median(known["hot"]) > (1.0 + LEAST_CONTRAST) * np.median(known["cold"]))


def equally_stiff(tests: Sequence[StandTest]) -> bool:
    """True if all tests were taken as cold for their stiffness, although they resist differently at rest.

    Args:
        tests: classified by comparison with each other.
    """
    rho = np.array([test.resistivity for test in tests if test.reason == ALIKE])
    rho = rho[np.isfinite(rho)]
    return bool(rho.size and np.ptp(rho) > LEAST_CONTRAST * rho.max())


@dataclass(frozen=True)
class _HotAndCold:
    """What tests of one alloy are compared with.

    Attributes:
        slope: slope at the beginning of the hottest test [Pa].
        cold: resistance per length of wire at rest of the coldest test [ohm/m].
        contrast: this resistance less that of the hottest test [ohm/m].
        sign: see `SIGN`.
    """

    slope: float
    cold: float
    contrast: float
    sign: float


def _phases(readings: Sequence[_Reading], softer: Softer) -> list[tuple[Phase, str]]:
    """Phase of every test with its reason, from a comparison of the tests with each other."""
    sign = SIGN[softer]
    slopes = np.array([r.slope for r in readings])
    rho = np.array([r.resistivity for r in readings])
    if not (np.isfinite(slopes).any() and np.isfinite(rho).any()):
        return [
            ("cold", "nothing tells its phase; taken as cold, as the source takes what was not measured")
        ] * len(readings)
    if sign == 0.0:
        coldest, hottest = int(np.nanargmax(rho)), int(np.nanargmin(rho))
    else:
        coldest, hottest = int(np.nanargmin(sign * slopes)), int(np.nanargmax(sign * slopes))
        away = np.abs(rho - rho[hottest])
        if np.isfinite(away).any():  # resistance goes one way from hot to cold; stiffness has its noise
            coldest = int(np.nanargmax(away))
    contrast = rho[coldest] - rho[hottest]
    apart = sign == 0.0 or (slopes[hottest] / slopes[coldest]) ** sign > LEAST_STIFFNESS_RATIO
    if not apart or not abs(contrast) > LEAST_CONTRAST * abs(rho[coldest]):
        return [("cold", ALIKE)] * len(readings)
    ends = _HotAndCold(slopes[hottest], rho[coldest], contrast, sign)
    return [_phase(reading, ends) for reading in readings]


def level_at_rest(spring: Spring, test: StandTest) -> float | None:
    """Full cold (1) or full heat (0) that a test may have by its resistance at rest; None if neither.

    Args:
        spring: the spring with fitted constants and dimensions. Its wire may be longer than is stated.
        test: the test.
    """
    if not np.isfinite(test.resistivity):
        return None
    longer = float(spring.geometry.wire_length) / float(dimensions(test.recording).wire_length)
    xi0 = float(_fraction_at_rest(spring.alloy, np.asarray(test.resistivity / longer)))
    return 1.0 if xi0 > COLD else 0.0 if xi0 < MAYBE_HOT else None


@eqx.filter_jit
def _fraction_at_rest(alloy: Alloy, resistivity: Array) -> Array:
    """Martensite fraction that the law reads from the resistivity of the unstrained wire [ohm/m]."""
    return alloy.martensite_fraction(resistivity, 0.0).xi0


def _by_alloy(alloy: Alloy, reading: _Reading) -> tuple[Phase, str]:
    """Phase of a test and its reason, from its resistance by the law of a known alloy."""
    if not np.isfinite(reading.resistivity):
        return "cold", "its resistance was not measured; taken as cold, as the source does"
    xi0 = float(_fraction_at_rest(alloy, np.asarray(reading.resistivity)))
    phase: Phase = "cold" if xi0 > COLD else "hot" if xi0 < HOT else "intermediate"
    blind = "; the resistance of hot wire hardly tells" if phase == "hot" else ""
    return (
        phase,
        f"the alloy's law reads a martensite fraction of {xi0:.2f} from its resistance at rest{blind}",
    )


def _phase(reading: _Reading, ends: _HotAndCold) -> tuple[Phase, str]:
    """Phase of a test and its reason, from a comparison with the hottest and the coldest one."""
    share = (reading.resistivity - (ends.cold - ends.contrast)) / ends.contrast
    word = "stiffer" if ends.sign > 0.0 else "softer"
    beyond = ends.sign * (reading.slope - ends.slope)  # [Pa]
    if share > 1.0 - SAME_RESISTANCE:
        return (
            "cold",
            f"its resistance at rest is that of the coldest test (to {100.0 * abs(1.0 - share):.1f} %)",
        )
    if ends.sign == 0.0 and share < ROUNDING:  # a small share is no proof: hot wire's resistance hardly tells
        return "hot", "it resists least at rest, and no stiffness tells the phases apart"
    if ends.sign != 0.0 and beyond > -SAME_STIFFNESS * ends.slope and share < SAME_RESISTANCE:
        return (
            "hot",
            f"no test is {word} at the beginning, and its resistance at rest is that of the hottest",
        )
    return (
        "intermediate",
        f"its resistance at rest is {100.0 * share:.0f} % of the way from the hot to the cold tests'",
    )
