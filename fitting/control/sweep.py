"""Effects of missing physics on control: the loss by each, and the gain from knowing it."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np

import pneusma_jax as pj
from fitting.inference.results import Result
from fitting.simulate.workspace.grid import modelled_actuator
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.actuator.designs import design_gravity
from pneusma_jax.actuator.result import Status, solved
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.pipeline import Effect

from .loop import Loop, Run
from .plant import Plant

CONCEALED: Mapping[str, Mapping[str, float]] = {
    "resistance_temperature_coefficient": {"alpha_m": 8e-4, "alpha_a": 8e-4},
    "series_resistance": {"ohms": 0.15},
    "radial_expansion": {"per_pressure": 4e-6},
    "viscoelastic_relaxation": {"g_1": 0.3},
    "wrap_friction": {"constant": 4e-4},
}
"""Concealed effects and their strengths, two to four times what the catalogue calls usual [SI].

Heat that reaches the opposing spring is not among them: that effect acts on a spring that is never driven,
and here both are."""
LOAD = 3e-3
"""Force on the tip that the controller does not know [N]: 0.3 g, a fifth of the actuator's own weight."""
STEP, HOLD, PERIOD = 5.0, 60.0, 45.0
"""Times of the step and of the end of its hold, and the period of the sine after it [s]."""
LEVEL, SWING = 20.0, 8.0
"""Curvature after the step, and the swing of the sine about it [1/m]."""
PRESSURE = 20e3
"""Gauge pressure, constant [Pa]."""
USUAL_DESIGN = "pneusma2"
"""Design that is driven where nothing names one."""
INTERVAL, UNTIL = 0.25, 150.0
"""Time between rows, and the end of a run [s]."""
SINCE = 10.0
"""Time from which errors count [s]: five seconds after the step."""
HALVINGS = 12
"""Number of halvings in the search for the pressure up to which a loop balances."""
BAND = 0.05
"""Share of the step's height within which a curvature counts as reached [1], as in `Run.settling`."""


@dataclass(frozen=True)
class Case:
    """One plant, driven without and with what is known of it.

    Attributes:
        name: name of the concealed effect.
        without, known: runs with the base model in the controller, and with the effect in it; None where
            nothing can be known.
    """

    name: str
    without: Run
    known: Run | None


@dataclass(frozen=True)
class Sweep(Result):
    """All cases.

    Attributes:
        design: name of the actuator.
        loop: task and settings of the controller.
        cases: the plant that is the model itself comes first.
    """

    design: str
    loop: Loop
    cases: tuple[Case, ...]

    @property
    def step(self) -> tuple[float, float]:
        """Wanted curvature at the end of the step's hold, and that of the controller's own model [1/m]; NaN
        where it has no equilibrium."""
        run = self.cases[0].without
        last = np.flatnonzero(run.time < HOLD)[-1]
        return float(run.wanted[last]), float(run.planned[last])

    @property
    def balanced(self) -> bool:
        """True if every run has an equilibrium in every row."""
        runs = [run for case in self.cases for run in (case.without, case.known) if run is not None]
        return all(bool(run.good.all()) for run in runs)

    @property
    def in_reach(self) -> bool:
        """True if the controller's own model follows the step up to the end of its hold."""
        wanted, reached = self.step
        return abs(wanted - reached) <= BAND * abs(wanted)


def usual_loop(seed: int = 0, level: float = LEVEL, swing: float = SWING, pressure: float = PRESSURE) -> Loop:
    """A step to a curvature, held, then a sine about it.

    Args:
        seed: seed of the noise.
        level: after the step [1/m]; swing: of the sine [1/m].
        pressure: gauge, constant [Pa].

    Raises:
        InputError: for a step without height.
    """
    if level == 0.0:
        raise InputError("a step needs a height, but the curvature after it is 0 1/m")
    time = np.arange(0.0, UNTIL, INTERVAL)
    sine = swing * np.sin(2.0 * np.pi * (time - HOLD) / PERIOD)
    wanted = np.where(time < STEP, 0.0, level) + np.where(time < HOLD, 0.0, sine)
    return Loop(time, wanted, pressure, seed=seed)


def all_effects(chosen: Mapping[str, Mapping[str, float]]) -> tuple[Effect, ...]:
    """The five effects with some of their numbers given, all others off: one program serves all of them."""
    return tuple(
        find_effect(slug)(**{key: as_array(float(x)) for key, x in chosen.get(slug, {}).items()})
        for slug in CONCEALED
    )


