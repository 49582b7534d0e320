"""One nitinol spring as an element: elongation and activation in, pull and resistance out."""

from collections.abc import Iterable
from typing import Any, Protocol

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from ..numerics.safe import as_array, is_concrete
from ..pipeline import PLAIN, Pipeline
from .alloy import Alloy
from .geometry import SpringGeometry
from .residual_strain import SpringState
from .resistivity import PhaseReading


class Activation(Protocol):
    """The interface of a spring's drive: it turns strain into a martensite fraction."""

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """Martensite fraction of the wire at shear strain `gamma`."""


class MartensiteFraction(eqx.Module):
    """A given onset martensite fraction xi0: 1 is cold, 0 is fully austenitic [1]."""

    value: Array = eqx.field(converter=as_array)

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """The given fraction, which never clips."""
        no = jnp.zeros(jnp.broadcast_shapes(jnp.shape(self.value), jnp.shape(gamma)), bool)
        return PhaseReading(self.value, no, no)


def drives_of(activations: Any, more: tuple[type, ...] = ()) -> tuple:
    """Activations as a tuple, empty where none is given.

    Args:
        activations: argument of a user.
        more: types that may stand in place of an activation.

    Raises:
        TypeError: if one is no drive.
    """
    drives = tuple(activations) if isinstance(activations, Iterable) else None
    if drives is None or any(not (hasattr(drive, "read") or isinstance(drive, more)) for drive in drives):
        raise TypeError(
            "Argument `activations` must be a tuple of drives, one per spring, such as "
            f"(MartensiteFraction(1.0), MartensiteFraction(0.4)), but it is {activations!r}."
        )
    return drives


def check_fractions(numbers: tuple[int, ...], activations: tuple) -> None:
    """Refuse given fractions outside of 0 to 1 and resistances that are not positive, where they are known.

    Args:
        numbers: numbers of the springs.
        activations: activations, one per spring.

    Raises:
        ValueError: naming the spring and the number.
    """
    for number, activation in zip(numbers, activations, strict=False):
        if isinstance(activation, Resistance) and is_concrete(activation.value):
            least = np.min(np.nan_to_num(activation.value, nan=np.inf), initial=np.inf)
            if least <= 0.0:
                raise ValueError(
                    f"The resistance of spring {number} must be positive [ohm], but it is {least:g}."
                )
        if isinstance(activation, MartensiteFraction):
            check_fraction(f"spring {number}", activation.value)


def check_fraction(whose: str, value: Array) -> None:
    """Refuse fractions outside of 0 to 1, where they are known.

    Args:
        whose: owner of the fraction, in words.
        value: fraction [1], any shape; NaN is let pass.

    Raises:
        ValueError: naming the owner and the number.
    """
    if not is_concrete(value):
        return
    given = np.asarray(value)
    wrong = given[np.isfinite(given) & ((given < 0.0) | (given > 1.0))]
    if wrong.size:
        raise ValueError(
            f"The martensite fraction of {whose} must be between 0 and 1, but it is {float(wrong.flat[0])}."
        )


class Temperature(eqx.Module):
    """A known temperature of the wire [degC]. The phase follows it on the one reversible curve."""

    value: Array = eqx.field(converter=as_array)

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """The fraction at the temperature, which never clips."""
        xi0 = alloy.martensite_fraction_at(pipeline.apply("temperature", self.value))
        no = jnp.zeros(jnp.broadcast_shapes(jnp.shape(xi0), jnp.shape(gamma)), bool)
        return PhaseReading(xi0, no, no)


class Resistance(eqx.Module):
    """A measured electrical resistance of the active wire.

    Attributes:
        value: reading [ohm].
        noise: standard deviation of the reading [ohm]. A cold or hot spring stays cold or hot if its
            resistance misses the reading by up to three of these. Otherwise noise about a cold spring would
            heat it.
    """

    value: Array = eqx.field(converter=as_array)
    noise: Array = eqx.field(converter=as_array, default=0.0)

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """The fraction by Eq. 2.48."""
        wire = pipeline.apply("wire_resistance", self.value)
        return alloy.martensite_fraction(wire / wire_length, gamma)

    def excess(
        self, spring: "Spring", elongation: Array, xi0: Array, pipeline: Pipeline = PLAIN
    ) -> tuple[Array, Array]:
        """Resistance of a candidate fraction less the measured one, and the contrast of the phases [ohm].

        Unlike the fraction of Eq. 2.48, which rises with infinite slope near full heat, this is smooth in the
        fraction. The contrast is that of full martensite over austenite at this elongation.
        """
        alloy, length = spring.alloy, spring.geometry.wire_length
        pipeline = pipeline.with_known(spring=spring)
        gamma = spring.shear_strain(pipeline.apply("elongation", elongation))
        wire = pipeline.with_known(elongation=elongation, gamma=gamma).apply("wire_resistance", self.value)
        return alloy.resistivity(xi0, gamma) * length - wire, spring.contrast(gamma)


class LocatedFraction(eqx.Module):
    """A fraction that was solved together with the configuration from a measured resistance.

    Attributes:
        value: onset martensite fraction [1].
        measured: underlying resistance, whose flags the reading carries.
    """

    value: Array
    measured: Resistance

    def read(
        self, alloy: Alloy, gamma: Array, wire_length: Array, pipeline: Pipeline = PLAIN
    ) -> PhaseReading:
        """The located fraction, with the flags of Eq. 2.48 at this strain."""
        law = self.measured.read(alloy, gamma, wire_length, pipeline)
        return PhaseReading(self.value, law.clipped, law.degenerate)


