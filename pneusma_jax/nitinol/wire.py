"""A straight wire in tension: the spring's law, with axial strain, Young's moduli and `eps_L`.

`sigma = E eps - max(eps_L (xi0 E_m xi_sm + (1 - xi0) E_a xi_sa), E eps_R)`, `E = xi0 E_m + (1 - xi0) E_a`.
The phase follows the temperature on one reversible curve: no hysteresis, no shift by stress.
"""

import dataclasses
import enum
from collections.abc import Callable
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Int

from ..calibration import Calibration, load_calibration
from ..late import optimistix as optx
from ..numerics.implicit_root import OneUnknown
from ..numerics.newton import BoundedNewton
from ..numerics.safe import as_array, is_concrete, safe_divide
from ..pipeline import PLAIN, Pipeline
from . import detwinning, residual_strain, stress
from .residual_strain import SpringState, hotter_of

# Eqs. 3.1 and 3.2 over strain / eps_L, for a table without residual strain; the shift is small, so that a
# cold wire unloads elastically (a spring, whose wire is strained unevenly, does so from large strains only)
RESIDUAL = {"gR_amplitude": 0.065 / 0.1013, "gR_slope": 10.32 * 0.1013, "gR_shift": 0.5, "gR_decay": 5.0}
LONGEST = 0.5  # Maximum strain in the search; nitinol breaks at a fraction of it
# strains in units of eps_L between which a wire's strain is looked for; closer where detwinning sets in
LADDER = np.concatenate([np.linspace(-0.5, -0.1, 5), np.arange(16) / 64.0, np.linspace(0.25, 2.5, 37)])
MOST_STEPS = 80  # Maximum number of Newton steps within a rung, on which the law is nearly straight
FLATTEST = 1e-6  # Minimum slope of stress over strain, relative to the modulus, whose inverse is taken


class WireStatus(enum.IntEnum):
    """Outcome of one row of a wire; `sentence` says it in words."""

    converged = 0
    several_strains = 1
    no_strain = 2
    input_not_finite = 3

    @property
    def sentence(self) -> str:
        """Description of the outcome, for a person."""
        return _SENTENCES[self]


_SENTENCES = {
    WireStatus.converged: "One strain carries the stress.",
    WireStatus.several_strains: (
        "Several strains carry the stress, because the law falls with strain somewhere (eps_L times the slope"
        " of the detwinned fraction exceeds 1); the smallest is given."
    ),
    WireStatus.no_strain: (
        f"No strain between {-LONGEST:g} and {LONGEST:g} carries the stress; is its unit right?"
    ),
    WireStatus.input_not_finite: "The stress, strain, temperature or phase is not a finite number.",
}


class WireResponse(eqx.Module):
    """Response of a wire in one row.

    Attributes:
        strain: axial engineering strain [1]; stress: engineering stress [Pa]; xi0: martensite fraction [1];
        eps_R: residual strain [1]; status: a `WireStatus` code. A row that failed is NaN.
    """

    strain: Array
    stress: Array
    xi0: Array
    eps_R: Array
    status: Int[Array, "..."]

    @property
    def gamma(self) -> Array:
        """The strain, by the name that effects know from springs."""
        return self.strain


def _number() -> Array:
    return eqx.field(converter=as_array)


