"""A spring on a test stand at a given trajectory of its martensite fraction: force, resistance and memory.

The memory follows the rule row by row, or comes from rows that are known to have set it.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from fitting.inference.latent_trajectory import smoother
from pneusma_jax.nitinol import Alloy, Spring, SpringState
from pneusma_jax.nitinol.residual_strain import residual_strain
from pneusma_jax.nitinol.resistivity import mixed_resistivity, mixing_fraction
from pneusma_jax.nitinol.stress import detwinning_stress, on_detwinning_branch, shear_stress, shear_stress_on

from . import turning_points


class Trajectory(eqx.Module):
    """Prediction of a recording; arrays of shape (rows,), SI.

    Attributes:
        force [N], resistance [ohm], stress [Pa]: predicted.
        gamma: shear strain [1]; xi0: martensite fraction [1]; gamma_R: residual strain [1].
        local: linearisation of force and resistance over the martensite fraction, about this trajectory.
    """

    force: Array
    resistance: Array
    stress: Array
    gamma: Array
    xi0: Array
    gamma_R: Array
    local: smoother.Local


class Decisions(eqx.Module):
    """Decisions of the residual strain's rule in each row of a test, shape (rows,) each.

    Attributes:
        origin: row whose strain set the residual strain at the beginning of this row; -1 for the pre-strain.
        hottest: row with the smallest martensite fraction since then; -1 for none.
        hotter: true if this row is hotter than that one.
        loading: true if the wire is on the detwinning branch, false on the elastic one.
        course: martensite fraction that the decisions were made on; the search at other parameters begins
            there.
    """

    origin: Int[Array, " rows"]
    hottest: Int[Array, " rows"]
    hotter: Bool[Array, " rows"]
    loading: Bool[Array, " rows"]
    course: Float[Array, " rows"]

    @classmethod
    def blank(cls, shape: tuple[int, ...]) -> "Decisions":
        """Decisions of a wire that remembers nothing but its pre-strain."""
        never, no = jnp.full(shape, -1, int), jnp.zeros(shape, bool)
        return cls(never, never, no, no, jnp.zeros(shape))


class Strained(eqx.Module):
    """A spring's alloy at the strains of a test: everything that the latent trajectory leaves as it is.

    Attributes:
        gamma: shear strain [1].
        xi_sm, xi_sa: detwinned fraction of the martensite, and stress-induced fraction of the austenite [1].
        rho_m, rho_a: resistivities of both phases [ohm/m].
        exponents: both exponents between the resistivities [1].
    """

    gamma: Float[Array, " rows"]
    xi_sm: Float[Array, " rows"]
    xi_sa: Float[Array, " rows"]
    rho_m: Float[Array, " rows"]
    rho_a: Float[Array, " rows"]
    exponents: tuple[Float[Array, " rows"], Float[Array, " rows"]]

    @classmethod
    def of(cls, alloy: Alloy, gamma: Float[Array, " rows"]) -> "Strained":
        """The alloy at these shear strains."""
        xi_sm, xi_sa = alloy.xi_sm(gamma), alloy.xi_sa(gamma)
        return cls(gamma, xi_sm, xi_sa, alloy.rho_m_of(xi_sm), alloy.rho_a_of(xi_sa), alloy.exponents(gamma))

    def resistivity(self, xi0: Array) -> Array:
        """Resistivity of the wire, Eq. 2.40 [ohm/m]."""
        return mixed_resistivity(mixing_fraction(xi0, *self.exponents), self.rho_m, self.rho_a)

    def detwinning_stress(self, alloy: Alloy, xi0: Array) -> Array:
        """Difference between the elastic stress and the stress with detwinning, Eq. 2.33 [Pa]."""
        return detwinning_stress(xi0, self.xi_sm, self.xi_sa, alloy.G_m, alloy.G_a, alloy.gamma_L)


class Law(eqx.Module):
    """A spring and its test, as a function of the latent trajectory.

    Attributes:
        spring: the spring; prestrain: its shear strain before the test [1].
        decisions: known decisions of the residual strain's rule; None to follow the rule.
        strained: the alloy at the strains of the test.
        limit: residual strain in every row if the wire stays cold, shape (rows,); None without decisions.
    """

    spring: Spring
    prestrain: Array
    decisions: Decisions | None
    strained: Strained
    limit: Float[Array, " rows"] | None

    @classmethod
    def of(cls, spring: Spring, prestrain: Array, elongation: Array, decisions: Decisions | None) -> "Law":
        """The law of a test with these elongations [m], shape (rows,)."""
        strained = Strained.of(spring.alloy, spring.shear_strain(elongation))
        by_rule = cls(spring, prestrain, None, strained, None)
        return by_rule if decisions is None else by_rule.decided(decisions)

    def decided(self, decisions: Decisions) -> "Law":
        """The same law with known decisions of the residual strain's rule."""
        strain = _strain_set(self.prestrain, self.strained.gamma, decisions)
        limit = self.spring.alloy.residual_strain_limit(strain)
        return Law(self.spring, self.prestrain, decisions, self.strained, limit)

    def states(self, xi0: Array) -> tuple[SpringState, Array]:
        """Memory at the beginning of every row, by the rule or from the rows that are known to have set it.

        The second result is the row that its martensite fraction comes from, -1 for none.
        """
        if self.decisions is None:
            states, (_, hottest) = self.by_rule(self.strained.gamma, xi0)
            return states, hottest
        strain = _strain_set(self.prestrain, self.strained.gamma, self.decisions)
        hottest = self.decisions.hottest
        return SpringState(strain, jnp.where(hottest < 0, 1.0, xi0[hottest])), hottest

    def by_rule(
        self, gamma: Array, xi0: Array, slack: Array | float = 0.0, margin: Array | float = 0.0
    ) -> tuple[SpringState, tuple[Array, Array]]:
        """Memory at the beginning of every row, and the rows that its strain and its fraction come from.

        A row within `slack` of the smallest fraction is the one that is remembered from then on. `margin` is
        a part of the residual strain: the wire must exceed the elastic branch by it to renew its memory.
        """

        def row(carry: tuple, now: tuple[Array, Array, Array, Array]) -> tuple[tuple, tuple]:
            state, origin, hottest = carry
            gamma, xi0, number, slack = now
            after = self.spring.alloy.remember(state, gamma, xi0, margin)
            alike = (after.xi_min != state.xi_min) | (xi0 < state.xi_min + slack)
            updated = (
                jnp.where(after.prestrain != state.prestrain, number, origin),
                jnp.where(alike, number, hottest),
            )
            return (after, *updated), carry

        first = SpringState(self.prestrain, jnp.ones_like(self.prestrain))
        never = jnp.asarray(-1)
        rows = (gamma, xi0, jnp.arange(gamma.size), jnp.broadcast_to(slack, gamma.shape))
        states, *sources = jax.lax.scan(row, (first, never, never), rows)[1]
        return states, tuple(sources)

    def mechanics(self, xi0: Array, states: SpringState) -> tuple[Array, Array]:
        """Shear stress [Pa] and residual strain [1]."""
        alloy, gamma = self.spring.alloy, self.strained.gamma
        modulus, detwinning = alloy.modulus(xi0), self.strained.detwinning_stress(alloy, xi0)
        if self.decisions is None:
            gamma_R = alloy.residual_strain(states, xi0)
            return shear_stress(gamma, modulus, detwinning, gamma_R), gamma_R
        hottest = jnp.where(self.decisions.hotter, xi0, states.xi_min)
        gamma_R = residual_strain(self.limit, hottest, alloy.gR_decay)
        return shear_stress_on(self.decisions.loading, gamma, modulus, detwinning, gamma_R), gamma_R

    def follow(self, xi0: Array) -> Trajectory:
        """The test at a given trajectory of the martensite fraction."""
        geometry, (states, hottest) = self.spring.geometry, self.states(xi0)

        def force(xi0: Array, xi_min: Array) -> tuple[Array, tuple[Array, Array]]:
            stress, gamma_R = self.mechanics(xi0, SpringState(states.prestrain, xi_min))
            return geometry.force(stress), (stress, gamma_R)

        def outputs(xi0: Array) -> tuple[Array, tuple[Array, Array]]:
            pull, known = force(xi0, states.xi_min)
            return jnp.stack([pull, self.strained.resistivity(xi0) * geometry.wire_length]), known

        one = jnp.ones_like(xi0)
        predicted, slope, (stress, gamma_R) = jax.jvp(outputs, (xi0,), (one,), has_aux=True)
        by_memory = jax.jvp(lambda xi_min: force(xi0, xi_min), (states.xi_min,), (one,), has_aux=True)[1]
        remembered = jnp.stack([jnp.where(hottest < 0, 0.0, by_memory), jnp.zeros_like(xi0)])
        local = smoother.Local(predicted, slope, remembered, jnp.maximum(hottest, 0))
        return Trajectory(predicted[0], predicted[1], stress, self.strained.gamma, xi0, gamma_R, local)

    def decide(self, xi0: Array, slack: Array | float = 0.0, margin: Array | float = 0.0) -> Decisions:
        """Decisions of the rule at a given trajectory of the martensite fraction.

        Args:
            xi0: martensite fraction, shape (rows,).
            slack: indistinguishable difference of fractions, shape (rows,). A row within it of the hottest
                one is as hot, and its own fraction counts.
            margin: part of the residual strain, see `by_rule`.
        """
        gamma = self.strained.gamma
        states, (origin, hottest) = self.by_rule(gamma, xi0, slack, margin)
        return self._decisions(gamma, xi0, slack, states, origin, hottest)

    def likeliest(
        self, xi0: Array, slack: Array, margin: Array, force: Array, weight: Array, count: int
    ) -> Decisions:
        """Decisions that agree with the rule and the measured force, the best first: shape (count, rows)
        each.

        Args:
            xi0: martensite fraction, shape (rows,).
            slack: indistinguishable difference of fractions, see `decide`.
            margin: maximum deviation of each turning point from the rule, as part of the residual strain.
            force: measured force [N]; weight: its inverse standard deviation, zero where it was not measured.
            count: number of decisions to return.
        """
        gamma, area = self.strained.gamma, self.spring.geometry.force(jnp.ones(()))
        course = turning_points.Course(gamma, xi0, slack, force / area, weight * area)
        found = turning_points.likeliest(self.spring.alloy, self.prestrain, course, margin, count)

        def one(known: turning_points.Memories) -> Decisions:
            states = SpringState(known.prestrain, known.xi_min)
            return self._decisions(gamma, xi0, slack, states, known.origin, known.hottest)

        return jax.vmap(one)(found)

    def _decisions(
        self,
        gamma: Array,
        xi0: Array,
        slack: Array | float,
        states: SpringState,
        origin: Array,
        hottest: Array,
    ) -> Decisions:
        alloy = self.spring.alloy
        gamma_R = alloy.residual_strain(states, xi0)
        loading = on_detwinning_branch(alloy.modulus(xi0), alloy.detwinning_stress(gamma, xi0), gamma_R)
        return Decisions(origin, hottest, xi0 < states.xi_min + slack, loading, xi0)


def _strain_set(prestrain: Array, gamma: Array, decisions: Decisions) -> Float[Array, " rows"]:
    """Shear strain that set the residual strain at the beginning of every row."""
    return jnp.where(decisions.origin < 0, prestrain, gamma[decisions.origin])
