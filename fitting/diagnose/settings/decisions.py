"""Thresholds on decisions of the search: score test, evidence, cross-validation, entry, drift, steps."""

from dataclasses import dataclass

from .threshold import NUMERICAL, threshold


@dataclass(frozen=True)
class ScoreTest:
    """The score of every effect against chance."""

    level: float = threshold(
        0.01, "Maximum p-value for a score to stand out: of all effects together, or of one that is fitted.",
        basis="sixteenth to twenty-third run: 3 of 708 nulls called a mismatch, all rules together",
    )  # fmt: skip
    level_together: float = threshold(
        0.005, "Maximum p-value for the same on all recordings together, at a second look."
    )
    draws: int = threshold(999, "Number of simulated nulls for a p-value.")
    shapes: int = threshold(5, "Number of shapes of every effect for its score.")
    slow_cosines: int = threshold(6, "Number of cosines over each recording for slow misfit, or for drift.")
    far_from_nominal: float = threshold(
        3.0, "Minimum deviation of a base constant for scores about nominal, too.", "sd",
        "eighteenth run: beyond it a true effect seemed to act the wrong way",
    )  # fmt: skip
    whole_effects: tuple[float, ...] = threshold(
        (0.3, 1.0), "Factor on a typical effect for its trial as a whole, about nominal constants."
    )
    price: float = threshold(3.0, "Factor on the degrees of freedom for the order of scores.")


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


@dataclass(frozen=True)
class Entry:
    """Minimum gain of a candidate on left-out values to enter the model."""

    minimum_further_share: float = threshold(
        0.45, "Minimum share of the held-out misfit for a further effect.",
        basis="a prototype on 34 actuators: imperfect forms of true effects breed second ones below 0.6",
    )  # fmt: skip
    minimum_of_base: float = threshold(
        0.025, "Minimum share of the base model's held-out misfit for a further effect, or a term of a "
        "custom model.",
    )  # fmt: skip
    minimum_of_fitted: float = threshold(
        0.1, "Minimum share of the base model's fitted misfit for a further effect, instead."
    )
    maximum_loss: float = threshold(
        3.0, "Maximum loss of log-likelihood of validation recordings for an effect.", "nat"
    )


@dataclass(frozen=True)
class Drift:
    """Thresholds of the misfit that instruments explain by themselves: slow drift, and noise of inputs."""

    sizes: tuple[float, ...] = threshold(
        (0.0, 0.2, 0.4, 0.6),
        "Number of drift sizes, equally likely, for its evidence: these, over the noise.",
        "sd",
        "nulls of the generator drift by up to 0.6 of their noise",
    )
    lasting_part: float = threshold(0.25, "Factor from a recording to the part for which drift lasts.")
    input_seed: int = threshold(20, "Number of the random stream for noise that both models get.")
    maximum_change: float = threshold(
        5.0, "Maximum change of a value for noise of inputs to have made it.", "sd"
    )

    @property
    def maximum_explained(self) -> float:
        """Most of a reduced chi-square that drift may explain: twice its largest variance."""
        return 2.0 * self.sizes[-1] ** 2


@dataclass(frozen=True)
class Search:
    """Number of sets of effects that are followed, and conditions for looking at larger ones."""

    maximum_effects: int = threshold(3, "Maximum number of effects for a model.")
    beam: int = threshold(8, "Number of sets of one size for a fit together with the base.")
