"""Forward model of a spring on a test stand without effects, along the latent trajectory that explains it
best.

The martensite fraction is no input. It is a latent trajectory that explains resistance and force together
(`inference.latent_trajectory.smoother.profile`). The resistance determines the fraction of a cold wire well
and that of a hot wire poorly. Where both phases conduct alike it says nothing. Read sample by sample, its
noise would enter the running minimum that the residual strain remembers.

Both measured quantities are outputs. The profile carries the fraction's uncertainty into both, so that no row
is overweighted.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.inference.latent_trajectory import smoother
from pneusma_jax.nitinol import Spring

from .correlated_noise import KEY, independent
from .rows import Rows, numbers, with_extra
from .spring_law import Decisions, Law, Trajectory
from .spring_rows import MARGIN, OUTPUTS, spring_of

MARGINS = (0.0, *(sign * size for size in (7e-4, 2e-3, 5e-3, 0.012, MARGIN) for sign in (-1.0, 1.0)))
"""Candidate deviations that all turning points of a test share, as parts of the residual strain. The first is
the rule."""
HISTORIES = 4
"""Number of further candidate histories per test, in which each turning point is decided by itself."""
LEVELS = (0.2, 0.5)
"""Constant trajectories that the search also starts from."""
ALIKE = 2.0
"""Number of standard deviations of the martensite fraction within which two rows are equally hot."""
NEARLY_COLD = 1e-3
"""Maximum austenite of a test that is held at martensite [1]. Up to there resistance is linear in it. For
an exponent `a` of 10, 1 - (1 - x)^a and a x differ by less than 0.5 %."""


def _outputs(law: Law, xi0: Array) -> smoother.Local:
    return law.follow(xi0).local


def law_of(values: Mapping[str, Array], rows: Rows) -> Law:
    """Law of the spring of a recording, with the decisions that the recording carries."""
    parameters = numbers(values, rows)
    spring, decisions = spring_of(parameters), rows.extra.get("decisions")
    return Law.of(spring, parameters["prestrain"], rows.inputs["elongation"], decisions)


def _walk(rows: Rows) -> smoother.Walk:
    extra = rows.extra
    free = extra["level_sd"] > 0.0
    level_sd = jnp.where(free, extra["level_sd"], 1.0)
    return smoother.Walk.over(rows.time, rows.mask & free, extra["process_noise"], extra["level"], level_sd)


def _independent(rows: Rows) -> smoother.Independent | None:
    """Function that makes the noise of the weighted outputs independent; None where it is so."""
    return eqx.Partial(_independent_outputs, rows) if KEY in rows.extra else None


def _independent_outputs(rows: Rows, weighted: Float[Array, "k rows"]) -> Float[Array, "k rows"]:
    parts = zip(OUTPUTS, weighted, strict=True)
    return jnp.stack([independent(rows, name, one) for name, one in parts])


def _first_guess(law: Law, rows: Rows) -> Array:
    """First guess of the trajectory: the earlier one, else the fractions that smoothed resistances imply,
    else the held level."""
    if law.decisions is not None:
        return law.decisions.course
    return jnp.where(rows.extra["level_sd"] > 0.0, fraction_read(law.spring, rows), rows.extra["level"])


def fraction_read(spring: Spring, rows: Rows) -> Array:
    """Martensite fraction that each resistance implies by itself, shape (rows,)."""
    gamma = spring.shear_strain(rows.inputs["elongation"])
    rho = rows.inputs["resistance"] / spring.geometry.wire_length
    return spring.alloy.martensite_fraction(rho, gamma).xi0


def trajectory(values: Mapping[str, Array], rows: Rows) -> Trajectory:
    """Prediction of a recording at the trajectory of the martensite fraction that explains it best.

    Args:
        values: free parameters by name, SI.
        rows: one recording. Where `extra["force_informs"]` is 0, as for a prediction, resistance alone
            determines the trajectory. Where it is 1, as for a fit, the force takes part.
    """
    law = law_of(values, rows)
    measured = jnp.stack([rows.measured[name] for name in OUTPUTS])
    weight = jnp.stack([rows.weight["force"] * rows.extra["force_informs"], rows.weight["resistance"]])
    start, noise, free = _first_guess(law, rows), _independent(rows), rows.extra["level_sd"] > 0.0
    # a held fraction has no walk: its search would take all rounds, and in a stack all others wait for it
    searched = jnp.where(free, weight, 0.0)
    course = smoother.profile(_outputs, law, measured, searched, _walk(rows), start, noise)
    return law.follow(jnp.where(free, course, _held(law, rows, measured, weight)))


def _held(law: Law, rows: Rows, measured: Array, weight: Array) -> Array:
    """Martensite fraction of a test that is held: its level, less the austenite that a cold wire shows.

    A cold wire's resistance falls by `a` times the fraction that is austenite, with an exponent `a` near ten.
    So a few parts in a million of austenite, as 12 widths below the transformation, move a precise
    resistance by half its noise. Held at exactly 1, that would bend the constants of the resistivity. The
    austenite of each cold test is constant, not negative, unknown otherwise, and profiled like a trajectory.
    """
    level = jnp.full_like(rows.time, rows.extra["level"])
    local = law.follow(level).local
    misfit, slope = weight * (local.predicted - measured), weight * local.along(jnp.ones_like(level))
    if noise := _independent(rows):
        misfit, slope = noise(misfit), noise(slope)
    austenite = jnp.sum(misfit * slope) / jnp.maximum(jnp.sum(slope**2), jnp.finfo(float).tiny)
    austenite = jnp.where(austenite > 0.0, jnp.minimum(austenite, NEARLY_COLD), 0.0)
    return level - jnp.where(rows.extra["level"] == 1.0, austenite, 0.0)


def at_phase(values: Mapping[str, Array], rows: Rows, xi0: Array) -> Trajectory:
    """Prediction of a recording at a given trajectory of the martensite fraction, shape (rows,)."""
    return law_of(values, rows).follow(xi0)


def decided(values: Mapping[str, Array], stacked: Rows) -> Rows:
    """A stack with the decisions of the residual strain's rule in each row, at these parameters.

    The rule goes row by row. As a function of the parameters it has corners and small jumps. With its
    decisions known everything is smooth and all rows are computed at once. A fit decides, fits, and decides
    again until nothing changes.

    The hottest row of a noisy trajectory is the one whose noise was lowest. All later rows would remember it,
    which biases the scale of the fraction. So the decision uses the trajectory at the process noise that the
    resistance implies, not the looser one of a fit. Rows that are indistinguishably hot use their own
    fraction.

    At a turning point noise often decides if a wire still loads and renews its memory, with a jump of all
    later rows. Of the decisions within a few per cent of the rule, each test takes those that explain it
    best. They share one margin, or the following force decides each turning point. The first needs good
    constants, the second a good trajectory.

    Args:
        values: free parameters by name, SI.
        stacked: stack of recordings of kind spring.
    """
    plain, before = undecided(stacked), stacked.extra.get("decisions")
    known = jnp.asarray(before is not None)
    found = _decided(values, plain, before if known else Decisions.blank(plain.mask.shape), known)
    return with_extra(plain, decisions=found)


@jax.jit
def _decided(values: Mapping[str, Array], plain: Rows, before: Decisions, known: Array) -> Decisions:
    """Decisions of a stack without any; those from before are candidates, too, where they are known.

    One program serves both cases, as it takes half a minute to compile.
    """

    def decide(rows: Rows, before: Decisions) -> Decisions:
        steady = eqx.tree_at(lambda r: r.extra["process_noise"], rows, rows.extra["implied_process_noise"])
        found, law = trajectory(values, steady), law_of(values, rows)
        slack, force, weight = ALIKE * _sd(found, steady), rows.measured["force"], rows.weight["force"]
        shared = jax.lax.map(lambda m: law.decide(found.xi0, slack, m), jnp.asarray(MARGINS))
        several = law.likeliest(found.xi0, slack, rows.extra["margin"], force, weight, HISTORIES)
        first = jax.tree.map(lambda old, rule: jnp.where(known, old, rule[0])[None], before, shared)
        every = jax.tree.map(lambda *x: jnp.concatenate(x), first, shared, several)

        def with_decisions(decisions: Decisions) -> Rows:
            return with_extra(rows, decisions=decisions)

        def misfit(decisions: Decisions) -> Array:
            return jnp.sum(residual(values, with_decisions(decisions)) ** 2)

        least = jnp.argmin(_of_different(misfit, every))
        best = jax.tree.map(lambda x: x[least], every)

        def begun(course: Array) -> tuple[Array, Array]:
            """End of a search that begins at a given trajectory, and the misfit there."""
            decisions = eqx.tree_at(lambda d: d.course, best, course)
            ended = trajectory(values, with_decisions(decisions))
            return ended.xi0, jnp.sum(_misfit(ended, rows) ** 2)

        # the trajectory of a hot wire may be stuck between limits: a constant start is often better
        trials = jnp.stack([best.course, *(jnp.full_like(best.course, level) for level in LEVELS)])
        courses, misfits = jax.lax.map(begun, trials)
        return eqx.tree_at(lambda d: d.course, best, courses[jnp.argmin(misfits)])

    return jax.vmap(decide)(plain, before)


def _of_different(misfit: Callable[[Decisions], Array], every: Decisions) -> Float[Array, " candidates"]:
    """Misfit of every candidate; infinite for one that repeats an earlier one, which costs no search."""
    count = len(every.course)
    same = [jnp.all(x[:, None] == x[None], axis=-1) for x in jax.tree.leaves(every)]
    repeats = jnp.any(jnp.tril(jnp.stack(same).all(axis=0), -1), axis=1)
    order = jnp.argsort(repeats, stable=True)

    def one(state: tuple[Array, Array]) -> tuple[Array, Array]:
        k, found = state
        place = order[k]
        return k + 1, found.at[place].set(misfit(jax.tree.map(lambda x: x[place], every)))

    begun = jnp.asarray(0), jnp.full(count, jnp.inf)
    return jax.lax.while_loop(lambda state: state[0] < count - jnp.sum(repeats), one, begun)[1]


def undecided(rows: Rows) -> Rows:
    """A recording or stack whose rule decides anew at any parameters: exact, slower, not smooth."""
    extra = {name: value for name, value in rows.extra.items() if name != "decisions"}
    return eqx.tree_at(lambda r: r.extra, rows, extra)


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Weighted residual of force, resistance and latent trajectory, in standard deviations.

    Its sum of squares over the parameters alone is the profile of the joint problem. The walk adds as many
    residuals as it has unknowns. Its degrees of freedom are those of the measured values, less what the
    trajectory takes of them (`residual_and_freedom`).
    """
    return _misfit(trajectory(values, rows), rows)


