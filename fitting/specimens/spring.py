"""Forward model of springs on a test stand: elongation in; force and resistance out, from one latent
trajectory.

The martensite fraction is no input. It is a latent trajectory that has to explain force and resistance
together, found anew for every set of parameters. The resistance determines the fraction of a cold wire well,
and that of a hot wire not at all. Read row by row, it would turn small errors of a constant into phases that
no force fits, and a fit would stall there.

There are two searches for the trajectory. `spring_trajectory` works without effects: it computes all rows at
once, with the decisions of the metal's memory held between fits. `spring_course` works with effects, whose
memories need a scan.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import logit
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.data.recordings import Campaign, Recording, kinds
from fitting.inference.channels import Channel
from fitting.inference.differences import differenced
from fitting.inference.parameters import Parameters
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import SpringResponse
from pneusma_jax.numerics.safe import frozen
from pneusma_jax.pipeline import Effect

from . import priors, spring_rows, spring_trajectory
from .latent import Drivers, LatentStates
from .registry import register
from .rows import Rows, numbers, stack, with_extra
from .specimen import FITTED, OF_HISTORIES, RowOptions, SigmoidLaw, Specimen
from .spring_by_temperature import BY_TEMPERATURE, without_resistance
from .spring_course import best_course, lasting_precision
from .spring_rows import ALLOY, FIXED, HELD_LENGTH_RANGE, OUTPUTS, dimension_numbers, spring_of
from .spring_trajectory import undecided
from .steady_fraction import changes_beyond_range, steady_along, steady_fractions

LEAST_NOISE = 1e-10
"""Minimum process-noise variance of a fraction in the middle of the transformation, per second."""
BEGUN = "course"
"""Entry of rows with the fraction at which the trajectory search begins. Without it, the search begins at the
fraction that each resistance implies."""
MARGIN = "renewal_margin"
"""Entry of rows with the excess over the residual strain that a renewal of the memory needs, as part of
it."""
TRIED_MARGIN = 3e-3
"""Excess over the residual strain that is tried where a renewal is all but one by the rule, as part of it.
A steady course is uncertain by some 5e-4 where rows are 0.5 s apart; Eq. 3.2 multiplies that by 5."""
FACTOR = 3.0
"""Factor of the process-noise variance over that of a steady course, which changes less than the fraction.
With 1 a fit leaves 2 to 4 % more than noise, with 10 trajectories follow noise and draw the constants."""
STEADY = 1e-15
"""Process-noise variance per second of a fraction that does not change."""
RESTS = "rests"
"""Entry of rows that is 1 where the fraction does not change, as of a wire at full heat, else 0."""
LOOSE = 1e-2
"""Process-noise variance per second of a fraction that follows its readings."""
LEAST_MOBILITY = 1e-3
"""Minimum slope of the fraction over the temperature, over its slope in the middle of the transformation."""
LEAST_FRACTION = LEAST_MOBILITY / 4.0
"""Distance of a fraction from its limits at which it has that slope [1]. Nearer ones have no other
temperature."""
MEDIAN_OF_SQUARES = 0.455
"""Median of the square of a standard normal number."""
ADDED = ("weight_", "correlation_")
"""Prefixes of the columns that hold a diagnosis's weights and noise correlations."""
SEARCHED = (BEGUN, MARGIN, RESTS)
"""Entries of rows for the search alone."""


def prepared(values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]]) -> Rows:
    """Rows with the process-noise variances that steady courses imply at these base constants.

    They also hold the noise of every channel as a diagnosis weights it, and a trajectory to begin with.

    Args:
        values: base constants by name, SI.
        stacked: stack of recordings of kind spring.
        channels: noise of every column as a diagnosis weights it.
    """
    own = {name: x for name, x in stacked.extra.items() if not name.startswith((*ADDED, *SEARCHED))}
    plain = undecided(eqx.tree_at(lambda rows: rows.extra, stacked, own))  # so that one program serves all
    found = with_extra(plain, **_noise_of(channels, stacked.mask.shape))
    known = {name: jnp.asarray(value, float) for name, value in values.items()}
    precision = {name: lasting_precision(found, name) for name in OUTPUTS}
    courses = steady_fractions(known, plain, precision)
    beyond = changes_beyond_range(known, plain, precision["resistance"])
    noise = jax.vmap(_process_noise)(plain.time, courses, plain.mask) + jax.vmap(_free)(plain.time, beyond)
    nothing = jnp.zeros(len(stacked.mask))
    searched = {
        BEGUN: stacked.extra.get(BEGUN, courses),
        MARGIN: stacked.extra.get(MARGIN, nothing),
        RESTS: stacked.extra.get(RESTS, nothing),
    }
    noise = jnp.where(searched[RESTS][:, None] > 0.0, STEADY, noise)
    return with_extra(found, process_noise=noise, **searched)


