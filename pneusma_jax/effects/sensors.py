"""Effects of the instruments: differences between recorded and true quantities."""

from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..numerics.safe import begun_as
from ..pipeline import Effect, Known
from ._spec import Spec


class PressureCalibration(Effect):
    """Chamber pressure = gain * recorded + offset + drift * time; offset [Pa], gain [1], drift [Pa/s]."""

    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)
    gain: Array = eqx.field(converter=jnp.asarray, default=1.0)
    drift: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "pressure_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The pressure sensor reads with an offset, a wrong gain or a drift."
    literature: ClassVar[str] = "IEC 61298-2: zero, span and drift of a transducer"
    specs: ClassVar[dict[str, Spec]] = {
        "offset": Spec(0.0, -3e3, 3e3, 1e3, "Pa", "what the pressure is above its reading, at zero"),
        "gain": Spec(1.0, 0.85, 1.15, 1.05, "1", "pressure per reading"),
        "drift": Spec(0.0, -30.0, 30.0, 5.0, "Pa/s", "growth of the same with time"),
    }

    def pressure(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pressure`."""
        return self.gain * value + self.offset + self.drift * at["time"]


class PressureLag(Effect):
    """The chamber follows the recorded pressure through a restriction; tau [s], laminar [Pa], line [1].

    A volume before the restriction, such as a filter or a long tube, may itself follow the sensor. Its time
    constant is `line` times `tau`. So two lags act in a row.

    Small pressure differences x drive a laminar flow, in proportion: a first-order lag. Large ones drive that
    of an orifice, as the root of the difference. The law is `dx/dt = -x / (tau s)` with s = 1 at x = DROP and
    s^4 proportional to `laminar^2 + x^2`.
    """

    tau: Array = eqx.field(converter=jnp.asarray, default=0.0)
    laminar: Array = eqx.field(converter=jnp.asarray, default=1e4)
    line: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "pressure_lag"
    by_rate: ClassVar[bool] = True
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "pressure"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The pressure in the chamber lags behind the one at the sensor."
    literature: ClassVar[str] = "flow through a restriction into a chamber, subsonic: ISO 6358"
    specs: ClassVar[dict[str, Spec]] = {
        "tau": Spec(0.0, 0.0, 5.0, 0.3, "s", "time constant of the supply line at a drop of 1 kPa"),
        "laminar": Spec(1e4, 1.0, 1e6, 1e4, "Pa", "drop of pressure to which the flow is laminar", True),
        "line": Spec(0.0, 0.0, 1.0, 0.3, "1", "time constant of a volume before, over that", True),
    }

    def begin(self, at: Known) -> tuple[Array, Array, Array]:
        """Recorded pressure, and the excesses below, zero at the first row."""
        return at["pressure"], jnp.zeros(()), jnp.zeros(())

    def _excess(self, at: Known, memory: tuple[Array, Array, Array]) -> tuple[Array, Array]:
        """Excess of the chamber over the line, and of the line over the sensor.

        The recorded pressure is linear over a row.

        Each part of a row is exact for the time constant of its middle. The slope over tau at tau = 0 is
        minus the pressure's rate, so a score test can detect the effect.
        """
        before, excess, ahead = memory
        interval, rise = at["interval"] / PARTS, (at["recorded_pressure"] - before) / PARTS
        tau = jnp.where(self.tau >= 0.0, self.tau, 0.0)
        for _ in range(PARTS):
            then = _lagged_excess(ahead, interval, rise, tau * self.line)
            risen, ahead = rise + then - ahead, then  # of the line, taken as linear over a part
            middle = _lagged_excess(excess, 0.5 * interval, 0.5 * risen, tau * self._time_factor(excess))
            excess = _lagged_excess(excess, interval, risen, tau * self._time_factor(middle))
        return excess, ahead

    def _time_factor(self, excess: Array) -> Array:
        """Factor on the time constant at a drop of pressure [Pa]."""
        return ((self.laminar**2 + excess**2) / (self.laminar**2 + DROP**2)) ** 0.25

    def pressure(self, value: Array, at: Known, memory: tuple[Array, Array, Array]) -> Array:
        """See `Effect.pressure`."""
        excess, ahead = self._excess(at, memory)
        return value + excess + ahead

    def remember(self, memory: tuple[Array, Array, Array], at: Known) -> tuple[Array, Array, Array]:
        """Recorded pressure, and both excesses after the row."""
        return at["recorded_pressure"], *self._excess(at, memory)


PARTS = 4
"""Number of parts of a row, each with one time constant of the chamber."""
DROP = 1e3
"""Pressure difference at which a chamber's time constant is `tau` [Pa]."""


def _lagged_excess(excess: Array, interval: Array, rise: Array, tau: Array) -> Array:
    """Excess of a first-order follower over an input that rises linearly by `rise` in an interval [s];
    exact."""
    quick = interval > 30.0 * tau
    ratio = interval / jnp.where(quick | (tau == 0.0), 1.0, tau)
    decay = jnp.where(quick, 0.0, jnp.exp(-ratio))
    flat = ratio < 1e-6
    slow = jnp.where(flat, 1.0 - 0.5 * ratio, -jnp.expm1(-ratio) / jnp.where(flat, 1.0, ratio))
    behind = jnp.where(quick, tau / jnp.where(quick, interval, 1.0), slow)
    return decay * excess - behind * rise


class CameraCalibration(Effect):
    """Curvature and angle are read with a wrong scale and an angular offset; scale [1], offset [rad]."""

    scale: Array = eqx.field(converter=jnp.asarray, default=1.0)
    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "camera_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "The camera reads curvature with a wrong scale or a tilted zero."
    literature: ClassVar[str] = "Z. Zhang, IEEE Trans. Pattern Anal. Mach. Intell. 22 (2000) 1330"
    specs: ClassVar[dict[str, Spec]] = {
        "scale": Spec(1.0, 0.85, 1.15, 1.05, "1", "scale of the camera"),
        "offset": Spec(0.0, -0.1, 0.1, 0.03, "rad", "angular offset of the camera"),
    }

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """See `Effect.outputs`; the angular offset shows as a curvature over the length."""
        if "curvature" not in value:  # no camera looks on
            return value
        seen = dict(value)
        seen["bend_angle"] = self.scale * seen["bend_angle"] + self.offset
        seen["curvature"] = self.scale * seen["curvature"] + self.offset / at["solved"].length
        return seen


class ForceCalibration(Effect):
    """Load cell with offset and drift; offset [N], drift [N/s], that ends at a rate `settling` [1/s].

    (Its gain cannot be distinguished from a modulus.)
    """

    offset: Array = eqx.field(converter=jnp.asarray, default=0.0)
    drift: Array = eqx.field(converter=jnp.asarray, default=0.0)
    settling: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "force_calibration"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "SE"
    sentence: ClassVar[str] = "The load cell has an offset or drifts."
    literature: ClassVar[str] = "ISO 376: zero and creep of force transducers"
    specs: ClassVar[dict[str, Spec]] = {
        "offset": Spec(0.0, -0.1, 0.1, 0.02, "N", "zero offset of the load cell"),
        "drift": Spec(0.0, -1e-3, 1e-3, 1e-4, "N/s", "drift of the load cell"),
        "settling": Spec(0.0, 0.0, 0.1, 2e-3, "1/s", "rate at which the drift comes to an end", True),
    }

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """See `Effect.outputs`; over a coupon's cross-section it is a stress."""
        ended = self.settling * at["time"]
        flat = ended < 1e-9
        share = jnp.where(flat, 1.0 - 0.5 * ended, -jnp.expm1(-ended) / jnp.where(flat, 1.0, ended))
        error = self.offset + self.drift * at["time"] * share
        if "stress" in value:
            return value | {"stress": value["stress"] + error / at["area"]}
        return value | ({"force": value["force"] + error} if "force" in value else {})


class LoadTrainCompliance(Effect):
    """The recorded length is that of specimen and load train in series; give [m/N].

    The compliance falls as joints and grips seat: by half at the force 1 / stiffening [1/N].
    """

    give: Array = eqx.field(converter=jnp.asarray, default=0.0)
    stiffening: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "load_train_compliance"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "SE"
    sentence: ClassVar[str] = "Grips and load cell give under load, recorded as the specimen's length."
    literature: ClassVar[str] = "ASTM D3379: system compliance"
    specs: ClassVar[dict[str, Spec]] = {
        "give": Spec(0.0, 0.0, 3.5e-3, 3e-4, "m/N", "compliance of the load train, unloaded"),
        "stiffening": Spec(0.0, 0.0, 3.0, 0.3, "1/N", "one over the force at which it is half of that", True),
    }

    def compliance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.compliance`."""
        return value + jnp.stack([self.give, self.stiffening])


class ChannelLag(Effect):
    """A channel runs late: those that are predicted by `delay` [s], a spring's resistance by its own.

    A buffer delays, and a filter follows. The share `filtered` [1] of the delay is the time constant of a
    first-order follower behind a pure delay of the rest. So 0 is a pure delay, and 1 a first-order lag.

    The thermometer of a wire lags by `delay_temperature` [s]. It is a first-order follower of the wire, such
    as a thermocouple. So the wire is warmer than its reading while that rises.
    """

    delay: Array = eqx.field(converter=jnp.asarray, default=0.0)
    delay_resistance: Array = eqx.field(converter=jnp.asarray, default=0.0)
    delay_temperature: Array = eqx.field(converter=jnp.asarray, default=0.0)
    filtered: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "channel_lag"
    by_rate: ClassVar[bool] = True
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "ASWET"
    sentence: ClassVar[str] = "One recorded channel runs late against the others."
    sentences: ClassVar[Mapping[str, str]] = {
        "W": "One recorded channel runs late against the others, or the thermometer lags behind the wire."
    }
    literature: ClassVar[str] = (
        "K. J. Astrom and T. Hagglund, Advanced PID Control, ISA (2006): first-order lag and dead time"
    )
    specs: ClassVar[dict[str, Spec]] = {
        "delay": Spec(0.0, 0.0, 3.0, 0.3, "s", "delay of the camera, the force or the length"),
        "delay_resistance": Spec(0.0, 0.0, 3.0, 0.3, "s", "delay of the resistance", kinds="S"),
        "delay_temperature": Spec(0.0, 0.0, 30.0, 2.0, "s", "time constant of the thermometer", kinds="W"),
        "filtered": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "a pure delay (0) or a first-order lag (1)", True, natural_ends=True
        ),
    }
    within: ClassVar[dict[str, dict[str, dict[str, Any]]]] = {
        kind: {"delay": {"text": f"delay of the {channel}"}}
        for kind, channel in {
            "A": "camera", "S": "force", "W": "strain or the stress", "E": "force", "T": "length",
        }.items()
    }  # fmt: skip

    def driven(self, value: dict[str, Array], time: Array) -> dict[str, Array]:
        """See `Effect.driven`."""
        if "temperature" not in value:
            return value
        return value | {"temperature": ahead(time, value["temperature"], self.delay_temperature)}

    def recorded(self, value: dict[str, Array], time: Array) -> dict[str, Array]:
        """See `Effect.recorded`; the model's own signal is shifted, so no noise is averaged."""
        late = {}
        for name, course in value.items():
            delay = self.delay_resistance if name == "resistance" else self.delay
            passed = delayed(time, course, (1.0 - self.filtered) * delay)
            late[name] = followed(time, passed, self.filtered * delay)
        return late


def delayed(time: Array, course: Array, delay: Array) -> Array:
    """A signal delayed by `delay` [s], linear between rows, at rest before the first; shape (rows,).

    A delay of 0 changes nothing; its derivative is minus the slope towards the row before. Time that stands
    still, as in padding, delays nothing.
    """
    late = time - delay
    when = jnp.where(late > time[0], late, time[0])
    after = jnp.clip(jnp.searchsorted(time, when, side="left"), 1, time.shape[0] - 1)
    gap = time[after] - time[after - 1]
    moving = gap > 0.0
    part = (when - time[after]) / jnp.where(moving, gap, 1.0)
    return jnp.where(moving, course[after] + part * (course[after] - course[after - 1]), course)


def followed(time: Array, course: Array, lag: Array) -> Array:
    """First-order follower of a signal, of time constant `lag` [s], at rest before the first row; (rows,).

    It is exact for a signal that is linear between rows. A lag of 0 changes nothing; its derivative is minus
    the slope from the row before. Time that stands still, as in padding, lets it wait. A row without a number
    has none here; later rows go on from the last that has one.
    """

    def step(carry: tuple[Array, Array], row: tuple[Array, Array]) -> tuple[tuple[Array, Array], Array]:
        excess, before = carry
        interval, value = row
        value = jnp.where(jnp.isfinite(value), value, before)
        rise = jnp.where(jnp.isfinite(before), value - before, 0.0)
        still = interval <= 0.0
        after = _lagged_excess(excess, jnp.where(still, 1.0, interval), rise, lag)
        after = jnp.where(still, excess, after)
        return (after, value), after

    first = begun_as((jnp.zeros_like(course[0]), course[0]), (time, course, lag))
    _, excess = jax.lax.scan(step, first, (jnp.diff(time), course[1:]))
    return course + jnp.concatenate([jnp.zeros_like(course[:1]), excess])


def ahead(time: Array, course: Array, lag: Array) -> Array:
    """A signal from that of its first-order follower of time constant `lag` [s], shape (rows,).

    It is the follower, and its slope times the lag. The slope is that between a third of a lag before the row
    and as much after it, linear between rows. Noise grows by a factor of 2.4 at most in rows of equal steps.
    Within a third of a lag of an end it grows by up to 5. Over a shorter time it would grow more, over a
    longer one sudden turns would be blunter. A lag of 0 changes nothing; its derivative is the slope. Time
    that stands still, as in padding, changes nothing.
    """
    half = jnp.where(lag / 3.0 > SHORT, lag / 3.0, SHORT)
    before, after = jnp.maximum(time - half, time[0]), jnp.minimum(time + half, time[-1])
    span = after - before
    rise = jnp.interp(after, time, course) - jnp.interp(before, time, course)
    return course + lag * jnp.where(span > 0.0, rise / jnp.where(span > 0.0, span, 1.0), 0.0)


SHORT = 1e-3
"""Minimum half of the time over which a slope is computed [s]."""
