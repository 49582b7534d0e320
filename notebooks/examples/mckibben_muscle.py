"""A new kind of specimen in one module: a straight McKibben-type muscle.

A rubber bladder in a braided sleeve shortens and pulls when it is inflated. At rest the braid has the angle
alpha_0 to the axis, the muscle the outer radius r_0 and the length l_0. The virtual work of an inextensible
braid gives the pull at gauge pressure P and contraction eps = 1 - l / l_0:

    F = pi r_0^2 P [a (1 - eps)^2 - b],   a = 3 / tan^2 alpha_0,   b = 1 / sin^2 alpha_0

(C.-P. Chou, B. Hannaford, IEEE Trans. Robot. Autom. 12 (1996) 90; B. Tondu, P. Lopez, IEEE Control Syst. Mag.
20 (2000) 15). Effects are what this law leaves out: friction of the braid, a bladder that must be inflated
before it touches the braid, ends that stay conical.

Importing this module registers everything. `docs/new_kind.md` explains it part by part. The command line with
this kind is the module itself:

    python notebooks/examples/mckibben_muscle.py synthesise muscle --out out/muscle --seed 1
    python notebooks/examples/mckibben_muscle.py characterise out/muscle --out out/fit
    python notebooks/examples/mckibben_muscle.py diagnose out/muscle --out out/diagnosis
"""

import sys
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.cli import main
from fitting.data.recordings import Campaign, Recording
from fitting.data.recordings.nominal import nominal_geometry
from fitting.data.recordings.schema import Columns, Kind
from fitting.inference.parameters import Parameters
from fitting.specimens import FITTED, RowOptions, Rows, Specimen, numbers, priors, register
from fitting.specimens.input_noise import have_driver_noise, with_driver_noise, with_effective_variance
from fitting.specimens.row_builders import columns_of, measured_and_weight
from fitting.specimens.saved_models import AugmentedModel, add_effect
from fitting.specimens.simulation import simulated
from fitting.synthesise.instruments import Instruments
from fitting.synthesise.registry import Maker, maker_of
from fitting.synthesise.truth import Truth
from fitting.synthesise.wishes import Synthetic, Wishes
from pneusma_jax.effects import Spec
from pneusma_jax.effects import register as register_effect
from pneusma_jax.numerics.safe import begun_as
from pneusma_jax.pipeline import Effect, Known, Pipeline, as_recorded
from pneusma_jax.units import to_si

# The law ----------------------------------------------------------------------------------------------------


class Muscle(eqx.Module):
    """A muscle at rest: length [m], outer diameter [m], angle of the braid to the axis [rad]."""

    length: Array
    outer_diameter: Array
    braid_angle: Array

    def contraction(self, length: Float[Array, "..."]) -> Float[Array, "..."]:
        """Share of the length at rest by which the muscle is shorter [1]."""
        return 1.0 - length / self.length

    def pull(self, pressure: Float[Array, "..."], contraction: Float[Array, "..."]) -> Float[Array, "..."]:
        """Pull of an inextensible braid [N] at a gauge pressure [Pa]."""
        a, b = 3.0 / jnp.tan(self.braid_angle) ** 2, 1.0 / jnp.sin(self.braid_angle) ** 2
        return self.area * pressure * (a * (1.0 - contraction) ** 2 - b)

    @property
    def area(self) -> Array:
        """Cross-section at rest [m2]."""
        return 0.25 * jnp.pi * self.outer_diameter**2


def simulate_muscle(
    muscle: Muscle,
    pressure: Float[Array, "rows"],
    length: Float[Array, "rows"],
    time: Float[Array, "rows"],
    effects: tuple[Effect, ...] = (),
) -> dict[str, Array]:
    """Pull of a muscle along a history of gauge pressure [Pa] and length [m].

    Args:
        muscle: at rest.
        pressure, length, time: as recorded; SI.
        effects: beyond the law; their memories start at rest.

    Returns:
        `force` [N] as the load cell shows it, shape (rows,), and what a remainder adds.
    """
    contraction = muscle.contraction(length)
    if not effects:  # no row depends on another
        return {"force": muscle.pull(pressure, contraction)}

    def step(memories: tuple, row: tuple) -> tuple[tuple, dict[str, Array]]:
        pressure, contraction, time, interval = row
        known = dict(muscle=muscle, time=time, interval=interval, contraction=contraction)
        known |= dict(recorded_pressure=pressure, recorded_strain=-contraction)
        pipeline = Pipeline(effects, memories, Known(known))
        chamber = pipeline.apply("pressure", pressure)
        pipeline = pipeline.with_known(pressure=chamber)
        true = {"force": pipeline.apply("pull", muscle.pull(chamber, contraction))}
        seen = pipeline.apply("outputs", true, solved=None)
        return pipeline.remembered(solved=None, seen=true), seen

    history = (pressure, contraction, time, jnp.diff(time, prepend=time[:1]))
    first = Pipeline.begin(effects, muscle=muscle, contraction=contraction[0]).memories
    _, seen = jax.lax.scan(step, begun_as(first, (muscle, effects, history)), history)
    return as_recorded(effects, seen, time)


