"""A spring on a test stand without effects: pull and resistance along the course that explains them best.

The martensite fraction is no input. It is a latent course that has to explain resistance and force together
(`inference.latent_trajectory.smoother.profile`), because a resistance says much about a cold wire, little
about a hot one and nothing where both phases conduct alike; read sample by sample, its noise would enter the
running minimum that the residual strain remembers. Both measured quantities are outputs, and the profile
carries the fraction's uncertainty into both, so that no row counts for more than it knows.
"""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.inference.channels import channel_weight
from fitting.inference.latent_trajectory import smoother
from fitting.inference.latent_trajectory.denoise import denoised
from fitting.inference.readings import measurements
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy, Spring, SpringGeometry

from . import priors
from .model_objects import geometry_of
from .reduction import reduced
from .rows import Rows, numbers
from .specimen import FITTED, RowOptions
from .spring_law import Decisions, Law, Trajectory

OUTPUTS = ("force", "resistance")
ALLOY = tuple(field.name for field in dataclasses.fields(Alloy) if field.name != "name")
GEOMETRY = ("wire_diameter", "mandrel_diameter", "initial_pitch", "active_coils", "free_length")
SPREAD = 0.5
"""1-sigma of the martensite fraction at the start, around one half, where nobody says more."""
MARGIN = 0.03
"""Part of the residual strain by which a turning point may be off the rule."""
MARGINS = (0.0, *(sign * size for size in (7e-4, 2e-3, 5e-3, 0.012, MARGIN) for sign in (-1.0, 1.0)))
"""Such parts that all turning points of a test share; the first is the rule."""
FIXED = ("gamma_max", "poisson_ratio", "T_mid", "T_width", "density", "heat_capacity", "convection")
"""Constants that tests on a stand do not identify: conventions, and those of heating."""
HISTORIES = 4
"""Likeliest histories of a test, each turning point decided by itself, that are weighed beside those."""
LEVELS = (0.2, 0.5)
"""Constant courses that a search begins with, too."""
ALIKE = 2.0
"""Standard deviations of the martensite fraction within which two rows are equally hot."""
WANDER = 1e-6
"""Variance per second of the martensite fraction's walk until `with_process_noise` has found it."""


def rows_of(
    recording: Recording,
    alloy: Mapping[str, float],
    specimen: int = 1,
    held_at: float | None = None,
    options: RowOptions = FITTED,
) -> Rows:
    """A recording of kind spring as arrays.

    Args:
        recording: checked.
        alloy: base constants by name, in SI.
        specimen: its number in the campaign.
        held_at: martensite fraction that the whole recording is taken to be at (1 cold, 0 hot); None to find
            it.
        options: which rows are taken.

    Raises:
        InputError: if fewer than four rows have both time and elongation.
    """
    recording = recording if options.most is None else reduced(recording, options.most)
    columns = {name: recording.si(name) for name in ("time", "elongation")}
    columns |= {name: measurements(recording, name) for name in OUTPUTS}
    driven = np.isfinite(columns["time"]) & np.isfinite(columns["elongation"])
    if driven.sum() < 4:
        raise InputError(
            f"{recording.path or recording.name}: {int(driven.sum())} rows have both time and elongation, "
            "but a test needs four or more"
        )
    kept = {name: values[driven] for name, values in columns.items()}
    weight = {name: channel_weight(recording, name, kept, recording.block) for name in OUTPUTS}
    smooth = denoised(kept["time"], kept["resistance"])
    known = np.isfinite(smooth)
    size = len(kept["time"])
    return Rows(
        mask=np.ones(size, bool),
        time=kept["time"],
        inputs={
            "elongation": kept["elongation"],
            "resistance": np.interp(kept["time"], kept["time"][known], smooth[known])
            if known.any()
            else np.full(size, np.nan_to_num(alloy["rho_mean"])),
        },
        measured={name: np.nan_to_num(kept[name]) for name in OUTPUTS},
        weight=weight,
        base={**{name: np.asarray(float(alloy[name])) for name in ALLOY}, **dimension_numbers(recording)},
        extra={
            "wander": np.asarray(WANDER),
            "pace": np.asarray(WANDER),
            "level": np.asarray(0.5 if held_at is None else held_at),
            "level_sd": np.asarray(SPREAD if held_at is None else 0.0),
            "force_informs": np.asarray(1.0),
            "margin": np.asarray(MARGIN),
            "loading": _loading(kept["elongation"]),
        },
        specimen=np.asarray(specimen),
    )


def _loading(elongation: np.ndarray) -> np.ndarray:
    """Rows on which the spring is longer than ever before: one, the others zero."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(elongation)[:-1]])
    return (elongation > before).astype(float)


def dimensions(recording: Recording) -> SpringGeometry:
    """Dimensions that a recording states for its spring, in SI."""
    geometry = geometry_of(recording)
    return SpringGeometry(**{name: getattr(geometry, name) for name in GEOMETRY})


def dimension_numbers(recording: Recording) -> dict[str, np.ndarray]:
    """Dimensions and pre-strain of a recording's spring by name, in SI."""
    geometry = geometry_of(recording)
    return {name: np.asarray(float(getattr(geometry, name))) for name in (*GEOMETRY, "prestrain")}


