"""One constrained problem from many starts by an optimiser of SciPy."""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from pneusma_jax.late import Late

from .lockstep import Ask, run_together
from .log import Evaluation, LoggedModel

optimize = Late("scipy.optimize")

PRECISION = 1e-9
"""Relative change of the scaled objective at which SLSQP ends [1]; the model is exact to 1e-10."""
ALLOWED = 1e-6
"""Scaled violation up to which a constraint counts as kept [1]: a millionth of its limit."""
BETTER = 1e-8
"""Least gain of the scaled objective at which a design counts as better than the end of a search [1]: ten
times the precision of the search."""
MOST_STEPS = 100
"""Maximum of iterations from a start; 8 to 40 are taken."""
BAD = 10.0
"""Rise of the scaled objective where a design cannot be evaluated, so that a line search steps back."""


@dataclass(frozen=True)
class Problem:
    """Objective and constraints, in terms of an evaluation's numbers.

    Attributes:
        weights: weights of the numbers in the objective, shape (numbers,).
        rows: numbers that are constraints, each to be at most its limit.
        limits: limits of these rows; scales: sizes by which the rows are divided.
        held: values at which parameters are held, by index.
        slack: true to minimise the largest violation instead of the objective.
    """

    weights: np.ndarray
    rows: np.ndarray
    limits: np.ndarray
    scales: np.ndarray
    held: dict[int, float] = field(default_factory=dict)
    slack: bool = False

    def objective(self, one: Evaluation) -> float:
        """Objective to be minimised [1]."""
        return float(self.weights @ one.values)

    def excess(self, one: Evaluation) -> np.ndarray:
        """Scaled violations, positive where violated [1]."""
        return (one.values[self.rows] - self.limits) / self.scales

    def violation(self, one: Evaluation) -> float:
        """The largest scaled violation; NaN where the design cannot be evaluated."""
        return float(np.max(self.excess(one), initial=-np.inf)) if one.finite else np.nan

    def free(self, size: int) -> np.ndarray:
        """Indices of the parameters that are not held."""
        return np.array([k for k in range(size) if k not in self.held], dtype=int)


@dataclass(frozen=True)
class Outcome:
    """Result of one start.

    Attributes:
        evaluation: the best that was seen; None where nothing could be evaluated.
        objective: scaled [1]; violation: the largest [1].
        message: message of the optimiser; steps: number of its iterations.
    """

    evaluation: Evaluation | None
    objective: float
    violation: float
    message: str
    steps: int

    @property
    def kept(self) -> bool:
        """True if all constraints are kept."""
        return self.evaluation is not None and self.violation <= ALLOWED


def best_of(outcomes: Sequence[Outcome]) -> Outcome:
    """The best outcome: the lowest objective among those that keep the constraints, else the least
    violation."""
    seen = [o for o in outcomes if o.evaluation is not None]
    if not seen:
        return outcomes[0]
    kept = [o for o in seen if o.kept]
    return min(kept, key=lambda o: o.objective) if kept else min(seen, key=lambda o: o.violation)


def better_seen(
    best: Outcome,
    problem: Problem,
    evaluate: LoggedModel,
    counts: Callable[[np.ndarray], bool] = lambda place: True,
    objectives: int = 1,
) -> Outcome | None:
    """The best design of all that were evaluated, if it is better than the one that a search ended at.

    Args:
        best: end of a search; problem: its problem.
        evaluate: evaluator that remembers what it was asked.
        counts: whether the design of a place counts, such as one that can be made.
        objectives: number of the study's objectives. On a front a better design is worse in none of them.
    """
    seen = [one for one in evaluate.seen.values() if one.finite and counts(one.place)]
    if not seen:
        return None
    values = np.stack([one.values for one in seen])
    excess = (values[:, problem.rows] - problem.limits) / problem.scales
    violation = np.max(excess, axis=1, initial=-np.inf)
    objective = np.where(violation <= ALLOWED, values @ problem.weights, np.inf)
    if objectives > 1 and best.kept:
        worse = values[:, :objectives] > best.evaluation.values[:objectives]
        objective = np.where(np.any(worse, axis=1), np.inf, objective)
    k = int(np.argmin(objective))
    if not objective[k] < (best.objective - BETTER if best.kept else np.inf):
        return None
    return Outcome(seen[k], float(objective[k]), float(violation[k]), "evaluated by another search", 0)


