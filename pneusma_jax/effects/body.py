"""Effects on the end cap's balance: contact, friction, pressure on more than the nominal bore."""

from collections.abc import Mapping
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array

from ..actuator.loads import STANDARD_GRAVITY, centred_weight
from ..pipeline import Effect, Known
from ._spec import Spec

UP = (0.0, 1.0)  # Direction of the plane of sides 1 and 2
ELEMENTS = 5
"""Number of elastic-slip elements of the wrapping's friction."""


class TipContact(Effect):
    """One-sided stop past a bend angle; stiffness [N m/rad^exponent], angle [rad], exponent [1]."""

    stiffness: Array = eqx.field(converter=jnp.asarray, default=0.0)
    angle: Array = eqx.field(converter=jnp.asarray, default=4.7)
    exponent: Array = eqx.field(converter=jnp.asarray, default=1.0)

    slug: ClassVar[str] = "tip_contact"
    component: ClassVar[str] = "contact"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "Past a certain bend the tip touches the base and cannot go on."
    literature: ClassVar[str] = "the source, Section 3.7.5, on PneuSMA1; exponent 1.5 is that of Hertz"
    specs: ClassVar[dict[str, Spec]] = {
        "stiffness": Spec(0.0, 0.0, 0.1, 0.01, "N m/rad", "stiffness of the stop"),
        "angle": Spec(4.7, 0.3, 8.0, 3.0, "rad", "bend angle at which they touch", True),
        "exponent": Spec(1.0, 1.0, 1.5, 1.0, "1", "exponent of the contact law", True, natural_ends=True),
    }

    def load(self, value: tuple[Array, Array], at: Known, memory: Any) -> tuple[Array, Array]:
        """See `Effect.load`; acts against the bend, in the plane of sides 1 and 2."""
        force, moment = value
        theta = at["bend"][1]
        deep = jnp.abs(theta) - self.angle
        touching = deep > 0.0
        push = jnp.where(touching, jnp.where(touching, deep, 1.0) ** self.exponent, 0.0)
        return force, moment + self.stiffness * push * jnp.sign(theta) * jnp.asarray(UP)


class WrapFriction(Effect):
    """Friction of the fibre wrapping, elastic-slip elements in parallel that share one limit.

    Limit `constant + per_pressure * P` [N m, N m/Pa] against bending. `slip` [rad] is the bend over which the
    middle element reverses by half. The others' slips are up to `exp(spread)` times less and more, evenly in
    their logarithm. A tube without springs or fibre rubs as it lengthens, by `theta = delta / R` and `M = F
    R`.

    A recording that begins loaded may begin with friction. `begun` is 1 if the body came there from its
    straight rest in one go. It is 0 if nothing rubs in the first row, and negative if the body came back from
    further on.
    """

    constant: Array = eqx.field(converter=jnp.asarray, default=0.0)
    per_pressure: Array = eqx.field(converter=jnp.asarray, default=0.0)
    slip: Array = eqx.field(converter=jnp.asarray, default=0.1)
    spread: Array = eqx.field(converter=jnp.asarray, default=0.5)
    begun: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "wrap_friction"
    component: ClassVar[str] = "friction"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The fibre wrapping rubs: bending and straightening follow different paths."
    sentences: ClassVar[Mapping[str, str]] = {
        "T": "The fibre wrapping rubs: the tube lengthens and shortens along different paths."
    }
    literature: ClassVar[str] = "W. D. Iwan, J. Appl. Mech. 33 (1966) 893: elastic-slip elements in parallel"
    specs: ClassVar[dict[str, Spec]] = {
        "constant": Spec(0.0, 0.0, 2e-3, 2e-4, "N m", "friction moment without pressure"),
        "per_pressure": Spec(0.0, 0.0, 5e-8, 5e-9, "N m/Pa", "friction moment per pressure"),
        "slip": Spec(0.1, 0.02, 0.8, 0.1, "rad", "bend over which the friction builds up", True),
        "spread": Spec(0.5, 0.0, 2.2, 0.5, "1", "spread of the elements' slips", True),
        "begun": Spec(0.0, -1.0, 1.0, 1.0, "1", "friction in the first row, of that on the way there", True),
    }

    within: ClassVar[dict[str, dict[str, dict[str, Any]]]] = {
        "T": {
            "constant": {"text": "friction force without pressure, times the outer radius"},
            "per_pressure": {"text": "the same per pressure"},
            "slip": {"text": "lengthening over which the friction builds up, over the outer radius"},
        }
    }

    def acts_at_rest(self) -> bool:
        """See `Effect.acts_at_rest`."""
        return bool(self.begun != 0.0)

    def begin(self, at: Known) -> tuple[Array, Array, Array]:
        """Flag of a previous row, its bend or lengthening, and the elements' states in [-1, 1]."""
        return jnp.asarray(0.0), jnp.asarray(0.0), jnp.zeros(ELEMENTS)

    def _states(self, place: Array, memory: tuple[Array, Array, Array]) -> Array:
        started, before, states = memory
        slips = self.slip * jnp.exp(self.spread * jnp.linspace(-1.0, 1.0, ELEMENTS))
        first = self.begun * jnp.clip(place / slips, -1.0, 1.0)
        return jnp.where(started > 0.0, jnp.clip(states + (place - before) / slips, -1.0, 1.0), first)

    def load(self, value: tuple[Array, Array], at: Known, memory: tuple) -> tuple[Array, Array]:
        """See `Effect.load`."""
        force, moment = value
        limit = self.constant + self.per_pressure * jnp.maximum(at["pressure"], 0.0)
        body, radius = at["actuator"], at["actuator"].section.radius
        if _is_tube(body):
            states = self._states(at["delta_centre"] / radius, memory)
            return force + limit / radius * jnp.mean(states), moment
        return force, moment + limit * jnp.mean(self._states(at["bend"][1], memory)) * jnp.asarray(UP)

    def remember(self, memory: tuple, at: Known) -> tuple[Array, Array, Array]:
        """Bend, or lengthening, and states after the row."""
        body, solved = at["actuator"], at["solved"]
        place = solved.delta_centre / body.section.radius if _is_tube(body) else solved.bend[1]
        return jnp.asarray(1.0), place, self._states(place, memory)