def spring_of(known: Mapping[str, Array]) -> Spring:
    """The spring that numbers describe; on a stand its elongation counts from the free length."""
    alloy = Alloy(**{name: known[name] for name in ALLOY})
    geometry = SpringGeometry(**{name: known[name] for name in GEOMETRY})
    return Spring(geometry, alloy, geometry.free_length)


def _outputs(law: Law, xi0: Array) -> smoother.Local:
    return law.follow(xi0).local


def _law(values: Mapping[str, Array], rows: Rows) -> Law:
    known = numbers(values, rows)
    return Law(spring_of(known), known["prestrain"], rows.inputs["elongation"], rows.extra.get("decisions"))


def _walk(rows: Rows) -> smoother.Walk:
    extra = rows.extra
    free = extra["level_sd"] > 0.0
    level_sd = jnp.where(free, extra["level_sd"], 1.0)
    return smoother.Walk.over(rows.time, rows.mask & free, extra["wander"], extra["level"], level_sd)


def _first_trial(law: Law, rows: Rows) -> Array:
    """The course that was decided on, the fraction that each smoothed resistance stands for where none was,
    or the level where it is held."""
    if law.decisions is not None:
        return law.decisions.course
    return jnp.where(rows.extra["level_sd"] > 0.0, fraction_read(law.spring, rows), rows.extra["level"])


def fraction_read(spring: Spring, rows: Rows) -> Array:
    """Fraction that each resistance by itself stands for, (rows,)."""
    gamma = spring.shear_strain(rows.inputs["elongation"])
    rho = rows.inputs["resistance"] / spring.geometry.wire_length
    return spring.alloy.martensite_fraction(rho, gamma).xi0


def trajectory(values: Mapping[str, Array], rows: Rows) -> Trajectory:
    """A recording as the model has it, at the course of the martensite fraction that explains it best.

    Args:
        values: free parameters by name, SI.
        rows: one recording. Where `extra["force_informs"]` is 0 the course is found from resistance alone, as
            for a prediction; where it is 1, as for a fit, force takes part.
    """
    law = _law(values, rows)
    measured = jnp.stack([rows.measured[name] for name in OUTPUTS])
    weight = jnp.stack([rows.weight["force"] * rows.extra["force_informs"], rows.weight["resistance"]])
    course = smoother.profile(_outputs, law, measured, weight, _walk(rows), _first_trial(law, rows))
    return law.follow(jnp.where(rows.extra["level_sd"] > 0.0, course, rows.extra["level"]))


def at_phase(values: Mapping[str, Array], rows: Rows, xi0: Array) -> Trajectory:
    """A recording as the model has it at a course of the martensite fraction that is given, shape (rows,)."""
    return _law(values, rows).follow(xi0)


@jax.jit
def decided(values: Mapping[str, Array], stacked: Rows) -> Rows:
    """A stack that knows what the rule of the residual strain decides in each row at these parameters.

    The rule goes row by row, and as a function of the parameters it has corners and small jumps. With its
    decisions known everything is smooth and all rows are computed at once. A fit decides, fits, and decides
    again until nothing changes.

    The hottest row of a noisy course is the one whose noise was lowest, and remembered by all later rows it
    would pull the scale of the fraction. So it is decided on the course at the pace that resistance shows,
    not on the looser one of a fit, and rows that are as hot as far as anyone can tell feel their own heat.

    Whether a wire at a turning point still loads, and renews its memory, is as often decided by noise, with a
    jump of all later rows. Of the decisions within a few per cent of the rule's, each test takes those that
    explain it best: with one margin for all its turning points, or each of them decided by the force that
    follows, as good constants are needed for the first and a good course for the second.

    Args:
        values: free parameters by name, SI.
        stacked: recordings of kind spring.
    """
    plain = undecided(stacked)

    def decide(rows: Rows, before: Decisions | None) -> Decisions:
        steady = eqx.tree_at(lambda r: r.extra["wander"], rows, rows.extra["pace"])
        found, law = trajectory(values, steady), _law(values, rows)
        slack, force, weight = ALIKE * _sd(found, steady), rows.measured["force"], rows.weight["force"]
        shared = jax.lax.map(lambda m: law.decide(found.xi0, slack, m), jnp.asarray(MARGINS))
        several = law.likeliest(found.xi0, slack, rows.extra["margin"], force, weight, HISTORIES)
        known = [] if before is None else [jax.tree.map(lambda x: x[None], before)]
        every = jax.tree.map(lambda *x: jnp.concatenate(x), *known, shared, several)

        def told(decisions: Decisions) -> Rows:
            return eqx.tree_at(lambda r: r.extra, rows, {**rows.extra, "decisions": decisions})

        def misfit(decisions: Decisions) -> Array:
            return jnp.sum(residual(values, told(decisions)) ** 2)

        least = jnp.argmin(jax.lax.map(misfit, every))
        best = jax.tree.map(lambda x: x[least], every)

        def begun(course: Array) -> tuple[Array, Array]:
            """Where a search that begins with a course ends, and the misfit there."""
            decisions = eqx.tree_at(lambda d: d.course, best, course)
            ended = trajectory(values, told(decisions))
            return ended.xi0, jnp.sum(_misfit(ended, rows) ** 2)

        # a hot wire's course may be caught between limits: what a level leads to is often better
        trials = jnp.stack([best.course, *(jnp.full_like(best.course, level) for level in LEVELS)])
        courses, misfits = jax.lax.map(begun, trials)
        return eqx.tree_at(lambda d: d.course, best, courses[jnp.argmin(misfits)])

    before = stacked.extra.get("decisions")
    first = jax.vmap(lambda rows: decide(rows, None))
    found = first(plain) if before is None else jax.vmap(decide)(plain, before)
    return eqx.tree_at(lambda r: r.extra, plain, {**plain.extra, "decisions": found})


