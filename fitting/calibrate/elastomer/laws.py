"""The laws that a curve of an elastomer is fitted with: their constants, bounds and starting points.

Stresses come from `pneusma_jax.silicone`; this module adds only what a fit needs besides. Every law is linear
in its moduli and curved in its exponents or limits. So a start is found by solving for the moduli on a grid
of the others.
"""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from pneusma_jax.errors import counted
from pneusma_jax.silicone.hyperelastic import (
    GENT_LIMIT,
    gent_stress,
    neo_hookean_stress,
    ogden_stress,
    yeoh_stress,
)
from pneusma_jax.silicone.polynomial import polynomial_stress

ORDER = 4  # of the polynomial: Table 3.1 lists five coefficients
MOST_TERMS = 3  # of Ogden's law
NEO_HOOKEAN_CHAIN = 1e5  # j_m past which Gent's law cannot be told from the neo-Hookean one
EXPONENTS = (0.8, 1.3, 2.0, 3.0, 4.5, 7.0, 11.0, -1.0, -2.0, -4.0, -7.0)  # Ogden's, tried as starts
SCATTERED, SCATTERED_RANGE = 60, (0.5, 15.0)  # more of them, at random
EXPONENT_RANGE = (0.05, 30.0)
SHARED = 0.05  # relative distance of the exponents of two terms that begin as one


@dataclass(frozen=True)
class Constant:
    """One constant of a law: its name in files, its unit there, and the range a fit may search (SI)."""

    name: str
    unit: str
    min: float = -np.inf
    max: float = np.inf


@dataclass(frozen=True)
class Start:
    """Values to start a fit from (SI), and the bounds that go with them; each of shape (constants,)."""

    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True)