# What the law leaves out ------------------------------------------------------------------------------------


@register_effect
class BraidFriction(Effect):
    """Coulomb friction between the threads, proportional to pressure, that turns over a small contraction.

    It takes `friction` pi r_0^2 P s from the pull. The state s moves from -1 (stretched) to 1 (shortened) in
    proportion to the contraction and stays at its limits, so that the loop has slanted ends.
    """

    friction: Array = eqx.field(converter=jnp.asarray, default=0.0)
    turn: Array = eqx.field(converter=jnp.asarray, default=0.01)

    slug: ClassVar[str] = "braid_friction"
    component: ClassVar[str] = "braid"
    kinds: ClassVar[str] = "M"
    sentence: ClassVar[str] = "Threads of the braid rub on each other: a shortening muscle pulls less."
    literature: ClassVar[str] = "B. Tondu, P. Lopez, IEEE Control Syst. Mag. 20 (2000) 15"
    specs: ClassVar[dict[str, Spec]] = {
        "friction": Spec(0.0, 0.0, 2.0, 0.2, "1", "friction over pressure times cross-section"),
        "turn": Spec(0.01, 0.001, 0.1, 0.01, "1", "contraction over which the friction turns", True),
    }

    def begin(self, at: Known) -> tuple[Array, Array]:
        """The state, and the contraction before the first row."""
        return jnp.zeros(()), at["contraction"]

    def _state(self, at: Known, memory: tuple[Array, Array]) -> Array:
        state, before = memory
        return jnp.clip(state + 2.0 * (at["contraction"] - before) / self.turn, -1.0, 1.0)

    def pull(self, value: Array, at: Known, memory: tuple[Array, Array]) -> Array:
        """See `Effect.pull`."""
        return value - self.friction * at["muscle"].area * at["pressure"] * self._state(at, memory)

    def remember(self, memory: tuple[Array, Array], at: Known) -> tuple[Array, Array]:
        """The state and the contraction of this row."""
        return self._state(at, memory), at["contraction"]


