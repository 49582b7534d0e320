"""The loop: a wanted curvature over time, a controller that sees resistances, a plant that it does not know
quite.

The feed-forward is the inverse of the controller's own model over time: the model is simulated under
feedback of its own curvature, which it knows. That gives currents and resistances of every moment. On the
plant, a PI controller keeps each resistance at that of the model, on top of the model's current. Beside it
an observer runs the model with the real currents and corrects its temperatures by the measured resistances;
it tells phase and shape.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from pneusma_jax.errors import InputError
from pneusma_jax.implausible import warn_of_pressure
from pneusma_jax.numerics.safe import as_array
from pneusma_jax.program_cache import stored_jit

from .plant import Memory, Plant, Seen


class Gains(eqx.Module):
    """Gains of both loops.

    Attributes:
        model: square of a current over curvature [A2 m]; model_time: integral time of the feedback inside the
            model [s].
        resistance: square of a current over a resistance [A2/ohm]; resistance_time: its integral time [s].
        temperature_sd: 1-sigma of the observer's temperatures before a reading [K].
    """

    model: Array = eqx.field(converter=as_array, default=4e-3)
    model_time: Array = eqx.field(converter=as_array, default=1.0)
    resistance: Array = eqx.field(converter=as_array, default=0.15)
    resistance_time: Array = eqx.field(converter=as_array, default=4.0)
    temperature_sd: Array = eqx.field(converter=as_array, default=0.3)


class Converter(eqx.Module):
    """Instruments and supply.

    Attributes:
        noise: 1-sigma of a resistance [ohm]; resolution: its step [ohm].
        current: largest of a heater [A]; steps: into which its range is divided.
        blind: slope of resistance over temperature below which a reading says nothing [ohm/K].
    """

    noise: Array = eqx.field(converter=as_array, default=1e-3)
    resolution: Array = eqx.field(converter=as_array, default=5e-4)
    current: Array = eqx.field(converter=as_array, default=0.4)
    steps: Array = eqx.field(converter=as_array, default=255.0)
    blind: Array = eqx.field(converter=as_array, default=2e-3)


@dataclass(frozen=True)
class Run:
    """One run; arrays have a leading axis of rows.

    Attributes:
        time: [s]; wanted, curvature, planned, observed: [1/m], of the target, the plant, the controller's
            own model in its plan, and the observer.
        currents: [A]; resistances: measured [ohm]; fractions: of the plant [1]; shapes (rows, springs).
        good: rows in which the plant balances.
    """

    time: np.ndarray
    wanted: np.ndarray
    curvature: np.ndarray
    planned: np.ndarray
    observed: np.ndarray
    currents: np.ndarray
    resistances: np.ndarray
    fractions: np.ndarray
    good: np.ndarray

    def rmse(self, since: float = 0.0, observer: bool = False) -> float:
        """Root mean square of wanted less real curvature from a time on, or of the observer's error [1/m]."""
        rows = self.time >= since
        other = self.observed if observer else self.wanted
        return float(np.sqrt(np.mean((self.curvature[rows] - other[rows]) ** 2)))

    def settling(self, begin: float, end: float, share: float = 0.05) -> float:
        """Time after which the curvature stays within a share of a step's height [s]; infinite if it does
        not.

        Args:
            begin, end: begin and end of the step's hold [s].
            share: share of the step's height [1].
        """
        rows = np.flatnonzero((self.time >= begin) & (self.time < end))
        height = abs(self.wanted[rows[-1]] - self.wanted[max(rows[0] - 1, 0)])
        off = ~(np.abs(self.curvature[rows] - self.wanted[rows]) <= share * height)  # NaN never settles
        if off[-1]:
            return float("inf")
        last = np.flatnonzero(off)
        return float(self.time[rows[last[-1] + 1]] - begin) if last.size else 0.0


@dataclass(frozen=True)
class Loop:
    """Task and settings of a controller.

    Attributes:
        time: [s], evenly spaced, shape (rows,).
        wanted: curvature [1/m], shape (rows,).
        pressure: gauge, constant [Pa].
        gains, converter: settings of the loop; seed: seed of the noise.
    """

    time: np.ndarray
    wanted: np.ndarray
    pressure: float = 20e3
    gains: Gains = Gains()
    converter: Converter = Converter()
    seed: int = 0

    def __post_init__(self) -> None:
        """Warn of a pressure that is rather in kPa."""
        warn_of_pressure(self.pressure)

    def run(self, plant: Plant, model: Plant) -> Run:
        """Drive a plant with a controller that takes it for a model.

        Args:
            plant: the plant that is driven; model: the controller's model of it, of the same structure or
                another.

        Raises:
            InputError: for an actuator that is not bent in a plane by two springs.
        """
        check_plane(plant.body)
        check_plane(model.body)
        plan = self.planned(model)
        shape = plan[1].resistances.shape
        noise = jax.random.normal(jax.random.key(self.seed), shape) * self.converter.noise
        seen, observed, used, read = self.driven(plant, model, plan, noise)
        arrays = (self.time, self.wanted, seen.curvature, plan[1].curvature, observed.curvature, used, read)
        return Run(*(np.asarray(x) for x in (*arrays, seen.fractions, seen.good)))

    def planned(self, model: Plant) -> tuple[Array, Seen]:
        """Squares of the currents with which the model follows [A2], and what it shows then."""
        return _plan(
            model, as_array(self.time), as_array(self.wanted), as_array(self.pressure), self.gains,
            self.converter,
        )  # fmt: skip

    def driven(
        self,
        plant: Plant,
        model: Plant,
        plan: tuple[Array, Seen],
        noise: Array,
        pressure: Array | None = None,
    ) -> tuple[Seen, Seen, Array, Array]:
        """Outputs of the plant, states of the observer, currents [A] and readings [ohm]; may be traced.

        Args:
            plant: the plant that is driven; model: the controller's model of it.
            plan: plan from `planned`.
            noise: noise of the readings [ohm], shape (rows, springs).
            pressure: gauge, in the plant [Pa]; that of the plan if None. The controller is not told.
        """
        inside = self.pressure if pressure is None else pressure
        squares, shown = plan
        rows = as_array(self.time), squares, shown.resistances, noise
        pressures = as_array(inside), as_array(self.pressure)
        return _drive(plant, model, pressures, rows, self.gains, self.converter)


