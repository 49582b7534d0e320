"""Thresholds that decide: what counts as evidence, as more than chance, as much, and as likely.

Each is one number for one principle, at every place where that principle decides.
"""

from dataclasses import dataclass

from .threshold import threshold

RIGHT_FORMS = "eleventh run: right effects in other forms left up to 0.19, once 0.3, wrong ones 0.2 or more"


@dataclass(frozen=True)
class Values:
    """Numbers of values without which nothing is concluded."""

    minimum: int = threshold(20, "Minimum number of values for a diagnosis, or for telling outliers.")
    minimum_rows: int = threshold(16, "Minimum number of rows of a recording for a comparison.", "rows")
    minimum_differences: int = threshold(60, "Minimum number of second differences for a noise estimate.")


@dataclass(frozen=True)
class Chance:
    """What noise makes by itself: p-values, and distances in standard deviations."""

    level: float = threshold(
        0.01, "Maximum p-value for a score to stand out: of all effects together, or of one that is fitted.",
        basis="sixteenth to twenty-third run: 3 of 708 nulls called a mismatch, all rules together",
    )  # fmt: skip
    level_together: float = threshold(
        0.005, "Maximum p-value for the same on all recordings together, at a second look."
    )
    deviations: float = threshold(
        3.0, "Minimum distance for more than chance: of a reduced chi-square, a base constant, or a reading "
        "over its neighbours' spread.", "sd",
        "eighteenth run: beyond it a true effect seemed to act the wrong way",
    )  # fmt: skip
    sure_deviations: float = threshold(
        3.5, "Minimum excess of a reduced chi-square for a mismatch, where noise is stated.", "sd"
    )
    sign_deviations: float = threshold(
        2.0, "Maximum excess of a reduced chi-square for chance to have left it beside names.", "sd"
    )
    agreement: float = threshold(4.0, "Maximum difference for two readings of one value to agree.", "sd")
    outlier: float = threshold(
        6.0, "Minimum ratio of its distance from its neighbours to noise, and to the usual distance, for an "
        "outlier.", "sd",
    )  # fmt: skip
    maximum_change: float = threshold(
        5.0, "Maximum change of a value for noise of inputs to have made it.", "sd"
    )
    driver_ratio: float = threshold(
        1.5, "Minimum ratio of a driver's standard deviation to its noise for it to vary."
    )
    block_excess: float = threshold(
        2.0, "Minimum ratio of the means' noise to that of independent errors for it to count."
    )
    scatter_ratio: float = threshold(
        2.4,
        "Maximum ratio of an estimated noise to the fast scatter of its readings for a report not to warn.",
        basis="50 generated campaigns: right to a quarter up to 2.36, 1.3 to 1.7 times too large above",
    )


@dataclass(frozen=True)
class Evidence:
    """Log Bayes factors, less the logarithm of the number of candidates."""

    minimum_first: float = threshold(
        8.0, "Minimum log Bayes factor for a first effect, or a model discrepancy. An effect at a bound pays "
        "as much again.", "nat",
        "sixteenth run: of 130 opened nulls no discrepancy reached 4; one null in a hundred names reached 9",
    )  # fmt: skip
    minimum_further: float = threshold(
        5.0, "Minimum log Bayes factor, or log-likelihood of left-out values, for an effect beside others, a "
        "discrepancy, or another base fit.", "nat",
        "13th run, of a discrepancy: of 24 right names none was outdone by as much, of four wrong ones three",
    )  # fmt: skip
    minimum_settled: float = threshold(
        12.0, "Minimum log Bayes factor, less drift, for more than a tentative name.", "nat",
        "fifteenth run: a null of a wire at 8.9 was named with 0.99",
    )  # fmt: skip
    minimum_difference: float = threshold(
        4.0, "Minimum difference of log-likelihoods for two explanations, models of noise or starts to be "
        "told apart.", "nat",
    )  # fmt: skip
    minimum_unstated: float = threshold(
        1.0,
        "Minimum log-likelihood for correlation of unstated noise.",
        "nat",
        "eighteenth run: of 27 opened nulls 22 gain less than 0.7, the others 1.6 and more",
    )
    maximum_loss: float = threshold(
        3.0, "Maximum loss of log-likelihood of validation recordings for an effect.", "nat"
    )
    alike: float = threshold(
        10.0, "Maximum difference of log Bayes factors for a rival to explain as well.", "nat"
    )
    untried: float = threshold(
        -5.0, "Maximum log Bayes factor for a candidate whose score was not worth a fit.", "nat"
    )