def _noise_of(channels: list[list[Channel]], shape: tuple[int, ...]) -> dict[str, Array]:
    """Weights and correlations of every output, each (recordings of the stack, rows); zero where there are
    none."""
    found = {}
    for name in OUTPUTS:
        weight, correlation = np.zeros((2, *shape))
        for k, members in enumerate(channels):
            for channel in members:
                if channel.quantity == name:
                    weight[k], correlation[k] = 1.0 / channel.sigma, channel.correlation
        names = [f"{what}{name}" for what in ADDED]
        found |= zip(names, map(jnp.asarray, (weight, correlation)), strict=True)
    return found


def begun(stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
    """A stack whose trajectory searches start at the end of an earlier evaluation, given by its drivers."""
    course, margin = jnp.clip(jnp.asarray(drivers["xi0"]), 0.0, 1.0), jnp.asarray(drivers[MARGIN])[:, 0]
    there = lambda rows: (rows.extra[BEGUN], rows.extra[MARGIN])  # noqa: E731
    return eqx.tree_at(there, stacked, (course, margin))


def otherwise_decided(drivers: Mapping[str, Array]) -> list[dict[str, Array]]:
    """Drivers of the same trajectories, with other decisions where a renewal is all but one by the rule."""
    moved = (drivers[MARGIN] + sign * TRIED_MARGIN for sign in (-1.0, 1.0))
    return [{**drivers, MARGIN: np.clip(m, -spring_rows.MARGIN, spring_rows.MARGIN)} for m in moved]


def with_effects(
    values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...]
) -> tuple[dict[str, Array], dict[str, Any]]:
    """Force and resistance under effects; see `Specimen.answer`."""
    parameters = numbers(values, rows)
    stand = spring_of(parameters), effects, pj.SpringState(parameters["prestrain"], jnp.ones(()))
    elongation, time = rows.inputs["elongation"], rows.time
    warm = rows.extra.get(spring_rows.RECORDED_TEMPERATURE)

    inputs, margin = (elongation, time, warm), rows.extra.get(MARGIN, jnp.zeros(()))

    def at(stand: tuple, xi0: Array, decided_by: Array) -> tuple[Array, Array, SpringResponse]:
        return _along(stand, inputs, pj.MartensiteFraction(xi0), decided_by=decided_by, margin=margin)

    still, start = frozen(stand), rows.extra.get(BEGUN)
    if start is None:
        start = _along(still, inputs, pj.Resistance(rows.inputs["resistance"]))[2].xi0

    def free(xi0: Array, decided_by: Array, here: Array) -> Array:
        if MARGIN not in rows.extra:  # no diagnosis: its program is small, and needs reverse derivatives
            return at(stand, xi0, decided_by)[0]
        given = stand, frozen((inputs, margin, xi0, decided_by))
        return differenced(_seen, given, here)

    found = best_course(free, partial(at, still), start, OUTPUTS, rows)
    gamma = found.known.gamma
    rate = jnp.gradient(gamma) / jnp.maximum(jnp.gradient(time), 1e-9)
    drivers = {
        "xi0": found.course,
        "strain": gamma,
        "strain_rate": rate,
        "max_strain": jax.lax.cummax(gamma),
        "force": found.known.force,
        "taken": found.taken,
        "taken_from_errors": found.taken_from_errors,
        **{f"slope_{name}": by_own for name, by_own in zip(OUTPUTS, found.local.slope, strict=True)},
        **{f"memory_{name}": more for name, more in zip(OUTPUTS, found.local.remembered, strict=True)},
        "memory_row": found.local.source,
        MARGIN: jnp.broadcast_to(margin, gamma.shape),
    }
    return dict(zip(OUTPUTS, found.predicted, strict=True)), drivers


def _along(
    stand: tuple, inputs: tuple, activation: Any, **more: Array
) -> tuple[Array, Array, SpringResponse]:
    """Outputs (channels, rows), rows that are remembered, and responses of a spring on its stand.

    Args:
        stand: the spring, its effects and its state before the first row.
        inputs: elongation, time and recorded temperature.
        activation: what drives it.
        more: other arguments of `simulate_spring`.
    """
    (element, effects, state), (elongation, time, warm) = stand, inputs
    found = pj.simulate_spring(
        element, elongation, activation, state, time=time, effects=effects, temperature=warm, **more
    )
    return jnp.stack([found.seen[name] for name in OUTPUTS]), found.kept, found.rows


