"""Thresholds on what is recorded: usable campaigns, noise of instruments, outliers, latent trajectories."""

from dataclasses import dataclass

from .threshold import NUMERICAL, threshold


@dataclass(frozen=True)
class Campaigns:
    """Conditions for using a campaign, and for two recordings to contradict each other."""

    minimum_values: int = threshold(20, "Minimum number of values for a diagnosis, or for telling outliers.")
    minimum_driver_ratio: float = threshold(
        1.5, "Minimum ratio of a driver's standard deviation to its noise for it to vary."
    )
    still_ranges: tuple[tuple[str, float], ...] = threshold(
        (
            ("strain", 0.01), ("pressure", 1e3), ("elongation", 5e-4), ("temperature", 2.0), ("stress", 2e6),
            ("current", 0.02),
        ),
        "Maximum range for a driver of unstated noise to be still, by quantity.",
        "SI",
    )  # fmt: skip
    same_input_share: float = threshold(
        0.01, "Maximum distance for two inputs to be the same, over the driver's range."
    )
    same_share: float = threshold(
        0.02, "Maximum difference of repeated tests beyond noise, over the output's range; or range of a "
        "still driver of unstated noise, over its largest value.",
    )  # fmt: skip
    minimum_rows: int = threshold(16, "Minimum number of rows of a recording for a comparison.", "rows")
    maximum_deviation: float = threshold(
        4.0, "Maximum difference for two readings of one value to agree, or for a prior's bounds.", "sd"
    )
    minimum_common_part: float = threshold(
        0.5, "Minimum part of the shorter recording for two inputs to be compared."
    )
    minimum_move: float = threshold(
        0.2, "Minimum change of a driver for its comparison to count, over the driver's range."
    )
    maximum_rows: int = threshold(400, "Maximum number of rows for a comparison.", "rows")
    maximum_told: int = threshold(3, "Maximum number of contradictions, outliers or drivers for a list.")


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
    minimum_block_excess: float = threshold(
        2.0, "Minimum ratio of the means' noise to that of independent errors for it to count."
    )
    lags: tuple[int, ...] = threshold((1, 2, 3), "Number of rows between the values of a difference.", "rows")
    dependent_differences: float = threshold(
        4.0, "Number of second differences for the information of an independent one."
    )
    student_degrees: float = threshold(
        4.0, "Number of degrees of freedom of Student's t for corners of a trajectory."
    )
    minimum_gain_unstated: float = threshold(
        1.0,
        "Minimum log-likelihood for correlation of unstated noise.",
        "nat",
        "eighteenth run: of 27 opened nulls 22 gain less than 0.7, the others 1.6 and more",
    )
    minimum_floor: float = threshold(
        0.04, "Minimum noise without a signal, over the usual noise of the instrument."
    )
    maximum_correlation: float = threshold(0.9, "Maximum correlation of neighbouring errors.")
    maximum_followed: float = threshold(
        0.2, "Maximum share of a value that a latent trajectory follows for the value to tell noise."
    )
    maximum_samples: int = threshold(
        4096, "Maximum number of samples of a recording for second differences.", "samples"
    )
    dither: float = threshold(0.5, "Factor from a rounding step to the width of errors drawn anew.")
    minimum_differences: int = threshold(60, "Minimum number of second differences for a noise estimate.")
    maximum_over_fast: float = threshold(
        2.4,
        "Maximum ratio of an estimated noise to the fast scatter of its readings for a report not to warn.",
        basis="50 generated campaigns: right to a quarter up to 2.36, 1.3 to 1.7 times too large above",
    )


@dataclass(frozen=True)
class Outliers:
    """Single readings that are not counted."""

    minimum_distance: float = threshold(
        6.0, "Minimum ratio of its distance from its neighbours to noise, and to the usual distance, for an "
        "outlier.",
    )  # fmt: skip
    minimum_lead: float = threshold(
        3.0, "Minimum ratio of that distance to the spread of its neighbours, and to the bend of the model."
    )
    neighbours: int = threshold(3, "Number of readings on each side for the comparison.")
    maximum_share: float = threshold(
        0.03, "Maximum share of a recording's readings for all of them to be outliers."
    )


@dataclass(frozen=True)
class LatentTrajectories:
    """The martensite fraction behind a measured resistance."""

    process_noise_variances: tuple[float, ...] = threshold(
        tuple(10.0**k for k in range(-10, -1)),
        "Number of process-noise variances for a choice by evidence: these.",
        "1/s",
    )
    usual_process_noise_variance: float = threshold(
        1e-6, "Factor from seconds to process-noise variance where no resistance tells it.", "1/s"
    )
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