class CurveLaw:
    """Engineering stress over engineering strain with free constants.

    Attributes:
        name: unique, `ogden_2`.
        law: the word of a table of constants, `ogden`.
        label: name for people.
        constants: the constants, in the order of `stress`'s second argument.
        stress: `(strain (n,), values (constants,)) -> (n,)` [Pa], a JAX function.
        curved: grid of the constants that the stress is not linear in, given the largest `I1 - 3` fitted and
            a source of random numbers.
        basis: `(strain, curved values) -> (n, moduli)`, so that the stress is `basis @ moduli`.
        assemble: `(moduli, curved values) -> values`.
    """

    name: str
    law: str
    label: str
    constants: tuple[Constant, ...]
    stress: Callable
    curved: Callable[[float, np.random.Generator], Iterator[tuple[float, ...]]]
    basis: Callable[[np.ndarray, tuple[float, ...]], np.ndarray]
    assemble: Callable[[np.ndarray, tuple[float, ...]], np.ndarray]

    def __reduce__(self) -> tuple:
        """Pickled by its name: its functions have none."""
        return _named, (self.name,)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the constants."""
        return tuple(constant.name for constant in self.constants)

    @property
    def linear(self) -> bool:
        """The stress is linear in every constant."""
        return self.curved is _nothing

    @property
    def from_energy(self) -> bool:
        """It derives from a strain energy, and so means something in strains that were not tested."""
        return self.law != "polynomial"

    def starts(
        self, strain: np.ndarray, stress: np.ndarray, spread: np.ndarray, seed: int = 0, most: int = 3
    ) -> list[Start]:
        """The best few starting points, best first.

        Args:
            strain, stress, spread: the curve to be fitted: strain [1], stress and its standard deviation
                [Pa], shape (n,).
            seed: seed of the exponents that are scattered beside the grid.
            most: maximum number of starting points.
        """
        bounds, random = self._bounds(strain), np.random.default_rng(seed)
        tried: list[tuple[float, Start]] = []
        for curved in self.curved(excess_invariant(strain), random):
            basis = self.basis(strain, curved) / spread[:, None]
            length = np.linalg.norm(basis, axis=0)
            moduli = np.linalg.lstsq(basis / length, stress / spread)[0] / length
            misfit = float(np.sum((basis @ moduli - stress / spread) ** 2))
            values = self.assemble(moduli, curved)
            start = Start(values, *(limits(values) for limits in bounds))
            if np.all((values >= start.lower) & (values <= start.upper)):
                tried.append((misfit, start))
        tried.sort(key=lambda pair: pair[0])
        return [start for _, start in tried[:most]] or [self._fallback(strain, stress)]

    def order(self, values: np.ndarray) -> np.ndarray:
        """Order of the constants in reports: Ogden's terms by exponent, terms of no stiffness last."""
        if self.law != "ogden":
            return np.arange(len(values))
        moduli, exponents = values[0::2], values[1::2]
        terms = np.lexsort((exponents, moduli * exponents <= 0.0))
        return np.stack([2 * terms, 2 * terms + 1], axis=1).ravel()

    def start_at(self, values: np.ndarray, strain: np.ndarray) -> Start:
        """A start at given constants, moved inside the bounds that the strains allow."""
        lower, upper = (limits(values) for limits in self._bounds(strain))
        return Start(np.clip(values, lower, upper), lower, upper)

    def start_at_fewer(self, values: np.ndarray, strain: np.ndarray) -> Start:
        """A start of Ogden's law at the fit with one term fewer, whose stiffest term is shared by two.

        Args:
            values: constants of the law with one term fewer.
            strain: strains to be fitted.
        """
        moduli, exponents = values[0::2], values[1::2]
        k = int(np.argmax(moduli * exponents))
        moduli = np.append(np.where(np.arange(len(moduli)) == k, 0.5 * moduli, moduli), 0.5 * moduli[k])
        exponents = np.append(exponents, exponents[k] * (1.0 - SHARED))
        return self.start_at(np.stack([moduli, exponents], axis=1).ravel(), strain)

    def _bounds(self, strain: np.ndarray) -> tuple[Callable, Callable]:
        """Lower and upper bounds given a start's values: Ogden's terms keep the sign they start with."""
        low = np.array([constant.min for constant in self.constants])
        high = np.array([constant.max for constant in self.constants])
        if self.law == "gent":
            low = np.array([low[0], excess_invariant(strain) / GENT_LIMIT])
        if self.law != "ogden":
            return (lambda _: low), (lambda _: high)
        return _ogden_lower, _ogden_upper

    def _fallback(self, strain: np.ndarray, stress: np.ndarray) -> Start:
        """A start inside the bounds where no grid point is: the neo-Hookean modulus, shared out."""
        stretch = 1.0 + strain
        rubber = stretch - stretch**-2.0
        modulus = max(float(rubber @ stress) / float(rubber @ rubber), 1.0)
        curved = next(iter(self.curved(excess_invariant(strain), np.random.default_rng(0))))
        count = len(self.constants) - len(curved)
        signs = np.sign(curved) if self.law == "ogden" else np.ones(count)
        values = self.assemble(modulus * signs / count, curved)
        return Start(values, *(limits(values) for limits in self._bounds(strain)))


def _named(name: str) -> CurveLaw:
    return LAWS[name]


def excess_invariant(strain: np.ndarray) -> float:
    """Largest `I1 - 3` of a set of uniaxial strains."""
    stretch = 1.0 + strain
    return max(float(np.max(stretch**2 + 2.0 / stretch - 3.0)), 1e-6)