def _seen(given: tuple) -> Array:
    """Outputs along a trajectory, (channels, rows)."""
    stand, (inputs, margin, xi0, decided_by) = given
    return _along(stand, inputs, pj.MartensiteFraction(xi0), decided_by=decided_by, margin=margin)[0]


@jax.jit  # one program for each length, not one for each of forty operations
def _process_noise(time: Array, course: Array, there: Array) -> Float[Array, " rows"]:
    """Process-noise variance per second of every row that lets a fraction follow a steady course [1/s].

    A temperature that walks moves the fraction by the slope of the transformation. In widths of the
    transformation it is the logit of the fraction. So a wire that is all martensite hardly moves, and noise
    does not push it away from its limit in the one direction that is left.

    Most steps tell the variance by their median. One that is larger has its own, and the mean slope over it:
    a pulse of heat takes the wire to its limit within a row, and leaves other rows as steady as they are.

    Args:
        time: [s], shape (rows,).
        course: fraction, shape (rows,).
        there: rows that are no padding, shape (rows,).
    """
    steps, changes = jnp.maximum(jnp.diff(time), 1e-6), jnp.diff(course)
    heated = jnp.diff(logit(jnp.clip(course, LEAST_FRACTION, 1.0 - LEAST_FRACTION)))
    moves = jnp.abs(heated) > LEAST_MOBILITY
    slope = jnp.where(moves, changes / jnp.where(moves, heated, 1.0), (course * (1.0 - course))[1:])
    mobility = (4.0 * slope) ** 2 + LEAST_MOBILITY**2
    squares = changes**2 / steps / mobility
    usual = jnp.nanmedian(jnp.where(there[1:], squares, jnp.nan)) / MEDIAN_OF_SQUARES
    variance = jnp.maximum(jnp.maximum(squares, jnp.where(jnp.isfinite(usual), usual, 0.0)), LEAST_NOISE)
    return FACTOR * jnp.concatenate([variance[:1] * mobility[:1], variance * mobility])


@jax.jit
def _free(time: Array, changes: Array) -> Float[Array, " rows"]:
    """Process-noise variance per second that allows these changes of a fraction from row to row.

    Args:
        time: [s], shape (rows,).
        changes: change from the row before [1], shape (rows,).
    """
    steps = jnp.diff(time, prepend=time[:1])
    return jnp.where(steps > 0.0, FACTOR * changes**2 / jnp.where(steps > 0.0, steps, 1.0), 0.0)


def _followed(rows: Rows, course: np.ndarray) -> Rows:
    """A recording with a steady course, and a process noise that lets the fraction follow it."""
    noise = _process_noise(jnp.asarray(rows.time), jnp.asarray(course), jnp.asarray(rows.mask))
    return with_extra(rows, process_noise=np.asarray(noise), **{BEGUN: course})


class SpringPhase(LatentStates):
    """Martensite fraction of a spring, found inside `answer`."""

    inside = True
    may_rest = True

    def rows_for(self, campaign: Campaign, **tables: Any) -> list[Rows]:
        """Recordings from the specimen's own row builder."""
        return spring_rows.rows_for(campaign, **tables)

    def count(self, stacked: Rows) -> int:
        """Zero: `answer` finds the trajectory."""
        return 0

    def prepared(
        self, values: Mapping[str, Array], stacked: Rows, channels: list[list[Channel]]
    ) -> Rows:
        """Stack with process-noise variances; see `prepared`."""
        return prepared(values, stacked, channels)

    def begun(self, stacked: Rows, drivers: Mapping[str, Array]) -> Rows:
        """Stack with a start for the search; see `begun`."""
        return begun(stacked, drivers)

    def resting(self, stacked: Rows) -> np.ndarray:
        """Recordings whose fraction does not change."""
        return np.asarray(stacked.extra[RESTS]) > 0.0

    def with_resting(self, stacked: Rows, chosen: np.ndarray) -> Rows:
        """Stack in which the fractions of chosen recordings do not change."""
        return with_extra(stacked, **{RESTS: jnp.asarray(chosen, float)})

    def otherwise(self, drivers: Mapping[str, Array]) -> list[dict[str, Array]]:
        """Drivers with other decisions; see `otherwise_decided`."""
        return otherwise_decided(drivers)

    def settled(self, recordings: list[Rows], drivers: Drivers) -> list[Rows]:
        """Recordings with the process noise and the steady course of the fraction that a model finds.

        `answer` finds the fraction itself anew under every model.
        """
        loose = [with_extra(rows, process_noise=np.asarray(LOOSE)) for rows in recordings]
        stacked, found = stack(loose), drivers(loose)
        information = sum(lasting_precision(stacked, name) * found[f"slope_{name}"] ** 2 for name in OUTPUTS)
        courses = np.asarray(steady_along(stacked.time, found["xi0"], information))
        pairs = zip(recordings, courses, strict=False)  # a stack may be padded
        return [_followed(rows, course[: len(rows.mask)]) for rows, course in pairs]