@register_effect
class BladderThreshold(Effect):
    """Pressure [Pa] that only stretches the bladder until it touches the braid."""

    threshold: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "bladder_threshold"
    component: ClassVar[str] = "pressure"
    kinds: ClassVar[str] = "M"
    sentence: ClassVar[str] = "Part of the pressure stretches the bladder and does not reach the braid."
    literature: ClassVar[str] = "C.-P. Chou, B. Hannaford, IEEE Trans. Robot. Autom. 12 (1996) 90"
    specs: ClassVar[dict[str, Spec]] = {
        "threshold": Spec(0.0, 0.0, 100e3, 10e3, "Pa", "pressure at which the bladder touches the braid"),
    }

    def pressure(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pressure`."""
        return jnp.maximum(value - self.threshold, 0.0)


@register_effect
class ConicalEnds(Effect):
    """Ends that stay conical: the middle contracts `factor` [1] times as far as the muscle."""

    factor: Array = eqx.field(converter=jnp.asarray, default=1.0)

    slug: ClassVar[str] = "conical_ends"
    component: ClassVar[str] = "geometry"
    kinds: ClassVar[str] = "M"
    sentence: ClassVar[str] = "The ends stay conical, so that the middle contracts further than the whole."
    literature: ClassVar[str] = "B. Tondu, P. Lopez, IEEE Control Syst. Mag. 20 (2000) 15"
    specs: ClassVar[dict[str, Spec]] = {
        "factor": Spec(1.0, 1.0, 1.6, 1.15, "1", "contraction of the middle over that of the muscle"),
    }

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pull`."""
        muscle, contraction, pressure = at["muscle"], at["contraction"], at["pressure"]
        more = muscle.pull(pressure, self.factor * contraction) - muscle.pull(pressure, contraction)
        return value + more


# The specimen -----------------------------------------------------------------------------------------------

KEYS = {"length": "length_mm", "outer_diameter": "outer_diameter_mm", "braid_angle": "braid_angle_deg"}
"""Key of `[geometry]` of every dimension."""


class McKibbenMuscle(Specimen):
    """A straight muscle between a pressure regulator, a slide and a load cell."""

    recording = Kind(
        "muscle",
        Columns(required=("time_s", "pressure_kPa", "length_mm", "force_N"), outputs=("force_N",)),
        nominal=lambda stated: {"length_mm": 200.0, "outer_diameter_mm": 12.0, "braid_angle_deg": 23.0},
        geometry={"braid_angle_deg": (0.0, False)},
    )
    outputs = ("force",)
    letter = "M"
    noun = "muscle"
    law = "the law of an inextensible braid"
    over = "length"
    loads = "pressure"
    profiled = 1
    element = "muscle"

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Pressure and length."""
        return ("pressure", "length")

    def rows_for(self, campaign: Campaign, options: RowOptions = FITTED, **tables: Any) -> list[Rows]:
        """See `Specimen.rows_for`."""
        number = {name: k for k, name in enumerate(campaign.specimens(), start=1)}
        found = []
        for recording in campaign.recordings:
            columns, block = columns_of(recording, self.drivers(recording), self.outputs, options)
            measured, weight = measured_and_weight(recording, self.outputs, columns, block, options)
            rows = Rows(
                mask=np.ones(len(columns["time"]), bool),
                time=columns["time"],
                inputs={name: columns[name] for name in self.drivers(recording)},
                measured=measured,
                weight=weight,
                base={name: np.asarray(value) for name, value in dimensions(recording).items()},
                extra={},
                specimen=np.asarray(number[recording.specimen]),
            )
            if options.compared:  # the noise of pressure and length adds to that of the force
                rows = with_driver_noise(rows, recording, self.drivers(recording), block)
            found.append(rows)
        return found

    def parameters_for(self, campaign: Campaign, **tables: Any) -> Parameters:
        """Each specimen's dimensions, as far as tolerances leave them open."""
        return priors.geometry_parameters(campaign, dimensions, {"braid_angle": "deg"})

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """Weights change with the parameters: so does what the noise of pressure and length adds."""
        return have_driver_noise(recordings)

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Recordings weighted by that noise, too."""
        return with_effective_variance(self, values, recordings)

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """See `Specimen.answer`."""
        known = numbers(values, rows)
        muscle = Muscle(**{name: known[name] for name in KEYS})
        pressure, length = rows.inputs["pressure"], rows.inputs["length"]
        seen = simulate_muscle(muscle, pressure, length, rows.time, effects)
        strain = -muscle.contraction(length)
        rate = jnp.gradient(strain) / jnp.maximum(jnp.gradient(rows.time), 1e-9)
        return seen, {"pressure": pressure, "strain": strain, "strain_rate": rate}


def dimensions(recording: Recording) -> dict[str, float]:
    """Dimensions of a recording's muscle by name, SI."""
    geometry = recording.full_geometry()
    return {name: float(to_si(geometry[key], key.rpartition("_")[2])) for name, key in KEYS.items()}


MUSCLE = register(McKibbenMuscle())

# Simulated campaigns ----------------------------------------------------------------------------------------

RUNS = (
    ("A", 100.0, "fit"), ("A", 200.0, "fit"), ("B", 150.0, "fit"), ("B", 250.0, "fit"),
    ("A", 300.0, "validation"),
)  # fmt: skip
"""Specimen, pressure [kPa] and role of every run: shortened and stretched twice at one pressure."""
TOLERANCE = {"braid_angle_deg": 0.05, "outer_diameter_mm": 0.03}
NOISE = {"force_N": 0.4, "pressure_kPa": 0.2, "length_mm": 0.02}
INTERVAL_S = 0.5
PERIOD_S = 30.0
STROKE = 0.2
"""Largest contraction [1]."""


def synthesise_muscles(wishes: Wishes, hidden: Sequence[Effect] = ()) -> Synthetic:
    """Simulate a campaign on two muscles.

    Args:
        wishes: of the campaign.
        hidden: effects that act in it and that no file names.
    """
    nominal = nominal_geometry(MUSCLE.kind, {})
    drawn = Truth(wishes, TOLERANCE)
    bench = Instruments.of(MUSCLE.kind, wishes, NOISE)
    truth = {specimen: drawn.geometry(nominal, specimen) for specimen in ("A", "B")}
    drawn.finish()
    time = np.arange(0.0, 2.0 * PERIOD_S, wishes.interval_s or INTERVAL_S)
    shortened = 0.5 * STROKE * (1.0 - np.cos(2.0 * np.pi * time / PERIOD_S))
    model, recordings = AugmentedModel(added=tuple(add_effect(one, "hidden") for one in hidden)), []
    for k, (specimen, pressure, role) in enumerate(RUNS, start=1):
        columns = {
            "pressure_kPa": np.full(len(time), pressure),
            "length_mm": truth[specimen]["length_mm"] * (1.0 - shortened),
        }
        true = Recording(
            "true", None, MUSCLE.kind, geometry=truth[specimen], columns={"time_s": time, **columns}
        )
        columns["force_N"] = simulated(MUSCLE, true, model).outputs["force"]
        recordings.append(
            bench.recording(f"run_{k}", role, specimen, time, columns, nominal, drawn.tolerance)
        )
    return Synthetic("Simulated pulls of McKibben muscles", recordings, dict(drawn.record))


@maker_of.register
def _(specimen: McKibbenMuscle) -> Maker:
    return Maker(synthesise_muscles, ("interval_s",))


if __name__ == "__main__":
    sys.exit(main())
