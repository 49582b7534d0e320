"""A model in memory: its changes to the base model's tables, and its effects."""

import dataclasses
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import schema
from fitting.inference.notes import joined
from pneusma_jax.calibration import load_calibration
from pneusma_jax.calibration.keys import KINDS, QUANTITIES
from pneusma_jax.calibration.records import Calibration, Prior, Quantity
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.pipeline import Effect
from pneusma_jax.units import INTERNAL_UNITS, TEMPERATURE_DIFFERENCE, UNITS, from_si

from .discrepancy import AddedDiscrepancy

Base = Mapping[str, Mapping[str, Quantity]]
"""Quantities by kind of table (`alloy`, `silicone`, `actuator`) and name."""
STIFFNESS = "silicone_stiffness"
SLACK = 1e-6  # Maximum excess over an effect's bounds by rounding of a fit, as part of their width
USUAL_UNITS = {"length": "mm", "angle": "deg"}  # Units in files, where the internal unit is not usual


@dataclass(frozen=True)
class AddedEffect:
    """One effect of a model on disk.

    Attributes:
        slug: name of the effect in the catalogue.
        parameters: parameters by name, values in SI.
        options: settings that are chosen and not fitted, such as the `number` of a spring.
    """

    slug: str
    parameters: Mapping[str, Quantity]
    options: Mapping[str, Any] = field(default_factory=dict)

    def build(self, values: Mapping[str, Any] | None = None) -> Effect:
        """The effect as an object.

        Args:
            values: parameter values by name, SI, in place of the file's; may be traced.
        """
        effect = find_effect(self.slug)
        numbers: dict[str, Any] = {}
        for name, value in {**{n: q.value for n, q in self.parameters.items()}, **(values or {})}.items():
            stem = parameter_of(effect, name)
            if stem in term_names(effect):
                numbers.setdefault(stem, []).append(value)
            else:
                numbers[name] = value
        made = np.asarray if values is None else jnp.asarray
        return effect(**{name: made(value) for name, value in numbers.items()}, **self.options)


DIAGNOSIS = "pneusma diagnose of"
"""Words before the title of the campaign with which the description of a diagnosis's model begins."""


def diagnosed_title(source: str) -> str | None:
    """Title of the campaign whose diagnosis a source names (`..., seed 1`); None for another source."""
    found = re.fullmatch(rf"{DIAGNOSIS} (?P<title>.*), seed \d+", source, flags=re.DOTALL)
    return None if found is None else found["title"]


@dataclass(frozen=True)
class AugmentedModel:
    """A base model with constants of its own, and effects beyond it.

    Attributes:
        base: quantities that replace those of the tables, by kind of table and name, SI. Each holds its own
            unit, origin and prior.
        added: effects in the order in which they act, model discrepancies included.
        tables: names or paths of the tables that the constants belong to: any of `design`, `alloy`,
            `material`.
        specimens: quantities as in `base`, for single specimens, by the name that recordings state.
        name, description: texts for people.
        path: file that it was read from, or None.
        caution: why its numbers are not to be trusted; empty where they are.
    """

    base: Base = field(default_factory=dict)
    added: tuple[AddedEffect | AddedDiscrepancy, ...] = ()
    tables: Mapping[str, str] = field(default_factory=dict)
    specimens: Mapping[str, Base] = field(default_factory=dict)
    name: str = "model"
    description: str = ""
    path: Path | None = field(default=None, compare=False)
    caution: str = ""

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects as `simulate_history` and `simulate_spring` take them."""
        return tuple(added.build() for added in self.added)

    @property
    def remainders(self) -> tuple[AddedDiscrepancy, ...]:
        """Model discrepancies: added functions that describe without explaining."""
        return tuple(added for added in self.added if isinstance(added, AddedDiscrepancy))

    @property
    def shown_name(self) -> str:
        """Name in messages: that of its file, where it has one."""
        return self.name if self.path is None else self.path.name

    def remarks(self, chosen: Mapping[str, str | None]) -> list[str]:
        """What a user has to know of a model that he names: sentences; none for the base model.

        Args:
            chosen: tables in place of the model's own, by their key in `tables`; None where there is none.
        """
        name, said = self.shown_name, []
        if self.added:
            said.append(f"{name} adds {joined(map(_told, self.added))} to the base model")
        for key, table in chosen.items():
            own = self.tables.get(key)
            if table is not None and own is not None and not _same_table(table, own):
                here = f"and its numbers are used with {table} here"
                sizes = sorted(self.base.get("actuator", {})) if key == "design" else []
                replaced = f": {joined(sizes)} of the model, not of the design" if sizes else ""
                said.append(f"{name} was made with the {key} {own}, {here}{replaced}")
        return said

    def quantities(self, kind: str, specimen: str | None = None) -> dict[str, Quantity]:
        """The model's own constants of one kind of table. Those of a specimen replace those of all."""
        own = self.specimens.get(specimen, {}) if specimen is not None else {}
        return {**self.base.get(kind, {}), **own.get(kind, {})}

    def table(self, kind: str, table: str | Path | Calibration, specimen: str | None = None) -> Calibration:
        """A table of constants with the model's values in it.

        A factor on the silicone's stress multiplies the table's own factor, as in fits. So does its error.

        Args:
            kind: `alloy`, `silicone` or `actuator`.
            table: name, path, or a table in memory.
            specimen: name of the specimen whose own constants count, if any.

        Raises:
            InputError: if there is no such table.
        """
        found = load_calibration(table, kind)
        own, factor = self.quantities(kind, specimen), found.quantities.get(STIFFNESS)
        if factor is not None and STIFFNESS in own:
            own[STIFFNESS] = _times(own[STIFFNESS], factor.value)
        return dataclasses.replace(found, quantities={**found.quantities, **own})

    def geometry(self, specimen: str | None = None) -> dict[str, float]:
        """The model's dimensions as a recording's `[geometry]` states them: canonical keys and units."""
        own = self.quantities("actuator", specimen)
        stated = {}
        for key in schema.GEOMETRY_NUMBERS:
            plain = key in schema.GEOMETRY_WITHOUT_UNIT
            name = key if plain else schema.quantity_and_unit(key)[0]
            if name in own:
                stated[key] = float(from_si(own[name].value, schema.geometry_unit(key)))
        return stated


