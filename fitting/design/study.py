"""A design study in memory: what is free, what is wanted, what must hold, what is uncertain. SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.units import from_si

CHOICES = ("design", "alloy", "material")
"""Keys of a choice among tables: the layout, the alloy, the silicone."""


@dataclass(frozen=True)
class Bound:
    """An end of a parameter's range: a number, or a multiple of another parameter and a number.

    Attributes:
        value: [SI].
        parameter: whose value counts, too; None for a plain number.
        times: factor on that parameter [1].
    """

    value: float
    parameter: str | None = None
    times: float = 0.0


@dataclass(frozen=True)
class Free:
    """A free parameter.

    Attributes:
        name: a dimension (`wall_thickness`), one of a segment (`2.wall_thickness`), `connector`, or a drive
            of a state (`hot.pressure`, `hot.xi0_2`).
        made: `continuous`, `steps`, `catalogue` or `integer`.
        low, high: ends of its range.
        values: values that can be made [SI], ascending; empty if the parameter is continuous.
        unit: unit in which it is shown.
    """

    name: str
    made: str
    low: Bound
    high: Bound
    values: tuple[float, ...]
    unit: str

    @property
    def discrete(self) -> bool:
        """True if only certain values can be made."""
        return self.made != "continuous"


@dataclass(frozen=True)
class State:
    """State of the actuator: a pressure and the phases of its springs.

    Attributes:
        name: name by which objectives and constraints refer to it.
        pressure: gauge [Pa]; None if it is free.
        fractions: martensite fraction by segment (from 1, 0 for all) and spring; None if it is free. Springs
            that are not named are cold.
    """

    name: str
    pressure: float | None
    fractions: Mapping[tuple[int, int], float | None] = field(default_factory=dict)


@dataclass(frozen=True)
class Sweep:
    """States round the edge of a range of pressure and activation, see `workspace.edge_states`.

    Attributes:
        low, high: gauge pressures [Pa].
        xi0_min: martensite fraction of the hottest spring [1].
        points: steps of pressure along an edge, and half as many as those of activation.
    """

    low: float
    high: float
    xi0_min: float
    points: int


@dataclass(frozen=True)
class Pose:
    """Where the tip is to be in a state.

    Attributes:
        state: name of the state.
        tip: place in the frame of the base [m].
        direction: unit vector along the tip; None if any will do.
    """

    state: str
    tip: tuple[float, float, float]
    direction: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Objective:
    """One thing that is wanted.

    Attributes:
        name: name of the objective.
        quantity: key of `quantities.QUANTITIES`, `workspace_area`, `stiffness_range` or `function`.
        goal: `maximise`, `minimise` or `target`.
        states: names of the states it looks at; of several, a quantity's mean counts.
        target: target value for the goal `target` [SI].
        poses: poses of `tip_miss`, one for each of the states.
        sweep: ranges of `workspace_area`.
        segment: segment whose quantity is meant, from 1.
        file, function: file and name of a user's function.
        unit: unit in which it is shown.
    """

    name: str
    quantity: str
    goal: str
    states: tuple[str, ...]
    target: tuple[float, ...] = ()
    poses: tuple[Pose, ...] = ()
    sweep: Sweep | None = None
    segment: int = 1
    file: Path | None = None
    function: str = ""
    unit: str = "1"

    @property
    def sign(self) -> float:
        """Factor that turns the value into one to be minimised."""
        return -1.0 if self.goal == "maximise" else 1.0

    @property
    def aims(self) -> bool:
        """True if the value is a distance from a target, and not the quantity itself."""
        return self.goal == "target"

    def in_unit(self, value: float | np.ndarray) -> float | np.ndarray:
        """Values [SI] in `unit`; for the goal `target` they are distances."""
        return from_si(value, self.unit, difference=self.aims)


@dataclass(frozen=True)
class Constraint:
    """One thing that must hold, as an inequality.

    Attributes:
        name: name of the constraint.
        quantity: same keys as those of an objective.
        most: true if the limit is an upper one.
        limit: [SI]; None for the range in which alloy or silicone were tested.
        states: names of states; empty for all, those of sweeps included.
        segment: segment whose quantity is meant, from 1; 0 for every segment.
        file, function: file and name of a user's function.
        unit: unit in which it is shown.
    """

    name: str
    quantity: str
    most: bool
    limit: float | None
    states: tuple[str, ...] = ()
    segment: int = 0
    file: Path | None = None
    function: str = ""
    unit: str = "1"


@dataclass(frozen=True)
class Tolerance:
    """Tolerance of a dimension: its distance from what was ordered.

    Attributes:
        name: name of the dimension.
        sd: 1-sigma [SI], of a Gaussian; half_width: of a uniform distribution [SI]. One of them is zero.
    """

    name: str
    sd: float = 0.0
    half_width: float = 0.0


@dataclass(frozen=True)
class Uncertainty:
    """Uncertain inputs, and the rule by which their spread counts.

    Attributes:
        tolerances: tolerances of dimensions.
        posterior: `posterior.nc` that `pneusma posterior` wrote, or None.
        fresh_posterior: the same of another run of the sampler, from which the fresh draws come; None to take
            them from `posterior`, too.
        specimen: number of the specimen whose posterior counts, where it is of several; else None.
        priors: kinds of tables (`alloy`, `silicone`) whose own priors count.
        objective: `mean`, `mean_plus_sigma`, `cvar` or `failure`.
        constraints: `mean` or `cvar`.
        k: sigmas of `mean_plus_sigma` [1].
        level: level of `cvar` [1]: 0.95 is the mean of the worst twentieth.
        draws: common random numbers of the search; fresh: draws of the final probability.
    """

    tolerances: tuple[Tolerance, ...] = ()
    posterior: Path | None = None
    fresh_posterior: Path | None = None
    specimen: int | None = None
    priors: tuple[str, ...] = ()
    objective: str = "mean"
    constraints: str = "cvar"
    k: float = 1.0
    level: float = 0.95
    draws: int = 64
    fresh: int = 10_000


@dataclass(frozen=True)
class Study:
    """A design study; `reading.read_study` makes one.

    Attributes:
        name: name for people; path: path of the file.
        designs, alloys, materials: tables to choose among; None stands for the design's own.
        free: parameters, in the order of the file; drives of states come last.
        states: states by name.
        objectives: one to three.
        constraints: inequalities.
        uncertainty: None if everything is taken to be nominal.
        starts: number of starts of the search; seed: seed of all random numbers; points: points of a front
            along an axis.
        optimiser: `slsqp` or `trust-constr`.
        model: constants in place of the tables', and effects beyond the base model.
    """

    name: str
    path: Path
    designs: tuple[str, ...]
    alloys: tuple[str | None, ...]
    materials: tuple[str | None, ...]
    free: tuple[Free, ...]
    states: Mapping[str, State]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    uncertainty: Uncertainty | None = None
    starts: int = 8
    seed: int = 0
    points: int = 9
    optimiser: str = "slsqp"
    model: AugmentedModel = BASE

    def parameter(self, name: str) -> Free:
        """A free parameter by its name."""
        return next(free for free in self.free if free.name == name)
