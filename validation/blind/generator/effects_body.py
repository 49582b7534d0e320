"""Effects around the actuator: contact, weight, an uneven wall, the heat of the other spring."""

import numpy as np
from scipy.linalg import expm

from .march import Effect
from .protocols import fraction_at

ONLY = ("actuator",)
GRAVITY = 9.81


class HertzContact(Effect):
    """The tip meets the base past a bend angle: Hertz's power of the approach."""

    slug, kinds, component = "tip_contact", ONLY, "contact"
    drivers, ceiling = ("curvature", "xi0_2", "pressure"), 0.1
    maskable = ("actuator",)

    def prepare(self, rng, bench, clean):
        bend = clean["bend_angle_deg"]
        fitted = float(np.max(bend[bench.fitted()]))
        highest = float(np.max(bend))
        masked = highest > 1.15 * fitted
        self.stop_deg = rng.uniform(0.9, 0.97) * fitted if masked else rng.uniform(0.55, 0.85) * fitted
        if rng.random() < 0.5:
            bench.geometry["tip_to_base_clearance_deg"] = float(np.round(self.stop_deg + rng.normal(0, 3.0), 0))

    def load(self, body, row):
        depth = np.maximum(body.bend - np.radians(self.stop_deg), 0.0)
        return 0.0, self.amplitude * depth**1.5


class WeightOfRod(Effect):
    """Weight of the actuator as a rod cut in pieces, with a mass at the tip; vertical stands."""

    slug, kinds, component = "gravity", ONLY, "environment"
    drivers, ceiling = ("curvature", "pressure"), 4.0

    def draw(self, rng, bench):
        self.rod_g, self.tip_g = float(rng.uniform(1.0, 3.0)), float(rng.uniform(0.0, 2.0))
        pieces = 40
        self._place = (np.arange(pieces) + 0.5) / pieces
        above = self.tip_g + self.rod_g * (1.0 - self._place)
        self._sign = 1.0 if bench.geometry["orientation"] == "vertical_base_down" else -1.0
        self._weight = self._sign * 1e-3 * GRAVITY * above / pieces

    def load(self, body, row):
        angle = body.bend[..., None] * self._place
        along = np.sum(self._weight * np.cos(angle), axis=-1)
        turn = -body.length * np.sum(self._weight * self._place * np.sin(angle), axis=-1)
        radius = 0.5e-3 * body.q["outer_diameter_mm"]
        return self.amplitude * along, self.amplitude * (turn + radius * along)


class ShiftedBore(Effect):
    """A bore that is off centre and out of round."""

    slug, kinds, component = "wall_eccentricity", ONLY, "geometry"
    drivers, ceiling = ("pressure",), 0.35

    def draw(self, rng, bench):
        self.side = float(rng.choice([-1.0, 1.0]))
        self.out_of_round = float(rng.uniform(-0.06, 0.06))

    def bore(self):
        """Shift of the bore in walls, and its flattening."""
        return self.side * self.amplitude, self.out_of_round * self.amplitude


class WrongCamera(Effect):
    """A camera that sees curvature wrong: scale, offset and a lens that stretches towards the rim."""

    slug, kinds, component = "camera_calibration", ONLY, "sensor"
    drivers, ceiling = ("curvature",), 3.0

    def draw(self, rng, bench):
        self.scale = float(rng.choice([-1, 1]) * rng.uniform(0.02, 0.05))
        self.offset_deg = float(rng.normal(0.0, 1.5))
        self.lens = float(rng.uniform(0.0, 0.3))

    def record(self, bench, series):
        out = dict(series)
        for name, length in (("curvature_1pm", 0.056), ("bend_angle_deg", 1.0)):
            value = series[name]
            offset = np.radians(self.offset_deg) / length if name == "curvature_1pm" else self.offset_deg
            rim = 1.0 + self.lens * (value / np.max(np.abs(value))) ** 2
            out[name] = value + self.amplitude[..., None] * (self.scale * value * rim + offset)
        return out


class HeatThroughTheTube(Effect):
    """Heat of the heated spring diffuses across the tube, with losses, to the spring that was assumed
    cold."""

    slug, kinds, component = "opposing_spring_heating", ONLY, "spring_1"
    drivers, ceiling = ("xi0_2", "time", "current_2"), 0.9
    maskable = ("actuator",)
    wants = {"design": "pneusma2"}

    def draw(self, rng, bench):
        self.crossing_s = float(10 ** rng.uniform(0.9, 1.8))
        self.loss_per_s = float(0.4 / self.crossing_s)

    def drives(self, bench, series):
        pieces = 14
        rate = pieces**2 / self.crossing_s
        matrix = rate * (np.eye(pieces, k=1) + np.eye(pieces, k=-1) - 2.0 * np.eye(pieces))
        matrix[-1, -1] = -rate
        matrix -= self.loss_per_s * np.eye(pieces)
        step = bench.times[0, 1] - bench.times[0, 0]
        forward = expm(matrix * step)
        push = np.linalg.solve(matrix, (forward - np.eye(pieces)) @ np.eye(pieces)[0] * rate)
        hot = series["hot_degC"] - 22.0
        now = np.zeros(hot.shape[:2] + (pieces,))
        rise = np.zeros(hot.shape)
        for n in range(1, hot.shape[-1]):
            now = now @ forward.T + hot[..., n - 1, None] * push
            rise[..., n] = now[..., -1]
        middle, width = bench.nominal["T_mid"], bench.nominal["T_width"]
        return series | {"xi0_1": fraction_at(22.0 + self.amplitude[..., None] * rise, middle, width, 22.0)}


EFFECTS = (HertzContact, WeightOfRod, ShiftedBore, WrongCamera, HeatThroughTheTube)