def _times(quantity: Quantity, factor: float) -> Quantity:
    """A quantity times a positive factor, with what is known of its error."""
    prior, interval = quantity.prior, quantity.interval90
    if prior is not None:
        prior = Prior(**{name: factor * number for name, number in dataclasses.asdict(prior).items()})
    if interval is not None:
        interval = (factor * interval[0], factor * interval[1])
    return dataclasses.replace(quantity, value=factor * quantity.value, prior=prior, interval90=interval)


def _same_table(one: str, other: str) -> bool:
    """True for equal names of tables, or paths of one file."""
    files = [Path(name) for name in (one, other) if name.endswith(".toml")]
    return files[0].resolve() == files[1].resolve() if len(files) == 2 else one == other


def _told(added: AddedEffect | AddedDiscrepancy) -> str:
    """What is added to a base model, in words."""
    return "an unnamed correction" if isinstance(added, AddedDiscrepancy) else added.slug


def fitted(
    kind: str, name: str, value: float, source: str, sd: float | None = None, unit: str | None = None
) -> Quantity:
    """A fitted parameter of the base model.

    Args:
        kind: kind of table that it belongs to: `alloy`, `silicone` or `actuator`.
        name: name in that table.
        value: fitted value, SI.
        source: description of the data that it was fitted to.
        sd: standard error, SI, kept as prior; None where there is none.
        unit: unit in the file; a usual one if None.

    Raises:
        InputError: if tables of that kind have no such number; names the nearest.
    """
    if kind not in KINDS or name not in QUANTITIES[kind]:
        known = QUANTITIES.get(kind, KINDS)
        raise InputError(f"tables of kind {kind!r} have no {name!r}, {nearest(name, known)}")
    dimension = QUANTITIES[kind][name]
    unit = unit or USUAL_UNITS.get(dimension, INTERNAL_UNITS[dimension])
    return Quantity(name, float(value), unit, "fitted", source, _prior(value, sd))


def add_effect(effect: Effect, source: str, sd: Mapping[str, float] | None = None) -> AddedEffect:
    """An effect with its parameters as a model on disk has it.

    Args:
        effect: effect with concrete parameters, SI.
        source: origin of its parameters.
        sd: standard errors by parameter, SI; kept as priors. Terms of a sum are counted: `g_1`, `g_2`.

    Raises:
        InputError: for a parameter beyond its physical bounds.
    """
    sd = sd or {}
    parameters = {}
    for name, spec in effect.specs.items():
        values = np.ravel(np.asarray(getattr(effect, name)))
        for k, value in enumerate(map(float, values), 1):
            key = name if len(values) == 1 else f"{name}_{k}"
            check_bounds(effect.slug, key, value)
            parameters[key] = Quantity(key, value, spec.unit, "fitted", source, _prior(value, sd.get(key)))
    options = {name: getattr(effect, name) for name in option_names(type(effect))}
    return AddedEffect(effect.slug, parameters, options)


def option_names(effect: type[Effect]) -> tuple[str, ...]:
    """Fields of an effect that are chosen and not fitted."""
    return tuple(f.name for f in dataclasses.fields(effect) if f.metadata.get("static", False))


def term_names(effect: type[Effect]) -> tuple[str, ...]:
    """Parameters of an effect that are a list, one entry for each term of a sum."""
    usual = effect()
    return tuple(name for name in effect.specs if np.ndim(getattr(usual, name)))


def parameter_of(effect: type[Effect], name: str) -> str | None:
    """Parameter that a name in a file belongs to (`g_2` to `g`); None if there is none."""
    if name in effect.specs:
        return name
    stem, _, number = name.rpartition("_")
    return stem if number.isdigit() and stem in term_names(effect) else None


def check_bounds(slug: str, name: str, value: float, where: str = "") -> None:
    """Refuse an impossible parameter value of an effect.

    Raises:
        InputError: one line with the physical range.
    """
    effect = find_effect(slug)
    spec = effect.specs[parameter_of(effect, name)]
    slack = SLACK * (spec.high - spec.low)
    if not (math.isfinite(value) and spec.low - slack <= value <= spec.high + slack):
        low, high = (f"{bound:g}" for bound in (spec.low, spec.high))
        raise InputError(
            f"{where or slug}: {name} = {value:g} {spec.unit} cannot be: {spec.text} is {low} to {high}"
            f" {spec.unit}"
        )


def dimension_of_parameter(unit: str) -> str | None:
    """Dimension of the unit of an effect's parameter; None for a composite unit such as `N m/rad`."""
    if unit == "K":
        return TEMPERATURE_DIFFERENCE
    return UNITS[unit].dimension if unit in UNITS else None


def _prior(value: float, sd: float | None) -> Prior | None:
    if sd is None or not math.isfinite(sd) or sd <= 0.0:
        return None
    return Prior(mean=float(value), sd=float(sd))
