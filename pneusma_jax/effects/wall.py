"""Effects in the silicone, fibre by fibre: rate, softening, set, stiffening."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..pipeline import Effect, Known
from ..silicone.hyperelastic import first_invariant, neo_hookean_stress, yeoh_stress
from ._spec import Spec


def _fibres(at: Known) -> int:
    """Number of fibres of the wall: a section's, or one for uniform strain."""
    return at["fibres"][1].shape[0] if "actuator" in at else 1


def fibre_strain(at: Known) -> Array:
    """Strain of every fibre in a solved row [1], shape (fibres,)."""
    if "actuator" not in at:
        return jnp.atleast_1d(at["strain"])
    body, solved = at["actuator"], at["solved"]
    return (solved.delta_centre + at["fibres"][0] @ solved.bend) / body.length


def base_law(at: Known) -> Any:
    """The silicone law of the element."""
    return at["actuator"].silicone if "actuator" in at else at["silicone"]


class ViscoelasticRelaxation(Effect):
    """Prony overstress on the slow, elastic stress, relaxed at the first sample; g_k [1], tau_k [s].

    All of the elastic stress relaxes, with what stiffens or softens it: quasi-linear viscoelasticity. Three
    terms; those whose g is 0 are absent.
    """

    g_1: Array = eqx.field(converter=jnp.asarray, default=0.0)
    g_2: Array = eqx.field(converter=jnp.asarray, default=0.0)
    g_3: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tau_1: Array = eqx.field(converter=jnp.asarray, default=10.0)
    tau_2: Array = eqx.field(converter=jnp.asarray, default=1.0)
    tau_3: Array = eqx.field(converter=jnp.asarray, default=100.0)

    slug: ClassVar[str] = "viscoelastic_relaxation"
    by_rate: ClassVar[bool] = True
    woken: ClassVar[bool] = True
    alike: ClassVar[tuple[tuple[str, ...], ...]] = (("tau_1", "g_1"), ("tau_2", "g_2"), ("tau_3", "g_3"))
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone relaxes: its stress depends on how fast and when it was strained."
    literature: ClassVar[str] = (
        "J. C. Simo, Comput. Methods Appl. Mech. Eng. 60 (1987) 153; Y. C. Fung, Biomechanics (1993)"
    )
    specs: ClassVar[dict[str, Spec]] = {
        "g_1": Spec(0.0, 0.0, 2.0, 0.1, "1", "overstress over slow stress, first term"),
        "g_2": Spec(0.0, 0.0, 2.0, 0.1, "1", "overstress over slow stress, second term"),
        "g_3": Spec(0.0, 0.0, 2.0, 0.1, "1", "overstress over slow stress, third term"),
        "tau_1": Spec(10.0, 0.05, 2000.0, 10.0, "s", "relaxation time of the first term", True),
        "tau_2": Spec(1.0, 0.05, 2000.0, 1.0, "s", "relaxation time of the second term", True),
        "tau_3": Spec(100.0, 0.05, 2000.0, 100.0, "s", "relaxation time of the third term", True),
    }

    def begin(self, at: Known) -> tuple[Array, Array, Array]:
        """Flag of a previous row, its slow stress, and each term's overstress per unit g."""
        count = _fibres(at)
        return jnp.asarray(0.0), jnp.zeros(count), jnp.zeros((3, count))

    def _overstress(self, stress: Array, interval: Array, memory: tuple[Array, Array, Array]) -> Array:
        """Overstress of every term; exact for a stress that changes linearly over the row."""
        started, before, over = memory
        ratio = interval / jnp.stack([self.tau_1, self.tau_2, self.tau_3])
        flat = ratio < 1e-8
        fresh = jnp.where(flat, 1.0, -jnp.expm1(-ratio) / jnp.where(flat, 1.0, ratio))
        return jnp.exp(-ratio)[:, None] * over + fresh[:, None] * started * (stress - before)

    def wall(self, value: Array, at: Known, memory: tuple) -> Array:
        """See `Effect.wall`."""
        over = self._overstress(at["elastic"], at["interval"], memory)
        return value + jnp.stack([self.g_1, self.g_2, self.g_3]) @ over

    def remember(self, memory: tuple, at: Known) -> tuple[Array, Array, Array]:
        """Slow stress and overstress of every fibre."""
        strain = fibre_strain(at)
        slow = at["elastic_at"](base_law(at)(strain), strain)
        return jnp.asarray(1.0), slow, self._overstress(slow, at["interval"], memory)