def _misfit(found: Trajectory, rows: Rows) -> Float[Array, " m"]:
    """Residual of a trajectory; see `residual`."""
    differences = [rows.weight[name] * (getattr(found, name) - rows.measured[name]) for name in OUTPUTS]
    misfit, noise = jnp.stack(differences), _independent(rows)
    return jnp.concatenate([(noise(misfit) if noise else misfit).ravel(), _walk(rows).residual(found.xi0)])


def _log_determinant(found: Trajectory, rows: Rows) -> Float[Array, ""]:
    """Log-determinant of the trajectory's second derivative, also where the noise is correlated."""
    known = rows.extra.get(KEY, {})
    scaled = jnp.stack([rows.weight[n] / (known[n].scale if n in known else 1.0) for n in OUTPUTS])
    curvature = smoother.hessian(found.local, scaled, _walk(rows), found.xi0)
    if not known:
        return smoother.log_determinant(*curvature)

    def felt(place: int, mode: Array) -> Array:
        """What the trajectory of each row feels of one mode of an output."""
        return found.local.back(jnp.zeros_like(scaled).at[place].set(scaled[place] * mode))

    columns = [jax.vmap(partial(felt, OUTPUTS.index(n)), 1, 1)(one.taken) for n, one in known.items()]
    return smoother.log_determinant_less(*curvature, jnp.concatenate(columns, axis=1))


