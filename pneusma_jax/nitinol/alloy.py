"""An alloy's constants as a module, with the laws as its methods."""

import dataclasses
from pathlib import Path

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool

from ..calibration import Calibration, load_calibration
from ..numerics.safe import as_array, as_numpy, is_concrete, namespace_of
from . import detwinning, residual_strain, resistivity, stress
from .residual_strain import SpringState, hotter_of, hottest
from .resistivity import PhaseReading


def _number() -> Array:
    return eqx.field(converter=as_array)


class Alloy(eqx.Module):
    """Constants of one nitinol alloy after one heat treatment (Table 2.2, Eqs. 3.1 and 3.2).

    Field names are those of the files. SI units; resistivities in ohm per metre of wire, as the source has
    them; temperatures in degC.

    Attributes:
        beta_1, beta_2, beta_3: constants of the detwinned fraction of martensite [1].
        ka_1, ka_2, ka_3: constants of the stress-induced fraction of austenite [1].
        rho_mean, rho_span, km_1, km_2, km_3: constants of the resistivity of martensite [ohm/m, ohm/m, 1, 1,
            1].
        alpha_1, alpha_2: constants of the resistivity of austenite [ohm/m].
        a, b, gamma_max: constants of the exponent of the power law between the two resistivities [1].
        c: second exponent of that law at zero strain, 1 in the source and for nitinol [1].
        G_m, G_a: shear moduli [Pa]; gamma_L: largest detwinning strain [1]; poisson_ratio [1].
        gR_amplitude, gR_slope, gR_shift, gR_decay: constants of the residual strain [1].
        T_mid, T_width: middle and width of the reversible martensite fraction over temperature [degC, K].
        density, heat_capacity, convection: thermal constants of the wire [kg/m3, J/(kg K), W/(m2 K)].
        name: static label.
    """

    beta_1: Array = _number()
    beta_2: Array = _number()
    beta_3: Array = _number()
    ka_1: Array = _number()
    ka_2: Array = _number()
    ka_3: Array = _number()
    rho_mean: Array = _number()
    rho_span: Array = _number()
    km_1: Array = _number()
    km_2: Array = _number()
    km_3: Array = _number()
    alpha_1: Array = _number()
    alpha_2: Array = _number()
    a: Array = _number()
    b: Array = _number()
    gamma_max: Array = _number()
    G_m: Array = _number()
    G_a: Array = _number()
    gamma_L: Array = _number()
    poisson_ratio: Array = _number()
    gR_amplitude: Array = _number()
    gR_slope: Array = _number()
    gR_shift: Array = _number()
    gR_decay: Array = _number()
    T_mid: Array = _number()
    T_width: Array = _number()
    density: Array = _number()
    heat_capacity: Array = _number()
    convection: Array = _number()
    c: Array = eqx.field(converter=as_array, default=1.0)
    name: str = eqx.field(static=True, default="")

    def __check_init__(self) -> None:
        if not is_concrete(self):
            return
        for key in ("G_m", "G_a", "gamma_max", "a", "b", "c", "T_width"):
            if not np.all(np.asarray(getattr(self, key)) > 0.0):
                raise ValueError(f"Alloy constant `{key}` must be positive, but it is {getattr(self, key)}.")
        if np.any(_contrast_at_rest(self) == 0.0):
            raise ValueError(
                "The phases of the alloy must differ in resistivity at zero strain, but they do not."
            )

    @classmethod
    def from_calibration(cls, table: Calibration) -> "Alloy":
        """Alloy from a loaded table, without the keys that a spring does not need.

        Raises:
            InputError: if the table, one for straight wires say, lacks a constant.
        """
        names = [field.name for field in dataclasses.fields(cls) if field.name != "name"]
        return cls(**table.require(names), name=table.name)

    def xi_sm(self, gamma: Array) -> Array:
        """Detwinned fraction of the martensite at a shear strain [1]."""
        return detwinning.generalised_logistic(gamma, self.beta_1, self.beta_2, self.beta_3)

    def xi_sa(self, gamma: Array) -> Array:
        """Stress-induced fraction of the austenite at a shear strain [1]."""
        return detwinning.algebraic_sigmoid(gamma, self.ka_1, self.ka_2, self.ka_3)

    def rho_m(self, gamma: Array) -> Array:
        """Resistivity of the fully martensitic wire at a shear strain [ohm/m]."""
        return self.rho_m_of(self.xi_sm(gamma))

    def rho_m_of(self, xi_sm: Array) -> Array:
        """Resistivity of the fully martensitic wire over its detwinned fraction [ohm/m]."""
        return resistivity.martensite_resistivity(
            xi_sm, self.rho_mean, self.rho_span, self.km_1, self.km_2, self.km_3
        )

    def rho_a(self, gamma: Array) -> Array:
        """Resistivity of the fully austenitic wire at a shear strain [ohm/m]."""
        return self.rho_a_of(self.xi_sa(gamma))

    def rho_a_of(self, xi_sa: Array) -> Array:
        """Resistivity of the fully austenitic wire over its stress-induced fraction [ohm/m]."""
        return resistivity.austenite_resistivity(xi_sa, self.alpha_1, self.alpha_2)

    def exponents(self, gamma: Array) -> tuple[Array, Array]:
        """Both exponents of the interpolation at a shear strain [1]."""
        first, second = (
            resistivity.interpolation_exponent(gamma, at_rest, self.b, self.gamma_max)
            for at_rest in (self.a, self.c)
        )
        return first, second

    def mixing_fraction(self, xi0: Array, gamma: Array) -> Array:
        """Weight A of the martensite's resistivity at a fraction and a shear strain, Eq. 2.41 [1]."""
        return resistivity.mixing_fraction(xi0, *self.exponents(gamma))

    def resistivity(self, xi0: Array, gamma: Array) -> Array:
        """Resistivity of the wire, Eq. 2.40 [ohm/m]."""
        weight = self.mixing_fraction(xi0, gamma)
        return resistivity.mixed_resistivity(weight, self.rho_m(gamma), self.rho_a(gamma))

    def resistivity_and_contrast(self, xi0: Array, gamma: Array) -> tuple[Array, Array]:
        """Resistivity of the wire, and the contrast: that of martensite less that of austenite [ohm/m]."""
        rho_m, rho_a = self.rho_m(gamma), self.rho_a(gamma)
        mixed = resistivity.mixed_resistivity(self.mixing_fraction(xi0, gamma), rho_m, rho_a)
        return mixed, rho_m - rho_a

    def martensite_fraction(self, rho: Array, gamma: Array) -> PhaseReading:
        """Onset martensite fraction from the resistivity [ohm/m], Eq. 2.48."""
        exponents = self.exponents(gamma)
        return resistivity.martensite_fraction(rho, self.rho_m(gamma), self.rho_a(gamma), *exponents)

    def martensite_fraction_at(self, temperature: Array) -> Array:
        """Onset martensite fraction on the one reversible curve over temperature [degC] -> [1]."""
        xp = namespace_of(temperature, self.T_mid, self.T_width)
        return 1.0 / (1.0 + xp.exp((temperature - self.T_mid) / self.T_width))

    def residual_strain_limit(self, prestrain: Array) -> Array:
        """Residual strain of the cold wire after a pre-strain, Eq. 3.1 [1]."""
        return residual_strain.residual_strain_limit(
            prestrain, self.gR_amplitude, self.gR_slope, self.gR_shift, self.gamma_L * self.xi_sm(prestrain)
        )

    def residual_strain(self, state: SpringState, xi0: Array) -> Array:
        """Residual strain of a spring in a state, now at martensite fraction `xi0`, Eq. 3.2 [1].

        It follows the hottest state since the pre-strain.
        """
        limit = self.residual_strain_limit(state.prestrain)
        return residual_strain.residual_strain(limit, hottest(state, xi0), self.gR_decay)

    def modulus(self, xi0: Array) -> Array:
        """Shear modulus of the phase mixture, Eq. 2.29 [Pa]."""
        return stress.shear_modulus(xi0, self.G_m, self.G_a)

    def detwinning_stress(self, gamma: Array, xi0: Array) -> Array:
        """Difference between the elastic stress and the stress with detwinning, Eq. 2.33 [Pa]."""
        return stress.detwinning_stress(
            xi0, self.xi_sm(gamma), self.xi_sa(gamma), self.G_m, self.G_a, self.gamma_L
        )

    def shear_stress(self, gamma: Array, xi0: Array, gamma_R: Array) -> Array:
        """Shear stress, Eqs. 2.33 and 3.3 [Pa]."""
        return stress.shear_stress(gamma, self.modulus(xi0), self.detwinning_stress(gamma, xi0), gamma_R)

    def remember(
        self, state: SpringState, gamma: Array, xi0: Array, margin: Array | float = 0.0
    ) -> SpringState:
        """State after a row that ended at strain `gamma` and fraction `xi0` (Section 3.4.1).

        Heating lowers `xi_min`. Loading along the detwinning curve renews the state if it leaves a larger
        residual strain: the pre-strain becomes `gamma`, and `xi_min` becomes `xi0`.

        Args:
            state: memory before the row.
            gamma: shear strain [1].
            xi0: martensite fraction [1].
            margin: excess that a renewal needs over the residual strain, as part of it [1]. The law has 0.
                Fits try other values, as the rule jumps with parameters.
        """
        xi_min = hottest(state, xi0)
        renew = self.renews(state, gamma, xi0, margin) if state.decided is None else state.decided.renews
        xp = namespace_of(renew, gamma, xi0, state.prestrain, xi_min)
        return SpringState(xp.where(renew, gamma, state.prestrain), xp.where(renew, xi0, xi_min))

    def renews(
        self, state: SpringState, gamma: Array, xi0: Array, margin: Array | float = 0.0
    ) -> Bool[Array, "..."]:
        """True where a row renews the memory; arguments as for `remember`."""
        xi_min = hotter_of(hottest(state, xi0), xi0)
        limit = self.residual_strain_limit(state.prestrain)
        gamma_R = residual_strain.residual_strain(limit, xi_min, self.gR_decay)
        threshold = (1.0 + margin) * gamma_R
        detwinning = self.detwinning_stress(gamma, xi0)
        loading = stress.on_detwinning_branch(self.modulus(xi0), detwinning, threshold)
        left = residual_strain.residual_strain(self.residual_strain_limit(gamma), xi0, self.gR_decay)
        return loading & (left > threshold)


def _contrast_at_rest(alloy: Alloy) -> Array:
    """Resistivity of martensite less that of austenite at zero strain [ohm/m]; no constant may be traced."""
    concrete, unstrained = as_numpy(alloy), np.zeros(())
    return concrete.rho_m(unstrained) - concrete.rho_a(unstrained)


def load_alloy(name_or_path: str | Path | Calibration) -> Alloy:
    """Alloy by the name of a shipped table (`"krl35"`, `"krl45"`), from a TOML file, or from a loaded table.

    Raises:
        InputError: if there is no such table, or something in it is wrong.
    """
    return Alloy.from_calibration(load_calibration(name_or_path, kind="alloy"))