def _is_tube(body: Any) -> bool:
    """True if nothing is attached, so that the body lengthens and does not bend."""
    return not body.springs and body.fibre_place is None


class RadialExpansion(Effect):
    """The bore widens with pressure, so that it pushes more; per_pressure [1/Pa] of the area."""

    per_pressure: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "radial_expansion"
    component: ClassVar[str] = "pressure"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The tube widens under pressure, so that the pressure pushes on a larger area."
    literature: ClassVar[str] = "Polygerinos et al., IEEE Trans. Robot. 31 (2015) 778"
    specs: ClassVar[dict[str, Spec]] = {
        "per_pressure": Spec(0.0, 0.0, 1e-5, 1e-6, "1/Pa", "relative growth of the bore's area per pressure")
    }

    def load(self, value: tuple[Array, Array], at: Known, memory: Any) -> tuple[Array, Array]:
        """See `Effect.load`."""
        section, pressure = at["actuator"].section, at["pressure"]
        more = pressure * section.enclosed_area * self.per_pressure * pressure
        return value[0] - more, value[1] - more * section.enclosed_centroid


class WallEccentricity(Effect):
    """The bore is off centre towards side 1; shift [m]. The wall is thinner there."""

    shift: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "wall_eccentricity"
    component: ClassVar[str] = "geometry"
    kinds: ClassVar[str] = "AT"
    sentence: ClassVar[str] = "The bore is off centre, so that one wall is thinner than the other."
    literature: ClassVar[str] = "Gorissen et al., Adv. Mater. 29 (2017) 1604977: eccentric tubes bend"
    specs: ClassVar[dict[str, Spec]] = {
        "shift": Spec(0.0, -2.5e-4, 2.5e-4, 5e-5, "m", "offset of the bore to side 1")
    }

    def load(self, value: tuple[Array, Array], at: Known, memory: Any) -> tuple[Array, Array]:
        """Force and moment of the wall that the shift adds and removes; the pressure's push moves along."""
        body = at["actuator"]
        section, bore = body.section, body.section.shapes[-1]
        rule = bore.rule(jnp.asarray(UP), jnp.zeros(0), section.nodes)
        stress = lambda y: body.silicone((at["delta_centre"] + y * at["bend"][1]) / body.length)  # noqa: E731
        pull, shifted = rule.area * stress(rule.s), rule.area * stress(rule.s + self.shift)
        force = value[0] + jnp.sum(pull) - jnp.sum(shifted)
        push = at["pressure"] * section.enclosed_area * self.shift
        moment = jnp.sum(pull * rule.s) - jnp.sum(shifted * (rule.s + self.shift)) - push
        return force, value[1] + moment * jnp.asarray(UP)


class Weight(Effect):
    """Weight of the tube and of the body at its tip; mass, tip_mass [kg].

    The direction is the recording's `gravity` [m/s2], shape (3,); clamped below, tip up, where not known.
    """

    mass: Array = eqx.field(converter=jnp.asarray, default=0.0)
    tip_mass: Array = eqx.field(converter=jnp.asarray, default=0.0)

    slug: ClassVar[str] = "gravity"
    component: ClassVar[str] = "environment"
    kinds: ClassVar[str] = "A"
    sentence: ClassVar[str] = "The actuator's own weight bends it."
    literature: ClassVar[str] = "the source, Section 3.7.3: weight changes curvature by 4 to 10 %"
    specs: ClassVar[dict[str, Spec]] = {
        "mass": Spec(0.0, 0.0, 6e-3, 2e-3, "kg", "mass spread along the tube"),
        "tip_mass": Spec(0.0, 0.0, 5e-3, 1e-3, "kg", "mass at the tip"),
    }

    def load(self, value: tuple[Array, Array], at: Known, memory: Any) -> tuple[Array, Array]:
        """See `Effect.load`."""
        down = at["gravity"] if "gravity" in at else jnp.asarray([0.0, 0.0, -STANDARD_GRAVITY])
        length = at["actuator"].length + at["delta_centre"]
        pull, turn = centred_weight(down, self.mass, self.tip_mass, length, at["bend"])
        return value[0] + pull, value[1] + turn
