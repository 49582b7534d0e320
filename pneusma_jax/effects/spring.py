"""Effects inside a spring: geometry of its turns, its ends, hysteresis, contact of its coils."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..chain import Effect, Known
from ..nitinol.geometry import coil_angle
from ._spec import Spec


class PrestrainError(Effect):
    """The spring's rest length differs from the nominal one; shift [m], longer spring positive."""

    shift: Array = eqx.field(converter=jnp.asarray, default=0.0)
    number: int = eqx.field(static=True, default=2)

    slug: ClassVar[str] = "prestrain_error"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "The spring was attached with another rest length than stated."
    specs: ClassVar[dict[str, Spec]] = {"shift": Spec(0.0, -2e-3, 2e-3, 5e-4, "m", "error of the rest length")}

    def elongation(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.elongation`."""
        return value - self.shift if at["number"] == self.number else value


class InactiveCoils(Effect):
    """Turns that carry current but do not stretch, so that the others stretch more; coils [1]."""

    coils: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "inactive_coils"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Some turns at the ends carry current but do not stretch."
    specs: ClassVar[dict[str, Spec]] = {"coils": Spec(0.0, 0.0, 5.0, 2.0, "1", "turns that do not stretch")}

    def _share(self, at: Known) -> Array:
        return self.coils / at["spring"].geometry.active_coils

    def elongation(self, value: Array, at: Known, memory: Any) -> Array:
        """The same elongation on fewer turns; counted from the free length, as the strain is."""
        spring = at["spring"]
        gap = spring.attached_length - spring.geometry.free_length
        return (value + gap) / (1.0 - self._share(at)) - gap

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """Stretched turns in series with unstretched ones."""
        spring, share = at["spring"], self._share(at)
        still = spring.alloy.resistivity(at["xi0"], jnp.zeros_like(at["gamma"])) * spring.geometry.wire_length
        return (1.0 - share) * value + share * still


class LargeHelixAngle(Effect):
    """Coils shrink as they open, so that equal stress gives more force; degree [1], 1 for `D = D_i cos a / cos a_i`."""

    degree: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "large_helix_angle"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SA"
    sentence: ClassVar[str] = "The coils' diameter shrinks as the spring opens, which shortens the wire's lever."
    specs: ClassVar[dict[str, Spec]] = {"degree": Spec(0.0, 0.0, 1.5, 1.0, "1", "exponent of the shrinking diameter")}

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pull`; angles are the true helix's."""
        spring = at["spring"]
        g = spring.geometry
        strain = (spring.attached_length + at["elongation"] - g.free_length) / g.free_length
        start = coil_angle(g.initial_pitch, g.coil_diameter, "true")
        open_ = coil_angle(g.initial_pitch * jnp.maximum(1.0 + strain, 0.0), g.coil_diameter, "true")
        return value * (jnp.cos(start) / jnp.cos(open_)) ** self.degree


class CoilContact(Effect):
    """Initial tension of close-wound coils, which builds up as they open; tension [N], opening [m]."""

    tension: Array = eqx.field(converter=jnp.asarray, default=0.0)
    opening: Array = eqx.field(converter=jnp.asarray, default=1e-3)

    slug: ClassVar[str] = "coil_contact"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Close-wound coils press on each other and must first be pulled apart."
    specs: ClassVar[dict[str, Spec]] = {
        "tension": Spec(0.0, 0.0, 0.4, 0.08, "N", "initial tension"),
        "opening": Spec(1e-3, 2e-4, 4e-3, 1e-3, "m", "opening over which it builds up", True),
    }

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pull`."""
        spring = at["spring"]
        stretch = spring.attached_length + at["elongation"] - spring.geometry.free_length
        return value + self.tension * (1.0 - jnp.exp(-jnp.maximum(stretch, 0.0) / self.opening))


class TransformationHysteresis(Effect):
    """Stress drops by a gap after a reversal of strain, over a width; gap_m, gap_a [Pa], width [1].

    The base curve is the loading one. The gap may differ between the phases.
    """

    gap_m: Array = eqx.field(converter=jnp.asarray, default=0.0)
    gap_a: Array = eqx.field(converter=jnp.asarray, default=0.0)
    width: Array = eqx.field(converter=jnp.asarray, default=0.02)

    slug: ClassVar[str] = "transformation_hysteresis"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "The nitinol returns along a lower branch than it was loaded on."
    specs: ClassVar[dict[str, Spec]] = {
        "gap_m": Spec(0.0, 0.0, 80e6, 15e6, "Pa", "stress gap of the martensite"),
        "gap_a": Spec(0.0, 0.0, 80e6, 30e6, "Pa", "stress gap of the austenite"),
        "width": Spec(0.02, 0.003, 0.06, 0.02, "1", "shear strain over which the gap opens", True),
    }

    def begin(self, at: Known) -> dict[int, tuple[Array, Array, Array]]:
        """Per spring: whether there was a row, its strain, and the branch, 0 loading to 1 unloading."""
        numbers = at["actuator"].spring_numbers if "actuator" in at else (1,)
        return {number: (jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(0.0)) for number in numbers}

    def _branch(self, gamma: Array, last: tuple[Array, Array, Array]) -> Array:
        started, before, branch = last
        moved = started * (gamma - before)
        return jnp.clip(branch - moved / self.width, 0.0, 1.0)

    def stress(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.stress`."""
        gap = at["xi0"] * self.gap_m + (1.0 - at["xi0"]) * self.gap_a
        return value - gap * self._branch(at["gamma"], memory[at["number"]])

    def remember(self, memory: dict, at: Known) -> dict:
        """Strain and branch of every spring."""
        solved = at["solved"]
        responses = solved.springs if "actuator" in at else (solved,)
        return {
            number: (jnp.asarray(1.0), response.gamma, self._branch(response.gamma, memory[number]))
            for number, response in zip(memory, responses, strict=True)
        }


class OpposingSpringHeating(Effect):
    """Heat of one spring reaches the other through two lags; gain [1], tau_1, tau_2 [s].

    The heated spring's austenite fraction stands for its temperature rise; the other loses `gain` times its lagged
    value of its martensite.
    """

    gain: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tau_1: Array = eqx.field(converter=jnp.asarray, default=20.0)
    tau_2: Array = eqx.field(converter=jnp.asarray, default=2.0)

    slug: ClassVar[str] = "opposing_spring_heating"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "Heat of the driven spring warms the opposite one, which was taken to be cold."
    specs: ClassVar[dict[str, Spec]] = {
        "gain": Spec(0.0, 0.0, 0.6, 0.15, "1", "share of the heat that arrives"),
        "tau_1": Spec(20.0, 3.0, 200.0, 20.0, "s", "time constant of the slower lag", True),
        "tau_2": Spec(2.0, 0.0, 60.0, 2.0, "s", "time constant of the faster lag", True),
    }

    def begin(self, at: Known) -> dict[int, tuple[Array, Array]]:
        """Nothing has arrived; per spring, both stages of its lagged heat."""
        zero = jnp.asarray(0.0)
        return {number: (zero, zero) for number in at["actuator"].spring_numbers}

    def phase(self, value: Array, at: Known, memory: dict) -> Array:
        """See `Effect.phase`."""
        others = [heat for number, (_, heat) in memory.items() if number != at["number"]]
        return value * (1.0 - self.gain * sum(others, jnp.asarray(0.0)))

    def remember(self, memory: dict, at: Known) -> dict:
        """Advance both lags of every spring by the row's interval."""
        later = {}
        for (number, (first, second)), response in zip(memory.items(), at["solved"].springs, strict=True):
            first = first + (1.0 - response.xi0 - first) * _arrived(at["interval"], self.tau_1)
            second = second + (first - second) * _arrived(at["interval"], self.tau_2)
            later[number] = (first, second)
        return later


def _arrived(interval: Array, tau: Array) -> Array:
    """Share of a step that a first-order lag has followed after an interval; all of it without a lag."""
    lagged = tau > 0.0
    return jnp.where(lagged, -jnp.expm1(-interval / jnp.where(lagged, tau, 1.0)), 1.0)


class UnevenHeating(Effect):
    """A share of the wire stays cold, in series with the rest: one force, strains and resistances add; share [1]."""

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "uneven_heating"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Part of the wire, near the crimps, stays colder than the rest."
    specs: ClassVar[dict[str, Spec]] = {"share": Spec(0.0, 0.0, 0.4, 0.1, "1", "share of the wire that stays cold")}

    def stress(self, value: Array, at: Known, memory: Any) -> Array:
        """To first order in the share: the cold zone's stress at equal strain, weighed by compliance."""
        alloy = at["spring"].alloy
        cold = alloy.shear_stress(at["gamma"], jnp.ones_like(at["xi0"]), alloy.residual_strain_limit(0.1924))
        return value + self.share * (cold - value)

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """Both zones in series."""
        spring = at["spring"]
        cold = spring.alloy.rho_m(at["gamma"]) * spring.geometry.wire_length
        return value + self.share * (cold - value)