@dataclass(frozen=True)
class Ends:
    """Stopping rules of SLSQP.

    Attributes:
        precision: relative change of the scaled objective [1]; steps: number of iterations at most.
    """

    precision: float = PRECISION
    steps: int = MOST_STEPS


JOINED = "stopped near an optimum that was found already"
"""Message of such a search."""
NEAR = 0.03
"""Distance in the box, along any parameter, at which a search that is no better joins a known optimum [1].
The next iterations would only close this distance."""
ON_FRONTS = Ends(1e-6, 40)
"""Stopping rules on fronts: a millionth of an objective is far below what a workshop can do. A search that
crept towards its limit of the heat took more than 400 evaluations."""


def optimise(
    problems: Sequence[Problem],
    starts: Sequence[np.ndarray],
    evaluate: LoggedModel,
    method: str = "slsqp",
    ends: Ends = Ends(),
    known: Sequence[Outcome] = (),
) -> list[Outcome]:
    """Solve problems side by side, one for each start.

    Args:
        problems: one per start.
        starts: places in the box.
        evaluate: evaluator of the model.
        method: `slsqp` or `trust-constr`.
        ends: stopping rules of `slsqp`.
        known: optima of the same problem; a search that comes near to one, and is no better, ends with it.
    """
    pairs = zip(problems, starts, strict=True)
    workers = [
        lambda ask, p=p, x=x: _Search(p, ask, np.array(x, dtype=float), ends, known).run(method)
        for p, x in pairs
    ]
    return run_together(workers, evaluate) if workers else []


def from_starts(
    problem: Problem, starts: Sequence[np.ndarray], evaluate: LoggedModel, method: str = "slsqp"
) -> list[Outcome]:
    """One problem from many starts: from the best one first, then from the others side by side.

    Most starts often lead to one optimum. So the others end where they come near to it.
    """
    first = [
        Outcome(one, problem.objective(one), problem.violation(one), "", 0)
        if one.finite
        else Outcome(None, np.inf, np.inf, "", 0)
        for one in evaluate(list(starts))
    ]
    best = best_of(first)
    begin = next(k for k, one in enumerate(first) if one is best)
    (ended,) = optimise([problem], [starts[begin]], evaluate, method)
    rest = [k for k in range(len(starts)) if k != begin]
    known = [ended] if ended.kept else []
    others = optimise([problem] * len(rest), [starts[k] for k in rest], evaluate, method, known=known)
    found = dict(zip(rest, others, strict=True)) | {begin: ended}
    return [found[k] for k in range(len(starts))]


def least_violation(problem: Problem, starts: Sequence[np.ndarray], evaluate: LoggedModel) -> Outcome:
    """The place of the least violation that searches for it find, whatever the objective there.

    Its `objective` is that violation [1].
    """
    slack = dataclasses.replace(problem, slack=True)
    return best_of(optimise([slack] * len(starts), starts, evaluate))


def from_within(
    problem: Problem, starts: Sequence[np.ndarray], evaluate: LoggedModel, method: str
) -> list[Outcome]:
    """The search from a place that keeps all constraints; nothing where none is found.

    A search for the objective may end outside, where a search for the least violation gets inside.
    """
    inside = least_violation(problem, starts, evaluate)
    if inside.evaluation is None or inside.objective > ALLOWED:
        return []
    return optimise([problem], [inside.evaluation.place], evaluate, method)


class _Joined(Exception):
    """Ends a search that leads to a known optimum."""

    def __init__(self, other: Outcome):
        super().__init__()
        self.other = other