class MullinsSoftening(Effect):
    """Softer below the largest tensile strain e_m seen: the stress loses a share of itself.

    The share is `depth (1 - exp(-d / scale)) / (1 - exp(-D / scale))`, over the distance `d` [1]. D is 1, or
    d at full unloading if that is farther. So `depth` [1] is what is lost there, and no more is ever lost.
    Over a small `scale` [1] it is lost at once, over a large one linearly.
    `d = (e_m - e) (1 + energy e / e_m)`. With `energy` 0 the distance in strain counts, with 1 that in
    energy of a linear law. With `relative` 1 d is over e_m, and 1 at full unloading. A larger maximum then
    softens over a larger distance, as in Ogden and Roxburgh's law.
    """

    depth: Array = eqx.field(converter=jnp.asarray, default=0.0)
    scale: Array = eqx.field(converter=jnp.asarray, default=0.3)
    energy: Array = eqx.field(converter=jnp.asarray, default=0.0)
    relative: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "mullins_softening"
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone is softer below the largest stretch it has seen."
    literature: ClassVar[str] = "Ogden and Roxburgh, Proc. R. Soc. A 455 (1999) 2861"
    specs: ClassVar[dict[str, Spec]] = {
        "depth": Spec(0.0, 0.0, 0.7, 0.2, "1", "share of the stress that is lost at a distance of 1"),
        "scale": Spec(
            0.3, 0.02, 10.0, 0.3, "1", "distance over which the loss levels off", True, natural_ends=True
        ),
        "energy": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "distance in strain (0) or in energy (1)", True, natural_ends=True
        ),
        "relative": Spec(
            0.0, 0.0, 1.0, 0.0, "1", "distance absolute (0), over the largest (1)", True, natural_ends=True
        ),
    }

    def begin(self, at: Known) -> Array:
        """Largest tensile strain of every fibre."""
        return jnp.zeros(_fibres(at))

    def softened(self, value: Array, at: Known, memory: Array) -> Array:
        """See `Effect.softened`; only tension softens."""
        strain = jnp.maximum(at["strain"], 0.0)
        below = jnp.where(memory > strain, memory - strain, 0.0)
        most = jnp.maximum(memory, 1e-6)
        counted = 1.0 + self.energy * (jnp.minimum(strain / most, 1.0))
        unit = 1.0 + self.relative * (most - 1.0)
        farthest = jnp.maximum(most / unit, 1.0)
        share = jnp.expm1(-below / unit * counted / self.scale) / jnp.expm1(-farthest / self.scale)
        lost = self.depth * share
        return jnp.where(at["strain"] > 0.0, value * (1.0 - lost), value)

    def remember(self, memory: Array, at: Known) -> Array:
        """The running maximum."""
        return _maximum(memory, fibre_strain(at))


class PermanentSet(Effect):
    """The rest length grows: strain of rest `share (1 - exp(-N / cycles))` [1] times the largest strain seen.

    N counts the strain's path over twice its largest, fibre by fibre.
    """

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)
    cycles: Array = eqx.field(converter=jnp.asarray, default=0.3)

    slug: ClassVar[str] = "permanent_set"
    woken: ClassVar[bool] = True
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone does not quite return to its rest length after it was stretched."
    literature: ClassVar[str] = "Dorfmann and Ogden, Int. J. Solids Struct. 41 (2004) 1855; ASTM D412 (set)"
    specs: ClassVar[dict[str, Spec]] = {
        "share": Spec(0.0, 0.0, 0.15, 0.03, "1", "set over the largest strain seen"),
        "cycles": Spec(0.3, 0.02, 30.0, 0.3, "1", "cycles in which two thirds of it come", True),
    }

    def begin(self, at: Known) -> tuple[Array, Array, Array, Array]:
        """Flag of a previous row, every fibre's strain in it, its largest strain, and its path."""
        still = jnp.zeros(_fibres(at))
        return jnp.asarray(0.0), still, still, still

    def elastic(self, value: Array, at: Known, memory: tuple) -> Array:
        """See `Effect.elastic`; the base law at the strain from the new rest length."""
        law, strain, (_, _, most, path) = base_law(at), at["strain"], memory
        count = 0.5 * path / jnp.maximum(most, 1e-6)
        rest = self.share * -jnp.expm1(-count / self.cycles) * most
        return value + law(strain - rest) - at["base"]

    def remember(self, memory: tuple, at: Known) -> tuple[Array, Array, Array, Array]:
        """Strain, largest strain and path of every fibre."""
        started, before, most, path = memory
        strain = fibre_strain(at)
        return jnp.asarray(1.0), strain, _maximum(most, strain), path + started * jnp.abs(strain - before)


