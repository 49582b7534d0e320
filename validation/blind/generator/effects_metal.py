"""Physics of the nitinol: springs on a stand and on an actuator, some of it in wires too."""

import numpy as np

from . import nitinol
from .march import Effect
from .roots import solve

SPRINGS = ("spring", "actuator")


class SlipHysteresis(Effect):
    """Unloading runs below loading: a Prandtl-Ishlinskii sum of elements that yield at many strains."""

    slug, kinds, component = "transformation_hysteresis", SPRINGS, "spring"
    drivers, ceiling = ("strain", "strain_rate", "force"), 80e6
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.widest = float(rng.uniform(0.02, 0.05))
        self.hot_share = float(rng.uniform(0.4, 1.0))
        self._reach = np.geomspace(0.08, 1.0, 6) * self.widest
        weight = rng.uniform(0.6, 1.4, 6)
        self._weight = weight / np.sum(weight)

    def begin(self, shape, numbers, bench):
        self._held = {k: np.ones(shape + (6,)) for k in (1, 2)}
        self._before = {1: None, 2: None}

    def _stops(self, gamma, which):
        before = self._before[which]
        increment = 0.0 * gamma if before is None else gamma - before
        return np.clip(self._held[which] + increment[..., None] / self._reach, -1.0, 1.0)

    def metal(self, gamma, stress, xi0, row, which):
        below = 0.5 * (1.0 - np.sum(self._weight * self._stops(gamma, which), axis=-1))
        phase = self.hot_share + (1.0 - self.hot_share) * xi0
        return stress - self.amplitude * phase * below

    def close_metal(self, strain, gamma, xi0, row, which):
        self._held[which] = self._stops(gamma, which)
        self._before[which] = gamma


class Shakedown(Effect):
    """Cycling leaves strain behind: it grows with the path and saturates hyperbolically."""

    slug, kinds, component = "cyclic_shakedown", ("spring", "actuator", "wire"), "spring"
    drivers, ceiling = ("cycle", "time", "max_strain"), 0.03
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.cycles = float(rng.uniform(0.5, 3.0))
        self._by_heat = bench.kind != "spring"
        if bench.kind == "wire":
            self.ceiling = 0.01

    def begin(self, shape, numbers, bench):
        self._count = {k: np.zeros(shape) for k in (1, 2)}
        self._before = {1: None, 2: None}
        if not self._by_heat:
            self._size = 2.0 * float(np.max(bench.stack("elongation_mm")) / bench.nominal["free_length_mm"])

    def shear(self, gamma, row, which):
        count = self._count[which]
        return gamma - self.amplitude * count / (count + self.cycles)

    def close_metal(self, strain, gamma, xi0, row, which):
        now = xi0 if self._by_heat else strain
        if self._before[which] is not None:
            increment = np.abs(now - self._before[which])
            self._count[which] = self._count[which] + increment / (2.0 if self._by_heat else self._size)
        self._before[which] = now


class RestLength(Effect):
    """A spring that was mounted longer or shorter than noted."""

    slug, kinds, component = "prestrain_error", SPRINGS, "spring"
    drivers, ceiling = ("strain", "force"), 3.0
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.side = float(rng.choice([-1.0, 1.0]))
        self._one = 1 if bench.kind == "spring" else 2

    def begin(self, shape, numbers, bench):
        self._free = numbers["free_length_mm"]

    def opening(self, strain, row, which):
        return strain + self.side * self.amplitude / self._free if which == self._one else strain


class ClosedCoils(Effect):
    """Coils wound on each other: a pull is needed before they part, and it builds up as they do."""

    slug, kinds, component = "coil_contact", ("spring",), "spring"
    drivers, ceiling = ("strain", "force"), 0.4

    def draw(self, rng, bench):
        self.parting_mm = float(rng.uniform(0.5, 3.0))

    def begin(self, shape, numbers, bench):
        self._free = numbers["free_length_mm"]

    def pull(self, strain, force, row, which):
        return force + self.amplitude * np.tanh(np.maximum(strain * self._free, 0.0) / self.parting_mm)


