"""Effort of the search and of what follows it: how many are tried, and on which grids."""

from dataclasses import dataclass

import numpy as np

from .threshold import NUMERICAL, threshold


@dataclass(frozen=True)
class Lists:
    """How much of a comparison is computed, and of a list is told."""

    compared_rows: int = threshold(400, "Maximum number of rows for a comparison.", "rows")
    told: int = threshold(3, "Maximum number of contradictions, outliers or drivers for a list.")


@dataclass(frozen=True)
class ScoreTest:
    """The score of every effect against chance."""

    draws: int = threshold(999, "Number of simulated nulls for a p-value.")
    shapes: int = threshold(5, "Number of shapes of every effect for its score.")
    slow_cosines: int = threshold(6, "Number of cosines over each recording for slow misfit, or for drift.")
    whole_effects: tuple[float, ...] = threshold(
        (0.3, 1.0), "Factor on a typical effect for its trial as a whole, about nominal constants."
    )
    price: float = threshold(3.0, "Factor on the degrees of freedom for the order of scores.")


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
    hopeless_factor: float = threshold(3.0, "Maximum ratio of predicted to best objective for a further fit.")
    untried: float = threshold(
        -5.0, "Maximum log Bayes factor that is told of a candidate whose score was not worth a fit.", "nat"
    )
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


@dataclass(frozen=True)
class CrossValidation:
    """Recordings, or parts of them, left out in turn."""

    blocks: int = threshold(4, "Number of parts of recordings for leaving out in turn.")
    groups: int = threshold(3, "Maximum number of groups of recordings for a decision.")
    maximum_folds: int = threshold(
        8, "Maximum number of groups of recordings for a held-out score, or of recordings whose parts are "
        "left out.",
    )  # fmt: skip
    steps: int = threshold(10, "Maximum number of trial steps for a fit without some values.")
    minimum_misfit: float = threshold(
        1e-3, "Minimum excess of a reduced chi-square for a share of it to be told.", basis=NUMERICAL
    )
    input_seed: int = threshold(20, "Number of the random stream for noise of inputs that two models get.")


@dataclass(frozen=True)
class Search:
    """Number of sets of effects that are followed, and conditions for looking at larger ones."""

    maximum_effects: int = threshold(3, "Maximum number of effects for a model.")
    beam: int = threshold(8, "Number of sets of one size for a fit together with the base.")
    refitted_slips: int = threshold(
        4, "Number of the most promising columns and factors of a slip that are refitted."
    )


@dataclass(frozen=True)
class Discrepancy:
    """A smooth function of one driver that stands for what has no name."""

    knots: int = threshold(24, "Number of knots for the evidence of a discrepancy.")
    lengths: tuple[float, ...] = threshold(
        (1.5, 4.0, 12.0), "Number of knots for one correlation length: these are tried.", "knots"
    )
    sizes: tuple[float, ...] = threshold(
        tuple(float(x) for x in 10.0 ** np.arange(-1.0, 3.1, 0.5)),
        "Factor on the noise for the size of a discrepancy: these are tried.",
        "sd",
    )
    saved_knots: tuple[int, ...] = threshold(
        (8, 16), "Number of knots for the saved discrepancy: these are tried."
    )
    period_knots: int = threshold(6, "Number of knots for one period of a misfit that repeats.")
    maximum_knots: float = threshold(
        0.25, "Maximum share of the fitted values for the knots of a misfit that repeats."
    )
    ridge: float = threshold(
        1e-3, "Factor on the information for holding a discrepancy near zero.", basis=NUMERICAL
    )
    minimum_distance: float = threshold(0.5, "Minimum distance of two knots, over that of equal ones.")


@dataclass(frozen=True)
class Place:
    """Thresholds of the place of a misfit."""

    bins: int = threshold(10, "Number of bins of a driver for the share that it explains.")
    window_part: float = threshold(
        0.2, "Factor from a recording to the stretch for the place of most misfit."
    )
    quantiles: tuple[float, ...] = threshold(
        (0.2, 0.35, 0.5, 0.65, 0.8), "Number of quantiles of a driver for the limit of a region: these."
    )
    stretch: int = threshold(8, "Number of rows of a stretch for a regime of misfit.", "rows")
    periods: int = threshold(3, "Minimum number of periods between two turning points of a drive.")
    beside: tuple[int, ...] = threshold(
        (2, 3, 4), "Number of resolved frequencies to either side for the power beside a period: these."
    )
