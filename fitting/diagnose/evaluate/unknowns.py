"""Scaled numbers of a diagnosis: free constants of the base model, and parameters of every candidate effect.

A scaled base constant is 0 at its nominal value, and 1 at one standard deviation of its tolerance from it. An
effect is absent where its scaled amplitudes are 0. Its shapes, such as a time constant, mean nothing there. A
scaled shape is 0 at its neutral value, or at its typical value where it is logarithmic.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Array

from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.specimens.model_parameters import is_logarithmic
from fitting.specimens.rows import MARK, Rows
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import CATALOGUE, Effect, specs_of

from ..settings import DEFAULT

SCALING = DEFAULT.scaling


@dataclass(frozen=True)
class Unknown:
    """One number that may be fitted.

    Attributes:
        name: name of the parameter, within its effect.
        effect: slug, or "" for a constant of the base model.
        reference: value in SI at scaled 0.
        scale: SI per scaled unit; for a logarithmic one, the relative change of one unit.
        low, high: bounds, scaled.
        start: scaled value from which a fit of a present effect starts.
        unit: unit for people; SI.
        text: description.
        shape: it means nothing while its effect is absent.
        logarithmic: the value is `reference * exp(scale * u)`.
    """

    name: str
    effect: str
    reference: float
    scale: float
    low: float
    high: float
    start: float
    unit: str
    text: str
    shape: bool = False
    logarithmic: bool = False

    def value(self, u: Array) -> Array:
        """SI value of a scaled one; may be traced."""
        if self.logarithmic:
            return self.reference * np.e ** (self.scale * u)
        return self.reference + self.scale * u

    def scaled(self, value: float) -> float:
        """Scaled number of an SI value."""
        if self.logarithmic:
            return float(np.log(value / self.reference) / self.scale)
        return (value - self.reference) / self.scale

    def at_share(self, share: float) -> float:
        """Scaled number at a share [1] of the way from low to high.

        Where the bounds are positive and far apart, the way is logarithmic. It is so, too, where the lower
        bound is 0 and the upper one is far from the typical value. Then it goes from a tenth of the typical
        value to ten times that, or to the upper bound.
        """
        low, high = float(self.value(self.low)), float(self.value(self.high))
        typical = float(self.value(self.start))
        if low > 0.0 and high / low > SCALING.minimum_wide_ratio:
            return self.scaled(low * (high / low) ** share)
        if low >= 0.0 and typical > 0.0 and high / typical > SCALING.minimum_wide_ratio:
            return self.scaled(min(typical * 10.0 ** (2.0 * share - 1.0), high))
        return self.scaled(low + (high - low) * share)

    def spread(self, u: float, sd: float) -> float:
        """Standard deviation in SI of a scaled one."""
        return abs(self.scale * sd * (float(self.value(u)) if self.logarithmic else 1.0))


class Unknowns:
    """All numbers of a diagnosis, in one order: the base constants, then the effects.

    Args:
        base: free constants with priors.
        slugs: candidate effects.
        letter: letter of the kind of recording; only parameters that act in it are unknown.
        known: numbers that are nominal instead of the parameters' own, by name.
    """

    def __init__(
        self,
        base: Parameters,
        slugs: Sequence[str],
        letter: str,
        known: Mapping[str, Quantity] | None = None,
    ):
        self.slugs = tuple(slugs)
        self.items = tuple(
            [
                *_base_unknowns(base, known or {}),
                *(u for slug in slugs for u in _effect_unknowns(slug, letter)),
            ]
        )
        self._places: dict[str, list[int]] = {}
        for k, item in enumerate(self.items):
            self._places.setdefault(item.effect, []).append(k)
        self.base = np.array(self._places.get("", []), int)
        self.low = np.array([item.low for item in self.items])
        self.high = np.array([item.high for item in self.items])
        self.neutral = np.array([item.start if item.shape else 0.0 for item in self.items])

    def __len__(self) -> int:
        """Number of unknowns."""
        return len(self.items)

    def of(self, slugs: Iterable[str]) -> np.ndarray:
        """Indices of the parameters of effects, in the order given."""
        return np.array([k for slug in slugs for k in self._places.get(slug, [])], int)

    def amplitudes(self, slug: str) -> np.ndarray:
        """Indices of the parameters of an effect that are not shapes."""
        return np.array([k for k in self.of([slug]) if not self.items[k].shape], int)

    def shapes(self, slug: str) -> np.ndarray:
        """Indices of an effect's shape parameters."""
        return np.array([k for k in self.of([slug]) if self.items[k].shape], int)

    def at_nominal(self, u: np.ndarray) -> np.ndarray:
        """Numbers as in `u`, with every base constant at its nominal value."""
        found = u.copy()
        found[self.base] = 0.0
        return found

    def present(self, u: np.ndarray, columns: Iterable[int] = ()) -> np.ndarray:
        """True for effects that change anything at `u`, or have one of `columns` as a parameter, (slugs,)."""
        there = {self.items[k].effect for k in columns}
        there |= {self.items[k].effect for k in np.flatnonzero(u) if not self.items[k].shape}
        return np.array([slug in there for slug in self.slugs], bool)

    def values(self, u: np.ndarray) -> dict[str, float]:
        """Base constants in SI by name."""
        return {self.items[k].name: float(self.items[k].value(u[k])) for k in self.base}

    def parameters(self) -> Parameters:
        """The base constants with their priors, SI; without those that are logarithmic."""
        items = (self.items[k] for k in self.base)
        return Parameters(
            *(
                Parameter(item.name, item.reference, unit=item.unit, prior=Prior(item.reference, item.scale))
                for item in items
                if not item.logarithmic
            )
        )

    def stated(self, u: np.ndarray, stacked: Rows) -> dict[str, np.ndarray]:
        """Every number of every recording's base model in SI, by name, shape (recordings,)."""
        found = {name: np.array(value, float) for name, value in stacked.base.items()}
        for k in self.base:
            stem, whose = self._whose(k, stacked)
            found[stem] = np.where(whose, float(self.items[k].value(u[k])), found[stem])
        return found

    def slope(self, u: np.ndarray, k: int, stacked: Rows) -> tuple[str, np.ndarray]:
        """Name of a base constant, and its derivative in every recording, shape (recordings,)."""
        stem, whose = self._whose(k, stacked)
        item = self.items[k]
        return stem, whose * item.scale * (float(item.value(u[k])) if item.logarithmic else 1.0)

    def _whose(self, k: int, stacked: Rows) -> tuple[str, np.ndarray]:
        """Name of a base constant in the model, and the recordings that it belongs to."""
        stem, mark, number = self.items[k].name.partition(MARK)
        specimen = np.asarray(stacked.specimen)
        return stem, (specimen == int(number)) if mark else np.ones(len(specimen), bool)

    def effects(self, u: Array, slugs: Iterable[str] | None = None) -> tuple[Effect, ...]:
        """Effects with their parameters; may be traced.

        Args:
            u: scaled numbers, shape (unknowns,).
            slugs: which; all if None.
        """
        chosen = self.slugs if slugs is None else slugs
        made = []
        for slug in chosen:
            members = {self.items[k].name: self.items[k].value(u[k]) for k in self.of([slug])}
            made.append(CATALOGUE[slug](**members))
        return tuple(made)