class OpeningHelix(Effect):
    """A wire that does not stretch: as the coil opens it gets thinner, and the same stress pulls harder."""

    slug, kinds, component = "large_helix_angle", SPRINGS, "spring"
    drivers, ceiling = ("strain", "force"), 3.0
    wants = {"springs": True}
    maskable = ("spring",)

    def begin(self, shape, numbers, bench):
        self._q = numbers

    def lever(self, strain, factor, row, which):
        q = self._q
        turn = np.pi * nitinol.coil_diameter(q)
        pitch = 1e-3 * q["initial_pitch_mm"] * (1.0 + strain)
        squared = np.maximum(turn**2 + (1e-3 * q["initial_pitch_mm"]) ** 2 - pitch**2, 0.05 * turn**2)
        thinner = (np.sqrt(squared) / turn) ** self.amplitude
        index = nitinol.coil_diameter(q) / (1e-3 * q["wire_diameter_mm"])
        return factor / thinner if np.all(thinner * index > 2) else factor * np.minimum(1.0 / thinner, 2.0)


class DeadCoils(Effect):
    """Coils that carry current but hardly stretch: the others stretch more, the resistance sums both."""

    slug, kinds, component = "inactive_coils", SPRINGS, "spring"
    drivers, ceiling = ("strain", "xi0"), 8.0
    wants = {"springs": True}
    maskable = ("spring",)

    def draw(self, rng, bench):
        self.share_of_stretch = float(rng.uniform(0.0, 0.12))

    def begin(self, shape, numbers, bench):
        self._q = numbers

    def _split(self, strain):
        dead = self.amplitude / self._q["active_coils"]
        live = strain / (1.0 - dead + dead * self.share_of_stretch)
        return live, dead

    def opening(self, strain, row, which):
        return self._split(strain)[0]

    def resistance(self, ohm, gamma, xi0, row, which, coil):
        dead = self.amplitude / self._q["active_coils"]
        still = coil.wire * nitinol.resistivity(self._q, xi0, self.share_of_stretch * gamma)
        return ohm + dead * (still - ohm)


class WarmResistance(Effect):
    """Both phases resist more when warm, a little more than in proportion."""

    slug, kinds, component = "resistance_temperature_coefficient", SPRINGS, "sensor"
    drivers, ceiling = ("temperature", "xi0"), 3e-3
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.bow_per_K = float(rng.uniform(0.0, 0.004))
        self._name = "temperature_degC" if bench.kind == "spring" else "hot_degC"
        if bench.kind == "spring" and rng.random() < 0.75:
            bench.extra = ("temperature_degC", "current_A")
        if bench.kind == "actuator" and rng.random() < 0.8:
            bench.extra = ("current_2_A",)

    def resistance(self, ohm, gamma, xi0, row, which, coil):
        if which == 1 and self._name == "hot_degC":
            return ohm
        warmer = row.drive[self._name] - 22.0
        return ohm * (1.0 + self.amplitude * warmer * (1.0 + self.bow_per_K * warmer))


class RememberedDetwinning(Effect):
    """Martensite that was detwinned stays so when the spring is let go, and resists less."""

    slug, kinds, component = "detwinned_resistivity_memory", SPRINGS, "spring"
    drivers, ceiling = ("max_strain", "xi0", "strain"), 1.0
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.fullness = float(rng.uniform(0.8, 1.6))

    def begin(self, shape, numbers, bench):
        self._q = numbers

    def resistance(self, ohm, gamma, xi0, row, which, coil):
        q = self._q
        now = nitinol.detwinned(q, gamma)
        retained = np.minimum(coil.memory.residual(xi0) / q["gamma_L"], 1.0)
        fraction = now + self.amplitude * np.maximum(retained - now, 0.0) ** self.fullness
        old, new = (nitinol.rho_martensite(q, f) for f in (now, fraction))
        return ohm + coil.wire * (nitinol.resistivity(q, xi0, gamma, new) - nitinol.resistivity(q, xi0, gamma, old))


