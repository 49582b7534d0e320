"""Effects on the resistance: leads, temperature, detwinned variants that stay."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol.thermal import next_temperature
from ..numerics.safe import safe_divide
from ..pipeline import Effect, Known
from ._spec import Spec
from ._springs import AMBIENT, each, law_of, solved_springs, temperature_of, zeros


class SeriesResistance(Effect):
    """Leads and crimps add to the measured resistance; ohms [ohm]."""

    ohms: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "series_resistance"
    leads: ClassVar[bool] = True
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "ASW"
    sentence: ClassVar[str] = "Leads and crimps add a constant resistance to that of the wire."
    literature: ClassVar[str] = "two-wire against four-wire measurement, IEC 60751"
    specs: ClassVar[dict[str, Spec]] = {
        "ohms": Spec(0.0, 0.0, 0.8, 0.05, "ohm", "resistance of leads and crimps")
    }

    def wire_resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wire_resistance`."""
        return value - self.ohms

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.resistance`."""
        return value + self.ohms


class ResistanceTemperatureCoefficient(Effect):
    """Each phase's resistivity rises with temperature, from 22 degC; alpha_m, alpha_a [1/K].

    The temperature is the recorded one of the specimen. Without it, it is that of the wire heated by its
    recorded current. Without either, it is the one at which the reversible curve has the fraction.
    """

    alpha_m: Array = eqx.field(converter=jnp.asarray, default=0.0)
    alpha_a: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "resistance_temperature_coefficient"
    component: ClassVar[str] = "sensor"
    kinds: ClassVar[str] = "ASW"
    sentence: ClassVar[str] = "The resistivity of each phase rises with temperature, not only with the phase."
    literature: ClassVar[str] = "Novak et al., Mater. Sci. Eng. A 481 (2008) 127"
    specs: ClassVar[dict[str, Spec]] = {
        "alpha_m": Spec(0.0, 0.0, 2e-3, 4e-4, "1/K", "temperature coefficient of the martensite"),
        "alpha_a": Spec(0.0, 0.0, 2e-3, 4e-4, "1/K", "temperature coefficient of the austenite"),
    }

    def begin(self, at: Known) -> dict[int, tuple[Array, Array]]:
        """Excess temperature of every spring's wire by its current, and its fraction."""
        return each(at, lambda: (jnp.asarray(0.0), jnp.asarray(1.0)))

    def _factor(self, at: Known, memory: tuple[Array, Array], xi0: Array) -> Array:
        implied = temperature_of(law_of(at), xi0) - AMBIENT
        if "temperature" in at and "actuator" not in at:  # NaN where another recording has the only one
            excess = jnp.where(jnp.isfinite(at["temperature"]), at["temperature"] - AMBIENT, implied)
        elif "currents" in at and at["number"] in at["currents"]:
            excess = memory[0]
        else:
            excess = implied
        return 1.0 + (xi0 * self.alpha_m + (1.0 - xi0) * self.alpha_a) * excess

    def wire_resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.wire_resistance`; with the fraction of the row before."""
        last = memory[at["number"]]
        return value / self._factor(at, last, last[1])

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.resistance`."""
        return value * self._factor(at, memory[at["number"]], at["xi0"])

    def remember(self, memory: dict, at: Known) -> dict:
        """Heat every wire by its current, if that was recorded."""
        later, currents = {}, at["currents"] if "currents" in at else {}
        for number, spring, (excess, _), response in solved_springs(at, memory):
            if number in currents:
                excess = next_temperature(
                    spring.alloy, spring.geometry, excess, at["interval"], currents[number],
                    response.resistance, 0.0,
                )  # fmt: skip
            later[number] = (excess, response.xi0)
        return later


class DetwinnedResistivityMemory(Effect):
    """Martensite that stays detwinned on unloading keeps its resistivity; share [1] of gamma_R / gamma_L.

    Literature has two forms, and this is one family with both as its ends. Part of what unloading would undo
    stays, the `share` of it, as soon as unloading begins. Or all stays down to the `share` of gamma_R /
    gamma_L, and nothing of it shows above. The share of this form is `capped` [1].
    """

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)
    capped: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "detwinned_resistivity_memory"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Detwinned martensite stays detwinned on unloading, and its resistance with it."
    literature: ClassVar[str] = "D. C. Lagoudas (ed.), Shape Memory Alloys, Springer (2008)"
    specs: ClassVar[dict[str, Spec]] = {
        "share": Spec(0.0, 0.0, 1.0, 0.7, "1", "share of the residual detwinning that resistance remembers"),
        "capped": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "a part throughout (0) or all up to a cap (1)", True, natural_ends=True
        ),
    }

    def begin(self, at: Known) -> dict[int, tuple[Array]]:
        """Residual strain of every spring, for reading a measured resistance."""
        return each(at, zeros(1))

    def _retained_resistivity(self, at: Known, residual: Array) -> tuple[Array, Array]:
        """Resistivity of the martensite by the base law, and the addition by the retained fraction
        [ohm/m]."""
        alloy = at["spring"].alloy
        now, retained = alloy.xi_sm(at["gamma"]), residual / alloy.gamma_L
        part = self.share * jnp.where(retained > now, retained - now, 0.0)
        cap = jnp.maximum(self.share * retained - now, 0.0)
        more = (1.0 - self.capped) * part + self.capped * cap
        base = alloy.rho_m_of(now)
        return base, alloy.rho_m_of(now + more) - base

    def resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.resistance`."""
        alloy = at["spring"].alloy
        _, more = self._retained_resistivity(at, at["gamma_R"])
        weight = alloy.mixing_fraction(at["xi0"], at["gamma"])
        return value + weight * more * at["spring"].geometry.wire_length

    def wire_resistance(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.wire_resistance`: resistance of the same phases without a retained fraction."""
        spring = at["spring"]
        base, more = self._retained_resistivity(at, memory[at["number"]][0])
        hot, length = spring.alloy.rho_a(at["gamma"]), spring.geometry.wire_length
        weight = safe_divide(value / length - hot, base + more - hot, 1e-9)
        return value - weight * more * length

    def remember(self, memory: dict, at: Known) -> dict:
        """The residual strain after the row."""
        return {number: (response.gamma_R,) for number, _, _, response in solved_springs(at, memory)}
