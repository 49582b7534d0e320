"""The actuator: tube, springs and pressure in balance, Eqs. 3.31-3.38 with corrected signs."""

import numpy as np

from .coil import Coil, Watch
from .march import batch, columns, rows
from .roots import solve
from .section import Annulus
from .tube import Body, close_fibres, fibre_stress

SPRINGS = {"pneusma1": (2,), "pneusma2": (1, 2), "pneuflex_s": ()}


class Frame:
    """Dimensions, section and springs of one campaign with one set of constants."""

    def __init__(self, bench, q, shape, effects=(), **quadrature):
        self.bench, self.q, self.effects = bench, q, effects
        bore = next((e.bore() for e in effects if hasattr(e, "bore")), (0.0, 0.0))
        self.section = Annulus(q, bore=bore, **quadrature)
        self.rest = 1e-3 * q["length_mm"]
        self.attached = q.get("attached_length_mm", q["length_mm"])
        self.which = SPRINGS[bench.geometry["design"]]
        prestrain = bench.geometry.get("prestrain", 0.1924)
        self.coils = {k: Coil(q, shape, prestrain, effects, k) for k in self.which}
        self.fibre = bench.geometry["design"].startswith("pneuflex")
        self.scale = 1e3 * self.section.bore_area * 10.0

    def strains(self, x):
        """Side strains of the unknowns. An inextensible fibre holds side 2."""
        return (x[..., 0], 0.0 * x[..., 0]) if self.fibre else (x[..., 0], x[..., 1])

    def spring_strain(self, which, side):
        """Strain of spring `which` at a side strain."""
        free = self.q["free_length_mm"]
        return (self.attached + self.q["length_mm"] * side - free) / free

    def body(self, x, pressure):
        """Configuration at unknown side strains."""
        one, two = self.strains(x)
        bend = (one - two) * self.rest / self.section.diameter
        axial = 0.5 * (one + two)
        return Body(one=one, two=two, bend=bend, axial=axial, length=self.rest * (1.0 + axial), pressure=pressure, q=self.q,
                    bore=self.section.bore_area, wall=np.sum(self.section.area, -1), frame=self)  # fmt: skip

    def fibres(self, x):
        """Strains of the section's points (..., B, K, points)."""
        one, two = self.strains(x)
        share = self.section.height / self.section.diameter[..., None]
        return two[..., None] + share * (one - two)[..., None]

    def balance(self, x, row, xi0, ohm):
        """Residual force and moment about side 2, divided by those of 10 kPa: (..., B, K, unknowns)."""
        section, pressure = self.section, 1e3 * row.drive["pressure_kPa"]
        body = self.body(x, pressure)
        pulls = section.area * fibre_stress(self.q, self.fibres(x), row, self.effects)
        force = np.sum(pulls, -1) - pressure * section.bore_area
        moment = np.sum(pulls * section.height, -1) - pressure * section.bore_area * section.bore_height
        for k, coil in self.coils.items():
            strain = self.spring_strain(k, body.one if k == 1 else body.two)
            if k in ohm:
                fraction, gamma = coil.fraction(strain, ohm[k], row)
                pull = coil.force(strain, fraction, row, gamma)
            else:
                pull = coil.force(strain, xi0[k], row)
            force = force + pull
            moment = moment + (pull * section.diameter if k == 1 else 0.0)
        for effect in self.effects:
            extra = effect.load(body, row)
            force, moment = force + extra[0], moment + extra[1]
        moment = moment / (self.scale * 0.5 * section.diameter)
        return moment[..., None] if self.fibre else np.stack([force / self.scale, moment], -1)

    def solve(self, guess, row, xi0, ohm):
        """Unknowns in balance. The phase may depend on the stretch through a resistance near its end point.
        Then the balance has a vertical tangent that Newton cannot cross, and the fraction itself is
        bisected."""
        try:
            return solve(lambda x: self.balance(x, row, xi0, ohm), guess, rounds=40 if ohm else 60)
        except ArithmeticError:
            if list(ohm) != [2]:
                raise
        low, high, x = np.zeros(guess.shape[:-1]), np.ones(guess.shape[:-1]), guess
        for _ in range(24):
            middle = 0.5 * (low + high)
            x = solve(lambda x, known=xi0 | {2: middle}: self.balance(x, row, known, {}), x)
            strain = self.spring_strain(2, self.strains(x)[1])
            implied = self.coils[2].fraction(strain, ohm[2], row)[0]
            low, high = np.where(implied > middle, middle, low), np.where(implied > middle, high, middle)
        return x

    def close(self, x, row, xi0, ohm):
        """Commit a solved row; returns fractions and the springs' resistances."""
        body = self.body(x, 1e3 * row.drive["pressure_kPa"])
        resistances = {}
        for k, coil in self.coils.items():
            strain = self.spring_strain(k, body.one if k == 1 else body.two)
            fraction = coil.fraction(strain, ohm[k], row)[0] if k in ohm else xi0[k]
            resistances[k] = coil.ohm(strain, fraction, row)
            coil.close(strain, fraction, row)
        close_fibres(self.q, self.fibres(x), row, self.effects)
        for effect in self.effects:
            effect.close_load(body, row)
        return body, resistances


