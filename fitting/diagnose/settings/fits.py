"""Numerical settings of fits: scaled unknowns, latent trajectories, the optimiser, noise, the base fit."""

from dataclasses import dataclass

from .threshold import NUMERICAL, threshold


@dataclass(frozen=True)
class Noise:
    """Size, growth and correlation of the errors of an instrument."""

    difference_order: int = threshold(
        4,
        "Number of differences in a row for the noise of an unstated resistance.",
        basis="sixth run: differences of lower order took fast phases for noise (0.0007 ohm for 0.0003)",
    )
    stretch: int = threshold(16, "Number of differences of one stretch for the same.")
    quiet_quantile: float = threshold(
        0.3,
        "Maximum quantile of stretches, the quietest first, for telling that noise.",
        basis="five opened cases of the sixth run: ramps, ripple and heaters pass for noise above it",
    )
    simulated_draws: int = threshold(50, "Number of simulated recordings for the scale of that quantile.")
    simulated_samples: int = threshold(
        2000, "Maximum number of samples of a simulated recording for the same.", "samples"
    )
    lags: tuple[int, ...] = threshold((1, 2, 3), "Number of rows between the values of a difference.", "rows")
    dependent_differences: float = threshold(
        4.0, "Number of second differences for the information of an independent one."
    )
    maximum_samples: int = threshold(
        4096, "Maximum number of samples of a recording for second differences.", "samples"
    )
    dither: float = threshold(0.5, "Factor from a rounding step to the width of errors drawn anew.")
    neighbours: int = threshold(3, "Number of readings on each side of one that may be an outlier.")


@dataclass(frozen=True)
class LatentTrajectories:
    """The martensite fraction behind a measured resistance."""

    hold_weight: float = threshold(
        1e-6, "Factor on the squared change of a fraction, for rows that say nothing.", basis=NUMERICAL
    )
    maximum_step: float = threshold(0.2, "Maximum change of a fraction for one linear step.")
    maximum_believed_step: float = threshold(
        0.02, "Maximum change of a fraction for its linear answer to be believed."
    )
    rounds: int = threshold(3, "Maximum number of rounds of trajectories and process noise.")
    first_rounds: int = threshold(8, "Maximum number of the same rounds for the first search.")
    converged_step: float = threshold(1e-3, "Maximum change of a fraction for these rounds to end.")
    runs: int = threshold(5, "Maximum number of model runs for one search of trajectories.")
    sufficient_step: float = threshold(0.005, "Minimum change of a fraction for another run of that search.")
    minimum_gain: float = threshold(0.05, "Minimum decrease of chi-square for another run of that search.")
    minimum_gain_share: float = threshold(
        2e-3, "Minimum decrease of chi-square for another run of that search, over chi-square."
    )
    minimum_step_share: float = threshold(0.2, "Minimum part of a step for a shorter one to be tried.")
    maximum_stiffness: float = threshold(
        1e10, "Maximum ratio of a walk's precision to what the best row tells; stiffer walks are as flat.",
        basis="freedom within 1e-4 of the exact one; rounding made it negative without",
    )  # fmt: skip


@dataclass(frozen=True)
class Scaling:
    """Scales of the free numbers of base model and effects, and their priors."""

    log_units: float = threshold(
        5.0, "Number of scaled units between the bounds of a shape that is fitted by its logarithm."
    )
    minimum_wide_ratio: float = threshold(
        8.0, "Minimum ratio of its bounds for a shape to be tried at logarithmic distances."
    )
    prior_bounds: float = threshold(
        4.0, "Maximum distance from nominal for a constant whose prior has no closer bounds.", "sd"
    )
    shape_deviation: float = threshold(
        1.5, "Factor from a shape's typical departure to the standard deviation of its prior."
    )
    minimum_positive_share: float = threshold(
        0.01, "Minimum part of a fitted positive constant for the search of the base fit."
    )


@dataclass(frozen=True)
class Optimiser:
    """Levenberg's method with bounds."""

    directions: int = threshold(
        16, "Maximum number of unknowns for the derivatives of one run of the compiled program.",
        basis="a triple of actuators has 13 to 16: one run of 20 ms replaced two of 17 ms",
    )  # fmt: skip
    kept_stacks: int = threshold(
        8, "Maximum number of stacks of recordings that are kept as a compiled program takes them."
    )
    failed_deviation: float = threshold(
        30.0, "Minimum misfit for a row in which the model has no answer.", "sd"
    )
    maximum_steps: int = threshold(40, "Maximum number of trial steps for a fit.")
    minimum_decrease: float = threshold(
        0.1, "Minimum predicted decrease of the objective for another step, over reduced chi-square.", "nat"
    )
    initial_damping: float = threshold(
        1e-3, "Factor on the second derivative for the first damping; its square is the least one."
    )
    damping_decrease: float = threshold(
        0.2, "Factor on the damping for a step that helps, and on the promise of one that is tried shorter."
    )
    damping_increase: float = threshold(8.0, "Factor on the damping for a step that fails.")
    damping_growth: float = threshold(3.0, "Factor on that factor for every failure in a row.")
    maximum_failures: int = threshold(3, "Maximum number of failures in a row for a fit to go on.")
    maximum_step: float = threshold(3.0, "Maximum step for one scaled unknown.", "sd")
    rounding: float = threshold(
        1e-12, "Maximum distance, or share of the largest direction, that is rounding.", "sd", NUMERICAL
    )
    negligible: float = threshold(
        1e-6, "Maximum scaled distance, or length of a sensitivity, that is nothing.", "sd", NUMERICAL
    )
    at_bound_share: float = threshold(
        1e-3, "Maximum distance from a bound for a parameter to be at it, over its range."
    )


@dataclass(frozen=True)
class BaseFit:
    """The fit of the base model that every search begins with."""

    scattered_starts: int = threshold(
        7, "Number of scattered starts for a hidden or stuck base fit.",
        basis="two of five starts of springs found the better of two optima",
    )  # fmt: skip
    maximum_start: float = threshold(2.0, "Maximum distance from nominal for another start.", "sd")
    noise_rounds: int = threshold(2, "Number of rounds for noise estimate and base fit.")
    maximum_searches: int = threshold(3, "Maximum number of searches for a base fit that candidates improve.")
