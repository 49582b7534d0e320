"""The circuit: springs side by side on one supply, each behind a coil and a capacitor in series.

A branch lets current pass near its resonance `f = 1 / (2 pi sqrt(L C))`. The supply chooses a spring by its
frequency, heats it, and senses it or another one by a second, weak frequency on the same wires.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from pneusma_jax.numerics.safe import as_array, as_numpy, is_concrete, namespace_of
from pneusma_jax.program_cache import stored_jit

VACUUM = 4e-7 * jnp.pi
"""Permeability of vacuum, and nearly that of nitinol [H/m]."""


class Circuit(eqx.Module):
    """Branches on one pair of wires.

    Attributes:
        resistance: resistance of the springs [ohm], shape (branches,).
        spring_inductance: inductance of the springs themselves [H], shape (branches,).
        inductance: inductance of the filters' coils [H], shape (branches,).
        capacitance: capacitance of the filters [F], shape (branches,).
        coil_time: inductance of a coil over its own resistance [s]; 1 ms for wound ferrite of a cubic
            centimetre.
        lead_resistance: resistance of the pair of wires [ohm].
        voltage: voltage of the supply, root mean square [V].
    """

    resistance: Float[Array, "branches"] = eqx.field(converter=as_array)
    spring_inductance: Float[Array, "branches"] = eqx.field(converter=as_array)
    inductance: Float[Array, "branches"] = eqx.field(converter=as_array)
    capacitance: Float[Array, "branches"] = eqx.field(converter=as_array)
    coil_time: Array = eqx.field(converter=as_array, default=1e-3)
    lead_resistance: Array = eqx.field(converter=as_array, default=0.1)
    voltage: Array = eqx.field(converter=as_array, default=3.0)

    @property
    def resonance(self) -> Float[Array, "branches"]:
        """Frequency that each branch lets pass [Hz]."""
        own = as_numpy(self) if is_concrete(self) else self
        whole = own.inductance + own.spring_inductance
        return 1.0 / (2.0 * np.pi * namespace_of(whole, own.capacitance).sqrt(whole * own.capacitance))

    @property
    def quality(self) -> Float[Array, "branches"]:
        """Reactance of the coil at resonance over the branch's resistance [1]."""
        own = as_numpy(self) if is_concrete(self) else self
        whole = own.inductance + own.spring_inductance
        return 2.0 * np.pi * own.resonance * whole / (own.resistance + own.inductance / own.coil_time)

    def impedance(self, frequency: Float[Array, "*f"]) -> Float[Array, "*f branches"]:
        """Complex impedance of every branch [ohm]."""
        omega = 2.0 * jnp.pi * jnp.asarray(frequency)[..., None]
        reactance = omega * (self.inductance + self.spring_inductance) - 1.0 / (omega * self.capacitance)
        return self.resistance + self.inductance / self.coil_time + 1j * reactance

    def admittance(self, frequency: Float[Array, "*f"]) -> Float[Array, "*f"]:
        """Complex admittance of the whole, as the supply sees it [S]."""
        branches = jnp.sum(1.0 / self.impedance(frequency), axis=-1)
        return 1.0 / (self.lead_resistance + 1.0 / branches)


def spring_inductance(active_coils: Array, coil_diameter: Array, length: Array) -> Array:
    """Inductance of a spring as a long coil in air [H].

    Args:
        active_coils: number of turns; coil_diameter: mean diameter [m]; length: of the spring [m].
    """
    return VACUUM * active_coils**2 * 0.25 * jnp.pi * coil_diameter**2 / length


@stored_jit()
def heating(circuit: Circuit, frequency: Float[Array, "*f"]) -> Float[Array, "*f branches"]:
    """Power that heats every spring when the supply is at a frequency [W]."""
    impedance = circuit.impedance(frequency)
    node = 1.0 / jnp.sum(1.0 / impedance, axis=-1)
    at_branches = circuit.voltage * node / (node + circuit.lead_resistance)
    current = at_branches[..., None] / impedance
    return jnp.abs(current) ** 2 * circuit.resistance


@stored_jit()
def crosstalk(circuit: Circuit) -> Float[Array, "branches branches"]:
    """Heating of branch j when branch k is selected, over that of k [1]: row k, column j."""
    power = heating(circuit, circuit.resonance)
    return power / jnp.diagonal(power)[:, None]


@stored_jit()
def sensing(circuit: Circuit, frequencies: Float[Array, "f"]) -> Float[Array, "branches f"]:
    """Amplification of errors of measured admittances in the resistances.

    The real parts of the admittance at the frequencies tell the resistances. Their derivatives form a matrix;
    this is its inverse, scaled.

    Args:
        circuit: branches.
        frequencies: frequencies at which the admittance is measured [Hz], as many as there are branches.

    Returns:
        Relative error of each resistance for a relative error of each measured real part [1].
    """

    def measured(resistance: Array) -> Array:
        return jnp.real(eqx.tree_at(lambda c: c.resistance, circuit, resistance).admittance(frequencies))

    slope = jax.jacfwd(measured)(circuit.resistance)
    seen = measured(circuit.resistance)
    return jnp.linalg.inv(slope) * seen[None, :] / circuit.resistance[:, None]
