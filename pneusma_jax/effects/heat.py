"""Effects of heat that the base model neglects: in the other spring, or not in all of the wire."""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol import Alloy, SpringState
from ..nitinol.thermal import next_temperature
from ..numerics.safe import unit_power
from ..pipeline import Effect, Known
from ._spec import Spec
from ._springs import AMBIENT, FARTHEST, arrived, each, solved_springs, zeros

LEAST_SLOPE = 0.02  # Minimum slope of the colder zone's stress over strain, relative to the modulus
ALL_AUSTENITE = 3.0  # Distance above T_mid at which 95 %, nearly all, is austenite, in widths of the curve
HOTTEST = 1e-5  # Minimum fraction of the rest of the wire; below it the colder zone gets no hotter


class OpposingSpringHeating(Effect):
    """Heat of the driven spring reaches those taken to be cold, through two lags; gain [1], tau_1, tau_2 [s].

    A spring whose fraction is exactly 1 was not measured. Heat that lasts, and makes the driven spring all
    austenite, takes the share `gain` of its martensite. Literature has two forms of the heat and two of the
    answer to it. Each pair is one family, whose ends are both forms.

    The heat is the driven spring's austenite, to a `power` [1], which is measured. It ends where all is
    austenite. Or it is the temperature rise of the wire by its recorded current, which goes on. Its assumed
    convection is part of `gain`. The share of this form is `by_current` [1]; it is 0 without a current.

    The answer is in proportion, down to no martensite. Or it follows the reversible curve from the air's
    temperature on: hardly anything happens before the transformation, and nothing after it. The share of this
    form is `along_curve` [1].
    """

    gain: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tau_1: Array = eqx.field(converter=jnp.asarray, default=20.0)
    tau_2: Array = eqx.field(converter=jnp.asarray, default=4.0)
    power: Array = eqx.field(converter=jnp.asarray, default=1.0)
    by_current: Array = eqx.field(converter=jnp.asarray, default=0.0)
    along_curve: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "opposing_spring_heating"
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "Heat of the driven spring warms the opposite one, which was taken to be cold."
    literature: ClassVar[str] = "the source, Section 3.7.5: incidental heating of the opposing spring"
    specs: ClassVar[dict[str, Spec]] = {
        "gain": Spec(0.0, 0.0, 0.98, 0.15, "1", "share of its martensite that lasting full heat takes"),
        "tau_1": Spec(20.0, 3.0, 200.0, 20.0, "s", "time constant of the slower lag", True),
        "tau_2": Spec(4.0, 0.0, 60.0, 4.0, "s", "time constant of the faster lag", True),
        "power": Spec(1.0, 0.3, 3.0, 1.0, "1", "exponent of the austenite that stands for heat", True),
        "by_current": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "heat by austenite (0) or by current (1)", True, natural_ends=True
        ),
        "along_curve": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "answer in proportion (0) or along the reversible curve (1)", True,
            natural_ends=True,
        ),
    }  # fmt: skip

    def begin(self, at: Known) -> dict[int, tuple[Array, Array, Array]]:
        """Zero heat of each spring after the first lag and after both, and the rise of its temperature."""
        return each(at, zeros(3))

    def _left(self, arriving: Array, at: Known) -> Array:
        """Share of a spring's martensite that heat leaves [1]; 1 where none arrives."""
        alloy = at["spring"].alloy
        cold = jnp.clip((_ambient(at) - alloy.T_mid) / alloy.T_width, -FARTHEST, FARTHEST)
        odds = jnp.exp(cold)  # of austenite, before any heat
        rise = jnp.log1p(self.gain / odds) - jnp.log1p(-self.gain)  # of lasting full heat, in widths
        along = (1.0 + odds) * jax.nn.sigmoid(-cold - rise * arriving)
        in_proportion = jnp.maximum(1.0 - self.gain * arriving, 0.0)
        return (1.0 - self.along_curve) * in_proportion + self.along_curve * along

    def _heat(self, spring: Any, number: int, xi0: Array, excess: Array, at: Known) -> Array:
        """Heat of a spring, 1 where it is all austenite [1]. Another recording may have the only current."""
        by_austenite = unit_power(1.0 - xi0, self.power)
        full = spring.alloy.T_mid + ALL_AUSTENITE * spring.alloy.T_width - _ambient(at)
        by_current = excess / jnp.maximum(full, spring.alloy.T_width)
        share = self.by_current * (at["has_currents"][number] if "has_currents" in at else 1.0)
        return (1.0 - share) * by_austenite + share * by_current

    def phase(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.phase`."""
        arriving = sum((last[1] for n, last in memory.items() if n != at["number"]), jnp.zeros(()))
        return jnp.where(value >= 1.0, value * self._left(arriving, at), value)

    def remember(self, memory: dict, at: Known) -> dict:
        """Advance the temperature of every wire and both lags by the row's interval."""
        later, currents = {}, at["currents"] if "currents" in at else {}
        shares = [arrived(at["interval"], tau) for tau in (self.tau_1, self.tau_2)]
        for number, spring, (first, second, excess), response in solved_springs(at, memory):
            if number in currents:
                excess = next_temperature(
                    spring.alloy, spring.geometry, excess, at["interval"], currents[number],
                    response.resistance, 0.0,
                )  # fmt: skip
                heat = self._heat(spring, number, response.xi0, excess, at)
            else:
                heat = unit_power(1.0 - response.xi0, self.power)
            first = first + (heat - first) * shares[0]
            later[number] = (first, second + (first - second) * shares[1], excess)
        return later


def _ambient(at: Known) -> Array:
    """Temperature of the air around an actuator [degC]."""
    return at["temperature"] if "temperature" in at else jnp.asarray(AMBIENT)


class UnevenHeating(Effect):
    """A share of the wire is colder, in series with the rest: one force, strains and resistances add.

    `share` [1] of the wire is colder by `colder` [1] widths of the reversible curve. From about ten on it is
    entirely cold; below, it lags behind the rest a little (ends that clamps cool). Where the rest is cold, so
    is it.

    The colder zone's strain follows the common stress by one Newton step a row from its last value. Nothing
    is solved inside the equilibrium, and the error is of second order in the change from row to row.
    """

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)
    colder: Array = eqx.field(converter=jnp.asarray, default=12.0)

    slug: ClassVar[str] = "uneven_heating"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Part of the wire, near the crimps, stays colder than the rest."
    literature: ClassVar[str] = "Iadicola and Shaw, Int. J. Plast. 20 (2004) 577: fronts and cold grips"
    specs: ClassVar[dict[str, Spec]] = {
        "share": Spec(0.0, 0.0, 0.6, 0.1, "1", "share of the wire that stays colder"),
        "colder": Spec(12.0, 0.3, 16.0, 8.0, "1", "how much, in widths of the reversible curve", True),
    }

    def begin(self, at: Known) -> dict[int, "ColdZone"]:
        """Every spring unstretched, as attached, and cold."""
        springs = at["actuator"].springs if "actuator" in at else (at["spring"],)
        numbers = at["actuator"].spring_numbers if "actuator" in at else (1,)
        zones = {}
        for number, spring, state in zip(numbers, springs, at["states"], strict=True):
            cold, gamma = SpringState.fresh(state.prestrain), spring.shear_strain(jnp.zeros(()))
            residual = spring.alloy.residual_strain(cold, jnp.ones(()))
            slope = _law(spring.alloy, gamma, jnp.ones(()), residual)[1]
            zones[number] = ColdZone(gamma, jnp.ones(()), cold, slope)
        return zones

    def _fraction(self, xi0: Array) -> Array:
        """Martensite fraction of the colder zone beside that of the rest [1]."""
        warm = jnp.maximum(xi0, HOTTEST)
        return warm / (warm + (1.0 - warm) * jnp.exp(-self.colder))

    def _zone(self, alloy: Alloy, zone: "ColdZone", xi0: Array) -> tuple[Array, Array]:
        """Stress and slope of the colder zone at its strain, beside a rest of fraction xi0 [Pa]."""
        cold = self._fraction(xi0)
        stress, slope = _law(alloy, zone.strain, cold, alloy.residual_strain(zone.state, cold))
        return stress, jnp.maximum(slope, LEAST_SLOPE * alloy.G_m)

    def _zone_strain(self, alloy: Alloy, zone: "ColdZone", xi0: Array, stress: Array) -> Array:
        """Strain of the colder zone under a stress near its own [1]."""
        own, slope = self._zone(alloy, zone, xi0)
        return zone.strain + (stress - own) / slope

    def _warm_strain(self, gamma: Array, cold: Array) -> Array:
        """Strain of the rest of the wire: strains add."""
        return (gamma - self.share * cold) / (1.0 - self.share)

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        zone, alloy, xi0 = memory[at["number"]], at["spring"].alloy, at["xi0"]
        warm = alloy.shear_stress(self._warm_strain(at["gamma"], zone.strain), xi0, at["gamma_R"])
        own, slope = self._zone(alloy, zone, xi0)
        weight = jnp.maximum(zone.warm_slope, 0.0) / slope * self.share / (1.0 - self.share)
        return value + (warm + weight * own) / (1.0 + weight) - at["base_stress"]

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """Both zones in series."""
        spring, xi0 = at["spring"], at["xi0"]
        strain = self._zone_strain(spring.alloy, memory[at["number"]], xi0, at["stress"])
        law, length = spring.alloy.resistivity, spring.geometry.wire_length
        warm, cold = law(xi0, self._warm_strain(at["gamma"], strain)), law(self._fraction(xi0), strain)
        return value + ((1.0 - self.share) * warm + self.share * cold - law(xi0, at["gamma"])) * length

    def wire_resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.wire_resistance`; with the colder zone of the row before."""
        spring, zone = at["spring"], memory[at["number"]]
        cold = spring.alloy.resistivity(zone.xi0, zone.strain) * spring.geometry.wire_length
        return (value - self.share * cold) / (1.0 - self.share)

    def remember(self, memory: dict, at: Known) -> dict:
        """Both zones of every spring."""
        later = {}
        for number, spring, zone, response in solved_springs(at, memory):
            alloy = spring.alloy
            strain = self._zone_strain(alloy, zone, response.xi0, response.stress)
            warm = self._warm_strain(response.gamma, strain)
            slope = _law(alloy, warm, response.xi0, response.gamma_R)[1]
            cold = self._fraction(response.xi0)
            later[number] = ColdZone(strain, cold, alloy.remember(zone.state, strain, cold), slope)
        return later


def _law(alloy: Alloy, gamma: Array, xi0: Array, gamma_R: Array) -> tuple[Array, Array]:
    """Stress and its slope over strain [Pa]."""
    gamma = jnp.asarray(gamma, dtype=float)
    return jax.jvp(lambda g: alloy.shear_stress(g, xi0, gamma_R), (gamma,), (jnp.ones_like(gamma),))


class ColdZone(eqx.Module):
    """The colder part of a spring's wire after a row.

    Attributes:
        strain: its shear strain [1]; xi0: its martensite fraction [1].
        state: memory of the zone.
        warm_slope: slope of the rest's law over strain [Pa].
    """

    strain: Array
    xi0: Array
    state: SpringState
    warm_slope: Array
