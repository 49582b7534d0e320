"""Characterisation of a material from a campaign of elastomer recordings."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fitting.calibrate.result import Characterisation, Estimate
from fitting.data.recordings import Campaign
from fitting.inference.progress import Stages
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.precision import require_float64
from pneusma_jax.units import from_si

from .analysis import Analysis, analyse
from .engine import Engine
from .fit import LawFit
from .laws import LAWS, MOST_TERMS, CurveLaw
from .next_test import NextTest, next_test
from .samples import FEWEST_SAMPLES, WEIGHTINGS, Samples, stack
from .stability import ACTUATOR_STRAIN

EVERY_LAW = "all"
PAST = 1.05
"""Factor by which stretches go past those of an actuator where laws are fitted to its strains apart [1]."""
LAW_WORDS = (*dict.fromkeys(law.law for law in LAWS.values()), EVERY_LAW)


@dataclass(frozen=True)
class ElastomerCharacterisation(Characterisation):
    """Hyperelastic laws of an elastomer, and which one to use.

    Attributes:
        title: title of the campaign.
        samples: the samples that were fitted and scored.
        whole: every law on all the samples.
        actuator: every law on an actuator's strains; the same object as `whole` if the samples end there.
        next_test: the further test that would help the law for an actuator most.
        seed: seed of the scattered starting points.
    """

    title: str
    samples: Samples
    whole: Analysis
    actuator: Analysis
    next_test: NextTest
    seed: int

    @property
    def best(self) -> LawFit:
        """The law of the whole tested range, fitted to everything with `role = fit`; for an actuator see
        `actuator.best`, which may be another one."""
        return self.whole.best

    @property
    def law(self) -> str:
        """Name of the law of the whole tested range, see `best`."""
        return self.best.law.name

    @property
    def parameters(self) -> dict[str, Estimate]:
        """Constants of the law of the whole tested range, see `best`, in the unit of files."""
        return estimates(self.best)


def estimates(fit: LawFit) -> dict[str, Estimate]:
    """Constants of a fit in the unit of files."""
    return {
        constant.name: Estimate(
            float(from_si(value, constant.unit)),
            float(from_si(sd, constant.unit)),
            constant.unit,
            constant.name in fit.at_bound,
        )
        for constant, value, sd in zip(fit.law.constants, fit.values, fit.sd, strict=True)
    }


def chosen_laws(law: str = EVERY_LAW, terms: int | None = None) -> list[CurveLaw]:
    """Laws that a word of the command line stands for.

    Args:
        law: one of `LAW_WORDS`.
        terms: number of terms of Ogden's law, 1 to `MOST_TERMS`; None tries every number of them.

    Raises:
        InputError: if there is no such law or number of terms.
    """
    if law not in LAW_WORDS:
        raise InputError(f"there is no law {law!r}, {nearest(law, LAW_WORDS)}")
    if terms is not None and not 1 <= terms <= MOST_TERMS:
        raise InputError(f"terms = {terms} must be 1 to {MOST_TERMS}")
    if terms is not None and law not in ("ogden", EVERY_LAW):
        raise InputError(f"terms = {terms} is about Ogden's law; {law} has none")
    words = [law] if law != EVERY_LAW else LAW_WORDS
    skipped = {f"ogden_{k}" for k in range(1, MOST_TERMS + 1) if terms is not None and k != terms}
    return [entry for entry in LAWS.values() if entry.law in words and entry.name not in skipped]


def _check_constants(laws: Sequence[CurveLaw], names: Iterable[str]) -> None:
    """Refuse a constant that none of the laws to be fitted has.

    Raises:
        InputError: with the constants that they have, or the laws that have it.
    """
    own = list(dict.fromkeys(name for law in laws for name in law.names))
    for name in names:
        if name in own:
            continue
        others = [law.name for law in LAWS.values() if name in law.names]
        if not others:
            every = [constant for law in LAWS.values() for constant in law.names]
            raise InputError(f"no law has a constant {name!r}, {nearest(name, every)}")
        raise InputError(
            f"{', '.join(law.name for law in laws)} has no constant {name!r} ({', '.join(others)} has); it"
            f" has {', '.join(own)}"
        )


def characterise_elastomer(
    campaign: Campaign,
    *,
    law: str = EVERY_LAW,
    terms: int | None = None,
    max_strain: float | None = None,
    weighting: str = "absolute",
    adjust: Mapping[str, Mapping[str, Any]] | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> ElastomerCharacterisation:
    """Fit hyperelastic laws to a campaign of elastomer recordings.

    Args:
        campaign: recordings of kind `elastomer`.
        law: one of `LAW_WORDS`.
        terms: number of terms of Ogden's law, 1 to `MOST_TERMS`; None tries every number of them.
        max_strain: engineering strain beyond which samples are left out; None for all.
        weighting: `absolute` divides residuals by the instrument's noise, so that every sample of a recording
            counts alike; `relative` adds `RELATIVE_SPREAD` times the stress to it.
        adjust: changes to constants by name. Each is a mapping of fields of `Parameter`: any of `value`,
            `min`, `max` (in the unit of files), `vary` and `tie`. Example: `{"p_5": {"value": 0,
            "vary": False}}`.
        seed: seed of the scattered starting points.
        progress: called with the label of each law before it is fitted. It is called a second time where
            laws are fitted to an actuator's strains apart.

    Raises:
        InputError: if the recordings or options cannot be used, in one line.
    """
    require_float64()
    laws = chosen_laws(law, terms)
    if weighting not in WEIGHTINGS:
        raise InputError(f"there is no weighting {weighting!r}, {nearest(weighting, WEIGHTINGS)}")
    if max_strain is not None and not max_strain > 0.0:
        raise InputError(f"max-strain = {max_strain:g} must be more than 0; 1.5 is a stretch of 2.5")
    _check_constants(laws, adjust or {})
    samples = stack(campaign.of_kind("elastomer"), max_strain, weighting)
    engine = Engine(samples, adjust, seed)
    narrow = samples.fitted & (samples.strain >= ACTUATOR_STRAIN[0]) & (samples.strain <= ACTUATOR_STRAIN[1])
    past = _goes_past(samples, narrow)
    scopes = ("law", "law for an actuator") if past else ("law",)
    told = [Stages(progress, scopes).of(scope, len(laws)) for scope in scopes]
    whole = analyse(engine, laws, samples.fitted, for_actuator=not past, progress=told[0])
    actuator = analyse(engine, laws, narrow, for_actuator=True, progress=told[1]) if past else whole
    weights = {ranked.name: ranked.weight for ranked in actuator.choice.ranked}
    chosen_for_actuator = actuator.choice.chosen
    possible = {
        name: fit
        for name, fit in actuator.fits.items()
        if name == chosen_for_actuator or name not in actuator.choice.unfit
    }
    extrapolation = actuator.held[chosen_for_actuator].extrapolation
    further = next_test(samples, possible, weights, chosen_for_actuator, extrapolation)
    return ElastomerCharacterisation(campaign.title, samples, whole, actuator, further, seed)


def _goes_past(samples: Samples, narrow: np.ndarray) -> bool:
    """The samples go well past an actuator's strains, and enough of them lie within."""
    stretch = samples.stretch[samples.fitted]
    low, high = 1.0 + ACTUATOR_STRAIN[0], 1.0 + ACTUATOR_STRAIN[1]
    past = bool(stretch.max() > high * PAST or stretch.min() < low / PAST)
    return past and int(narrow.sum()) >= FEWEST_SAMPLES
