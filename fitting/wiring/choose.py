"""Filters for so many springs between two frequencies, by the optimiser of design studies."""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fitting.design.log import Evaluation
from fitting.design.optimise import Outcome, Problem, best_of, optimise
from fitting.inference.results import Result
from pneusma_jax.errors import InputError
from pneusma_jax.numerics.safe import as_numpy
from pneusma_jax.program_cache import stored_jit

from .circuit import Circuit, crosstalk

E24 = (
    1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0, 3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2,
    6.8, 7.5, 8.2, 9.1,
)  # fmt: skip
"""Values in which capacitors are sold, to a power of ten (IEC 60063)."""
NEIGHBOURS = 2
"""Maximum distance in the order of resonances of pairs that are constraints; the check afterwards takes all
pairs."""
ALLOWED = 0.01
"""Limit of the crosstalk where nothing else is said [1]."""
MOST = 40
"""Maximum of springs that are tried."""


@dataclass(frozen=True)
class Springs:
    """Springs to be heated.

    Attributes:
        resistance: resistance of one spring [ohm]; inductance: its inductance [H].
    """

    resistance: float
    inductance: float


@dataclass(frozen=True)
class Bounds:
    """Bounds of the filters.

    Attributes:
        low, high: ends of the band [Hz].
        inductance: smallest and largest coil [H].
        coil_time: see `Circuit`; lead_resistance: [ohm]; voltage: [V].
    """

    low: float
    high: float
    inductance: tuple[float, float] = (10e-6, 1e-3)
    coil_time: float = 1e-3
    lead_resistance: float = 0.1
    voltage: float = 3.0

    def check(self) -> None:
        """Refuse a band or coils that cannot be.

        Raises:
            InputError: in one line.
        """
        if not 0.0 < self.low < self.high:
            raise InputError(
                f"frequencies must ascend and be positive, but they are {self.low:g} and {self.high:g} Hz"
            )
        if not 0.0 < self.inductance[0] < self.inductance[1]:
            raise InputError(
                "inductances must ascend and be positive, but they are "
                f"{1e6 * self.inductance[0]:g} and {1e6 * self.inductance[1]:g} uH"
            )
        if not self.voltage > 0.0:
            raise InputError(f"the voltage must be positive, but it is {self.voltage:g} V")


@dataclass(frozen=True)
class Wiring(Result):
    """Filters that were chosen.

    Attributes:
        circuit: circuit with the best values. made: the same with capacitors that are sold, and coils trimmed
            to keep the resonances. spread: with the capacitors that are sold, and untrimmed coils.
        crosstalk: worst, over all pairs [1], of `circuit`; made_crosstalk: of `made`; spread_crosstalk: of
            `spread`.
        even: worst crosstalk of evenly spaced resonances with the largest coils, before the search [1].
        allowed: limit of the crosstalk [1].
    """

    circuit: Circuit
    made: Circuit
    spread: Circuit
    crosstalk: float
    made_crosstalk: float
    spread_crosstalk: float
    even: float
    allowed: float = ALLOWED

    @property
    def kept(self) -> bool:
        """True if the crosstalk keeps its limit."""
        return self.crosstalk <= self.allowed


def worst(circuit: Circuit) -> float:
    """Largest crosstalk between two different branches [1]; 0 for a single one."""
    table = np.array(crosstalk(circuit))
    np.fill_diagonal(table, 0.0)
    return float(table.max())


def circuit_of(springs: Springs, bounds: Bounds, resonance: np.ndarray, inductance: np.ndarray) -> Circuit:
    """Branches with given resonances [Hz] and coils [H]."""
    count = len(resonance)
    whole = inductance + springs.inductance
    return Circuit(
        np.full(count, springs.resistance),
        np.full(count, springs.inductance),
        inductance,
        1.0 / ((2.0 * np.pi * resonance) ** 2 * whole),
        bounds.coil_time,
        bounds.lead_resistance,
        bounds.voltage,
    )


@stored_jit()
def _values_and_slopes(
    places: jax.Array, springs: Springs, bounds: Bounds, count: int
) -> tuple[jax.Array, jax.Array]:
    """Bound of the crosstalk, how far each pair is above it, gaps between resonances; and derivatives.

    Resonances ascend: each is a share of the way that is left to the end of the band.

    Args:
        places: in the box; resonances, coils, the bound; shape (places, 2 count + 1).
        springs, bounds, count: static; springs, bounds of the filters, number of springs.

    Returns:
        Shapes (places, numbers) and (places, numbers, 2 count + 1).
    """
    low, high = bounds.inductance
    apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    near = (apart > 0) & (apart <= NEIGHBOURS)

    def numbers(place: jax.Array) -> jax.Array:
        spot, coils, bound = place[:count], place[count : 2 * count], place[-1]
        resonance = bounds.low * (bounds.high / bounds.low) ** spot
        inductance = low * (high / low) ** coils
        table = crosstalk(circuit_of(springs, bounds, resonance, inductance))
        level = -10.0 * bound  # natural logarithm of the worst crosstalk, from 1 down to 5e-5
        return jnp.concatenate([level[None], jnp.log(table[near]) - level, spot[:-1] - spot[1:] + 1e-3])

    def one(place: jax.Array) -> tuple[jax.Array, jax.Array]:
        values, push = jax.linearize(numbers, place)
        return values, jax.vmap(push)(jnp.eye(place.size)).T

    return jax.vmap(one)(places)


