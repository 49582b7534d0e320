"""Thresholds that decide: what counts as evidence, as more than chance, as much, and as likely.

Each is one number for one principle, at every place where that principle decides.
"""

from dataclasses import dataclass

from .threshold import threshold


@dataclass(frozen=True)
class Values:
    """Numbers of values without which nothing is concluded."""

    minimum: int = threshold(
        20, "Minimum number of independent values for a diagnosis, a comparison, a noise estimate or telling "
        "outliers.",
    )  # fmt: skip


@dataclass(frozen=True)
class Chance:
    """What noise makes by itself: p-values, and distances in standard deviations."""

    level: float = threshold(
        0.01, "Maximum p-value for a score to stand out. Where recordings are looked at twice, each look has "
        "half of it.",
        basis="sixteenth to twenty-third run: 3 of 708 nulls called a mismatch, all rules together",
    )  # fmt: skip
    period_level: float = threshold(
        1e-3, "Maximum probability by chance, over all outputs and drivers, of a period that is told.",
        basis="white noise: 3 of 300 below 0.01, none below 0.001; ripples of 0.7 sd in time: 40 of 40 below",
    )  # fmt: skip
    deviations: float = threshold(
        3.0, "Minimum distance for more than chance: of a reduced chi-square, a base constant, a mean of "
        "readings, or a reading over its neighbours' spread.", "sd",
        "eighteenth run: beyond it a true effect seemed to act the wrong way",
    )  # fmt: skip
    left_beside_names: float = threshold(
        2.0, "Maximum excess of a reduced chi-square for chance to have left it beside names.", "sd",
        "the calibrated curve of something unknown was fitted with it; with 3 a sign of 0.37 is 0.31",
    )  # fmt: skip
    outlier: float = threshold(
        6.0, "Minimum distance from neighbours or from a repetition, or change of a value, that noise does "
        "not make in any row.", "sd",
        "39 opened campaigns: the farthest reading was at 1.7 to 4.6 in 36, at 6.1 and more in three",
    )  # fmt: skip
    scatter_ratio: float = threshold(
        2.4, "Minimum ratio of two estimates of one scatter for them to differ: of a driver, of means, or of "
        "fast and slow noise.",
        basis="50 generated campaigns: right to a quarter up to 2.36, 1.3 to 1.7 times too large above",
    )  # fmt: skip


@dataclass(frozen=True)
class Evidence:
    """Log Bayes factors, less the logarithm of the number of candidates."""

    minimum_unstated: float = threshold(
        1.0, "Minimum log-likelihood for correlation of unstated noise.", "nat",
        "eighteenth run: of 27 opened nulls 22 gain less than 0.7, the others 1.6 and more",
    )  # fmt: skip
    minimum_difference: float = threshold(
        4.0, "Minimum difference of log-likelihoods for two models to be told apart: with a further effect "
        "and without, two fits, two models of noise.", "nat",
        "39 opened campaigns: of 442 comparisons none was between 3.85 and 7.38, 15 were between 2 and 3.85",
    )  # fmt: skip
    minimum_first: float = threshold(
        8.0, "Minimum log Bayes factor for a first effect, or a model discrepancy. An effect at a bound pays "
        "as much again.", "nat",
        "sixteenth run: of 130 opened nulls no discrepancy reached 4; one null in a hundred names reached 9",
    )  # fmt: skip
    minimum_settled: float = threshold(
        12.0, "Minimum log Bayes factor, less drift, for more than a tentative name, or over a rival that "
        "leaves as little.", "nat",
        "fifteenth run: a null of a wire at 8.9 was named with 0.99",
    )  # fmt: skip


@dataclass(frozen=True)
class Excess:
    """Reduced chi-square beyond that of noise."""

    little: float = threshold(
        0.3, "Maximum excess of a misfit that is faint: no name, no other start and no further effect is "
        "needed for it.",
        basis="39 opened campaigns: no conclusion depends on 0.2, 0.3 or 0.4",
    )  # fmt: skip
    clear: float = threshold(
        2.0, "Maximum excess for names to be trusted whatever share they leave, or for a misfit that shows "
        "in one of two ways only.",
        basis="field: names that left a reduced chi-square of 3 to 233 were imperfect or wrong",
    )  # fmt: skip


@dataclass(frozen=True)
class Share:
    """Parts of a whole: of a misfit, of evidence, of a range, of a recording."""

    same: float = threshold(
        0.01, "Maximum difference of two inputs that are the same, or of a driver that is still, over its "
        "range or value.",
        basis="with 0.05 instead, two like pulls were called a contradiction",
    )  # fmt: skip
    outliers: float = threshold(
        0.03, "Maximum share of a recording's readings for all of them to be outliers.",
        basis="with 0.05, pulses in one of twenty rows were outliers",
    )  # fmt: skip
    small: float = threshold(
        0.05, "Maximum share that is small: of misfit or gain, as a right form may cost; of an output's "
        "range; of martensite near full heat.",
        basis="eleventh run: right effects in other forms left up to 0.19, once 0.3, wrong ones 0.2 or more",
    )  # fmt: skip
    alike: float = threshold(
        0.1, "Maximum relative difference of two reduced chi-squares, amplitudes or units that are as good; "
        "what exceeds noise by more is left over.",
    )
    minor: float = threshold(
        0.2, "Maximum share of a minor part: of evidence, of explained misfit, of a range, or of a value "
        "that a trajectory follows.",
        basis="practice campaigns had a misfit of 0.19 of an output's range or less, wrong units 0.3 or more",
    )  # fmt: skip
    most: float = threshold(
        0.5, "Minimum share for most of something: of held-out misfit that effects remove, or of a recording "
        "that is compared.",
        basis="twelfth run: one slipping crimp kept more under a wrong name, no right name did",
    )  # fmt: skip


@dataclass(frozen=True)
class Probability:
    """Probabilities that are told, and those from which on something is said."""

    least: float = threshold(0.01, "Minimum probability that is told of something unknown, averaged over, or "
                             "separated from a name by the next experiment.")  # fmt: skip
    beside: float = threshold(
        0.25, "Minimum probability of something unknown for it to stand beside names.",
        basis="31 named blind cases: 4 of 7 that left more were wrong or incomplete, 4 of 24 others",
    )  # fmt: skip
    doubtful: float = threshold(
        0.5, "Maximum probability for an effect that something else explains as well, or of something "
        "unknown behind names.",
    )  # fmt: skip
    tentative: float = threshold(
        0.7, "Maximum probability for what lacks settled evidence or outside support, ends at a bound, or "
        "for nothing missing; minimum where names leave too much.",
        basis="seed 952: of 26 springs in which nothing was found, 17 had nothing missing",
    )  # fmt: skip
    sure: float = threshold(
        0.95, "Minimum probability of an explanation set; maximum probability of something unknown."
    )