def undecided(rows: Rows) -> Rows:
    """A recording or stack in which the rule decides anew at any parameters: exact, slower, not smooth."""
    extra = {name: value for name, value in rows.extra.items() if name != "decisions"}
    return eqx.tree_at(lambda r: r.extra, rows, extra)


def residual(values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
    """Misfit of force and resistance and of the latent course, in standard deviations.

    Its sum of squares over the parameters alone is the profile of the joint problem; the rows of the course
    number as many as its unknowns, so that degrees of freedom are those of the measured values.
    """
    return _misfit(trajectory(values, rows), rows)


def _misfit(found: Trajectory, rows: Rows) -> Float[Array, " m"]:
    """Residual of a trajectory: see `residual`."""
    misfit = [rows.weight[name] * (getattr(found, name) - rows.measured[name]) for name in OUTPUTS]
    return jnp.concatenate([*misfit, _walk(rows).residual(found.xi0)])


def evidence(values: Mapping[str, Array], rows: Rows) -> Float[Array, ""]:
    """Log-likelihood with the latent course integrated out (Laplace), up to a constant of the parameters.

    For choosing between walks at given parameters. As a function of the parameters it would take the walk for
    knowledge about how a fraction is scaled; fits and samplers use the profile, `residual`.
    """
    found = trajectory(values, rows)
    weight = jnp.stack([rows.weight[name] for name in OUTPUTS])
    curvature = smoother.hessian(found.local, weight, _walk(rows), found.xi0)
    return -0.5 * (jnp.sum(_misfit(found, rows) ** 2) + smoother.log_determinant(*curvature))


def _sd(found: Trajectory, rows: Rows, share: Array | float = 1.0) -> Array:
    """Standard deviation of the fraction about a course; `share` of the weight of each output counts."""
    weight = share * jnp.stack([rows.weight[name] for name in OUTPUTS])
    diagonal, upper = smoother.hessian(found.local, weight, _walk(rows), found.xi0)
    return jnp.sqrt(smoother.variances(diagonal, upper))


def phase_sd(values: Mapping[str, Array], rows: Rows, by_force: bool = True) -> Float[Array, " rows"]:
    """Standard deviation of the martensite fraction in every row, given the parameters.

    Args:
        values: free parameters by name.
        rows: one recording.
        by_force: whether the force takes part; without it, what resistance alone says.
    """
    return _sd(trajectory(values, rows), rows, jnp.asarray([[1.0 if by_force else 0.0], [1.0]]))


def process_noise_evidence(values: Mapping[str, Array], rows: Rows, wander: Array) -> Float[Array, ""]:
    """Log-evidence of how fast the martensite fraction wanders, from resistance alone.

    Force is left out: a wrong force law must not be explained by a phase that wanders.
    """
    rows = undecided(rows)
    extra = {**rows.extra, "wander": wander, "force_informs": jnp.zeros(())}
    rows = eqx.tree_at(lambda r: r.extra, rows, extra)
    rows = eqx.tree_at(lambda r: r.weight["force"], rows, jnp.zeros_like(rows.weight["force"]))
    count = jnp.sum(_walk(rows).weight > 0.0)
    return evidence(values, rows) - 0.5 * count * jnp.log(wander)


def rows_for(
    campaign: Campaign,
    options: RowOptions = FITTED,
    base: str | Path | None = None,
    held_at: Mapping[str, float] | None = None,
) -> list[Rows]:
    """Every recording of a campaign as arrays, in its order.

    Args:
        campaign: recordings of kind spring.
        options: which rows are taken.
        base: table to start from where `alloy = "fit"`; see `specimens.priors.alloy_quantities`.
        held_at: martensite fraction of recordings, by name, that are taken to be at one.
    """
    quantities, _ = priors.alloy_quantities(campaign, ALLOY, base)
    alloy = {name: quantity.value for name, quantity in quantities.items()}
    number = {specimen: k for k, specimen in enumerate(campaign.specimens(), start=1)}
    held = held_at or {}
    return [rows_of(r, alloy, number[r.specimen], held.get(r.name), options) for r in campaign.recordings]