@dataclass(frozen=True)
class _Numbers:
    """What the optimiser asks for, see `_values_and_slopes`."""

    springs: Springs
    bounds: Bounds
    count: int

    def __call__(self, places: Sequence[np.ndarray]) -> list[Evaluation]:
        found = _values_and_slopes(np.stack(places), self.springs, self.bounds, self.count)
        values, slopes = (np.asarray(x) for x in found)
        return [Evaluation(np.array(p), v, s) for p, v, s in zip(places, values, slopes, strict=True)]


def choose_filters(springs: Springs, bounds: Bounds, count: int, allowed: float = ALLOWED) -> Wiring:
    """Filters with the least of the worst crosstalk.

    The logarithm of the worst crosstalk is minimised, every pair a constraint.

    Args:
        springs: the springs to be heated, all alike.
        bounds: bounds of the filters.
        count: number of springs.
        allowed: limit of the crosstalk that the result is compared with [1].

    Raises:
        InputError: for bounds that cannot be, or less than two springs, or where nothing can be computed.
    """
    bounds.check()
    if count < 2:
        raise InputError("a choice of filters needs at least two springs")
    numbers = _Numbers(springs, bounds, count)
    even = np.linspace(bounds.low, bounds.high, count)
    ratio = np.log(even / bounds.low) / np.log(bounds.high / bounds.low)
    geometric = np.linspace(0.0, 1.0, count)
    starts = [
        np.concatenate([s, np.full(count, coil), [0.1]]) for s in (ratio, geometric) for coil in (1.0, 0.9)
    ]
    size = numbers(starts[:1])[0].values.size
    rows = np.arange(1, size)
    problem = Problem(np.eye(size)[0], rows, np.zeros(rows.size), np.ones(rows.size))
    best: Outcome = best_of(optimise([problem] * len(starts), starts, numbers))
    if best.evaluation is None:
        raise InputError(
            "the heat of the springs is no finite number anywhere between these frequencies and coils, at "
            f"{bounds.voltage:g} V"
        )
    place = best.evaluation.place
    low, high = bounds.inductance
    resonance = bounds.low * (bounds.high / bounds.low) ** place[:count]
    circuit = circuit_of(springs, bounds, resonance, low * (high / low) ** place[count : 2 * count])
    made, spread = _sold(circuit)
    return Wiring(
        circuit,
        made,
        spread,
        worst(circuit),
        worst(made),
        worst(spread),
        worst(_even(springs, bounds, count)),
        allowed,
    )


def _sold(circuit: Circuit) -> tuple[Circuit, Circuit]:
    """The circuit with capacitors of the series E24: coils trimmed to the resonances, and coils left."""
    circuit = as_numpy(circuit)
    wanted = circuit.capacitance
    decade = 10.0 ** np.floor(np.log10(wanted))
    series = np.array([*E24, 10.0])
    near = (
        series[np.argmin(np.abs(np.log(series[None] * decade[:, None] / wanted[:, None])), axis=1)] * decade
    )
    trimmed = (circuit.inductance + circuit.spring_inductance) * wanted / near - circuit.spring_inductance
    made = eqx.tree_at(lambda c: (c.capacitance, c.inductance), circuit, (near, trimmed))
    return made, eqx.tree_at(lambda c: c.capacitance, circuit, near)


def most_springs(springs: Springs, bounds: Bounds, allowed: float = ALLOWED) -> tuple[int, Wiring | None]:
    """Largest number of springs whose worst crosstalk is allowed, and their filters.

    Args:
        springs: the springs to be heated, all alike.
        bounds: bounds of the filters.
        allowed: crosstalk [1].

    Returns:
        The number, at most `MOST`, and the filters; (1, None) where not even two fit.
    """
    bounds.check()
    count = 1
    while count < MOST and worst(_even(springs, bounds, count + 1)) <= allowed:
        count += 1
    found = choose_filters(springs, bounds, count, allowed) if count > 1 else None
    while count < MOST:
        better = choose_filters(springs, bounds, count + 1, allowed)
        if not better.kept:
            break
        count, found = count + 1, better
    return count, found


def _even(springs: Springs, bounds: Bounds, count: int) -> Circuit:
    """Evenly spaced resonances with the largest coils."""
    return circuit_of(
        springs, bounds, np.linspace(bounds.low, bounds.high, count), np.full(count, bounds.inductance[1])
    )