def _balanced(design: str, plant: Plant, model: Plant, run: Run, loop: Loop) -> Run:
    """A run that has an equilibrium in some row whose error counts, as the controller's own model does.

    Raises:
        InputError: where there is no such row; says up to which pressure the loop has an equilibrium, and why
            not beyond, of the plant that is cold.
    """
    good = run.good & np.isfinite(run.planned)
    if good[run.time >= SINCE].any():
        return run
    when = f" from {run.time[np.flatnonzero(good)[-1] + 1]:g} s on" if good.any() else ""
    kPa, ends = 1e-3 * loop.pressure, _pressure_that_balances(plant, model, loop)
    end = "none at 0 kPa either" if ends is None else (
        f"all rows have one {'down' if kPa < 0.0 else 'up'} to {1e-3 * ends:.3g} kPa"
    )  # fmt: skip
    cold = tuple(pj.MartensiteFraction(1.0) for _ in plant.body.springs)
    status = Status(int(pj.solve(plant.body, loop.pressure, cold, throw=False).status))
    why = f". {status.sentence}" if not solved(status) else ""
    raise InputError(f"{design}: under {kPa:g} kPa no row of the loop has an equilibrium{when}; {end}{why}")


def _pressure_that_balances(plant: Plant, model: Plant, loop: Loop) -> float | None:
    """The pressure nearest to the loop's at which plant and controller's own model balance in all rows [Pa].

    It is found by halving from no pressure on; None where one of them does not balance without pressure.
    """

    def balances(pressure: float) -> bool:
        one = dataclasses.replace(loop, pressure=pressure)
        seen = one.planned(model)[1]
        own = np.all(np.asarray(seen.good) & np.isfinite(np.asarray(seen.curvature)))
        return bool(own and (plant is model or one.run(plant, model).good.all()))

    low, high = 0.0, loop.pressure
    if not balances(low):
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if balances(middle) else (low, middle)
    return low


def run_sweep(
    design: str = USUAL_DESIGN,
    error: float = 0.1,
    loop: Loop | None = None,
    progress: Callable[[str], object] = lambda text: None,
) -> Sweep:
    """Five concealed effects and an unknown load, each with a controller that knows nothing and one that was
    told.

    Args:
        design: name or path of a table.
        error: relative error of the numbers that the controller was told [1], as of a diagnosis.
        loop: task and settings; the usual ones if None.
        progress: called with the name of each case.

    Raises:
        InputError: where the plain plant has no equilibrium in any row whose error counts.
    """
    loop, body = loop or usual_loop(), pj.make_actuator(design)
    place = body.section.enclosed_centroid
    under = lambda force: body.with_loads(pj.TipForce(as_array(np.array([0.0, -force, 0.0])), place))  # noqa: E731
    nothing = Plant(under(0.0), all_effects({}))
    cases = []
    progress("no mismatch")
    plain = _balanced(design, nothing, nothing, loop.run(nothing, nothing), loop)
    cases.append(Case("no mismatch", plain, None))
    for slug, numbers in CONCEALED.items():
        progress(slug)
        plant = Plant(under(0.0), all_effects({slug: numbers}))
        found = Plant(under(0.0), all_effects({slug: _told(slug, numbers, error)}))
        cases.append(Case(slug, loop.run(plant, nothing), loop.run(plant, found)))
    progress("unknown load")
    cases.append(Case("unknown load", loop.run(Plant(under(LOAD), all_effects({})), nothing), None))
    return Sweep(Path(design).stem, loop, tuple(cases))


def _told(slug: str, numbers: Mapping[str, float], error: float) -> dict[str, float]:
    """Numbers of an effect that a controller was told: nearer to no effect by a relative error."""
    absent = find_effect(slug)()
    neutral = {name: float(getattr(absent, name)) for name in numbers}
    return {name: neutral[name] + (1.0 - error) * (x - neutral[name]) for name, x in numbers.items()}


def run_model(
    design: str | None,
    model: AugmentedModel,
    loop: Loop | None = None,
    progress: Callable[[str], object] = lambda text: None,
) -> Sweep:
    """A model on disk as the plant: a controller without its effects, and one with that model.

    The constants of the model are those of the plant and of both controllers.

    Args:
        design: name or path of a table; that of the model, or PneuSMA2, if None.
        model: model on disk.
        loop: task and settings; the usual ones if None.
        progress: called with the name of each controller.

    Raises:
        InputError: if the model adds nothing, or the plant has no equilibrium in any row whose error
            counts.
    """
    if not model.effects:
        raise InputError(f"{model.path}: this model has no effect, so the base model is all there is to know")
    design = design or model.tables.get("design", USUAL_DESIGN)
    body = modelled_actuator(design, model.tables.get("alloy"), model.tables.get("material"), model)
    loop = loop or usual_loop()
    gravity = jnp.asarray(design_gravity(model.table("actuator", design)))
    plant, base = Plant(body, model.effects, gravity), Plant(body)
    progress("without")
    without = _balanced(design, plant, base, loop.run(plant, base), loop)
    progress("known")
    name = ", ".join(e.slug for e in model.effects)
    return Sweep(Path(design).stem, loop, (Case(name, without, loop.run(plant, plant)),))