class WireAlloy(eqx.Module):
    """Constants of one nitinol alloy drawn into straight wire. SI, temperatures in degC.

    Attributes:
        beta_1, beta_2, beta_3: constants of the detwinned fraction of martensite over axial strain [1].
        ka_1, ka_2, ka_3: constants of the stress-induced fraction of austenite over axial strain [1].
        E_m, E_a: Young's moduli [Pa]; eps_L: largest detwinning strain [1].
        gR_amplitude, gR_slope, gR_shift, gR_decay: constants of the residual axial strain, Eqs. 3.1 and 3.2
            [1].
        T_mid, T_width: middle and width of the reversible martensite fraction over temperature [degC, K].
        name: static label.
    """

    beta_1: Array = _number()
    beta_2: Array = _number()
    beta_3: Array = _number()
    ka_1: Array = _number()
    ka_2: Array = _number()
    ka_3: Array = _number()
    E_m: Array = _number()
    E_a: Array = _number()
    eps_L: Array = _number()
    gR_amplitude: Array = _number()
    gR_slope: Array = _number()
    gR_shift: Array = _number()
    gR_decay: Array = _number()
    T_mid: Array = _number()
    T_width: Array = _number()
    name: str = eqx.field(static=True, default="")

    def __check_init__(self) -> None:
        if not is_concrete(self):
            return
        for key in ("E_m", "E_a", "eps_L", "T_width"):
            if not np.all(np.asarray(getattr(self, key)) > 0.0):
                raise ValueError(f"Wire constant `{key}` must be positive, but it is {getattr(self, key)}.")

    @classmethod
    def from_calibration(cls, table: Calibration) -> "WireAlloy":
        """Wire from a loaded table of kind alloy.

        A table without residual strain gets `RESIDUAL`, scaled by its `eps_L`.

        Raises:
            InputError: if the table, one for springs say, lacks a constant.
        """
        names = [field.name for field in dataclasses.fields(cls) if field.name not in (*RESIDUAL, "name")]
        values = table.require(names)
        residual = dict(RESIDUAL)
        residual["gR_amplitude"] *= values["eps_L"]
        residual["gR_slope"] /= values["eps_L"]
        stated = {key: value for key, value in table.values().items() if key in residual}
        return cls(**values, **(residual | stated), name=table.name)

    def xi_sm(self, strain: Array) -> Array:
        """Detwinned fraction of the martensite at an axial strain [1]."""
        return detwinning.generalised_logistic(strain, self.beta_1, self.beta_2, self.beta_3)

    def xi_sa(self, strain: Array) -> Array:
        """Stress-induced fraction of the austenite at an axial strain [1]."""
        return detwinning.algebraic_sigmoid(strain, self.ka_1, self.ka_2, self.ka_3)

    def martensite_fraction_at(self, temperature: Array) -> Array:
        """Onset martensite fraction on the one reversible curve over temperature [degC] -> [1]."""
        return jax.nn.sigmoid((self.T_mid - temperature) / self.T_width)

    def modulus(self, xi0: Array) -> Array:
        """Young's modulus of the phase mixture, Eq. 2.29 in tension [Pa]."""
        return stress.shear_modulus(xi0, self.E_m, self.E_a)

    def detwinning_stress(self, strain: Array, xi0: Array) -> Array:
        """Difference between the elastic stress and the stress with detwinning, Eq. 2.33 in tension [Pa]."""
        return stress.detwinning_stress(
            xi0, self.xi_sm(strain), self.xi_sa(strain), self.E_m, self.E_a, self.eps_L
        )

    def residual_strain_limit(self, prestrain: Array) -> Array:
        """Residual strain of the cold wire after a pre-strain, Eq. 3.1 in tension [1]."""
        return residual_strain.residual_strain_limit(
            prestrain, self.gR_amplitude, self.gR_slope, self.gR_shift, self.eps_L * self.xi_sm(prestrain)
        )

    def residual_strain(self, state: SpringState, xi0: Array) -> Array:
        """Residual strain at the present martensite fraction, remembering the hottest since, Eq. 3.2 [1]."""
        limit = self.residual_strain_limit(state.prestrain)
        return residual_strain.residual_strain(limit, hotter_of(state.xi_min, xi0), self.gR_decay)

    def axial_stress(self, strain: Array, xi0: Array, eps_R: Array) -> Array:
        """Engineering stress, Eqs. 2.33 and 3.3 in tension [Pa]."""
        return stress.shear_stress(strain, self.modulus(xi0), self.detwinning_stress(strain, xi0), eps_R)

    def loaded_stress(self, strain: Array, xi0: Array, eps_R: Array, pipeline: Pipeline = PLAIN) -> Array:
        """`axial_stress` with the effects that act at the slot `stress` [Pa]."""
        value = self.axial_stress(strain, xi0, eps_R)
        return pipeline.apply(
            "stress", value, wire=self, gamma=strain, xi0=xi0, gamma_R=eps_R, base_stress=value
        )

    def respond(
        self, strain: Array, xi0: Array, state: SpringState, pipeline: Pipeline = PLAIN
    ) -> WireResponse:
        """Stress at a prescribed strain [1] and martensite fraction [1]."""
        good = jnp.isfinite(strain) & jnp.isfinite(xi0)
        eps, phase = (jnp.where(good, x, 0.5) for x in (strain, xi0))
        eps_R = self.residual_strain(state, phase)
        status = jnp.where(good, int(WireStatus.converged), int(WireStatus.input_not_finite))
        return _checked_response(eps, self.loaded_stress(eps, phase, eps_R, pipeline), phase, eps_R, status)

    def strain_at(
        self, stress: Array, xi0: Array, state: SpringState, pipeline: Pipeline = PLAIN
    ) -> WireResponse:
        """Strain at a prescribed stress [Pa] and martensite fraction [1], all scalars.

        It is the smallest strain that carries the stress on the way up. A ladder of strains brackets it, and
        Newton's method refines it inside its rung. Derivatives come from the implicit function theorem.
        """
        good = jnp.isfinite(stress) & jnp.isfinite(xi0)
        load, phase = jnp.where(good, stress, 0.0), jnp.where(good, xi0, 0.5)
        eps_R, modulus = self.residual_strain(state, phase), self.modulus(phase)
        excess = lambda eps: (self.loaded_stress(eps, phase, eps_R, pipeline) - load) / modulus  # noqa: E731
        rungs = jnp.clip(jax.lax.stop_gradient(self.eps_L) * LADDER, -LONGEST, LONGEST)
        rungs = jnp.concatenate([jnp.asarray([-LONGEST]), rungs, jnp.asarray([LONGEST])])
        heights = jax.lax.stop_gradient(jax.vmap(excess)(rungs))
        crossings = (heights[:-1] < 0.0) & (heights[1:] >= 0.0)
        k = jnp.argmax(crossings)

        def search(f, start):
            return _refined_root(f, rungs[k], rungs[k + 1])

        eps, ended = jax.lax.custom_root(excess, rungs[k], search, _step, has_aux=True)
        found = jnp.where(jnp.sum(crossings) > 1, int(WireStatus.several_strains), int(WireStatus.converged))
        there = jnp.any(crossings) & (jax.lax.stop_gradient(ended) > 0.0)
        status = jnp.where(good, jnp.where(there, found, int(WireStatus.no_strain)),
                           int(WireStatus.input_not_finite))  # fmt: skip
        return _checked_response(eps, load, phase, eps_R, status)

    def remember(self, state: SpringState, response: WireResponse) -> SpringState:
        """Memory after a row (Section 3.4.1): the springs' rule, with axial strain.

        A failed row changes nothing.
        """
        good = response.status <= int(WireStatus.several_strains)
        eps, xi0 = (jnp.where(good, x, 0.5) for x in (response.strain, response.xi0))
        heated = SpringState(state.prestrain, hotter_of(state.xi_min, xi0))
        eps_R = self.residual_strain(heated, xi0)
        loading = stress.on_detwinning_branch(self.modulus(xi0), self.detwinning_stress(eps, xi0), eps_R)
        deeper = residual_strain.residual_strain(self.residual_strain_limit(eps), xi0, self.gR_decay) > eps_R
        renew = loading & deeper
        return SpringState(
            jnp.where(good & renew, eps, state.prestrain),
            jnp.where(good, jnp.where(renew, xi0, heated.xi_min), state.xi_min),
        )


