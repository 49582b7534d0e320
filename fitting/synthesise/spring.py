"""A simulated campaign on one spring, as in the source: cold, hot, and held at resistances in between."""

import dataclasses
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.specimens.priors import NEW_ALLOY
from pneusma_jax.calibration import load_calibration

from .controller import STEP_S, TRICKLE, build_stand, rest_resistances, run_stand, steps_of, travel_profile
from .instruments import Instruments
from .truth import Truth
from .wishes import Synthetic, Wishes, stream

STRAINS = (1.15, 2.30, 3.45, 4.60, 5.75)  # Spring strains of the loading cycles, Section 2.4.2
HOT_STRAINS = STRAINS[:3]  # Spring strains of hot springs; larger ones would damage them
HOT_SHARE = 0.35  # Maximum share of the held resistance, hot (0) to cold (1), of a spring that counts as hot
RATE = 1.15 / 8.0  # Rate of pulling, spring strain per second
REST_S = 20.0  # Time at zero elongation before a recording, for the heater to reach its set-point
SETPOINTS = 5  # Number of held resistances between cold and hot; with both ends the source's seven
INTERVAL_S = 0.5
NOISE = {"force_N": 0.004, "resistance_ohm": 0.0002}
TOLERANCE = {
    "G_m": 0.05, "G_a": 0.05, "gamma_L": 0.03, "rho_mean": 0.003, "rho_span": 0.003, "alpha_1": 0.003,
    "alpha_2": 0.003, "a": 0.02, "b": 0.02,
}  # fmt: skip
COLD_WIDTHS = 12.0  # Number of widths below the transformation's middle at which no austenite is measurable
FREE_LENGTH_MM = 14.0
CONSTANTS = [field.name for field in dataclasses.fields(pj.Alloy) if field.name != "name"]


@dataclass(frozen=True)
class SpringTest:
    """One test of a spring.

    Attributes:
        name: name of the recording.
        strains: spring strains of the loading cycles [1].
        share: position of the held resistance between the hot (0) and the cold one (1) at rest; None if not
            controlled.
        duty: limits of the heater's duty cycle [1].
        role: `fit` or `validation`.
    """

    name: str
    strains: tuple[float, ...]
    share: float | None
    duty: tuple[float, float]
    role: str = "fit"


def spring_tests(setpoints: int = SETPOINTS) -> list[SpringTest]:
    """Tests: cold, hot, `setpoints` resistances in between, and one more for validation. Hot ones are pulled
    less far."""
    full = (*STRAINS, STRAINS[-1])
    tests = [
        SpringTest("cold", full, None, (TRICKLE, TRICKLE)),
        SpringTest("hot", HOT_STRAINS, None, (1.0, 1.0)),
    ]
    for k in range(1, setpoints + 1):
        share = k / (setpoints + 1)
        strains = HOT_STRAINS if share < HOT_SHARE else full
        tests.append(SpringTest(f"isoresistive_{k}", strains, share, (TRICKLE, 1.0)))
    return [*tests, SpringTest("isoresistive_check", full, 0.58, (TRICKLE, 1.0), "validation")]


def synthesise_spring(wishes: Wishes) -> Synthetic:
    """Simulate the campaign.

    Raises:
        InputError: for an alloy without a spring's constants, or impossible wishes.
    """
    # an unknown alloy is drawn from the wide priors from which a fit with alloy = "fit" starts
    usual = NEW_ALLOY if wishes.spread == "prior" else "krl35"
    table = load_calibration(wishes.alloy or usual, "alloy")
    drawn = Truth(wishes, TOLERANCE)
    constants = drawn.alloy(table, list(table.require(CONSTANTS)), possible_spring)
    given = {"active_coils": nominal_geometry("spring", {})["active_coils"], "free_length_mm": FREE_LENGTH_MM}
    name = "fit" if wishes.spread == "prior" else wishes.alloy or "krl35"
    nominal = nominal_geometry("spring", given) | given | {"alloy": name}
    nominal.pop("cycles_before")
    spring = _spring(drawn.geometry(nominal), pj.Alloy(**constants, name=table.name))
    drawn.finish()
    instruments = Instruments.of("spring", wishes, NOISE)
    ambient = wishes.ambient_degC
    if ambient is None:
        ambient = round(float(constants["T_mid"] - COLD_WIDTHS * constants["T_width"]), 1)
    recordings, fractions = _run_tests(spring, ambient, wishes, drawn, instruments, nominal)
    truth = {**drawn.record, "ambient_degC": ambient}
    title = f"Simulated tests of a spring of alloy {table.name}"
    return Synthetic(title, recordings, truth, fractions)


