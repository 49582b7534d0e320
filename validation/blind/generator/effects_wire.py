"""Physics of a straight wire that cycles through its transformation under load."""

import numpy as np

from .march import Effect

ONLY = ("wire",)


class Relays(Effect):
    """Preisach: many small regions that turn at their own temperature, later on the way than back."""

    slug, kinds, component = "transformation_hysteresis", ONLY, "spring"
    drivers, ceiling = ("temperature",), 40.0
    maskable = ("wire",)

    def draw(self, rng, bench):
        self.unlike = float(rng.uniform(0.2, 0.6))
        edges = np.linspace(-9.0, 9.0, 361)
        share = np.diff(1.0 / (1.0 + np.exp(-edges)))
        self._ramp = 0.5 * (edges[1] - edges[0])
        place, wide = np.meshgrid(0.5 * (edges[1:] + edges[:-1]), [1.0 - self.unlike, 1.0, 1.0 + self.unlike])
        self._place, self._wide = place.ravel(), wide.ravel()
        self._weight = np.tile(share / np.sum(share) / 3.0, 3)

    def begin(self, shape, numbers, bench):
        self._cold = None

    def phase(self, xi0, temperature, row, q):
        middle = q["T_mid"][..., None] + q["T_width"][..., None] * self._place
        half = 0.5 * self.amplitude[..., None] * self._wide
        ramp = 2.0 * self._ramp * q["T_width"][..., None]
        off = (middle - np.asarray(temperature)[..., None]) / ramp
        if self._cold is None:
            self._cold = np.clip(0.5 + off, 0.0, 1.0)
        least, most = np.clip(0.5 + off - half / ramp, 0.0, 1.0), np.clip(0.5 + off + half / ramp, 0.0, 1.0)
        self._cold = np.clip(self._cold, least, most)
        return self._cold @ self._weight


class ClausiusClapeyron(Effect):
    """Load raises the transformation temperature, a little more than in proportion."""

    slug, kinds, component = "stress_shifted_transformation", ONLY, "spring"
    drivers, ceiling = ("stress", "temperature"), 0.25
    maskable = ("wire",)

    def draw(self, rng, bench):
        self.bow_per_MPa = float(rng.uniform(0.0, 0.001))

    def warmth(self, temperature, stress, row, q):
        load = 1e-6 * stress
        return temperature - self.amplitude * load * (1.0 + self.bow_per_MPa * load)


class SelfHeating(Effect):
    """Latent heat: the wire is warmer than its sensor while martensite forms, colder while it goes."""

    slug, kinds, component = "self_heating_rate", ONLY, "spring"
    drivers, ceiling = ("time", "temperature", "strain_rate"), 2500.0

    def draw(self, rng, bench):
        self.cooling_s = float(rng.uniform(3.0, 8.0))

    def begin(self, shape, numbers, bench):
        self._rise, self._before = np.zeros(shape), None

    def warmth(self, temperature, stress, row, q):
        return temperature + self._rise

    def close_metal(self, strain, gamma, xi0, row, which):
        if self._before is not None:
            step = np.maximum(row.step, 1e-9)
            fall = np.exp(-step / self.cooling_s)
            rate = np.clip((xi0 - self._before) / step, -0.05, 0.05)
            self._rise = fall * self._rise + (1.0 - fall) * np.clip(self.amplitude * rate, -25.0, 25.0)
        self._before = xi0


class RPhase(Effect):
    """An intermediate phase on cooling only: it stretches a little before martensite comes, and is used up by
    it."""

    slug, kinds, component = "r_phase", ONLY, "spring"
    drivers, ceiling = ("temperature", "stress"), 0.015

    def draw(self, rng, bench):
        self.above_K, self.width_K = float(rng.uniform(9.0, 18.0)), float(rng.uniform(1.2, 2.5))
        self.knee_MPa = float(rng.uniform(40.0, 90.0))

    def begin(self, shape, numbers, bench):
        self._cooling, self._before, self._stretch = np.zeros(shape), None, np.zeros(shape)

    def phase(self, xi0, temperature, row, q):
        if self._before is not None:
            self._cooling = np.clip(self._cooling - (temperature - self._before) / 3.0, 0.0, 1.0)
        self._before = temperature
        formed = 1.0 / (1.0 + np.exp(np.clip((temperature - q["T_mid"] - self.above_K) / self.width_K, -50, 50)))
        load = np.tanh(row.drive["stress_MPa"] / self.knee_MPa)
        self._stretch = self.amplitude * load * formed * self._cooling * (1.0 - xi0)
        return xi0

    def shear(self, strain, row, which):
        return strain - self._stretch


EFFECTS = (Relays, ClausiusClapeyron, SelfHeating, RPhase)
