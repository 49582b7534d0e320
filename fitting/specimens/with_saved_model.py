"""A model on disk (`--model`) as a `Model` of recordings of a kind.

Fits, samplers and reports see its constants and its effects' parameters.
"""

import dataclasses
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Array, Float

from fitting.data.recordings import Campaign, Recording
from fitting.inference.parameters import Parameters
from fitting.specimens.saved_models.model import parameter_of
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.effects import Spec, find_effect, specs_of
from pneusma_jax.model_discrepancy import CHANNELS
from pneusma_jax.numerics.safe import as_arrays
from pneusma_jax.pipeline import Effect

from .input_noise import have_driver_noise, with_effective_variance
from .model_parameters import effect_parameter, start_from
from .priors import FIT
from .reduction import thinned
from .registry import drivers_of, of_each, specimen_of
from .rows import MARK, MOST_ROWS, Rows, stack, with_numbers
from .saved_models import AddedDiscrepancy, AddedEffect, AugmentedModel, diagnosed_title
from .silicones import FACTOR
from .specimen import Model, Specimen


@dataclass(frozen=True)
class Held:
    """A parameter of the model that is not fitted.

    Attributes:
        name: name that it would have as a parameter.
        value: value, SI; unit: unit in files.
        why: reason in words.
    """

    name: str
    value: float
    unit: str
    why: str


