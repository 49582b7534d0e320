"""Thresholds on fits: scaled unknowns, the optimiser, the base fit, candidate fits."""

from dataclasses import dataclass

from .threshold import NUMERICAL, threshold


@dataclass(frozen=True)
class Scaling:
    """Scales of the free numbers of base model and effects, and their priors."""

    minimum_log_ratio: float = threshold(
        20.0, "Minimum ratio of its bounds for a positive shape to be fitted by its logarithm."
    )
    log_units: float = threshold(5.0, "Number of scaled units between the bounds of such a shape.")
    minimum_wide_ratio: float = threshold(
        8.0, "Minimum ratio of its bounds for a shape to be tried at logarithmic distances."
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

    minimum_poor: float = threshold(
        1.2, "Minimum reduced chi-square for other starts of the base fit, or an effect at a bound."
    )
    scattered_starts: int = threshold(
        7, "Number of scattered starts for a hidden or stuck base fit.",
        basis="two of five starts of springs found the better of two optima",
    )  # fmt: skip
    maximum_start: float = threshold(2.0, "Maximum distance from nominal for another start.", "sd")
    noise_rounds: int = threshold(2, "Number of rounds for noise estimate and base fit.")
    maximum_searches: int = threshold(3, "Maximum number of searches for a base fit that candidates improve.")
    maximum_hot: float = threshold(
        0.1, "Maximum martensite fraction in a test for a fit in which it is constant there.",
        basis="seven simulated springs at full heat reached 0.015 to 0.03 with a fraction that walks",
    )  # fmt: skip


@dataclass(frozen=True)
class Candidates:
    """Choice of the candidates that are fitted together with the base, and effort for each."""

    tried: int = threshold(10, "Maximum number of candidates for a first effect.")
    first_steps: int = threshold(2, "Number of trial steps for every candidate.")
    second_steps: int = threshold(4, "Number of further trial steps for the better candidates.")
    second_count: int = threshold(
        5, "Number of candidates for these further steps, or for an effect beside others."
    )
    final_count: int = threshold(3, "Number of candidates for a fit to the end.")
    kept_by_score: int = threshold(
        2, "Number of candidates, first by score, for every step, however they began.",
        basis="fifteenth run: an effect of many shapes needs many steps",
    )  # fmt: skip
    about_nominal: int = threshold(
        4, "Maximum number of further candidates for scores about nominal constants.",
        basis="eighteenth run: beyond three standard deviations a true effect seemed to act the wrong way",
    )  # fmt: skip
    comparable_share: float = threshold(0.3, "Minimum share of the best such score for a candidate.")
    hopeless_factor: float = threshold(3.0, "Maximum ratio of predicted to best objective for a further fit.")
    other_shapes: tuple[float, ...] = threshold(
        (0.15, 0.5, 0.85), "Number of further starts for shapes, by their share of the range: these.",
        basis="wires, coupons and tubes: widths and time constants have optima of their own",
    )  # fmt: skip
    faint_share: float = threshold(
        0.1, "Factor on an effect for a second start where the first ended worse than none."
    )
    begin_share: float = threshold(
        0.02, "Factor on a typical amplitude for a start at zero.",
        basis="with 0.1 the mismatch of an opened tube (c0022) was lost",
    )  # fmt: skip
    minimum_ahead: float = threshold(
        0.75, "Minimum share of the best log Bayes factor for another base fit beside trajectories."
    )
    minimum_elsewhere: float = threshold(
        0.5, "Minimum change of a base constant for another base fit from there.", "sd"
    )
