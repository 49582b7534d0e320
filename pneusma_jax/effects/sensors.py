"""Effects of the instruments: what is recorded is not what acts."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..chain import Effect, Known
from ._spec import Spec


class PressureCalibration(Effect):
    """Chamber pressure = gain * recorded + offset; offset [Pa], gain [1]."""

    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)
    gain: Array = eqx.field(converter=jnp.asarray, default=1.0)

    slug: ClassVar[str] = "pressure_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The pressure sensor reads with an offset or a wrong gain."
    specs: ClassVar[dict[str, Spec]] = {
        "offset": Spec(0.0, -3e3, 3e3, 1e3, "Pa", "zero offset of the pressure sensor"),
        "gain": Spec(1.0, 0.8, 1.25, 1.05, "1", "gain of the pressure sensor"),
    }

    def pressure(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pressure`."""
        return self.gain * value + self.offset


class PressureLag(Effect):
    """The chamber follows the recorded pressure with a first-order lag; tau [s]."""

    tau: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "pressure_lag"
    component: ClassVar[str] = "pressure"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The pressure in the chamber lags behind the one at the sensor."
    specs: ClassVar[dict[str, Spec]] = {"tau": Spec(0.0, 0.0, 5.0, 0.3, "s", "time constant of the supply line")}

    def begin(self, at: Known) -> Array:
        """The chamber is settled at the first recorded pressure."""
        return at["pressure"]

    def pressure(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.pressure`; exact for a recorded pressure that is linear over a row."""
        tau = jnp.maximum(self.tau, 0.0)
        ratio = at["interval"] / jnp.where(tau > 0.0, tau, 1.0)
        left = jnp.where(tau > 0.0, jnp.exp(-ratio), 0.0)
        return value + (memory - value) * left

    def remember(self, memory: Array, at: Known) -> Array:
        """The chamber's own pressure."""
        return at["pressure"]


class SeriesResistance(Effect):
    """Leads and crimps add to the measured resistance; ohms [ohm]."""

    ohms: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "series_resistance"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "ASW"
    sentence: ClassVar[str] = "Leads and crimps add a constant resistance to that of the wire."
    specs: ClassVar[dict[str, Spec]] = {"ohms": Spec(0.0, 0.0, 0.5, 0.05, "ohm", "resistance of leads and crimps")}

    def wire_resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wire_resistance`."""
        return value - self.ohms

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.resistance`."""
        return value + self.ohms


class CameraCalibration(Effect):
    """Curvature and angle are read with a wrong scale and an angular offset; scale [1], offset [rad]."""

    scale: Array = eqx.field(converter=jnp.asarray, default=1.0)
    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "camera_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "The camera reads curvature with a wrong scale or a tilted zero."
    specs: ClassVar[dict[str, Spec]] = {
        "scale": Spec(1.0, 0.85, 1.15, 1.05, "1", "scale of the camera"),
        "offset": Spec(0.0, -0.1, 0.1, 0.03, "rad", "angular offset of the camera"),
    }

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """See `Effect.outputs`; the angular offset shows as a curvature over the length."""
        seen = dict(value)
        if "bend_angle" in seen:
            seen["bend_angle"] = self.scale * seen["bend_angle"] + self.offset
        if "curvature" in seen:
            seen["curvature"] = self.scale * seen["curvature"] + self.offset / at["solved"].length
        return seen


class ForceCalibration(Effect):
    """Load cell with offset and drift; offset [N], drift [N/s]. (Its gain cannot be told from a modulus.)"""

    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)
    drift: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "force_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "S"
    sentence: ClassVar[str] = "The load cell has an offset or drifts."
    specs: ClassVar[dict[str, Spec]] = {
        "offset": Spec(0.0, -0.1, 0.1, 0.02, "N", "zero offset of the load cell"),
        "drift": Spec(0.0, -1e-3, 1e-3, 1e-4, "N/s", "drift of the load cell"),
    }

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """See `Effect.outputs`."""
        return value | {"force": value["force"] + self.offset + self.drift * at["time"]}
