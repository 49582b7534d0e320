"""Physics of the silicone: coupons, tubes and actuators alike. Strains carry the section's points as last axis."""

import numpy as np

from .march import Effect

SOFT = ("elastomer", "tube", "actuator")


class PowerLawRelaxation(Effect):
    """Stress relaxes as a power of time: a row of many Maxwell elements whose weights fall with their time."""

    slug, kinds, component = "viscoelastic_relaxation", SOFT, "elastomer"
    drivers, ceiling = ("time", "strain_rate"), 0.5

    def draw(self, rng, bench):
        self.exponent = float(rng.uniform(0.1, 0.4))
        self.slowest_s = float(10 ** rng.uniform(2.0, 2.8))
        tau = np.geomspace(0.3, self.slowest_s, 14)
        self._tau = tau
        self._share = tau**-self.exponent / np.sum(tau**-self.exponent)

    def begin(self, shape, numbers, bench):
        self._carried, self._before = 0.0, None

    def _decay(self, row):
        step = np.maximum(row.step, 1e-9)[:, None, None]
        fall = np.exp(-step / self._tau)
        return fall, self._share * self._tau / step * (1.0 - fall)

    def fibre(self, strain, stress, row):
        if self._before is None:
            return stress
        fall, gain = self._decay(row)
        amplitude = self.amplitude[..., None]
        memory = np.sum(fall * self._carried, axis=-1)
        return stress + amplitude * (memory + np.sum(gain, axis=-1) * (stress - self._before))

    def close_fibre(self, strain, stress, row):
        fall, gain = self._decay(row)
        if self._before is None:
            self._carried = np.zeros(stress.shape + self._tau.shape)
        else:
            self._carried = fall * self._carried + gain * (stress - self._before)[..., None]
        self._before = stress


class RunningMaximumSoftening(Effect):
    """Mullins softening: below the largest strain so far the stress is lower, the more the further below."""

    slug, kinds, component = "mullins_softening", SOFT, "elastomer"
    drivers, ceiling, maskable = ("max_strain", "strain", "cycle"), 0.7, True

    def draw(self, rng, bench):
        self.sharpness = float(rng.uniform(0.6, 1.6))
        self.onset_strain = float(rng.uniform(0.05, 0.2))

    def begin(self, shape, numbers, bench):
        self._largest = 0.0

    def fibre(self, strain, stress, row):
        largest = np.maximum(self._largest, np.maximum(strain, 0.0))
        below = np.clip(1.0 - strain / np.maximum(largest, 1e-9), 0.0, 1.0)
        damage = largest / (largest + self.onset_strain)
        return stress * (1.0 - self.amplitude[..., None] * damage * np.where(strain > 0, np.tanh(2.0 * below**self.sharpness), 0.0))

    def close_fibre(self, strain, stress, row):
        self._largest = np.maximum(self._largest, np.maximum(strain, 0.0))


EFFECTS = (PowerLawRelaxation, RunningMaximumSoftening)