def check_plane(body: pj.Actuator) -> None:
    """Refuse what a loop cannot drive.

    Raises:
        InputError: for an actuator that is not bent in a plane by two springs.
    """
    if not body.planar or len(body.springs) != 2:
        raise InputError("a closed loop needs an actuator that is bent in a plane by two springs")


def _limited(square: Array, converter: Converter) -> Array:
    """Current [A] of a wanted square [A2], within the heater's range and steps."""
    current = jnp.sqrt(jnp.clip(square, 0.0, converter.current**2))
    return jnp.round(current / converter.current * converter.steps) / converter.steps * converter.current


@stored_jit(Seen)
def _plan(
    model: Plant, time: Array, wanted: Array, pressure: Array, gains: Gains, converter: Converter
) -> tuple[Array, Seen]:
    """Currents with which the model follows, and what it shows then.

    One signed drive heats spring 2 where it is positive and spring 1 where it is negative; its integral
    stops at the heaters' limit.
    """
    interval = jnp.diff(time, prepend=time[:1])
    most = converter.current**2

    def step(carry: tuple[Memory, Array, Array], row: tuple) -> tuple:
        memory, curvature, integral = carry
        time, interval, wanted = row
        error = wanted - curvature
        drive = gains.model * error + integral
        more = gains.model * error * interval / gains.model_time
        integral = jnp.where(jnp.abs(drive) < most, integral + more, integral)
        squares = jnp.stack([jnp.clip(-drive, 0.0, most), jnp.clip(drive, 0.0, most)])
        memory, seen = model.step(memory, pressure, jnp.sqrt(squares), time, interval)
        return (memory, seen.curvature, integral), (squares, seen)

    first = (model.begin(pressure), jnp.zeros(()), jnp.zeros(()))
    return jax.lax.scan(step, first, (time, interval, wanted))[1]


@stored_jit(Seen)
def _drive(
    plant: Plant,
    model: Plant,
    pressures: tuple[Array, Array],
    rows: tuple[Array, Array, Array, Array],
    gains: Gains,
    converter: Converter,
) -> tuple[Seen, Seen, Array, Array]:
    """The real run: what the plant shows, what the observer thinks, currents and readings.

    Args:
        plant: what is driven.
        model: what the controller takes it for.
        pressures: inside the plant, and the one that the controller believes [Pa].
        rows: time [s]; squares of planned currents [A2], resistances that are aimed at and noise of readings
            [ohm], shape (rows, springs) each.
        gains: gains of the controller; converter: heaters and readings.
    """
    (real_pressure, pressure), (time, squares, targets, noise) = pressures, rows
    interval = jnp.diff(time, prepend=time[:1])

    def step(carry: tuple, row: tuple) -> tuple:
        real, own, reading, integral = carry
        time, interval, planned, target, noise = row
        error = reading - target  # too high: too cold
        wanted = planned + gains.resistance * error + integral
        currents = _limited(wanted, converter)
        more = gains.resistance * error * interval / gains.resistance_time
        inside = ((wanted < converter.current**2) | (error < 0.0)) & ((wanted > 0.0) | (error > 0.0))
        integral = jnp.where(inside, integral + more, integral)
        real, seen = plant.step(real, real_pressure, currents, time, interval)
        reading = jnp.round((seen.resistances + noise) / converter.resolution) * converter.resolution
        own, guess = model.step(own, pressure, currents, time, interval)
        own = _corrected(own, guess, reading, gains, converter)
        return (real, own, reading, integral), (seen, guess, currents, reading)

    begin = model.begin(pressure)
    first = (plant.begin(real_pressure), begin, targets[0], jnp.zeros(targets.shape[1]))
    return jax.lax.scan(step, first, (time, interval, squares, targets, noise))[1]


def _corrected(own: Memory, guess: Seen, reading: Array, gains: Gains, converter: Converter) -> Memory:
    """The observer's temperatures after a reading: a Kalman gain, none where the resistance is blind."""
    variance = gains.temperature_sd**2
    slope = guess.slopes
    gain = variance * slope / (variance * slope**2 + converter.noise**2)
    gain = jnp.where(jnp.abs(slope) > converter.blind, gain, 0.0)
    moved = jnp.clip(gain * (reading - guess.resistances), -1.0, 1.0)
    return eqx.tree_at(lambda m: m.temperatures, own, own.temperatures + moved)
