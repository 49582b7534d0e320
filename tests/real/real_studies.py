"""The studies of real recordings: what is asked, what the tests' design makes true, and how the answer is scored."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from real_campaigns import Case, loading_unloading, tension, thermal_cycles, two_laboratories

from fitting.data.recordings import read_campaign, schema
from fitting.diagnose import Conclusion, diagnose
from fitting.diagnose.evaluate.program import Program
from pneusma_jax.units import from_si

CONFIDENT = 0.8
"""Probability above which a name is given without reserve."""
UNMODELLED = "unmodelled"


@dataclass(frozen=True)
class Answer:
    """What the tool said of a case, and what that is worth.

    Attributes:
        case: name.
        named: effects with their probabilities, most certain first.
        explanation_set: as reported.
        unknown: probability of something without a name.
        before, after: RMSE of what was kept out, refitted base and augmented model, in `unit`.
        unit: of these.
        right: whether the answer is what the design makes true.
        seconds: of the diagnosis.
    """

    case: str
    named: dict[str, float]
    explanation_set: list[str]
    unknown: float
    before: float
    after: float
    unit: str
    right: bool
    seconds: float

    @property
    def cut(self) -> float:
        """Share of the error on what was kept out that is gone."""
        return 1.0 - self.after / self.before


@dataclass(frozen=True)
class Study:
    """Cases that ask one thing.

    Attributes:
        letter: in the table.
        title, truth: the question, and what the design makes true, for people.
        cases: makers of the cases, by a name for the command line.
        judged: whether an answer is right, from names with probabilities and from the explanation set.
        cut: share of the error on what was kept out that must be gone at least.
    """

    letter: str
    title: str
    truth: str
    cases: dict[str, Callable[[], Case]]
    judged: Callable[[dict[str, float], list[str]], bool]
    cut: float | None


def _holds(*wanted: str) -> Callable[[dict[str, float], list[str]], bool]:
    """Whether every wanted effect was named."""
    return lambda named, _: all(slug in named for slug in wanted)


def _first(wanted: str) -> Callable[[dict[str, float], list[str]], bool]:
    """Whether the wanted effect was named first."""
    return lambda named, _: next(iter(named), None) == wanted


def _reserved(named: dict[str, float], explanation_set: list[str]) -> bool:
    """No name without reserve, and the set holds what may be behind a contradiction of laboratories."""
    sure = [slug for slug, p in named.items() if slug != UNMODELLED and p > CONFIDENT]
    return not sure and bool({"load_train_compliance", UNMODELLED} & {*explanation_set, *named})


STUDIES = (
    Study(
        "a",
        "a soft polymer pulled and let back at three rates; elastic base",
        "the peak grows with rate and the loop is wide: viscoelastic_relaxation",
        {rate: (lambda rate=rate: loading_unloading(rate)) for rate in ("03", "01", "05")},
        _first("viscoelastic_relaxation"),
        0.5,
    ),
    Study(
        "b",
        "silicones in tension; neo-Hookean base",
        "the modulus grows with the range of stretch: strain_stiffening",
        {
            "dragon_skin_10": lambda: tension("Dragon Skin 10 MEDIUM"),
            "dragon_skin_30": lambda: tension("Dragon Skin 30"),
            "ecoflex_30": lambda: tension("Ecoflex 00-30"),
            "dragon_skin_10_200": lambda: tension("Dragon Skin 10 MEDIUM", 2.0),
            "dragon_skin_30_200": lambda: tension("Dragon Skin 30", 2.0),
            "ecoflex_30_200": lambda: tension("Ecoflex 00-30", 2.0),
        },
        _first("strain_stiffening"),
        0.5,
    ),
    Study(
        "c",
        "one name of silicone, pulled in one laboratory, pressed in another",
        "twofold contradiction of unknown cause: load_train_compliance or unmodelled in the set, no name above 0.8",
        {"ecoflex_30": two_laboratories},
        _reserved,
        None,
    ),
    Study(
        "d",
        "NiTiCo cooled and heated under four stresses; reversible base, blind to stress",
        "transformation_hysteresis and stress_shifted_transformation, both",
        {str(load): (lambda load=load: thermal_cycles(load)) for load in (150, 50)},
        _holds("transformation_hysteresis", "stress_shifted_transformation"),
        0.5,
    ),
)


def answer(study: Study, case: Case, folder: Path, seed: int = 1) -> Answer:
    """Write a case without its names, diagnose it, and predict what was kept out.

    Args:
        study: that the case belongs to.
        case: recordings.
        folder: for the campaign.
        seed: of the diagnosis and of the order of recordings.
    """
    seen, whole = case.write(folder, seed)
    began = time.perf_counter()
    conclusion = diagnose(read_campaign(seen), seed=seed)
    seconds = time.perf_counter() - began
    named = {found.slug: float(found.probability) for found in conclusion.found}
    before, after, unit = kept_out(conclusion, whole)
    explanation_set = list(conclusion.explanation_set)
    right = study.judged(named, explanation_set)
    return Answer(
        case.name, named, explanation_set, float(conclusion.unknown), before, after, unit, right, seconds
    )


def kept_out(conclusion: Conclusion, whole: Path) -> tuple[float, float, str]:
    """RMSE of the refitted base model and of the augmented one on recordings that the tool never saw.

    Args:
        conclusion: of the campaign without them.
        whole: folder of the campaign with them, as `validation`.

    Returns:
        Both errors, and their unit.
    """
    explanation = conclusion.explanation
    campaign = read_campaign(whole)
    program = Program.of(campaign, explanation.program.kind)
    errors = []
    for fit in (explanation.base, explanation.final):
        evaluation = program.evaluate(fit.u, fit.free[:0])
        misses = []
        for k in np.flatnonzero(~program.fitted):
            channel = program.channels[k][0]
            misses.append((evaluation.predicted[k][0] - channel.measured)[np.isfinite(channel.sigma)])
        errors.append(float(np.sqrt(np.mean(np.concatenate(misses) ** 2))))
    quantity = program.channels[0][0].quantity
    unit = schema.quantity_and_unit(campaign.recordings[0].column(quantity))[1]
    return (*(float(from_si(error, unit)) for error in errors), unit)
