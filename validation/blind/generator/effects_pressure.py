"""Pressure, its area and its way into the chamber; friction of the wrap. Tubes and actuators."""

import numpy as np

from .march import Effect

BLOWN = ("tube", "actuator")


class GrowingBore(Effect):
    """The bore widens with pressure and as the wall thins with stretch; the area goes with the square."""

    slug, kinds, component = "radial_expansion", BLOWN, "pressure"
    drivers, ceiling = ("pressure", "strain"), 0.3
    maskable = ("tube",)

    def load(self, body, row):
        wider = self.amplitude * body.pressure / 1e5 * (1.0 + body.axial)
        force = -body.pressure * body.bore * ((1.0 + wider) ** 2 - 1.0)
        return force, force * (0.5e-3 * body.q["outer_diameter_mm"])


class WrongGauge(Effect):
    """A pressure gauge that is off: offset, gain and a drift with the root of time."""

    slug, kinds, component = "pressure_calibration", BLOWN, "sensor"
    drivers, ceiling = ("pressure", "time"), 3.0

    def draw(self, rng, bench):
        self.offset_kPa = float(rng.choice([-1, 1]) * rng.uniform(0.6, 1.5))
        self.gain = float(rng.normal(0.0, 0.02))
        self.drift_kPa = float(rng.normal(0.0, 0.4))

    def drives(self, bench, series):
        share = np.sqrt(bench.times / bench.times[:, -1:])
        error = self.offset_kPa + self.gain * series["pressure_kPa"] + self.drift_kPa * share
        return series | {"pressure_kPa": series["pressure_kPa"] + self.amplitude[..., None] * error}


class NarrowHose(Effect):
    """The chamber fills through a narrow hose: a flow that goes with the root of the pressure difference."""

    slug, kinds, component = "pressure_lag", BLOWN, "pressure"
    drivers, ceiling = ("pressure_rate", "time"), 6.0

    def draw(self, rng, bench):
        self.reference_kPa = float(rng.uniform(2.0, 6.0))

    def drives(self, bench, series):
        gauge, parts = series["pressure_kPa"], 8
        behind = np.zeros_like(gauge[..., 0] * self.amplitude)
        inside = np.empty(behind.shape + gauge.shape[-1:])
        inside[..., 0] = gauge[..., 0]
        for n in range(1, gauge.shape[-1]):
            step = (bench.times[:, n] - bench.times[:, n - 1]) / parts
            closing = np.sqrt(self.reference_kPa) * step / (2.0 * np.maximum(self.amplitude, 1e-6))
            for _ in range(parts):
                behind = behind + (gauge[..., n] - gauge[..., n - 1]) / parts
                behind = np.sign(behind) * np.maximum(np.sqrt(np.abs(behind)) - closing, 0.0) ** 2
            inside[..., n] = gauge[..., n] - behind
        return series | {"pressure_kPa": inside}


class MaxwellSlip(Effect):
    """The wrap rubs: springs in parallel that each slip at their own force, which grows with pressure."""

    slug, kinds, component = "wrap_friction", BLOWN, "friction"
    drivers, ceiling = ("curvature", "strain", "pressure"), 1.0

    def draw(self, rng, bench):
        count = 7
        self.pressure_share = float(rng.uniform(0.2, 0.7))
        self._axial = bench.kind == "tube"
        widest = rng.uniform(0.02, 0.05) if self._axial else rng.uniform(0.15, 0.4)
        self.widest = float(widest)
        self._reach = np.geomspace(0.04, 1.0, count) * widest
        weight = rng.uniform(0.5, 1.5, count)
        self._limit = weight / np.sum(weight) * (0.6 if self._axial else 4e-3)

    def begin(self, shape, numbers, bench):
        self._held = np.zeros(shape + self._reach.shape)
        self._before = np.zeros(shape)

    def _forces(self, body):
        place = body.axial if self._axial else body.bend
        press = 1.0 - self.pressure_share + self.pressure_share * body.pressure / 3e4
        limit = self._limit * np.maximum(press, 0.05)[..., None]
        trial = self._held + self._limit / self._reach * (place - self._before)[..., None]
        return np.clip(trial, -limit, limit), place

    def load(self, body, row):
        total = self.amplitude * np.sum(self._forces(body)[0], axis=-1)
        return (total, 0.0) if self._axial else (0.0, total)

    def close_load(self, body, row):
        self._held, self._before = self._forces(body)


EFFECTS = (GrowingBore, WrongGauge, NarrowHose, MaxwellSlip)