def _base_unknowns(base: Parameters, known: Mapping[str, Quantity]) -> list[Unknown]:
    found = []
    for name, parameter in base.items():
        prior = parameter.prior
        if name in known:
            own = known[name].prior
            prior = Prior(known[name].value, own.sd if own else prior.sd, prior.min, prior.max)
        logarithmic = parameter.scale == "log"
        scale = prior.sd / prior.mean if logarithmic else prior.sd
        at = (lambda x, p=prior, s=scale: np.log(x / p.mean) / s) if logarithmic else (
            lambda x, p=prior, s=scale: (x - p.mean) / s
        )  # fmt: skip
        low, high = (
            max(at(prior.min), -SCALING.prior_bounds),
            min(at(prior.max), SCALING.prior_bounds),
        )
        found.append(
            Unknown(name, "", prior.mean, scale, low, high, 0.0, parameter.unit, name, False, logarithmic)
        )
    return found


def _effect_unknowns(slug: str, letter: str) -> list[Unknown]:
    found = []
    for name, spec in specs_of(CATALOGUE[slug], letter).items():
        if is_logarithmic(spec):  # a time constant, say
            scale = np.log(spec.high / spec.low) / SCALING.log_units
            low, high = (float(np.log(x / spec.typical) / scale) for x in (spec.low, spec.high))
            found.append(
                Unknown(name, slug, spec.typical, scale, low, high, 0.0, spec.unit, spec.text, True, True)
            )
            continue
        scale = abs(spec.typical - spec.neutral) or 0.25 * (spec.high - spec.low)
        low, high = (spec.low - spec.neutral) / scale, (spec.high - spec.neutral) / scale
        start = (spec.typical - spec.neutral) / scale
        found.append(
            Unknown(name, slug, spec.neutral, scale, low, high, start, spec.unit, spec.text, spec.shape)
        )
    return found
