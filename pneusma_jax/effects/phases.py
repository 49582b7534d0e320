"""Effects of the transformation itself: its branches, a third phase, stress, sign, rate and repetition."""

from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..pipeline import Effect, Known
from ._saturation import saturation
from ._spec import Spec
from ._springs import branch, each, law_of, law_stress, solved_springs, zeros

REGIONS = 5
"""Number of regions that return over strains of their own, see `TransformationHysteresis`."""


class TransformationHysteresis(Effect):
    """A second branch: stress drops by gap_m, gap_a [Pa] after a reversal of strain, over a width [1].

    The base curve is the loading one. The gap may differ between the phases. It closes again below a strain
    `closed` [1], as the loop of an unstrained wire has no height. Regions of the metal return one after the
    other: equal parts do so over widths of up to `exp(spread)` times less and more, evenly in their
    logarithm. Where temperature drives, the heating curve
    lies `gap_T` [K] above the cooling one and is `1 + sharper` times as steep. It is reached over `gap_T` and
    `width_T` more. Which of them has the base curve's middle says `between` [1]: 0 the cooling one, 1 the
    heating one. Between 0 and 1 it is a place between them.
    """

    gap_m: Array = eqx.field(converter=jnp.asarray, default=0.0)
    gap_a: Array = eqx.field(converter=jnp.asarray, default=0.0)
    gap_T: Array = eqx.field(converter=jnp.asarray, default=0.0)
    sharper: Array = eqx.field(converter=jnp.asarray, default=0.0)
    width: Array = eqx.field(converter=jnp.asarray, default=0.02)
    closed: Array = eqx.field(converter=jnp.asarray, default=0.02)
    width_T: Array = eqx.field(converter=jnp.asarray, default=3.0)
    between: Array = eqx.field(converter=jnp.asarray, default=0.0)
    spread: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "transformation_hysteresis"
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "ASW"
    sentence: ClassVar[str] = "The nitinol returns along a lower branch than it was loaded on."
    sentences: ClassVar[Mapping[str, str]] = {
        "W": "The nitinol returns along another branch than it came on, by heat or by load."
    }
    literature: ClassVar[str] = (
        "Liang and Rogers, J. Intell. Mater. Syst. Struct. 1 (1990) 207; W. D. Iwan, J. Appl. Mech. 33 (1966)"
        " 893: elements in parallel"
    )
    specs: ClassVar[dict[str, Spec]] = {
        "gap_m": Spec(0.0, 0.0, 500e6, 15e6, "Pa", "stress gap of the martensite"),
        "gap_a": Spec(0.0, 0.0, 500e6, 30e6, "Pa", "stress gap of the austenite"),
        "gap_T": Spec(0.0, 0.0, 50.0, 15.0, "K", "gap between heating and cooling", kinds="W"),
        "sharper": Spec(0.0, -0.7, 3.0, 0.5, "1", "steepness of heating over cooling, less one", kinds="W"),
        "width": Spec(0.02, 0.003, 0.06, 0.02, "1", "strain over which the stress gap opens", True),
        "closed": Spec(0.02, 1e-4, 0.08, 0.02, "1", "strain below which the gap closes again", True),
        "width_T": Spec(3.0, 0.5, 30.0, 3.0, "K", "temperature past the gap over which they join", True, "W"),
        "between": Spec(
            0.0, 0.0, 1.0, 0.5, "1", "place of the base curve, 0 cooling, 1 heating", True, "W", True
        ),
        "spread": Spec(0.0, 0.0, 2.2, 0.5, "1", "spread of the widths in which regions return", True),
    }
    # shear in a coil; along a superelastic wire the branches are 150 to 400 MPa apart (Duerig, Melton,
    # Stoeckel and Wayman, Engineering Aspects of Shape Memory Alloys, 1990)
    within: ClassVar[dict[str, dict[str, dict[str, float]]]] = {
        kind: {name: {"high": 80e6} for name in ("gap_m", "gap_a")} for kind in "AS"
    }

    def begin(self, at: Known) -> dict[int, tuple]:
        """Flag of a previous row, its strain and branch, then its temperature and branch, for every
        spring."""
        warm = cooling = jnp.asarray(0.0)
        if "temperature" in at and "actuator" not in at:
            warm = at["temperature"]
            # a specimen that starts cold has cooled, one that starts hot has been heated
            cooling = law_of(at).martensite_fraction_at(warm)
        still = jnp.asarray(0.0), jnp.asarray(0.0), jnp.zeros(REGIONS)
        return {number: (*last, warm, cooling) for number, last in each(at, lambda: still).items()}

    def _returned(self, gamma: Array, last: tuple) -> Array:
        """Share of every region's way to the lower branch [1], shape (regions,)."""
        widths = self.width * jnp.exp(self.spread * jnp.linspace(-1.0, 1.0, REGIONS))
        return branch(gamma, last[:3], widths)

    def _cooling(self, temperature: Array, last: tuple) -> Array:
        """1 on the cooling branch, 0 on the heating one."""
        return branch(temperature, (1.0, last[3], last[4]), self.gap_T + self.width_T)

    def temperature(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.temperature`."""
        mid = law_of(at).T_mid
        cooled = value + self.between * self.gap_T  # where the base curve is as the cooling one at `value`
        below = self.gap_T - self.sharper * (cooled - self.gap_T - mid)
        return cooled - below * (1.0 - self._cooling(value, memory[at["number"]]))

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        gap = at["xi0"] * self.gap_m + (1.0 - at["xi0"]) * self.gap_a
        height = jnp.clip(jnp.abs(at["gamma"]) / self.closed, 0.0, 1.0)
        return value - gap * height * jnp.mean(self._returned(at["gamma"], memory[at["number"]]))

    def remember(self, memory: dict, at: Known) -> dict:
        """Strain, temperature and branches of every spring."""
        later = {}
        for number, _, last, response in solved_springs(at, memory):
            thermal = last[3:]
            if "temperature" in at and "actuator" not in at:
                thermal = at["temperature"], self._cooling(at["temperature"], last)
            gamma = response.gamma
            later[number] = (jnp.asarray(1.0), gamma, self._returned(gamma, last), *thermal)
        return later


class RPhase(Effect):
    """A third phase on cooling only: strain [1], resistivity [1] (relative); onset [K] above the middle.

    Its share is that of the material that is not yet martensite. It is the reversible curve over temperature,
    moved up by the onset, and `narrow` [1] times as steep. It shears by `strain`, fully from 0.5 % of strain
    on.
    """

    strain: Array = eqx.field(converter=jnp.asarray, default=0.0)
    resistivity: Array = eqx.field(converter=jnp.asarray, default=0.0)
    onset: Array = eqx.field(converter=jnp.asarray, default=8.0)
    narrow: Array = eqx.field(converter=jnp.asarray, default=1.0)

    slug: ClassVar[str] = "r_phase"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SW"
    sentence: ClassVar[str] = "Cooled, the nitinol passes through the R-phase, soft and of high resistance."
    literature: ClassVar[str] = "Otsuka and Ren, Prog. Mater. Sci. 50 (2005) 511, section 4"
    specs: ClassVar[dict[str, Spec]] = {
        "strain": Spec(0.0, 0.0, 0.012, 0.006, "1", "transformation strain of the R-phase"),
        "resistivity": Spec(0.0, 0.0, 0.3, 0.08, "1", "resistivity over that of the mixture", kinds="S"),
        "onset": Spec(8.0, 2.0, 25.0, 8.0, "K", "temperature above the middle of the transformation", True),
        "narrow": Spec(1.0, 0.5, 6.0, 1.5, "1", "steepness over that of the transformation", True),
    }

    def begin(self, at: Known) -> dict[int, tuple]:
        """Fraction of every spring, and 1 while it cools; a recording that starts cold has cooled."""
        return each(at, zeros(3))

    def _share(self, at: Known, last: tuple) -> Array:
        law, xi0 = law_of(at), at["xi0"]
        least = jnp.finfo(jnp.result_type(xi0)).tiny ** 0.5
        inside = (xi0 > least) & (xi0 < 1.0)
        x = jnp.where(inside, xi0, 0.5)
        above = jnp.log(x / (1.0 - x)) + self.onset / law.T_width
        formed = jnp.where(inside, jax.nn.sigmoid(self.narrow * above), xi0 >= 1.0)
        # play over 2 % of the fraction: cooling raises it
        cooling = 1.0 - branch(xi0, last, 0.02)
        return cooling * (1.0 - xi0) * formed

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        strain = self.strain * self._share(at, memory[at["number"]]) * jnp.tanh(at["gamma"] / 5e-3)
        return value - law_of(at).modulus(at["xi0"]) * strain

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.resistance`."""
        return value * (1.0 + self.resistivity * self._share(at, memory[at["number"]]))

    def remember(self, memory: dict, at: Known) -> dict:
        """Fraction and direction."""
        return {
            number: (jnp.asarray(1.0), response.xi0, branch(response.xi0, last, 0.02))
            for number, _, last, response in solved_springs(at, memory)
        }


class StressShiftedTransformation(Effect):
    """Stress raises the transformation's temperature; shift [K/Pa], one over Clausius and Clapeyron's slope.

    Where temperature drives a wire, the effect shifts the fraction. Where the fraction comes from resistance,
    it shifts the load-bearing one against the one that was read without load.
    """

    shift: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "stress_shifted_transformation"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SW"
    sentence: ClassVar[str] = "Stress raises the temperatures at which the nitinol transforms."
    literature: ClassVar[str] = "Liang and Rogers, J. Intell. Mater. Syst. Struct. 1 (1990) 207"
    specs: ClassVar[dict[str, Spec]] = {
        "shift": Spec(0.0, 0.0, 3e-7, 1.2e-7, "K/Pa", "shift of the transformation per stress")
    }

    def begin(self, at: Known) -> Array:
        """Stress of the row before, for a wire whose strain is prescribed."""
        return jnp.asarray(0.0)

    def temperature(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.temperature`."""
        return value - self.shift * (at["stress"] if "stress" in at else memory)

    def stress(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.stress`; the fraction of a wire driven by temperature has been shifted already."""
        if "wire" in at:
            return value
        alloy, xi0 = at["spring"].alloy, at["xi0"]
        odds = jnp.exp(jnp.clip(self.shift * value / alloy.T_width, -30.0, 30.0))
        shifted = xi0 * odds / (1.0 - xi0 + odds * xi0)
        return value + alloy.shear_stress(at["gamma"], shifted, at["gamma_R"]) - at["base_stress"]

    def remember(self, memory: Array, at: Known) -> Array:
        """The stress."""
        return at["solved"].stress


class TensionCompressionAsymmetry(Effect):
    """The spring or wire is stiffer, or softer, when pushed; excess [1] of the compressive stress."""

    excess: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "tension_compression_asymmetry"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SW"
    sentence: ClassVar[str] = "Pushed, the nitinol answers with another stress than pulled."
    literature: ClassVar[str] = "Gall et al., Acta Mater. 47 (1999) 1203"
    specs: ClassVar[dict[str, Spec]] = {
        "excess": Spec(0.0, -0.5, 1.0, 0.3, "1", "compressive over tensile stress, less one")
    }

    def stress(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.stress`."""
        return value + self.excess * jnp.where(at["gamma"] < 0.0, jnp.minimum(value, 0.0), 0.0)


class SelfHeatingRate(Effect):
    """Latent heat warms a wire that is strained fast: `rise` [1] of stress per strain gained in `tau` [s].

    The wire's recent strain, its high-passed strain, counts over 0.05. `heat` [Pa] is the gain of stress, in
    the same way, per fraction that the strain transformed recently: warm metal needs more. A wire that is
    heated and cooled from outside stays `warmth` [K] per fraction gained recently behind its thermometer.
    """

    rise: Array = eqx.field(converter=jnp.asarray, default=0.0)
    heat: Array = eqx.field(converter=jnp.asarray, default=0.0)
    warmth: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tau: Array = eqx.field(converter=jnp.asarray, default=5.0)

    slug: ClassVar[str] = "self_heating_rate"
    by_rate: ClassVar[bool] = True
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SW"
    sentence: ClassVar[str] = "Strained fast, the nitinol warms by its latent heat and its plateau rises."
    sentences: ClassVar[Mapping[str, str]] = {
        "W": "Transforming fast, the nitinol is warmer or colder than measured, by its latent heat."
    }
    literature: ClassVar[str] = "Shaw and Kyriakides, J. Mech. Phys. Solids 43 (1995) 1243"
    specs: ClassVar[dict[str, Spec]] = {
        "rise": Spec(0.0, 0.0, 0.6, 0.1, "1", "rise of the stress per recent strain of 0.05"),
        "heat": Spec(0.0, 0.0, 400e6, 30e6, "Pa", "stress gained per fraction transformed lately", kinds="S"),
        "warmth": Spec(0.0, 0.0, 150.0, 20.0, "K", "warmth per fraction transformed lately", kinds="W"),
        "tau": Spec(5.0, 0.3, 120.0, 5.0, "s", "time in which the heat is lost", True),
    }

    def begin(self, at: Known) -> dict[int, tuple]:
        """Flag of a previous row, and its strain and recent gain, for every spring. Then strain and gain of
        the fraction that strain transformed, and those of the fraction that heat transformed."""
        return each(at, zeros(7))

    @staticmethod
    def _transformed(at: Known, gamma: Array, xi0: Array) -> Array:
        """Fraction that the strain detwinned or transformed; 0 of a wire whose stress is prescribed."""
        if "spring" not in at:
            return jnp.zeros_like(gamma)
        alloy = law_of(at)
        return xi0 * alloy.xi_sm(gamma) + (1.0 - xi0) * alloy.xi_sa(gamma)

    def _high_passed(self, at: Known, now: Array, started: Array, before: Array, gained: Array) -> Array:
        """High-passed signal, exact for one that is linear over the row."""
        ratio = at["interval"] / self.tau
        flat = ratio < 1e-8
        fresh = jnp.where(flat, 1.0, -jnp.expm1(-ratio) / jnp.where(flat, 1.0, ratio))
        return jnp.exp(-ratio) * gained + fresh * started * (now - before)

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        started, *last = memory[at["number"]]
        strained = self._high_passed(at, at["gamma"], started, *last[:2])
        done = self._high_passed(at, self._transformed(at, at["gamma"], at["xi0"]), started, *last[2:4])
        return value * (1.0 + self.rise * strained / 0.05) + self.heat * done

    def remember(self, memory: dict, at: Known) -> dict:
        """Strain and fraction, and the recent gain of both."""
        later = {}
        for number, _, (started, *last), response in solved_springs(at, memory):
            done = self._transformed(at, response.gamma, response.xi0)
            later[number] = (
                jnp.asarray(1.0),
                response.gamma,
                self._high_passed(at, response.gamma, started, *last[:2]),
                done,
                self._high_passed(at, done, started, *last[2:4]),
                response.xi0,
                self._high_passed(at, response.xi0, started, *last[4:]),
            )
        return later

    def temperature(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.temperature`, by the gain up to the row before."""
        lately = jnp.exp(-at["interval"] / self.tau) * memory[at["number"]][6]
        return value + self.warmth * lately


class CyclicShakedown(Effect):
    """Irreversible strain that grows with cycles, `settled(N / cycles, slowness)` times `strain` [1].

    It saturates exponentially where `slowness` [1] is 0, and ever more slowly where it is larger. It is added
    to the residual strain after the base rule. Further parts are fractions of the strain. `plastic` [1]
    enters neither law nor resistivity, so that both see less strain. `shift` [1] unloads in every state. The
    resistivity alone does not see `apparent` [1]. `resistivity` [1] is the gain of the resistance.

    N counts the elongation's path over twice the largest stretch of the test (a spring or wire whose length
    is prescribed). Otherwise it counts the fraction's path over two: heat cycles.
    """

    strain: Array = eqx.field(converter=jnp.asarray, default=0.0)
    plastic: Array = eqx.field(converter=jnp.asarray, default=0.0)
    shift: Array = eqx.field(converter=jnp.asarray, default=0.0)
    apparent: Array = eqx.field(converter=jnp.asarray, default=0.0)
    resistivity: Array = eqx.field(converter=jnp.asarray, default=0.0)
    cycles: Array = eqx.field(converter=jnp.asarray, default=3.0)
    slowness: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "cyclic_shakedown"
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "ASW"
    sentence: ClassVar[str] = "Every cycle leaves a little strain in the nitinol, until it has shaken down."
    lookalike: ClassVar[str] = "an attachment that slips a little every time"
    literature: ClassVar[str] = "Lagoudas and Entchev, Mech. Mater. 36 (2004) 865"
    specs: ClassVar[dict[str, Spec]] = {
        "strain": Spec(0.0, 0.0, 0.03, 8e-3, "1", "residual strain after many cycles"),
        "plastic": Spec(0.0, 0.0, 0.03, 4e-3, "1", "strain after many cycles that neither law feels"),
        "shift": Spec(0.0, 0.0, 0.03, 4e-3, "1", "strain after many cycles that unloads in every state"),
        "apparent": Spec(0.0, 0.0, 0.03, 4e-3, "1", "strain that the resistivity does not see", kinds="AS"),
        "resistivity": Spec(0.0, -0.05, 0.05, 0.01, "1", "relative change of the resistance", kinds="AS"),
        "cycles": Spec(3.0, 0.3, 50.0, 3.0, "1", "cycles in which two thirds or half of it come", True),
        "slowness": Spec(0.0, 0.0, 3.0, 0.5, "1", "lateness of the rest; 0 exponential, 1 hyperbolic", True),
    }

    def begin(self, at: Known) -> dict[int, tuple]:
        """Flag of a previous row, its position, and the number of cycles so far."""
        return each(at, zeros(3))

    def _progress(self, at: Known, memory: dict) -> Array:
        return saturation(memory[at["number"]][2] / self.cycles, self.slowness)

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        modulus, progress = law_of(at).modulus(at["xi0"]), self._progress(at, memory)
        change = law_stress(at, at["gamma"] - self.plastic * progress) - at["base_stress"]
        # where detwinning reduces the stress by more than the residual strain does, only the excess counts
        spare = modulus * (at["gamma"] - at["gamma_R"]) - at["base_stress"]
        spare = jnp.where(spare > 1e-9 * modulus, spare, 0.0)  # zero but for rounding on the elastic branch
        extra = modulus * self.strain * progress - spare
        extra = jnp.where(extra >= 0.0, extra, 0.0)  # at a tie, where absent, in full
        return value + change - extra - modulus * self.shift * progress

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.resistance`."""
        progress = self._progress(at, memory)
        if "spring" in at:
            law, length = law_of(at).resistivity, at["spring"].geometry.wire_length
            effective = at["gamma"] - (self.plastic + self.apparent) * progress
            value = value + length * (law(at["xi0"], effective) - law(at["xi0"], at["gamma"]))
        return value * (1.0 + self.resistivity * progress)

    def remember(self, memory: dict, at: Known) -> dict:
        """Number of cycles after the row."""
        later = {}
        for number, _, (started, before, count), response in solved_springs(at, memory):
            position, whole = response.xi0, 2.0
            if "elongation" in at or "strain" in at:
                position = at["elongation"] if "elongation" in at else at["strain"]
                whole = 2.0 * jnp.maximum(at["span"], 1e-9)
            path = jnp.abs(position - before) / whole
            later[number] = (jnp.asarray(1.0), position, count + started * path)
        return later