class SpringResponse(eqx.Module):
    """Response of a spring at one elongation.

    Attributes:
        force: pull [N]; stress: shear stress [Pa]; gamma: shear strain [1]; xi0: martensite fraction [1];
        gamma_R: residual strain [1].
        resistance: instrument reading of the resistance, of the active wire in the base model [ohm].
        clipped, degenerate: flags of `PhaseReading`.
    """

    force: Array
    stress: Array
    gamma: Array
    xi0: Array
    gamma_R: Array
    resistance: Array
    clipped: Array
    degenerate: Array


class Spring(eqx.Module):
    """A spring held at `attached_length` when its elongation coordinate is zero.

    Attributes:
        geometry: dimensions of the spring.
        alloy: constants of the alloy.
        attached_length: length at zero elongation [m]; the free length on a test stand, 56 mm on the source's
            actuators.
    """

    geometry: SpringGeometry
    alloy: Alloy
    attached_length: Array = eqx.field(converter=as_array)

    @property
    def contrast_at_rest(self) -> Array:
        """Magnitude of the difference between the phases' resistances at zero strain [ohm]."""
        zero = jnp.zeros(())
        return jnp.abs(self.alloy.rho_m(zero) - self.alloy.rho_a(zero)) * self.geometry.wire_length

    def contrast(self, gamma: Array) -> Array:
        """Resistance of full martensite less that of austenite at a shear strain [ohm]."""
        return (self.alloy.rho_m(gamma) - self.alloy.rho_a(gamma)) * self.geometry.wire_length

    def shear_strain(self, elongation: Array) -> Array:
        """Shear strain of the wire at an elongation from the attached length [m] -> [1]."""
        stretch = self.attached_length + elongation - self.geometry.free_length
        return self.geometry.shear_strain(stretch, self.alloy.poisson_ratio)

    def respond(
        self, elongation: Array, activation: Activation, state: SpringState, pipeline: Pipeline = PLAIN
    ) -> SpringResponse:
        """Pull and resistance at an elongation from the attached length [m].

        Args:
            elongation: elongation from the attached length [m].
            activation: drive of the phase.
            state: memory of the spring.
            pipeline: effects beyond the base model.
        """
        loaded, pipeline = self._loaded(elongation, activation, state, pipeline)
        wire = self.alloy.resistivity(loaded["xi0"], loaded["gamma"]) * self.geometry.wire_length
        solved = dict(stress=loaded["stress"], force=loaded["force"])
        return SpringResponse(**loaded, resistance=pipeline.apply("resistance", wire, **solved))

    def pull(
        self, elongation: Array, activation: Activation, state: SpringState, pipeline: Pipeline = PLAIN
    ) -> Array:
        """The force of `respond` alone [N]."""
        return self._loaded(elongation, activation, state, pipeline)[0]["force"]

    def plain_pull(self, elongation: Array, xi0: Array, state: SpringState) -> Array:
        """Pull at a fraction [N], without effects."""
        gamma = self.shear_strain(elongation)
        gamma_R = self.alloy.residual_strain(state, xi0)
        return self.geometry.force(self.alloy.shear_stress(gamma, xi0, gamma_R))

    def plain_pull_and_resistance(
        self, elongation: Array, xi0: Array, state: SpringState
    ) -> tuple[Array, Array, Array]:
        """Pull [N], resistance [ohm] and `contrast` [ohm] at a fraction, without effects."""
        wire = self.geometry.wire_length
        ohms, contrast = self.alloy.resistivity_and_contrast(xi0, self.shear_strain(elongation))
        return self.plain_pull(elongation, xi0, state), ohms * wire, contrast * wire

    def _loaded(
        self, elongation: Array, activation: Activation, state: SpringState, pipeline: Pipeline
    ) -> tuple[dict[str, Array], Pipeline]:
        """Response without the resistance, and the pipeline that computes it."""
        pipeline = pipeline.with_known(spring=self)
        gamma = self.shear_strain(pipeline.apply("elongation", elongation))
        pipeline = pipeline.with_known(elongation=elongation, gamma=gamma)
        reading = activation.read(self.alloy, gamma, self.geometry.wire_length, pipeline)
        xi0 = pipeline.apply("phase", reading.xi0)
        gamma_R = self.alloy.residual_strain(state, xi0)
        base = self.alloy.shear_stress(gamma, xi0, gamma_R)
        pipeline = pipeline.with_known(xi0=xi0, gamma_R=gamma_R, base_stress=base)
        stress = pipeline.apply("stress", base)
        loaded = dict(
            force=pipeline.apply("pull", self.geometry.force(stress), stress=stress),
            stress=stress,
            gamma=gamma,
            xi0=xi0,
            gamma_R=gamma_R,
            clipped=reading.clipped,
            degenerate=reading.degenerate,
        )
        return loaded, pipeline

    def remember(self, state: SpringState, response: SpringResponse) -> SpringState:
        """State after a row that ended with this response."""
        return self.alloy.remember(state, response.gamma, response.xi0)
