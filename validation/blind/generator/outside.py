"""Physics outside the catalogue: a diagnosis should say that something is missing, and may not name it.

Each class is an effect of the generator. `march.Effect` explains its attributes and the hooks that a stand
calls. `amplitude` is the strength that the generator sets, in the unit that the class states, up to `ceiling`.
"""

import numpy as np

from .march import Effect


class FlatteningTube(Effect):
    """Bending flattens the tube's section (Brazier): it loses bending stiffness with about the square of the
    curvature.

    The amplitude [1] is the ratio of lost to remaining stiffness at a curvature of 60 1/m. The power is drawn.
    """

    slug, kinds, component = "section_ovalisation", ("actuator",), "geometry"
    drivers, ceiling = ("curvature",), 0.3

    def draw(self, rng, bench):
        self.power = float(rng.uniform(1.8, 2.4))

    def load(self, body, row):
        curvature = np.abs(body.bend) / body.length / 60.0
        lost = 1.0 - 1.0 / (1.0 + self.amplitude * curvature**self.power)
        return 0.0, -lost * 2.2e-3 * body.bend  # N m of a tube of 2.2e-3 N m/rad


class HeatedSilicone(Effect):
    """The heated spring slowly warms all silicone around it, which gets softer.

    The amplitude [1] is the share of stress that is lost when the silicone is at 37 degC, 15 K above the room.
    """

    slug, kinds, component = "silicone_softened_by_heat", ("actuator",), "elastomer"
    drivers, ceiling = ("xi0_2", "time", "current_2"), 0.6
    wants = {"design": "pneusma2"}

    def draw(self, rng, bench):
        self.warming_s = float(rng.uniform(6.0, 25.0))

    def begin(self, shape, numbers, bench):
        self._warm = np.zeros(shape)

    def fibre(self, strain, stress, row):
        return stress * (1.0 - self.amplitude * np.clip(self._warm, 0.0, 1.2))[..., None]

    def close_load(self, body, row):
        goal = (row.drive["hot_degC"] - 22.0) / 15.0
        self._warm = self._warm + (goal - self._warm) * (1.0 - np.exp(-row.step / self.warming_s))


class SlippingCrimp(Effect):
    """A crimp that creeps while the spring pulls hard: the spring's end moves for good.

    The amplitude is the slip in 20 s under 1 N more than the crimp holds [mm].
    """

    slug, kinds, component = "slipping_crimp", ("actuator",), "spring_2"
    drivers, ceiling = ("force", "time", "xi0_2"), 8.0
    wants = {"springs": True}

    def draw(self, rng, bench):
        self.holds_N = float(rng.uniform(0.15, 0.35))

    def begin(self, shape, numbers, bench):
        self._slip, self._free = np.zeros(shape), numbers["free_length_mm"]

    def opening(self, strain, row, which):
        return strain - self._slip / self._free if which == 2 else strain

    def solved(self, strain, force, row, which):
        if which == 2:
            over = np.maximum(force - self.holds_N, 0.0)
            self._slip = self._slip + self.amplitude * over * row.step / 20.0


class WrapEngages(Effect):
    """The fibre wrap was wound loosely: it lets the tube give until it engages at a pressure.

    The amplitude, times 0.4 N, is the axial load that the engaged wrap adds.
    """

    slug, kinds, component = "wrap_engagement", ("tube",), "pressure"
    drivers, ceiling = ("pressure",), 0.5

    def draw(self, rng, bench):
        self.engages_kPa = float(rng.uniform(9.0, 18.0))
        self.over_kPa = float(rng.uniform(1.0, 3.0))

    def load(self, body, row):
        tight = 1.0 / (1.0 + np.exp(-(body.pressure / 1e3 - self.engages_kPa) / self.over_kPa))
        return self.amplitude * 0.4 * (tight - 1.0 / (1.0 + np.exp(self.engages_kPa / self.over_kPa))), 0.0


class Ageing(Effect):
    """Silicone that still cures: its stiffness grows with time, with or without load.

    The amplitude [1] is the final increase of stress, as part of the stress of the first row.
    """

    slug, kinds, component = "curing_on_the_stand", ("elastomer", "tube"), "elastomer"
    drivers, ceiling = ("time",), 1.0

    def draw(self, rng, bench):
        self.half_s = float(rng.uniform(100.0, 500.0))

    def fibre(self, strain, stress, row):
        cured = row.time / (row.time + self.half_s)
        return stress * (1.0 + self.amplitude[..., None] * cured[:, None])


class Ripple(Effect):
    """A moulded rib that buckles in and out: stress ripples with strain. The amplitude is in Pa."""

    slug, kinds, component = "ribbed_coupon", ("elastomer",), "elastomer"
    drivers, ceiling = ("strain",), 12e3

    def draw(self, rng, bench):
        self.period = float(rng.uniform(0.08, 0.2))

    def fibre(self, strain, stress, row):
        grown = np.tanh(np.maximum(strain, 0.0) / 0.1)
        return stress + self.amplitude[..., None] * grown * np.sin(2.0 * np.pi * strain / self.period)


class TangledCoils(Effect):
    """Two coils catch each other at one length and let go at another: a hump of force, of amplitude in N."""

    slug, kinds, component = "tangled_coils", ("spring",), "spring"
    drivers, ceiling = ("strain",), 0.5

    def draw(self, rng, bench):
        reach = float(np.max(bench.stack("elongation_mm")))
        self.at_mm = float(rng.uniform(0.35, 0.6)) * reach
        self.width_mm = float(rng.uniform(2.0, 5.0))

    def begin(self, shape, numbers, bench):
        self._free = numbers["free_length_mm"]

    def pull(self, strain, force, row, which):
        away = (strain * self._free - self.at_mm) / self.width_mm
        return force + self.amplitude * np.exp(-(away**2)) * (1.0 - 0.4 * np.tanh(away))


class CurrentAttracts(Effect):
    """Neighbouring turns attract each other with the square of the current.

    The amplitude is the force at the largest current and no strain [N].
    """

    slug, kinds, component = "current_attraction", ("spring",), "spring"
    drivers, ceiling = ("current", "xi0"), 0.6

    def draw(self, rng, bench):
        bench.extra = ("temperature_degC", "current_A")

    def begin(self, shape, numbers, bench):
        self._most = max(float(np.max(bench.stack("current_A"))), 1e-3)

    def pull(self, strain, force, row, which):
        return force + self.amplitude * (row.drive["current_A"] / self._most) ** 2 / (1.0 + 0.5 * np.abs(strain))


class HotAgeing(Effect):
    """Time spent hot precipitates nickel and moves the transformation temperature for good.

    The amplitude is the shift after 200 s at 20 K above the limit [K].
    """

    slug, kinds, component = "hot_ageing", ("wire",), "spring"
    drivers, ceiling = ("time", "temperature"), 12.0

    def draw(self, rng, bench):
        self.above_degC = float(rng.uniform(60.0, 75.0))

    def begin(self, shape, numbers, bench):
        self._age = np.zeros(shape)

    def warmth(self, temperature, stress, row, q):
        return temperature - self.amplitude * self._age

    def close_metal(self, strain, gamma, xi0, row, which):
        hot = np.maximum(row.drive["temperature_degC"] - self.above_degC, 0.0) / 20.0
        self._age = self._age + hot * row.step / 200.0


OUTSIDE = (FlatteningTube, HeatedSilicone, SlippingCrimp, WrapEngages, Ageing, Ripple, TangledCoils, CurrentAttracts,
           HotAgeing)  # fmt: skip