@dataclass(frozen=True, eq=False)
class Augmented(Model):
    """A model on disk for recordings of one kind.

    Attributes:
        kind: kind of the recordings.
        model: loaded model.
        title: title of the campaign that is fitted. Numbers of the model whose source names it come from the
            same recordings. Empty where nothing is fitted.
    """

    kind: str
    model: AugmentedModel
    title: str = ""

    @property
    def acting(self) -> tuple[AddedEffect, ...]:
        """Effects of the catalogue that recordings of this kind can show."""
        named = (one for one in self.model.added if isinstance(one, AddedEffect))
        return tuple(one for one in named if self.specimen.letter in find_effect(one.slug).kinds)

    @property
    def discrepancies(self) -> tuple[AddedDiscrepancy, ...]:
        """Model discrepancies that act in recordings of this kind, as the file states them. They are held."""
        return tuple(one for one in self.model.remainders if one.acts_in(self.specimen))

    @property
    def idle(self) -> tuple[AddedDiscrepancy, ...]:
        """Model discrepancies that do nothing in recordings of this kind."""
        return tuple(one for one in self.model.remainders if not one.acts_in(self.specimen))

    @property
    def reused(self) -> tuple[AddedDiscrepancy, ...]:
        """Acting model discrepancies that come from the recordings that are fitted."""
        return tuple(one for one in self.discrepancies if any(map(self.is_from_here, one.corrections)))

    @property
    def more_than_base(self) -> bool:
        """True if an effect or a model discrepancy acts in recordings of this kind."""
        return bool(self.acting or self.discrepancies)

    @property
    def specimen(self) -> Specimen:
        """Kind of specimen that is recorded."""
        return specimen_of(self.kind)

    @property
    def searches(self) -> bool:
        """True for a spring with effects, whose trajectory is found inside each prediction."""
        return self.more_than_base and self.specimen.latent.inside

    @property
    def in_turn(self) -> bool:
        """True for histories of actuators, tubes and springs with effects."""
        return self.more_than_base and (self.specimen.each_alone or self.searches)

    @property
    def most_rows(self) -> int:
        """Maximum number of rows of a recording."""
        return self.specimen.most_rows_with_effects if self.more_than_base else MOST_ROWS

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the predicted quantities."""
        return self.specimen.explained if self.more_than_base else self.specimen.outputs

    def options(self, campaign: Campaign, given: Mapping[str, Any]) -> dict[str, str | Path]:
        """Start tables: the given ones first, then the model's, then the recordings'."""
        named = {"base": self.model.tables.get("alloy"), "material": self.model.tables.get("material")}
        found = {name: given.get(name) or named[name] for name in self.specimen.options}
        return {name: table for name, table in found.items() if table is not None}

    def rows_for(self, campaign: Campaign, **options: Any) -> list[Rows]:
        """Recordings as arrays, with the model's constants in them."""
        campaign = thinned(self.described(campaign), self.most_rows)
        made = self.specimen.rows_for(campaign, **self.options(campaign, options))
        rows = [self._predicted(r) for r in made]
        pairs = zip(rows, campaign.recordings, strict=True)
        return [with_numbers(r, self._known(recording.specimen)) for r, recording in pairs]

    def _predicted(self, rows: Rows) -> Rows:
        """Rows without outputs that the chain of effects does not predict: an actuator's bend direction."""
        both = (rows.measured, rows.weight)
        parts = [{n: x for n, x in part.items() if n in self.outputs} for part in both]
        return dataclasses.replace(rows, measured=parts[0], weight=parts[1])

    def described(self, campaign: Campaign) -> Campaign:
        """Recordings with the model's design and tables, where they are known."""
        keys = {"design": "design", "alloy": "alloy", "material": "material"}

        def with_tables(recording: Recording) -> Recording:
            own = {
                key: self.model.tables[table]
                for key, table in keys.items()
                if table in self.model.tables and recording.geometry.get(key) != FIT
            }
            return dataclasses.replace(recording, geometry={**recording.geometry, **own})

        return dataclasses.replace(campaign, recordings=[with_tables(r) for r in campaign.recordings])

    def _known(self, specimen: str | None) -> dict[str, Quantity]:
        """The model's constants by their parameter names in `Rows`."""
        found: dict[str, Quantity] = {}
        for kind in self.specimen.tables:
            for name, quantity in self.model.quantities(kind, specimen).items():
                found.setdefault(name, quantity)
        return found

    def parameters_for(self, campaign: Campaign, **options: Any) -> Parameters:
        """Free parameters: base constants that tolerances leave open, at the model's values, then those of
        effects.

        A prior of the file counts, unless it comes from these very recordings. An effect's parameter without
        a prior is flat between its physical bounds. The factor on a silicone's stress is held where nothing
        tells it from the constants of a law that is fitted.
        """
        campaign = self.described(campaign)
        base = self.specimen.parameters_for(campaign, **self.options(campaign, options))
        for name, entry in base.items():
            quantity = self.quantity(campaign, name)
            if quantity is not None:
                start_from(entry, quantity, self.is_from_here(quantity))
        if self._factor_is_of_the_law(campaign, base):
            base[FACTOR].set(vary=False)
        for added, names in zip(self.acting, self.names, strict=True):
            for key, name in names.items():
                base.add(effect_parameter(added, key, name, self.is_from_here(added.parameters[key])))
        return base

    def _factor_is_of_the_law(self, campaign: Campaign, base: Parameters) -> bool:
        """True if the factor on the stress of one specimen multiplies free constants of its silicone's law.

        So it is where the law was fitted to these very recordings, and no other source states the factor. A
        law from other recordings leaves the factor as the difference of this specimen.
        """
        if FACTOR not in base or any(r.geometry.get("material") != FIT for r in campaign.recordings):
            return False
        known = {name: self.quantity(campaign, name) for name in base}
        pressures = {name for name in known if QUANTITIES["silicone"].get(name) == "pressure"}
        own = {name for name, q in known.items() if q is not None and self.is_from_here(q)}
        stated = set() if known[FACTOR] is None else {FACTOR}
        return bool(pressures) and pressures | stated <= own

    def is_from_here(self, quantity: Quantity) -> bool:
        """True if a number's source names the campaign that is fitted: `S1` is not named by `S10`."""
        diagnosed = diagnosed_title(quantity.source)
        if diagnosed is not None:
            return bool(self.title) and self.title == diagnosed
        named = rf"(?<![\w-]){re.escape(self.title)}(?![\w-])"
        return bool(self.title) and re.search(named, quantity.source) is not None

    @property
    def diagnosed_here(self) -> bool:
        """True if a diagnosis of the campaign that is fitted led to the model, and so has looked already."""
        return bool(self.title) and self.title == diagnosed_title(self.model.description)

    def quantity(self, campaign: Campaign, name: str) -> Quantity | None:
        """The model's number of a parameter in a fit of a campaign; None where it states none."""
        stem, mark, number = name.partition(MARK)
        specimens = list(campaign.specimens())
        own = specimens[int(number) - 1] if mark else specimens[0] if len(specimens) == 1 else None
        return self._known(own).get(stem)

    @property
    def stems(self) -> tuple[str, ...]:
        """Beginning of the names of each effect's parameters; the second effect of a slug has its number."""
        slugs = [added.slug for added in self.model.added]
        counts = [slugs[: k + 1].count(slug) for k, slug in enumerate(slugs)]
        return tuple(slug if n == 1 else f"{slug}_{n}" for slug, n in zip(slugs, counts, strict=True))

    @property
    def names(self) -> tuple[dict[str, str], ...]:
        """Free parameters of each acting effect: the name in the fit by the name in the file."""
        result = []
        for added, stem in zip(self.model.added, self.stems, strict=True):
            if added in self.acting:
                effect = find_effect(added.slug)
                acts = specs_of(effect, self.specimen.letter)
                own = (key for key in added.parameters if parameter_of(effect, key) in acts)
                result.append({key: f"{stem}_{key}" for key in own})
        return tuple(result)

    def held(self, campaign: Campaign, parameters: Parameters) -> list[Held]:
        """Parameters that the model states and this fit holds.

        Args:
            campaign: recordings that are fitted.
            parameters: parameters of the fit.
        """
        free = set(parameters.layout().free)
        found = []
        for added, stem in zip(self.model.added, self.stems, strict=True):
            why = f"does not act in recordings of kind {self.kind}"
            if added in self.discrepancies:
                why = "a model discrepancy is held as the file states it"
            for key, quantity in added.parameters.items():
                name = f"{stem}_{key}"
                if name in parameters and name not in free:
                    found.append(Held(name, parameters[name].value, quantity.unit, "held as asked"))
                elif name not in free:
                    found.append(Held(name, quantity.value, quantity.unit, why))
        of_base = {name.partition(MARK)[0] for name in free}
        for name, quantity in self._known(None).items():
            if name not in of_base:
                of_law = name == FACTOR and self._factor_is_of_the_law(campaign, parameters)
                why = "it multiplies the law's fitted constants" if of_law else "no tolerance leaves it open"
                found.append(Held(name, quantity.value, quantity.unit, why))
        return found

    def spent(self, campaign: Campaign) -> list[str]:
        """Parameters whose prior in the file comes from these recordings, so that it does not count again."""
        quantities = {n: q for s in (None, *campaign.specimens()) for n, q in self._known(s).items()}
        for added, names in zip(self.acting, self.names, strict=True):
            quantities |= {names[k]: q for k, q in added.parameters.items() if k in names}
        return [n for n, q in quantities.items() if q.prior is not None and self.is_from_here(q)]

    def specs(self) -> Iterator[tuple[str, str, Spec]]:
        """Name in the fit, slug and prior knowledge of every parameter of the acting effects."""
        for added, names in zip(self.acting, self.names, strict=True):
            effect = find_effect(added.slug)
            for key, name in names.items():
                yield name, added.slug, effect.specs[parameter_of(effect, key)]

    def alike(self) -> list[list[tuple[str, ...]]]:
        """Of each acting effect with terms that may change places, the terms by their names in the fit.

        Terms that the file leaves out are absent, and have no name.
        """
        found = []
        for added, names in zip(self.acting, self.names, strict=True):
            terms = [term for term in find_effect(added.slug).alike if set(term) <= set(names)]
            found.append([tuple(names[key] for key in term) for term in terms])
        return [terms for terms in found if len(terms) > 1]

    def natural_ends(self) -> frozenset[str]:
        """Names of the parameters of effects both ends of whose ranges are forms of their own."""
        return frozenset(name for name, _, spec in self.specs() if spec.natural_ends)

    def effects(self, values: Mapping[str, Array]) -> tuple[Effect, ...]:
        """Acting effects with the parameters of a fit, and discrepancies as they are; may be traced."""
        names, made = iter(self.names), []
        acting, held = self.acting, self.discrepancies
        for added in self.model.added:  # in the order of the file
            if isinstance(added, AddedDiscrepancy):
                made += [added.build()] if added in held else []
            elif added in acting:
                found = {key: values[name] for key, name in next(names).items() if name in values}
                made.append(added.build(found))
        return tuple(made)

    def _split(self, values: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[Effect, ...]]:
        own = {name for names in self.names for name in names.values()}
        return {n: v for n, v in values.items() if n not in own}, self.effects(values)

    def answer(self, values: Mapping[str, Array], rows: Rows) -> tuple[dict[str, Array], dict[str, Any]]:
        """Outputs and drivers of one recording through its effects, without a discrepancy's own channels."""
        base, effects = self._split(values)
        found, drivers = self.specimen.answer(base, rows, effects)
        return {name: x for name, x in found.items() if not name.startswith(CHANNELS)}, drivers

    def predict(self, values: Mapping[str, Array], rows: Rows) -> dict[str, Float[Array, " rows"]]:
        """Outputs of one recording by quantity, SI."""
        return self.answer(values, rows)[0]

    def residual(self, values: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Weighted residual of one recording, in standard deviations."""
        if not self.more_than_base:
            return self.specimen.residual(values, rows)
        return self.misfit(self.predict(values, rows), rows)

    def misfit(self, found: Mapping[str, Array], rows: Rows) -> Float[Array, " m"]:
        """Prediction minus measurement in standard deviations, as the specimen counts it."""
        return self.specimen.misfit(found, rows)

    def observations(self, values: Mapping[str, float], recordings: Sequence[Rows]) -> int:
        """Number of measured values that count, less those that hidden states and model discrepancies use up.

        A discrepancy that comes from these recordings uses one for each knot.
        """
        count = super().observations(values, recordings) - sum(len(one.knots) for one in self.reused)
        if self.searches:
            count -= round(float(np.sum(self.taken(values, recordings))))
        return max(count, 1)

    def decides(self, recordings: Sequence[Rows]) -> bool:
        """True if the prediction depends on the parameters in a non-smooth way, as the kind states, or as the
        memory of a spring does."""
        return self.searches or self.specimen.decides(recordings)

    def decided(self, values: Mapping[str, float], recordings: list[Rows]) -> list[Rows]:
        """Actuators with phases that their resistances imply at these parameters; springs with what they
        remember; wires with noise of drivers."""
        if have_driver_noise(recordings):
            return with_effective_variance(self, values, recordings)
        if not self.more_than_base:
            return self.specimen.decided(values, recordings)
        point = as_arrays(values)

        def drivers(rows: list[Rows]) -> dict[str, np.ndarray]:
            return jax.device_get(drivers_of(self)(point, stack(rows)))

        return self.specimen.latent.settled(recordings, drivers)

    def taken(self, values: Mapping[str, float], recordings: Sequence[Rows]) -> np.ndarray:
        """Degrees of freedom that the trajectory of each recording takes, shape (recordings,)."""
        taken = np.asarray(eqx.filter_jit(self._by_row)(as_arrays(values), stack(recordings)))
        pairs = zip(recordings, taken, strict=False)  # a stack may be padded
        return np.array([np.sum(one[: len(rows.mask)]) for rows, one in pairs])

    def _by_row(self, values: Mapping[str, Array], stacked: Rows) -> Float[Array, "recordings rows"]:
        return of_each(self, lambda rows: self.answer(values, rows)[1]["taken_from_errors"], stacked)
