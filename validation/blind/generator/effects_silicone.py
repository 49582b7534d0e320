"""Physics of the silicone for coupons, tubes and actuators. Strains carry the section's points as last
axis."""

import numpy as np

from .march import Effect
from .silicone import base_stress

SOFT = ("elastomer", "tube", "actuator")


class PowerLawRelaxation(Effect):
    """Stress relaxes as a power of time: a row of many Maxwell elements whose weights fall with their
    time."""

    slug, kinds, component = "viscoelastic_relaxation", SOFT, "elastomer"
    drivers, ceiling = ("time", "strain_rate"), 0.5
    maskable = ("elastomer", "tube")

    def draw(self, rng, bench):
        self.exponent = float(rng.uniform(0.1, 0.4))
        self.slowest_s = float(10 ** rng.uniform(2.0, 2.8))
        tau = np.geomspace(0.3, self.slowest_s, 10)
        self._tau = tau
        self._share = tau**-self.exponent / np.sum(tau**-self.exponent)

    def begin(self, shape, numbers, bench):
        self._carried, self._before, self._recalled = 0.0, None, (-1, 0.0, 0.0)

    def _recall(self, row):
        """Remaining part of earlier overstress in this row, and the part of a stress step that counts."""
        if self._recalled[0] != row.index:
            step = np.maximum(row.step, 1e-9)[:, None, None]
            fall = np.exp(-step / self._tau)
            gain = self._share * self._tau / step * (1.0 - fall)
            self._carried = fall * self._carried
            self._recalled = (row.index, np.sum(self._carried, axis=-1), gain)
        return self._recalled[1:]

    def fibre(self, strain, stress, row):
        if self._before is None:
            return stress
        left, gain = self._recall(row)
        return stress + self.amplitude[..., None] * (left + np.sum(gain, axis=-1) * (stress - self._before))

    def close_fibre(self, strain, stress, row):
        if self._before is None:
            self._carried = np.zeros(stress.shape + self._tau.shape)
        else:
            gain = self._recall(row)[1]
            self._carried = self._carried + gain * (stress - self._before)[..., None]
        self._before = stress


class RunningMaximumSoftening(Effect):
    """Mullins softening: below the largest strain so far the stress is lower, the more the further below."""

    slug, kinds, component = "mullins_softening", SOFT, "elastomer"
    drivers, ceiling = ("max_strain", "strain", "cycle"), 0.7
    maskable = ("elastomer", "tube")

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


class CreepingSet(Effect):
    """A permanent set that creeps towards a share of the largest strain along the path of deformation."""

    slug, kinds, component = "permanent_set", SOFT, "elastomer"
    drivers, ceiling = ("cycle", "max_strain", "time"), 0.15

    def draw(self, rng, bench):
        self.path = float(rng.uniform(0.5, 2.0))

    def begin(self, shape, numbers, bench):
        self._stiffness = numbers["silicone_stiffness"][..., None]
        self._largest, self._set, self._before = 0.0, 0.0, None

    def fibre(self, strain, stress, row):
        return stress + self._stiffness * (base_stress(strain - self._set) - base_stress(strain))

    def close_fibre(self, strain, stress, row):
        increment = 0.0 if self._before is None else np.abs(strain - self._before)
        self._largest = np.maximum(self._largest, np.maximum(strain, 0.0))
        goal = self.amplitude[..., None] * self._largest
        self._set = self._set + (goal - self._set) * (1.0 - np.exp(-increment / self.path))
        self._before = strain


class ExponentialStiffening(Effect):
    """Chains that lock: a stress that grows exponentially with the square of the stretch."""

    slug, kinds, component = "strain_stiffening", SOFT, "elastomer"
    drivers, ceiling = ("strain", "force", "pressure"), 2.0
    maskable = ("elastomer", "tube")

    def draw(self, rng, bench):
        self.rate = float(rng.uniform(1.5, 3.0))

    def fibre(self, strain, stress, row):
        pulled = np.clip(strain, 0.0, 1.5)
        return stress + self.amplitude[..., None] * 2e4 * pulled * np.expm1(self.rate * pulled**2)


class RadialStress(Effect):
    """A wall that is not thin: pressure squeezes it through its thickness, by the logarithmic profile of
    large strain."""

    slug, kinds, component = "thick_wall", ("tube", "actuator"), "elastomer"
    drivers, ceiling = ("pressure", "strain"), 2.0
    maskable = ("tube",)

    def begin(self, shape, numbers, bench):
        outer = 0.5 * numbers["outer_diameter_mm"]
        inner = outer - numbers["wall_thickness_mm"]
        share = np.linspace(0.0, 1.0, 41)
        radius = inner[..., None] + (outer - inner)[..., None] * share
        profile = np.log(outer[..., None] / radius) / np.log(outer / inner)[..., None]
        self._mean = np.mean(profile * radius, axis=-1) / np.mean(radius, axis=-1)

    def fibre(self, strain, stress, row):
        squeeze = 1e3 * row.drive["pressure_kPa"] * self._mean * self.amplitude
        return stress - squeeze[..., None] / np.maximum(1.0 + strain, 0.3)


EFFECTS = (PowerLawRelaxation, RunningMaximumSoftening, CreepingSet, ExponentialStiffening, RadialStress)