def _sd(found: Trajectory, rows: Rows) -> Array:
    """Standard deviation of the fraction about a trajectory, shape (rows,)."""
    weight = jnp.stack([rows.weight[name] for name in OUTPUTS])
    diagonal, upper = smoother.hessian(found.local, weight, _walk(rows), found.xi0)
    return jnp.sqrt(smoother.variances(diagonal, upper))


def residual_and_freedom(values: Mapping[str, Array], rows: Rows) -> tuple[Array, Array]:
    """Residual, and the degrees of freedom that the trajectory takes: the trace of its smoother.

    A trajectory that follows every resistance takes one a row. A steady one, as of a cold wire, takes few,
    and one at a limit, as of a hot wire, next to none (T. Hastie and R. Tibshirani, Generalized Additive
    Models, 1990). The count holds where the walk's prior is loose beside the readings, as in a fit. A
    fraction that walks as far as its prior says leaves its own steps in the residuals as well.
    """
    found = trajectory(values, rows)
    weight = jnp.stack([rows.weight[name] for name in OUTPUTS])
    taken = jnp.sum(smoother.information(found.local, weight) * _sd(found, rows) ** 2)
    return _misfit(found, rows), jnp.where(rows.extra["level_sd"] > 0.0, taken, 0.0)


class FromResistance(NamedTuple):
    """A recording as its resistance alone explains it.

    Attributes:
        found: the trajectory and what the law predicts along it.
        sd: standard deviation of the martensite fraction in every row, given the parameters, shape (rows,).
        evidence: log-likelihood with the trajectory integrated out (Laplace), up to a constant of the
            parameters.
    """

    found: Trajectory
    sd: Array
    evidence: Array


def from_resistance(values: Mapping[str, Array], rows: Rows, process_noise: Array) -> FromResistance:
    """A recording by its resistance alone, at one process-noise variance of the martensite fraction.

    Force is left out, so that process noise cannot compensate a wrong force law. The evidence serves to
    choose between variances at given parameters. As a function of the parameters it would treat the walk as
    knowledge about the fraction's scale. Fits and samplers use the profile, `residual`.

    Args:
        values: free parameters by name, SI.
        rows: one recording; decisions that it carries do not count.
        process_noise: variance per second.
    """
    rows = undecided(rows)
    extra = {**rows.extra, "process_noise": process_noise, "force_informs": jnp.zeros(())}
    rows = eqx.tree_at(lambda r: r.extra, rows, extra)
    rows = eqx.tree_at(lambda r: r.weight["force"], rows, jnp.zeros_like(rows.weight["force"]))
    found, count = trajectory(values, rows), jnp.sum(_walk(rows).weight > 0.0)
    square = jnp.sum(_misfit(found, rows) ** 2) + _log_determinant(found, rows)
    free = rows.extra["level_sd"] > 0.0
    sd = jnp.where(free, _sd(found, rows), 0.0)
    return FromResistance(found, sd, -0.5 * (square + count * jnp.log(process_noise)))