@dataclass(frozen=True)
class Excess:
    """Reduced chi-square beyond that of noise."""

    minimum: float = threshold(0.15, "Minimum excess of a reduced chi-square for something to be left.")
    poor: float = threshold(
        1.2, "Minimum reduced chi-square for other starts of the base fit, or an effect at a bound."
    )
    little: float = threshold(
        0.3, "Minimum excess over noise for effects to leave something unmodelled."
    )
    faint: float = threshold(1.4, "Maximum reduced chi-square for a misfit that is faint.")
    clear: float = threshold(
        2.0, "Maximum excess of a reduced chi-square over noise for names to be trusted.",
        basis="field: names that left a reduced chi-square of 3 to 233 were imperfect or wrong",
    )  # fmt: skip
    gross: float = threshold(
        4.0, "Minimum reduced chi-square for a mismatch without a score that stands out."
    )


@dataclass(frozen=True)
class Share:
    """Parts of a whole: of a misfit, of evidence, of a range, of a recording."""

    same_input: float = threshold(
        0.01, "Maximum distance for two inputs to be the same, over the driver's range."
    )
    same: float = threshold(
        0.02, "Maximum difference of repeated tests beyond noise, over the output's range; or range of a "
        "still driver of unstated noise, over its largest value.",
    )  # fmt: skip
    of_base: float = threshold(
        0.025, "Minimum share of the base model's held-out misfit for a further effect, or a term of a "
        "custom model.",
    )  # fmt: skip
    outliers: float = threshold(
        0.03, "Maximum share of a recording's readings for all of them to be outliers."
    )
    small: float = threshold(
        0.05, "Maximum share of the misfit, or of a gain, that a right form may cost.", basis=RIGHT_FORMS
    )
    hot: float = threshold(
        0.1, "Maximum martensite fraction in a test for a fit in which it is constant there.",
        basis="seven simulated springs at full heat reached 0.015 to 0.03 with a fraction that walks",
    )  # fmt: skip
    of_fitted: float = threshold(
        0.1, "Minimum share of the base model's fitted misfit for a further effect, instead."
    )
    alike: float = threshold(
        0.1, "Maximum relative difference for two ratios to count as one, or for a ratio to change nothing."
    )
    alike_factor: float = threshold(
        1.1, "Maximum ratio of reduced chi-squares for a rival to explain as well."
    )
    minor: float = threshold(
        0.2, "Maximum share for a part to be minor: of evidence, explained misfit, a driver's range, or a "
        "value that a trajectory follows.",
    )  # fmt: skip
    comparable: float = threshold(0.3, "Minimum share of the best such score for a candidate.")
    misread: float = threshold(
        0.3, "Minimum error of the refitted base model, over an output's range, for asking about units.",
        basis="shipped examples: 18 of 20 slips of ten made 0.3 or more; practice campaigns had 0.19 or less",
    )  # fmt: skip
    further: float = threshold(
        0.45, "Minimum share of the held-out misfit for a further effect.",
        basis="a prototype on 34 actuators: imperfect forms of true effects breed second ones below 0.6",
    )  # fmt: skip
    most: float = threshold(
        0.5, "Maximum share of the held-out misfit for effects to keep and still help; minimum part of a "
        "recording for a comparison.",
        basis="twelfth run: one slipping crimp kept more under a wrong name, no right name did",
    )  # fmt: skip
    kept_by_discrepancy: float = threshold(
        0.75, "Maximum share of what effects leave for a saved discrepancy beside them."
    )


@dataclass(frozen=True)
class Probability:
    """Probabilities that are told, and those from which on something is said."""

    least: float = threshold(0.01, "Minimum probability of something unknown beside names.")
    minimum_weight: float = threshold(
        0.02, "Minimum probability for an explanation to enter averaged predictions."
    )
    beside: float = threshold(
        0.25, "Minimum probability of something unknown for it to stand beside names.",
        basis="31 named blind cases: 4 of 7 that left more were wrong or incomplete, 4 of 24 others",
    )  # fmt: skip
    doubtful: float = threshold(
        0.5, "Maximum probability for an effect that something else explains as well."
    )
    refuted: float = threshold(
        0.6, "Minimum probability of something unknown for names that leave far more than noise, or all."
    )
    tentative: float = threshold(
        0.7,
        "Maximum probability for what lacks settled evidence, ends at a bound, or for nothing missing.",
        basis="seed 952: of 26 springs in which nothing was found, 17 had nothing missing",
    )  # fmt: skip
    nothing_named: float = threshold(
        0.9, "Minimum probability of something unknown for a mismatch without a name."
    )
    sure: float = threshold(0.95, "Minimum probability for an explanation set.")
    most: float = threshold(0.97, "Maximum probability of something unknown.")