def _checked_response(eps: Array, sigma: Array, xi0: Array, eps_R: Array, status: Array) -> WireResponse:
    """Response whose numbers are NaN where the status says that there are none."""
    bad = status > int(WireStatus.several_strains)
    eps, sigma, xi0, eps_R = (jnp.where(bad, jnp.nan, x) for x in (eps, sigma, xi0, eps_R))
    return WireResponse(eps, sigma, xi0, eps_R, status)


def _step(slope: Callable, excess: Array) -> Array:
    """Newton's step for a residual whose derivative is `slope(1)`."""
    return safe_divide(excess, slope(jnp.ones_like(excess)), FLATTEST)


def _refined_root(f: Callable, low: Array, high: Array) -> tuple[Array, Array]:
    """Root between `low`, where f < 0, and `high`, and 1 where there is one, else 0."""
    place = lambda share: low + share * (high - low)  # noqa: E731
    found = optx.root_find(
        lambda share, _: f(place(share[0]))[None] / (high - low), BoundedNewton(), jnp.full(1, 0.5),
        options={"free": 0}, max_steps=MOST_STEPS, adjoint=OneUnknown(), throw=False,
    )  # fmt: skip
    good = jnp.asarray(found.result == optx.RESULTS.successful)
    return place(found.value[0]), good.astype(low.dtype)


def load_wire(name_or_path: str | Path = "niti_wire") -> WireAlloy:
    """Wire by the name of a shipped table (`"niti_wire"`) or from a TOML file.

    Raises:
        InputError: if there is no such table, or it lacks a wire's constant.
    """
    return WireAlloy.from_calibration(load_calibration(name_or_path, kind="alloy"))