class ColdEnds(Effect):
    """Clamps cool the ends of a spring on a stand: zones of three temperatures in series, with a common
    force."""

    slug, kinds, component = "uneven_heating", ("spring",), "spring"
    drivers, ceiling = ("xi0", "strain"), 0.45

    def draw(self, rng, bench):
        self.colder_K = float(rng.uniform(4.0, 10.0))

    def begin(self, shape, numbers, bench):
        self._q, self._index = numbers, -1
        self._zones = nitinol.Memory(numbers, (3,) + shape, bench.geometry["prestrain"])
        self._weights = np.stack([1.0 - self.amplitude, 0.5 * self.amplitude, 0.5 * self.amplitude])
        self._shape, self._start = shape, np.zeros(shape + (2,))

    def _fractions(self, xi0):
        share = np.clip(xi0, 1e-6, 1.0 - 1e-9)
        logit = np.log(share / (1.0 - share))
        shifts = self.colder_K / self._q["T_width"] * np.array([0.0, 0.5, 1.0]).reshape(3, 1, 1)
        cold = 1.0 / (1.0 + np.exp(-(logit + shifts)))
        return np.where(np.asarray(xi0) >= 1.0 - 1e-9, 1.0, cold)

    def _zone_strains(self, x, gamma):
        cold = np.moveaxis(x, -1, -3)
        warm = gamma - np.sum(self._weights[1:] * cold, axis=-3)
        return np.concatenate([(warm / self._weights[0])[..., None, :, :], cold], axis=-3)

    def metal(self, gamma, stress, xi0, row, which):
        if self._index != row.index:
            self._index = row.index
            gamma, self._fraction = np.broadcast_to(gamma, self._shape), self._fractions(xi0)

            def residual(x):
                each = self._zones.stress(self._zone_strains(x, gamma), self._fraction)
                return np.moveaxis(each[..., 1:, :, :] - each[..., :1, :, :], -3, -1) / 3e9

            self._start = solve(residual, self._start, longest=0.02)
            self._each = self._zone_strains(self._start, gamma)
            self._common = self._zones.stress(self._each, self._fraction)[0]
        return self._common

    def resistance(self, ohm, gamma, xi0, row, which, coil):
        return coil.wire * np.sum(self._weights * nitinol.resistivity(self._q, self._fraction, self._each), axis=0)

    def close_metal(self, strain, gamma, xi0, row, which):
        self._zones.commit(self._each, self._fraction)


class LatentHeatStress(Effect):
    """Fast pulling warms the metal by the heat of its transformation, and warm metal is stronger."""

    slug, kinds, component = "self_heating_rate", ("spring",), "spring"
    drivers, ceiling = ("strain_rate", "time"), 6e9

    def draw(self, rng, bench):
        self.cooling_s = float(rng.uniform(1.5, 5.0))

    def begin(self, shape, numbers, bench):
        self._warm, self._before, self._q = np.zeros(shape), None, numbers

    def _rise(self, gamma, xi0, row):
        done = xi0 * nitinol.detwinned(self._q, gamma) + (1 - xi0) * nitinol.stress_induced(self._q, gamma)
        if self._before is None:
            return self._warm, done
        step = np.maximum(row.step, 1e-9)
        fall = np.exp(-step / self.cooling_s)
        return fall * self._warm + (1 - fall) * (done - self._before) / step, done

    def metal(self, gamma, stress, xi0, row, which):
        return stress + self.amplitude * self._rise(gamma, xi0, row)[0]

    def close_metal(self, strain, gamma, xi0, row, which):
        self._warm, self._before = self._rise(gamma, xi0, row)


EFFECTS = (SlipHysteresis, Shakedown, RestLength, ClosedCoils, OpeningHelix, DeadCoils, WarmResistance,
           RememberedDetwinning, ColdEnds, LatentHeatStress)  # fmt: skip
