"""Effects of instruments: compliant fixtures, drifting cells, late channels, leads in series."""

import numpy as np

from .march import Effect


class LeadResistance(Effect):
    """Leads and crimps in series with the spring; they warm a little over a recording."""

    slug, kinds, component = "series_resistance", ("spring", "actuator"), "sensor"
    drivers, ceiling = ("xi0", "time"), 0.6
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.warming = float(rng.uniform(0.0, 0.06))
        if bench.kind == "actuator":
            self.ceiling, self.drivers = 0.25, ("xi0_2", "time")

    def record(self, bench, series):
        out = dict(series)
        leads = self.amplitude[..., None] * (1.0 + self.warming * bench.times / bench.times[:, -1:])
        for name in ("resistance_ohm", "resistance_2_ohm"):
            if name in out:
                out[name] = out[name] + leads
        return out


class GivingFixture(Effect):
    """The load train gives way under force, less so the more it is loaded."""

    slug, kinds, component = "load_train_compliance", ("spring", "elastomer"), "sensor"
    drivers, ceiling = ("force", "stress"), 1.0

    def draw(self, rng, bench):
        self.power = float(rng.uniform(0.75, 1.0))

    def record(self, bench, series):
        if bench.kind == "spring":
            pull = series["force_N"]
            give = 6.0 * np.sign(pull) * np.abs(pull) ** self.power
            return series | {"elongation_mm": series["elongation_mm"] + self.amplitude[..., None] * give}
        pull = series["stress_kPa"] / 100.0
        give = 0.2 * np.sign(pull) * np.abs(pull) ** self.power
        return series | {"strain": series["strain"] + self.amplitude[..., None] * give}


class WrongCell(Effect):
    """A force cell with an offset that drifts while it warms."""

    slug, kinds, component = "force_calibration", ("spring", "elastomer"), "sensor"
    drivers, ceiling = ("time", "force", "stress"), 1.0

    def draw(self, rng, bench):
        self.offset = float(rng.choice([-1, 1]) * rng.uniform(0.5, 1.0))
        self.drift = float(rng.choice([-1, 1]) * rng.uniform(0.2, 1.0))
        self.warming_s = float(rng.uniform(40, 400))

    def record(self, bench, series):
        name, size = ("force_N", 0.15) if bench.kind == "spring" else ("stress_kPa", 12.0)
        error = size * (self.offset + self.drift * -np.expm1(-bench.times / self.warming_s))
        return series | {name: series[name] + self.amplitude[..., None] * error}


class LateChannel(Effect):
    """One output is late: three filters in a row, as a camera's and a logger's buffers are."""

    slug, kinds, component = "channel_lag", ("actuator", "tube", "spring", "elastomer"), "sensor"
    drivers, ceiling = ("time", "strain_rate", "pressure_rate"), 6.0

    def record(self, bench, series):
        name = bench.outputs[0]
        value = series[name]
        tau = np.maximum(self.amplitude, 1e-6) / 3.0
        for _ in range(3):
            late = np.empty(np.broadcast_shapes(value.shape, tau.shape + (1,)))
            late[..., 0] = value[..., 0]
            for n in range(1, value.shape[-1]):
                step = (bench.times[:, n] - bench.times[:, n - 1]) / tau
                fall = np.exp(-step)
                ramp = (value[..., n] - value[..., n - 1]) / step
                late[..., n] = fall * late[..., n - 1] + (1 - fall) * (value[..., n - 1] - ramp) + ramp * step
            value = late
        return series | {name: value}


EFFECTS = (LeadResistance, GivingFixture, WrongCell, LateChannel)