class _Search:
    """One start of one problem."""

    def __init__(
        self, problem: Problem, ask: Ask, start: np.ndarray, ends: Ends, known: Sequence[Outcome] = ()
    ):
        self.problem, self.ask, self.ends, self.known = problem, ask, ends, known
        for k, value in problem.held.items():
            start[k] = value
        self.place, self.free = np.clip(start, 0.0, 1.0), problem.free(start.size)
        self.last: tuple[bytes, Evaluation] | None = None
        self.good: Evaluation | None = None
        self.best: Outcome | None = None

    def at(self, x: np.ndarray) -> Evaluation:
        """Evaluation at values of the free parameters; the last one is remembered."""
        place = self.place.copy()
        place[self.free] = np.clip(x[: self.free.size], 0.0, 1.0)
        if self.last is None or self.last[0] != place.tobytes():
            self.last = (place.tobytes(), self.ask(place))
            self._judge(self.last[1])
        return self.last[1]

    def _judge(self, one: Evaluation) -> None:
        if not one.finite:
            return
        found = Outcome(one, self.problem.objective(one), self.problem.violation(one), "", 0)
        if self.problem.slack:
            found = Outcome(one, found.violation, 0.0, "", 0)
        self.best = found if self.best is None else best_of([self.best, found])
        self.good = one
        for other in self.known:
            apart = float(np.max(np.abs(one.place - other.evaluation.place)))
            if apart < NEAR and best_of([other, self.best]) is other:
                raise _Joined(other)

    def run(self, method: str) -> Outcome:
        """Search from the start."""
        try:
            return self._searched(method)
        except _Joined as joined:
            return dataclasses.replace(joined.other, message=JOINED)

    def _searched(self, method: str) -> Outcome:
        first = self.at(self.place[self.free])
        if not first.finite:
            return Outcome(None, np.inf, np.inf, "the start cannot be evaluated", 0)
        if self.free.size == 0 or self._stuck(first):
            return self.best
        x = self.place[self.free]
        if self.problem.slack:
            x = np.append(x, max(self.problem.violation(first), 0.0) + 0.1)
        found = self._slsqp(x) if method == "slsqp" else self._trust_region(x)
        return Outcome(
            self.best.evaluation, self.best.objective, self.best.violation, str(found.message), int(found.nit)
        )

    def _stuck(self, first: Evaluation) -> bool:
        """True if a constraint is violated that no free parameter moves, such as a diameter of held sizes.

        A search could not mend it: its linear model of the constraint has no step to offer.
        """
        if self.problem.slack:
            return False
        still = np.all(first.jacobian[self.problem.rows][:, self.free] == 0.0, axis=1)
        return bool(np.any(still & (self.problem.excess(first) > ALLOWED)))

    def _value(self, x: np.ndarray) -> float:
        if self.problem.slack:
            self.at(x)
            return float(x[-1])
        one = self.at(x)
        return self.problem.objective(one) if one.finite else self.problem.objective(self.good) + BAD

    def _slope(self, x: np.ndarray) -> np.ndarray:
        if self.problem.slack:
            return np.append(np.zeros(self.free.size), 1.0)
        return self._known(x).jacobian.T[self.free] @ self.problem.weights

    def _known(self, x: np.ndarray) -> Evaluation:
        one = self.at(x)
        return one if one.finite else self.good

    def _room(self, x: np.ndarray) -> np.ndarray:
        one = self.at(x)
        room = -self.problem.excess(one if one.finite else self.good)
        if self.problem.slack:
            return room + (x[-1] if one.finite else x[-1] - BAD)
        return room

    def _room_slope(self, x: np.ndarray) -> np.ndarray:
        slope = -self._known(x).jacobian[self.problem.rows][:, self.free] / self.problem.scales[:, None]
        return np.hstack([slope, np.ones((len(slope), 1))]) if self.problem.slack else slope

    def _box(self, x: np.ndarray) -> object:
        more = x.size - self.free.size
        return optimize.Bounds(
            np.append(np.zeros(self.free.size), [-1e3] * more),
            np.append(np.ones(self.free.size), [1e6] * more),
        )

    def _slsqp(self, x: np.ndarray) -> object:
        rooms = (
            [{"type": "ineq", "fun": self._room, "jac": self._room_slope}] if self.problem.rows.size else []
        )
        return optimize.minimize(
            self._value, x, jac=self._slope, bounds=self._box(x), constraints=rooms, method="SLSQP",
            options={"maxiter": self.ends.steps, "ftol": self.ends.precision},
        )  # fmt: skip

    def _trust_region(self, x: np.ndarray) -> object:
        rooms = (
            [optimize.NonlinearConstraint(self._room, 0.0, np.inf, jac=self._room_slope)]
            if self.problem.rows.size
            else []
        )
        return optimize.minimize(
            self._value, x, jac=self._slope, bounds=self._box(x), constraints=rooms, method="trust-constr",
            options={"maxiter": 3 * MOST_STEPS, "gtol": 1e-7, "xtol": 1e-9},
        )  # fmt: skip
