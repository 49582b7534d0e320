"""The weight of a chain of segments and of the bodies on it."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ..actuator import Actuator
from ..actuator.weight import mass_of
from ..numerics.safe import as_array, numpy_if_known, safe_divide
from .loads import ChainWeight


def chain_weight(
    segments: Sequence[Actuator],
    silicone_density: Array | Sequence[float],
    acceleration: Float[Array, "3"],
    tip_mass: Array = 0.0,
    tip_place: Float[Array, "2"] | None = None,
    connectors: Array = 0.0,
    connector_mass: Array = 0.0,
) -> ChainWeight:
    """Gravity on a chain: `chain.with_loads(chain_weight(chain.segments, 1070.0,
    gravity_vector("horizontal")))`.

    Every segment weighs as much as by `weight` alone.

    Args:
        segments: actuators from base to tip.
        silicone_density: density of the wall [kg/m3], one for all or one per segment.
        acceleration: acceleration of gravity in the frame of the chain's base [m/s2]; see
            `actuator.loads.gravity_vector`.
        tip_mass: mass of the end cap and bodies on it [kg].
        tip_place: centre of the tip mass in the last segment's section [m]; its bore's centroid if None.
        connectors: lengths of the rigid connectors between segments [m], as of the chain.
        connector_mass: mass of each of them, centred half-way along it [kg]; one for all or one per
            connector.
    """
    count = len(segments)
    xp = numpy_if_known(
        segments, silicone_density, acceleration, tip_mass, tip_place, connectors, connector_mass
    )
    densities = xp.broadcast_to(xp.asarray(silicone_density, dtype=float), (count,))
    weighed = [mass_of(body, densities[k]) for k, body in enumerate(segments)]
    tip_place = segments[-1].section.enclosed_centroid if tip_place is None else tip_place
    gaps = xp.broadcast_to(xp.asarray(connectors, dtype=float), (count - 1,))
    joints = xp.broadcast_to(xp.asarray(connector_mass, dtype=float), (count - 1,))
    ahead = xp.stack([xp.zeros(count - 1), xp.zeros(count - 1), 0.5 * gaps], axis=-1)
    at_tip = xp.concatenate([xp.asarray(tip_place, dtype=float), xp.zeros(1)])
    found = ChainWeight(
        acceleration=xp.asarray(acceleration, dtype=float),
        masses=xp.stack([xp.asarray(mass) for mass, _ in weighed]),
        places=xp.stack([xp.asarray(place) for _, place in weighed]),
        end_masses=xp.append(joints, tip_mass),
        end_places=xp.concatenate([ahead, at_tip[None]]),
    )
    return jax.tree.map(as_array, found)


def with_bodies(weight: ChainWeight, masses: Float[Array, "n"], places: Float[Array, "n 2"]) -> ChainWeight:
    """A weight with further bodies at the segments' ends. The bodies at one end count as one.

    Args:
        weight: weight of the chain.
        masses: masses of the further bodies [kg].
        places: positions of their centres in the section [m].
    """
    places = jnp.concatenate([places, jnp.zeros((len(masses), 1))], axis=1)
    together = weight.end_masses + masses
    turning = weight.end_masses[:, None] * weight.end_places + masses[:, None] * places
    centre = safe_divide(turning, together[:, None], 1e-12)
    return ChainWeight(weight.acceleration, weight.masses, weight.places, together, centre)
