"""Effects of a spring's turns: its rest length, its ends, its opening coils, coils that touch."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..nitinol.geometry import coil_slope
from ..pipeline import Effect, Known
from ._spec import Spec


def opening(at: Known) -> Array:
    """Elongation of a spring from its free length [m]."""
    spring = at["spring"]
    return spring.attached_length + at["elongation"] - spring.geometry.free_length


class PrestrainError(Effect):
    """The spring's rest length differs from the nominal one; shift [m], longer spring positive.

    `shift` is that of spring `number`, or of the only one there is; `shift_other` that of the others.
    """

    shift: Array = eqx.field(converter=jnp.asarray, default=0.0)
    shift_other: Array = eqx.field(converter=jnp.asarray, default=0.0)
    number: int = eqx.field(static=True, default=2)

    slug: ClassVar[str] = "prestrain_error"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "The spring was attached with another rest length than stated."
    literature: ClassVar[str] = "the source: springs are stretched and attached by hand"
    specs: ClassVar[dict[str, Spec]] = {
        "shift": Spec(0.0, -3e-3, 3e-3, 5e-4, "m", "error of the spring's rest length"),
        "shift_other": Spec(0.0, -3e-3, 3e-3, 5e-4, "m", "error of the other springs'", kinds="A"),
    }

    def elongation(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.elongation`."""
        alone = "actuator" not in at or len(at["actuator"].springs) == 1
        return value - (self.shift if alone or at["number"] == self.number else self.shift_other)


class InactiveCoils(Effect):
    """Turns that carry current but do not stretch, so that the others stretch more; coils [1]."""

    coils: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "inactive_coils"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Some turns at the ends carry current but do not stretch."
    literature: ClassVar[str] = "A. M. Wahl, Mechanical Springs (1963), on end turns"
    specs: ClassVar[dict[str, Spec]] = {"coils": Spec(0.0, 0.0, 8.0, 2.0, "1", "turns that do not stretch")}

    def _share(self, at: Known) -> Array:
        return self.coils / at["spring"].geometry.active_coils

    def elongation(self, value: Array, at: Known, memory: Any) -> Array:
        """The same elongation on fewer turns; counted from the free length, as the strain is."""
        spring = at["spring"]
        gap = spring.attached_length - spring.geometry.free_length
        return (value + gap) / (1.0 - self._share(at)) - gap

    def wire_resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wire_resistance`. The unstretched turns count as martensite, which differs little."""
        return self._without_still_turns(value, at, jnp.ones(()))

    def _without_still_turns(self, value: Array, at: Known, xi0: Array) -> Array:
        share = self._share(at)
        return (value - share * self._unstretched_resistance(at, xi0)) / (1.0 - share)

    def _unstretched_resistance(self, at: Known, xi0: Array) -> Array:
        """Resistance of the whole wire if none of it were stretched [ohm]."""
        spring = at["spring"]
        return spring.alloy.resistivity(xi0, jnp.zeros_like(at["gamma"])) * spring.geometry.wire_length

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """Stretched turns in series with unstretched ones."""
        share = self._share(at)
        return (1.0 - share) * value + share * self._unstretched_resistance(at, at["xi0"])


STRAIGHTEST = 0.97
"""Maximum sine of a coil's angle; at 1 the wire is straight and has no lever."""


class LargeHelixAngle(Effect):
    """Coils shrink as they open: equal stress gives more force; degree 1 is `D = D_i cos a / cos a_i`.

    So the wire keeps its length L, and a coil of pitch p has `sin a = p / L`.
    """

    degree: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "large_helix_angle"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "SA"
    sentence: ClassVar[str] = "The coils shrink as the spring opens, which shortens the lever of the wire."
    literature: ClassVar[str] = "A. M. Wahl, Mechanical Springs (1963), on large deflections"
    specs: ClassVar[dict[str, Spec]] = {
        "degree": Spec(0.0, 0.0, 3.0, 1.0, "1", "exponent of the shrinking diameter")
    }

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pull`; the helix is the true one. A coil is opened to `STRAIGHTEST` at most."""
        g = at["spring"].geometry
        start = coil_slope(g.initial_pitch, g.coil_diameter, "true")
        sine = start / jnp.sqrt(1.0 + start**2)
        stretch = jnp.maximum(1.0 + opening(at) / g.free_length, 0.0)
        open_ = jnp.minimum(sine * stretch, STRAIGHTEST)
        return value * ((1.0 - sine**2) / (1.0 - open_**2)) ** (0.5 * self.degree)


class CoilContact(Effect):
    """Coils that touch: tension [N] that builds up over an opening [m]; a stop [N/m] where compressed."""

    tension: Array = eqx.field(converter=jnp.asarray, default=0.0)
    stop: Array = eqx.field(converter=jnp.asarray, default=0.0)
    opening: Array = eqx.field(converter=jnp.asarray, default=1e-3)

    slug: ClassVar[str] = "coil_contact"
    component: ClassVar[str] = "spring"
    kinds: ClassVar[str] = "AS"
    sentence: ClassVar[str] = "Close-wound coils press on each other and must first be pulled apart."
    literature: ClassVar[str] = "A. M. Wahl, Mechanical Springs (1963), on initial tension"
    specs: ClassVar[dict[str, Spec]] = {
        "tension": Spec(0.0, 0.0, 0.4, 0.08, "N", "initial tension"),
        "stop": Spec(0.0, 0.0, 2e4, 5e2, "N/m", "stiffness of the closed coils", kinds="S"),
        "opening": Spec(1e-3, 2e-4, 4e-3, 1e-3, "m", "opening over which the tension builds up", True),
    }

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.pull`."""
        opened = opening(at)
        built = -jnp.expm1(-jnp.maximum(opened, 0.0) / self.opening)
        return value + self.tension * built + self.stop * jnp.where(opened < 0.0, opened, 0.0)
