"""Thresholds on conclusions: model discrepancy, place, probabilities, next experiment, custom models."""

from dataclasses import dataclass

import numpy as np

from .threshold import NUMERICAL, threshold

RIGHT_FORMS = "eleventh run: right effects in other forms left up to 0.19, once 0.3, wrong ones 0.2 or more"


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
    maximum_kept: float = threshold(
        0.75, "Maximum share of what effects leave for a saved discrepancy beside them."
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


@dataclass(frozen=True)
class Misread:
    """A column in another unit than is stated, or of the other sign."""

    minimum_error: float = threshold(
        0.3, "Minimum error of the refitted base model, over an output's range, for asking about units.",
        basis="shipped examples: 18 of 20 slips of ten made 0.3 or more; practice campaigns had 0.19 or less",
    )  # fmt: skip
    ratios: tuple[float, float] = threshold((4.0, 1000.0), "Minimum and maximum ratio of confused units.")
    refitted: int = threshold(4, "Number of the most promising columns and ratios that are refitted.")
    equal: float = threshold(
        0.1, "Maximum relative difference for two ratios to count as one, or for a ratio to change nothing."
    )


@dataclass(frozen=True)
class Verdict:
    """Probabilities of candidates, of nothing and of something unknown."""

    set_probability: float = threshold(0.95, "Minimum probability for an explanation set.")
    imperfect_share: float = threshold(
        0.05, "Maximum share of the misfit, or of a gain, that a right form may cost.", basis=RIGHT_FORMS
    )
    minor_share: float = threshold(
        0.2, "Maximum share of evidence or explained misfit for an effect to be minor beside others."
    )
    doubtful: float = threshold(
        0.5, "Maximum probability for an effect that something else explains as well."
    )
    tentative: float = threshold(
        0.7,
        "Maximum probability for what lacks settled evidence, ends at a bound, or for nothing missing.",
        basis="seed 952: of 26 springs in which nothing was found, 17 had nothing missing",
    )  # fmt: skip
    untried: float = threshold(
        -5.0, "Maximum log Bayes factor for a candidate whose score was not worth a fit.", "nat"
    )
    alike_factor: float = threshold(
        1.1, "Maximum ratio of reduced chi-squares for a rival to explain as well."
    )
    alike_evidence: float = threshold(
        10.0, "Maximum difference of log Bayes factors for a rival to explain as well.", "nat"
    )
    refuted_unknown: float = threshold(
        0.6, "Minimum probability of something unknown for names that leave far more than noise, or all."
    )
    clearly_left: float = threshold(
        2.0, "Maximum excess of a reduced chi-square over noise for names to be trusted.",
        basis="field: names that left a reduced chi-square of 3 to 233 were imperfect or wrong",
    )  # fmt: skip
    beside_unknown: float = threshold(
        0.25, "Minimum probability of something unknown for it to stand beside names.",
        basis="31 named blind cases: 4 of 7 that left more were wrong or incomplete, 4 of 24 others",
    )  # fmt: skip
    chance_deviations: float = threshold(
        2.0, "Maximum excess of a reduced chi-square for chance to have left it beside names.", "sd"
    )
    least_unknown: float = threshold(0.01, "Minimum probability of something unknown beside names.")
    most_unknown: float = threshold(0.97, "Maximum probability of something unknown.")
    nothing_named_unknown: float = threshold(
        0.9, "Minimum probability of something unknown for a mismatch without a name."
    )
    minimum_excess: float = threshold(
        0.15, "Minimum excess of a reduced chi-square for something to be left."
    )
    minimum_deviations: float = threshold(
        3.0, "Minimum excess of a reduced chi-square for more than chance.", "sd"
    )
    minimum_over: float = threshold(
        0.3, "Minimum excess over noise for effects to leave something unmodelled."
    )
    maximum_kept: float = threshold(
        0.5, "Maximum share of the held-out misfit for effects to keep and still help.",
        basis="twelfth run: one slipping crimp kept more under a wrong name, no right name did",
    )  # fmt: skip
    faint: float = threshold(1.4, "Maximum reduced chi-square for a misfit that is faint.")
    sure_deviations: float = threshold(
        3.5, "Minimum excess of a reduced chi-square for a mismatch, where noise is stated.", "sd"
    )
    gross: float = threshold(
        4.0, "Minimum reduced chi-square for a mismatch without a score that stands out."
    )
    minimum_weight: float = threshold(
        0.02, "Minimum probability for an explanation to enter averaged predictions."
    )


@dataclass(frozen=True)
class NextExperiment:
    """Repetitions that are compared."""

    rate_factor: float = threshold(10.0, "Factor on the clock for slower and faster repetitions.")
    load_factor: float = threshold(1.25, "Factor on the load for a stronger repetition.")
    pause: float = threshold(300.0, "Number of seconds for holding the largest load.", "s")
