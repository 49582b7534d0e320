"""Effects of heat that is not where the base model has it: in the other spring, or not in all of the wire."""

from typing import ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array

from .._numerics import unit_power
from ..chain import Effect, Known
from ..nitinol import Alloy
from ._spec import Spec
from ._springs import arrived, each, solved_springs, zeros

LEAST_SLOPE = 0.02  # of the cold zone's stress over strain, relative to the modulus


class OpposingSpringHeating(Effect):
    """Heat of the driven spring reaches those taken to be cold, through two lags; gain [1], tau_1, tau_2 [s].

    The driven spring's austenite, to a `power` [1], stands for its temperature rise: it is measured, where a
    temperature from the current would hang on a convection that is only assumed. A spring whose fraction is
    exactly 1, one that was not measured, loses `gain` times the lagged value of its martensite.
    """

    gain: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tau_1: Array = eqx.field(converter=jnp.asarray, default=20.0)
    tau_2: Array = eqx.field(converter=jnp.asarray, default=4.0)
    power: Array = eqx.field(converter=jnp.asarray, default=1.0)

    slug: ClassVar[str] = "opposing_spring_heating"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "Heat of the driven spring warms the opposite one, which was taken to be cold."
    literature: ClassVar[str] = "the source, Section 3.7.5: incidental heating of the opposing spring"
    specs: ClassVar[dict[str, Spec]] = {
        "gain": Spec(0.0, 0.0, 0.6, 0.15, "1", "share of the heat that arrives"),
        "tau_1": Spec(20.0, 3.0, 200.0, 20.0, "s", "time constant of the slower lag", True),
        "tau_2": Spec(4.0, 0.0, 60.0, 4.0, "s", "time constant of the faster lag", True),
        "power": Spec(1.0, 0.3, 3.0, 1.0, "1", "exponent of the austenite that stands for heat", True),
    }

    def begin(self, at: Known) -> dict[int, tuple[Array, Array]]:
        """Nothing has arrived: per spring, its heat after the first lag and after both."""
        return each(at, zeros(2))

    def phase(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.phase`."""
        arriving = sum((last[1] for n, last in memory.items() if n != at["number"]), jnp.zeros(()))
        return jnp.where(value >= 1.0, value * (1.0 - self.gain * arriving), value)

    def remember(self, memory: dict, at: Known) -> dict:
        """Advance both lags of every spring by the row's interval."""
        later = {}
        shares = [arrived(at["interval"], tau) for tau in (self.tau_1, self.tau_2)]
        for number, _, (first, second), response in solved_springs(at, memory):
            heat = unit_power(1.0 - response.xi0, self.power)
            first = first + (heat - first) * shares[0]
            later[number] = (first, second + (first - second) * shares[1])
        return later


class UnevenHeating(Effect):
    """A share of the wire stays cold, in series with the rest: one force, strains and resistances add.

    The cold zone's strain follows the common stress by one Newton step a row from where it was, with the
    slopes of the row before: nothing is solved inside the equilibrium, and the error is of second order in
    the change from row to row.
    """

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "uneven_heating"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Part of the wire, near the crimps, stays colder than the rest."
    literature: ClassVar[str] = "Iadicola and Shaw, Int. J. Plast. 20 (2004) 577: fronts and cold grips"
    specs: ClassVar[dict[str, Spec]] = {
        "share": Spec(0.0, 0.0, 0.4, 0.1, "1", "share of the wire that stays cold")
    }

    def begin(self, at: Known) -> dict[int, "ColdZone"]:
        """Every spring unstretched from how it is attached, and cold."""
        springs = at["actuator"].springs if "actuator" in at else (at["spring"],)
        numbers = at["actuator"].spring_numbers if "actuator" in at else (1,)
        zones = {}
        for number, spring, state in zip(numbers, springs, at["states"], strict=True):
            gamma = spring.shear_strain(jnp.zeros(()))
            most = jnp.asarray(state.prestrain, dtype=float)
            residual = spring.alloy.residual_strain(state, jnp.ones(()))
            zones[number] = self._zone(spring.alloy, gamma, most, gamma, jnp.ones(()), residual)
        return zones

    def _zone(
        self, alloy: Alloy, strain: Array, most: Array, warm_strain: Array, xi0: Array, gamma_R: Array
    ) -> "ColdZone":
        """Both zones' laws where they are now, for the row to come."""
        limit = alloy.residual_strain_limit(most)
        both = lambda g: alloy.shear_stress(  # noqa: E731
            g, jnp.stack([jnp.ones_like(xi0), xi0]), jnp.stack([limit, gamma_R])
        )
        at = jnp.stack([strain, warm_strain])
        stress, slopes = jax.jvp(both, (at,), (jnp.ones_like(at),))
        slope = jnp.maximum(slopes[0], LEAST_SLOPE * alloy.G_m)
        return ColdZone(strain, most, stress[0], slope, jnp.maximum(slopes[1], 0.0) / slope)

    def _warm_strain(self, gamma: Array, cold: Array) -> Array:
        """Strain of the rest of the wire: strains add."""
        return (gamma - self.share * cold) / (1.0 - self.share)

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        zone = memory[at["number"]]
        warm = at["spring"].alloy.shear_stress(
            self._warm_strain(at["gamma"], zone.strain), at["xi0"], at["gamma_R"]
        )
        weight = zone.ratio * self.share / (1.0 - self.share)
        return value + (warm + weight * zone.stress) / (1.0 + weight) - at["base_stress"]

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """Both zones in series."""
        spring = at["spring"]
        strain = memory[at["number"]].under(at["stress"])
        law, length = spring.alloy.resistivity, spring.geometry.wire_length
        warm = law(at["xi0"], self._warm_strain(at["gamma"], strain))
        more = (1.0 - self.share) * warm + self.share * spring.alloy.rho_m(strain)
        return value + (more - law(at["xi0"], at["gamma"])) * length

    def wire_resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.wire_resistance`; with the cold zone as it was."""
        spring, zone = at["spring"], memory[at["number"]]
        cold = spring.alloy.rho_m(zone.strain) * spring.geometry.wire_length
        return (value - self.share * cold) / (1.0 - self.share)

    def remember(self, memory: dict, at: Known) -> dict:
        """Both zones of every spring."""
        later = {}
        for number, spring, zone, response in solved_springs(at, memory):
            strain = zone.under(response.stress)
            most = jnp.where(strain > zone.most, strain, zone.most)
            warm = self._warm_strain(response.gamma, strain)
            later[number] = self._zone(spring.alloy, strain, most, warm, response.xi0, response.gamma_R)
        return later


class ColdZone(eqx.Module):
    """The cold part of a spring's wire after a row.

    Attributes:
        strain: its shear strain; most: its largest, which sets its residual strain [1].
        stress, slope: its law's stress there and the slope over strain [Pa].
        ratio: slope of the warm zone over that of the cold one [1].
    """

    strain: Array
    most: Array
    stress: Array
    slope: Array
    ratio: Array

    def under(self, stress: Array) -> Array:
        """Strain under a stress near its own [1]."""
        return self.strain + (stress - self.stress) / self.slope