class StrainStiffening(Effect):
    """Yeoh's higher terms on the base law: `2 (l - l^-2) (2 c_2 J + 3 c_3 J^2)`, J = I_1 - 3; c_2, c_3 [Pa].

    Gent's law is their series with `c_2 = mu / (4 J_m)`, `c_3 = mu / (6 J_m^2)`. A coupon may also stiffen
    from the start and then ever more slowly, as silicones do that are pulled to ten times their length. For
    it `c_log ln(I_1 / 3)`, c_log [Pa], in the same bracket, is a limit of Lopez-Pamies' powers of I_1. A bent
    wall is pulled on one side and pushed on the other. There, c_pull [Pa] is a c_2 of pulled fibres alone.
    """

    c_2: Array = eqx.field(converter=jnp.asarray, default=0.0)
    c_3: Array = eqx.field(converter=jnp.asarray, default=0.0)
    c_log: Array = eqx.field(converter=jnp.asarray, default=0.0)
    c_pull: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "strain_stiffening"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AET"
    sentence: ClassVar[str] = "The silicone stiffens at large stretch more than its base law says."
    lookalike: ClassVar[str] = "a wrap of fibres that is slack at first"
    lookalike_kinds: ClassVar[str] = "T"
    literature: ClassVar[str] = (
        "O. H. Yeoh, Rubber Chem. Technol. 66 (1993) 754; O. Lopez-Pamies, C. R. Mecanique 338 (2010) 3"
    )
    specs: ClassVar[dict[str, Spec]] = {
        "c_2": Spec(0.0, -5e3, 2e4, 2e3, "Pa", "second constant of Yeoh's law"),
        "c_3": Spec(0.0, -5e2, 5e3, 2e2, "Pa", "third constant of Yeoh's law"),
        "c_log": Spec(0.0, 0.0, 2e5, 1e4, "Pa", "constant of ln(I_1 / 3)", kinds="E"),
        "c_pull": Spec(0.0, -5e3, 2e4, 2e3, "Pa", "second constant in tension alone", kinds="A"),
    }

    def elastic(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.elastic`."""
        stretch = jnp.maximum(1.0 + at["strain"], 0.2)
        zero = jnp.zeros_like(self.c_2)
        slow = 2.0 * self.c_log * jnp.log(first_invariant(stretch) / 3.0)
        more = yeoh_stress(stretch, zero, self.c_2, self.c_3) + neo_hookean_stress(stretch, slow)
        return value + more + yeoh_stress(jnp.maximum(stretch, 1.0), zero, self.c_pull, zero)


class ThickWall(Effect):
    """Radial and hoop stress change the axial one in a thick wall: `P (share + stretched e)` is added.

    Lame's field in an incompressible wall gives a term in P and one in P times the strain e.
    """

    share: Array = eqx.field(converter=jnp.asarray, default=0.0)
    stretched: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "thick_wall"
    component: ClassVar[str] = "elastomer"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "Pressure stresses the thick wall across too, which changes its axial stress."
    lookalike: ClassVar[str] = "a wrap of fibres that is slack at first, or not quite round the tube"
    lookalike_kinds: ClassVar[str] = "T"
    literature: ClassVar[str] = "Timoshenko and Goodier, Theory of Elasticity (1970): Lame's cylinder"
    specs: ClassVar[dict[str, Spec]] = {
        "share": Spec(0.0, -2.0, 2.0, 0.3, "1", "axial stress over pressure"),
        "stretched": Spec(0.0, -2.0, 2.0, 0.5, "1", "axial stress over pressure times strain"),
    }

    def wall(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wall`."""
        return value + at["pressure"] * (self.share + self.stretched * at["strain"])


def _maximum(most: Array, strain: Array) -> Array:
    """Running maximum. A fibre at its largest strain ever follows the next increment in full."""
    return jnp.where(strain >= most, strain, most)
