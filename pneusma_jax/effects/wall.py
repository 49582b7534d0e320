"""Effects in the silicone, fibre by fibre: rate, softening, set, stiffening."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..chain import Effect, Known
from ._spec import Spec


def _fibres(at: Known) -> int:
    """Number of fibres that the wall is followed by: a section's, or one for uniform strain."""
    return at["actuator"].section.fibres()[1].shape[0] if "actuator" in at else 1


def fibre_strain(at: Known) -> Array:
    """Strain of every fibre in a solved row [1], shape (fibres,)."""
    if "actuator" not in at:
        return jnp.atleast_1d(at["strain"])
    body, solved = at["actuator"], at["solved"]
    return (solved.delta_centre + body.section.fibres()[0] @ solved.bend) / body.length


def base_law(at: Known) -> Any:
    """The silicone law of the element."""
    return at["actuator"].silicone if "actuator" in at else at["silicone"]


class ViscoelasticRelaxation(Effect):
    """Prony overstress on the base curve as the slow one, relaxed at the first sample; g [1], tau [s], shape (terms,)."""

    g: Array = eqx.field(converter=jnp.asarray, default=(0.0,))
    tau: Array = eqx.field(converter=jnp.asarray, default=(10.0,))

    slug: ClassVar[str] = "viscoelastic_relaxation"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone relaxes: its stress depends on how fast and how long ago it was strained."
    specs: ClassVar[dict[str, Spec]] = {
        "g": Spec(0.0, 0.0, 0.6, 0.1, "1", "overstress over slow stress"),
        "tau": Spec(10.0, 0.1, 1000.0, 10.0, "s", "relaxation time", True),
    }

    def begin(self, at: Known) -> tuple[Array, Array, Array]:
        """Whether there was a row, its slow stress, and each term's overstress per unit g."""
        count = _fibres(at)
        return jnp.asarray(0.0), jnp.zeros(count), jnp.zeros((self.g.shape[0], count))

    def _over(self, stress: Array, interval: Array, memory: tuple[Array, Array, Array]) -> Array:
        started, before, over = memory
        change = started * (stress - before)
        ratio = (interval / self.tau)[:, None]
        # exact for a stress that changes linearly over the row
        kept = jnp.exp(-ratio)
        fresh = jnp.where(ratio > 1e-8, -jnp.expm1(-ratio) / jnp.where(ratio > 1e-8, ratio, 1.0), 1.0)
        return kept * over + fresh * change

    def wall(self, value: Array, at: Known, memory: tuple) -> Array:
        """See `Effect.wall`."""
        slow = base_law(at)(at["strain"])
        return value + self.g @ self._over(slow, at["interval"], memory)

    def remember(self, memory: tuple, at: Known) -> tuple[Array, Array, Array]:
        """Slow stress and overstress of every fibre."""
        slow = base_law(at)(fibre_strain(at))
        return jnp.asarray(1.0), slow, self._over(slow, at["interval"], memory)


class MullinsSoftening(Effect):
    """Softer below the largest tensile strain seen; depth [1], scale [1] of strain over which it develops."""

    depth: Array = eqx.field(converter=jnp.asarray, default=0.0)
    scale: Array = eqx.field(converter=jnp.asarray, default=0.3)

    slug: ClassVar[str] = "mullins_softening"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone is softer below the largest stretch it has seen."
    specs: ClassVar[dict[str, Spec]] = {
        "depth": Spec(0.0, 0.0, 0.7, 0.2, "1", "share of the stress that is lost"),
        "scale": Spec(0.3, 0.02, 2.0, 0.3, "1", "distance below the largest strain over which it is lost", True),
    }

    def begin(self, at: Known) -> Array:
        """Largest tensile strain of every fibre."""
        return jnp.zeros(_fibres(at))

    def wall(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.wall`; only tension softens."""
        strain = at["strain"]
        below = jnp.maximum(memory - jnp.maximum(strain, 0.0), 0.0)
        lost = self.depth * -jnp.expm1(-below / self.scale)
        return jnp.where(strain > 0.0, value * (1.0 - lost), value)

    def remember(self, memory: Array, at: Known) -> Array:
        """The running maximum."""
        return jnp.maximum(memory, fibre_strain(at))


class PermanentSet(Effect):
    """The rest length grows with the largest strain seen; share [1] of it."""

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "permanent_set"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone does not quite return to its rest length after it was stretched."
    specs: ClassVar[dict[str, Spec]] = {"share": Spec(0.0, 0.0, 0.15, 0.03, "1", "set over the largest strain seen")}

    def begin(self, at: Known) -> Array:
        """Largest tensile strain of every fibre."""
        return jnp.zeros(_fibres(at))

    def wall(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.wall`; the base law at the strain from the new rest length."""
        law, strain = base_law(at), at["strain"]
        return value + law(strain - self.share * memory) - law(strain)

    def remember(self, memory: Array, at: Known) -> Array:
        """The running maximum."""
        return jnp.maximum(memory, fibre_strain(at))


class StrainStiffening(Effect):
    """Yeoh's cubic term on top of the base law; modulus [Pa], onset [1] of strain."""

    modulus: Array = eqx.field(converter=jnp.asarray, default=0.0)
    onset: Array = eqx.field(converter=jnp.asarray, default=0.2)

    slug: ClassVar[str] = "strain_stiffening"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone stiffens at large stretch more than its base law says."
    specs: ClassVar[dict[str, Spec]] = {
        "modulus": Spec(0.0, -5e4, 2e5, 2e4, "Pa", "stiffening past the onset"),
        "onset": Spec(0.2, 0.0, 3.0, 0.2, "1", "strain at which it sets in", True),
    }

    def wall(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wall`."""
        past = jnp.maximum(at["strain"] - self.onset, 0.0)
        return value + self.modulus * past**2


class ThickWall(Effect):
    """Radial and hoop stress add to the axial one in a wall that is not thin; share [1] of P times stretch."""

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "thick_wall"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "Pressure stresses the thick wall across as well, which changes its axial stress."
    specs: ClassVar[dict[str, Spec]] = {"share": Spec(0.0, -2.0, 2.0, 0.5, "1", "axial stress over pressure times stretch")}

    def wall(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wall`."""
        return value + self.share * at["pressure"] * at["strain"]
