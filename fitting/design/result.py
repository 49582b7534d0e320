"""Results of a study as data; `fitting.report.design` renders them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fitting.inference.results import Result

from .discrete import Step
from .log import Evaluation
from .optimality import Conditions
from .optimise import Problem
from .program import Model
from .study import Study


@dataclass(frozen=True)
class Choice:
    """One combination of what can be chosen; None stands for the design's own."""

    design: str
    alloy: str | None
    material: str | None

    def words(self, study: Study) -> str:
        """Only what there was a choice of; empty where there was none."""
        pairs = ((self.design, study.designs), (self.alloy, study.alloys), (self.material, study.materials))
        return ", ".join(Path(str(one)).name for one, all_of in pairs if len(all_of) > 1)


@dataclass(frozen=True)
class Design:
    """A design and what it is worth.

    Attributes:
        choice: tables.
        parameters: values by name [SI].
        objectives: values in the order of the study [SI], with their own sign.
        violation: the largest scaled one of a constraint [1]; negative where there is room everywhere.
        evaluation: the numbers that the optimiser received.
        reached: quantities that have a target [SI], by the index of the objective, whose own value is the
            distance from it.
    """

    choice: Choice
    parameters: Mapping[str, float]
    objectives: tuple[float, ...]
    violation: float
    evaluation: Evaluation
    reached: Mapping[int, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Chance:
    """Results of fresh draws for a design.

    Attributes:
        draws: number of them; failures: how many violate a constraint, or have no equilibrium.
        interval: 95 % interval of the probability of failure.
        by_constraint: failures of each constraint.
        lost: draws without equilibrium.
        values: first objective of every draw that has one [SI].
    """

    draws: int
    failures: int
    interval: tuple[float, float]
    by_constraint: tuple[int, ...]
    lost: int
    values: np.ndarray

    @property
    def probability(self) -> float:
        """Probability of failure [1]."""
        return self.failures / self.draws


@dataclass(frozen=True)
class Front:
    """Designs of which none is better than another in every objective.

    Attributes:
        designs: designs in the order of the first objective.
        hypervolume: volume that they dominate, up to the reference [1]. It is a share of the box between the
            best of each objective and the reference.
        reference: worst value that counts of each objective, with its own sign [SI].
        made: true if the designs can be made.
        chances: results of each design on fresh draws, where the probability of failure is an objective. The
            search has a smooth share of its own draws instead.
    """

    designs: tuple[Design, ...]
    hypervolume: float
    reference: tuple[float, ...]
    made: bool
    chances: tuple[Chance, ...] = ()


@dataclass(frozen=True)
class Limits:
    """What keeps a design that can be made from being better.

    Attributes:
        conditions: of its continuous parameters, the discrete ones fixed.
        blocked: steps of its discrete parameters that would help.
    """

    conditions: Conditions
    blocked: tuple[Step, ...]


@dataclass
class DesignResult(Result):
    """A solved study.

    Attributes:
        study: the study that was solved.
        model: model of the chosen combination.
        base: the tables' own dimensions, or None where a free parameter has no such value.
        ideal: the best before rounding to what can be made.
        made: the design that can be made; the same where nothing is discrete.
        problem: the problem that was solved; conditions: first-order conditions at `ideal`.
        limits: what limits `made`.
        front: designs of which none dominates another; None for a single objective.
        chances: results on fresh draws by `robust design`, `nominal design` and `design of the tables`; empty
            without uncertainty.
        others: the best of the other combinations of choices.
        starts: objective [SI] and violation that each start of the chosen combination ended with.
        lost, joined: number of its starts that could not be solved, and that were stopped near an optimum
            found before.
        evaluations, equilibria: numbers of evaluations and of equilibria that were computed.
        finer_areas: areas of the workspaces of `made` and `base` [m2], by objective, from polygons of
            `workspace.FINER` times as many states; empty under uncertainty.
        notes: cautions for the reader.
    """

    study: Study
    model: Model
    base: Design | None
    ideal: Design
    made: Design
    problem: Problem
    conditions: Conditions
    limits: Limits
    front: Front | None
    chances: Mapping[str, Chance]
    others: tuple[Design, ...]
    starts: tuple[tuple[float, float], ...]
    lost: int
    joined: int
    evaluations: int
    equilibria: int
    finer_areas: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