def possible_spring(values: dict[str, float]) -> bool:
    """True if an alloy with these constants (SI) can exist: stress rises, the cold wire resists more."""
    try:
        alloy = pj.Alloy(**values)
    except ValueError:
        return False
    gamma = np.linspace(0.0, float(alloy.gamma_max), 200)
    return bool(np.all(np.diff(_stresses(alloy, gamma)) > 0.0)) and float(_contrast(alloy)) > 0.0


@eqx.filter_jit
def _stresses(alloy: pj.Alloy, gamma: Array) -> Array:
    """Stress of the hot and of the cold wire at shear strains [Pa], shape (2, strains)."""
    return jnp.stack([alloy.shear_stress(gamma, x, 0.0) for x in (0.0, 1.0)])


@eqx.filter_jit
def _contrast(alloy: pj.Alloy) -> Array:
    """Resistivity of the unstrained wire when cold less that when hot [ohm/m]."""
    return alloy.rho_m(0.0) - alloy.rho_a(0.0)


def _spring(g: dict, alloy: pj.Alloy) -> pj.Spring:
    lengths = (1e-3 * g[key] for key in ("wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm"))
    free = 1e-3 * g["free_length_mm"]
    return pj.Spring(pj.SpringGeometry(*lengths, g["active_coils"], free), alloy, free)


def _run_tests(
    spring: pj.Spring, ambient: float, wishes: Wishes, drawn: Truth, bench: Instruments, nominal: dict
) -> tuple[list[Recording], dict[str, np.ndarray]]:
    """The recordings, and the true martensite fraction in their rows by recording."""
    tests = spring_tests(SETPOINTS if wishes.tests is None else wishes.tests)
    every = max(1, round((wishes.interval_s or INTERVAL_S) / STEP_S))
    travels = _travels(float(spring.geometry.free_length), tests, every * STEP_S)
    longest = max(map(len, travels))
    elongation = np.stack([np.pad(t, (0, longest - len(t))) for t in travels])
    cold, hot = rest_resistances(spring)
    setpoints = np.array([hot + (0.5 if t.share is None else t.share) * (cold - hot) for t in tests])
    readings = [stream(wishes.seed, "controller", t.name).standard_normal(longest) for t in tests]
    stand = build_stand(spring, ambient, bench.noise["resistance_ohm"])
    run = run_stand(stand, elongation, setpoints, np.array([t.duty for t in tests]), np.stack(readings))
    # recorded rows; the model carries the memory along them
    first = steps_of(REST_S)
    run, elongation = jax.tree.map(lambda x: np.asarray(x)[:, first::every], (run, elongation))
    force = _forces(spring, elongation, run.xi0)
    recordings, fractions = [], {}
    for k, test in enumerate(tests):
        rows = slice(0, -(-(len(travels[k]) - first) // every))
        columns = {
            "elongation_mm": 1e3 * elongation[k, rows],
            "force_N": force[k, rows],
            "resistance_ohm": run.resistance[k, rows],
            "current_A": run.current[k, rows],
        }
        if test.share is not None:
            columns["setpoint_ohm"] = np.full(len(columns["force_N"]), setpoints[k])
        time = every * STEP_S * np.arange(len(columns["force_N"]))
        recordings.append(
            bench.recording(test.name, test.role, "S", time, columns, nominal, drawn.tolerance)
        )
        fractions[test.name] = run.xi0[k, rows]
    return recordings, fractions


def _travels(free_length: float, tests: list[SpringTest], interval: float) -> list[np.ndarray]:
    """Travel of each test. Legs last whole intervals, so that every peak is a sample."""
    travels = []
    for test in tests:
        strains = np.asarray(test.strains)
        legs = interval * np.maximum(1.0, np.round(strains / RATE / interval))
        travels.append(travel_profile(free_length * strains, REST_S, legs))
    return travels


def _forces(spring: pj.Spring, elongation: np.ndarray, xi0: np.ndarray) -> np.ndarray:
    """Force of a spring that starts each test fresh [N], shape (tests, rows)."""
    run = lambda x, phase: pj.simulate_spring(spring, x, pj.MartensiteFraction(phase)).rows.force  # noqa: E731
    return np.asarray(jax.vmap(run)(elongation, xi0))