def _ogden_lower(values: np.ndarray) -> np.ndarray:
    positive = np.array([0.0, EXPONENT_RANGE[0]] * (len(values) // 2))
    negative = np.array([-np.inf, -EXPONENT_RANGE[1]] * (len(values) // 2))
    return np.where(np.repeat(values[1::2] > 0.0, 2), positive, negative)


def _ogden_upper(values: np.ndarray) -> np.ndarray:
    positive = np.array([np.inf, EXPONENT_RANGE[1]] * (len(values) // 2))
    negative = np.array([0.0, -EXPONENT_RANGE[0]] * (len(values) // 2))
    return np.where(np.repeat(values[1::2] > 0.0, 2), positive, negative)


def _nothing(_: float, __: np.random.Generator) -> Iterator[tuple[float, ...]]:
    yield ()


def _rubber(strain: np.ndarray, _: tuple = ()) -> np.ndarray:
    stretch = 1.0 + strain
    return (stretch - stretch**-2.0)[:, None]


def _yeoh_basis(strain: np.ndarray, _: tuple) -> np.ndarray:
    stretch = 1.0 + strain
    excess = stretch**2 + 2.0 / stretch - 3.0
    return 2.0 * _rubber(strain) * np.stack([np.ones_like(excess), 2.0 * excess, 3.0 * excess**2], axis=1)


def _gent_grid(excess: float, _: np.random.Generator) -> Iterator[tuple[float, ...]]:
    yield from ((float(j),) for j in excess * np.geomspace(1.02, 50.0, 40))


def _gent_basis(strain: np.ndarray, curved: tuple[float, ...]) -> np.ndarray:
    stretch = 1.0 + strain
    excess = stretch**2 + 2.0 / stretch - 3.0
    return _rubber(strain) / (1.0 - excess / curved[0])[:, None]


def _ogden_grid(terms: int) -> Callable[[float, np.random.Generator], Iterator[tuple[float, ...]]]:
    def grid(_: float, random: np.random.Generator) -> Iterator[tuple[float, ...]]:
        yield from itertools.combinations(EXPONENTS, terms)
        size = np.exp(random.uniform(*np.log(SCATTERED_RANGE), (SCATTERED, terms)))
        yield from map(tuple, size * random.choice([1.0, 1.0, -1.0], (SCATTERED, terms)))

    return grid


def _ogden_basis(strain: np.ndarray, curved: tuple[float, ...]) -> np.ndarray:
    stretch, alpha = 1.0 + strain[:, None], np.array(curved)
    return stretch ** (alpha - 1.0) - stretch ** (-0.5 * alpha - 1.0)


def _interleave(moduli: np.ndarray, curved: tuple[float, ...]) -> np.ndarray:
    return np.stack([moduli, np.array(curved)], axis=1).ravel()


def _ogden_stress(strain, values):
    return ogden_stress(1.0 + strain, values[0::2], values[1::2])


def _ogden(terms: int) -> CurveLaw:
    constants = [
        constant
        for k in range(1, terms + 1)
        for constant in (Constant(f"mu_{k}", "kPa"), Constant(f"alpha_{k}", "1"))
    ]
    return CurveLaw(
        f"ogden_{terms}", "ogden", f"Ogden with {counted(terms, 'term')}", tuple(constants),
        _ogden_stress, _ogden_grid(terms), _ogden_basis, _interleave,
    )  # fmt: skip


LAWS: dict[str, CurveLaw] = {
    law.name: law
    for law in (
        CurveLaw(
            "polynomial", "polynomial", f"polynomial of order {ORDER}",
            tuple(Constant(f"p_{k}", "kPa") for k in range(1, ORDER + 2)),
            lambda strain, values: polynomial_stress(strain, values),
            _nothing, lambda strain, _: np.vander(strain, ORDER + 1), lambda moduli, _: moduli,
        ),
        CurveLaw(
            "neo_hookean", "neo_hookean", "neo-Hookean", (Constant("mu", "kPa", 0.0),),
            lambda strain, values: neo_hookean_stress(1.0 + strain, values[0]),
            _nothing, _rubber, lambda moduli, _: moduli,
        ),
        CurveLaw(
            "yeoh", "yeoh", "Yeoh",
            (Constant("c_10", "kPa", 0.0), Constant("c_20", "kPa"), Constant("c_30", "kPa")),
            lambda strain, values: yeoh_stress(1.0 + strain, *values),
            _nothing, _yeoh_basis, lambda moduli, _: moduli,
        ),
        CurveLaw(
            "gent", "gent", "Gent",
            (Constant("mu", "kPa", 0.0), Constant("j_m", "1", 0.0, NEO_HOOKEAN_CHAIN)),
            lambda strain, values: gent_stress(1.0 + strain, values[0], values[1]),
            _gent_grid, _gent_basis, lambda moduli, curved: np.array([*moduli, *curved]),
        ),
        *(_ogden(terms) for terms in range(1, MOST_TERMS + 1)),
    )
}  # fmt: skip