class SpringOnStand(Specimen):
    """A spring whose resistance is measured."""

    recording = kinds.SPRING
    outputs = OUTPUTS
    letter = "S"
    noun = "spring"
    law = "the base law of the spring"
    tables = ("alloy", "actuator")
    options = ("base",)
    identified = ("alloy",)
    starts_with_model = 1
    element = "spring"
    output_drivers = (
        "time", "xi0", "force", "resistance", "stress", "strain", "strain_rate", "max_strain",
    )  # fmt: skip
    compiler_options = OF_HISTORIES
    differenced = True
    sigmoid_law = SigmoidLaw("rho_mean", "rho_span", "km_1", "km_2", "km_3")
    latent = SpringPhase()

    def drivers(self, recording: Recording) -> tuple[str, ...]:
        """Elongation, and the columns that determine the phase: resistance, temperature, or both."""
        phase_columns = [name for name in ("resistance", "temperature") if recording.has(name)]
        return ("elongation", *phase_columns)

    def influences(self, recording: Recording) -> tuple[str, ...]:
        """Elongation and resistance."""
        return tuple(name for name in ("elongation", "resistance") if recording.has(name))

    def rows_for(
        self,
        campaign: Campaign,
        options: RowOptions = FITTED,
        base: str | Path | None = None,
        held_at: Mapping[str, float] | None = None,
    ) -> list[Rows]:
        """Recordings as arrays; see `spring_rows.rows_for`."""
        return spring_rows.rows_for(campaign, options, base, held_at)

    def parameters_for(self, campaign: Campaign, base: str | Path | None = None) -> Parameters:
        """Free parameters of a campaign of springs with their priors: the alloy's, then each specimen's
        dimensions.

        Args:
            campaign: recordings of kind spring.
            base: name or path of the alloy's prior table, where `alloy = "fit"`; see
                `specimens.priors.alloy_quantities`.

        Raises:
            InputError: if the recordings name several alloys, or one that cannot be loaded.
        """
        parameters, _ = priors.alloy_parameters(campaign, ALLOY, FIXED, base)
        parameters.update(priors.geometry_parameters(campaign, dimension_numbers))
        return parameters

    def answer(
        self, values: Mapping[str, Array], rows: Rows, effects: tuple[Effect, ...] = ()
    ) -> tuple[dict[str, Array], dict[str, Any]]:
        """Outputs and drivers, see `Specimen.answer`. With effects, and in a diagnosis, `spring_course` finds
        the trajectory."""
        if effects or BEGUN in rows.extra:
            return with_effects(values, rows, effects)
        found = spring_trajectory.trajectory(values, rows)
        outputs = {"force": found.force, "resistance": found.resistance}
        return outputs, {"xi0": found.xi0, "strain": found.gamma}

    def residual(self, values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Weighted residual of force, resistance and latent trajectory, in standard deviations."""
        return spring_trajectory.residual(values, rows)

    def variant(self, campaign: Campaign) -> Specimen:
        """`SpringByTemperature` where no resistance was measured."""
        return BY_TEMPERATURE if without_resistance(campaign) else self

    def alloy_quantities(self, campaign: Campaign, base: str | Path | None = None) -> dict[str, Quantity]:
        """Constants of the spring's alloy with their priors."""
        return priors.alloy_quantities(campaign, ALLOY, base)[0]

    def plotted_over(self, rows: Rows) -> str:
        """Temperature for a spring held at a length, elongation for others. Without a temperature, a held
        spring is drawn over the clock."""
        over = "temperature" if np.ptp(rows.inputs["elongation"]) < HELD_LENGTH_RANGE else "elongation"
        return over if "temperature" in rows.inputs else "time"

    def check_diagnosable(self, recording: Recording) -> None:
        """Refuse a spring without resistance.

        Raises:
            InputError: in one line.
        """
        if not recording.has("resistance"):
            raise InputError(
                f"{recording.path or recording.name}: there is no resistance_ohm, and a diagnosis of springs "
                "reads the phase from it; add the column. `pneusma characterise` takes springs by their "
                "temperature"
            )


SPRING = register(SpringOnStand())