def _outputs(body):
    degrees = np.degrees(body.bend)
    return body.bend / body.length, degrees, 1e3 * body.length


def _simulate(bench, numbers, series, effects, known, quadrature, watch=None):
    """March an actuator; `known(row)` gives the springs' inputs: fractions, measured resistances."""
    q = columns(numbers)
    size = next(iter(series.values())).shape[0]
    shape = (size, len(bench.recordings))
    for effect in effects:
        effect.begin(shape, q, bench)
        series = effect.drives(bench, series)
    frame = Frame(bench, q, shape, effects, **quadrature)
    x = np.zeros(shape + (1 if frame.fibre else 2,))
    before = x
    names = ["curvature_1pm", "bend_angle_deg", "length_mm"] + [f"resistance_{k}_ohm" for k in frame.which]
    out = {name: np.empty(shape + (bench.times.shape[1],)) for name in names}
    for row in rows(bench.times, series):
        if watch:
            watch(frame.coils, row)
        xi0, ohm = known(row)
        guess = x if row.index < 2 else x + 0.9 * (x - before)
        before = x
        x = frame.solve(guess, row, xi0, ohm)
        body, resistances = frame.close(x, row, xi0, ohm)
        for name, value in zip(names[:3], _outputs(body), strict=True):
            out[name][..., row.index] = value
        for k, value in resistances.items():
            out[f"resistance_{k}_ohm"][..., row.index] = value
    return out, series


def actuator_truth(bench, numbers, effects=(), **quadrature):
    """Columns of an actuator under prescribed pressure and phase fractions."""
    size = max([np.size(v) for v in numbers.values()] + [len(e.amplitude) for e in effects])
    series = {name: batch(bench.stack(name), size) for name in bench.drives}
    written = {name: value for name, value in series.items() if not name.startswith("xi0")}

    def known(row):
        return {k: row.drive.get(f"xi0_{k}", np.ones((1, 1))) for k in (1, 2)}, {}

    out, _ = _simulate(bench, numbers, series, effects, known, quadrature)
    out = written | out
    for effect in effects:
        out = effect.record(bench, out)
    return out


def actuator_base(bench, numbers, recorded, **quadrature):
    """Prediction of the base from recorded pressure and resistances; an unmeasured spring is cold."""
    size = max(np.size(v) for v in numbers.values())
    names = [n for n in ("pressure_kPa", "resistance_1_ohm", "resistance_2_ohm") if n in bench.measured]
    series = {name: batch(recorded[name], size) for name in names}

    def known(row):
        ohm = {k: row.drive[f"resistance_{k}_ohm"] for k in (1, 2) if f"resistance_{k}_ohm" in row.drive}
        return {k: np.ones((1, 1)) for k in (1, 2)}, ohm

    return _simulate(bench, numbers, series, (), known, quadrature)[0]


def actuator_forward(bench, numbers, recorded, course, watched=False):
    """Prediction of the base from recorded pressure and fractions (B, K, N) of the measured spring, the other
    being cold. Second, the row sources of a `Watch`."""
    series = {"pressure_kPa": batch(recorded["pressure_kPa"], len(course)), "xi0_2": course}
    watch = Watch(2, bench.times.shape)

    def known(row):
        return {1: np.ones((1, 1)), 2: row.drive["xi0_2"]}, {}

    out, _ = _simulate(bench, numbers, series, (), known, {}, watch if watched else None)
    return out, watch.source
