"""Model discrepancy in a model on disk: knots of a driver, and the correction at each.

    [[effect]]
    slug = "unmodelled"
    kind = "elastomer"      # recordings in which it was found
    quantity = "stress"     # corrected output, or "silicone_stiffness" (relative change)
    driver = "strain"       # what it is a function of, from the first knot to the last one
    [effect.parameters]
    knot_1 = {value = 0.0, unit = "1", status = "fitted", source = "..."}
    correction_1 = {value = 1.2, unit = "kPa", status = "fitted", source = "..."}
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneusma_jax.calibration.records import Quantity
from pneusma_jax.calibration.toml import quantity_entry, read_quantity
from pneusma_jax.documents import check_keys
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.late import tomlkit
from pneusma_jax.model_discrepancy import WALL, Unmodelled, unit_of, unmodelled
from pneusma_jax.units import UNITS as KNOWN_UNITS
from pneusma_jax.units import amount

from ..registry import SPECIMENS, specimen_of
from ..specimen import Specimen

SLUG = Unmodelled.slug
WORDS = ("kind", "quantity", "driver")
LEAST = 2
"""Minimum number of knots of a function."""


@dataclass(frozen=True)
class AddedDiscrepancy:
    """A smooth function of one driver that is added to one output, or to the silicone's stiffness. It
    describes a misfit without explaining it.

    Attributes:
        kind: kind of the recordings in which it was found.
        quantity: output that it is added to, or `silicone_stiffness`, whose relative change it is.
        driver: quantity that it is a function of.
        knots: values of the driver, ascending, SI; the function is unknown beyond them.
        corrections: added value at each knot, SI.
    """

    kind: str
    quantity: str
    driver: str
    knots: tuple[Quantity, ...]
    corrections: tuple[Quantity, ...]

    slug = SLUG

    @property
    def span(self) -> tuple[float, float]:
        """Smallest and largest value of the driver that it was fitted over, SI."""
        return self.knots[0].value, self.knots[-1].value

    @property
    def parameters(self) -> dict[str, Quantity]:
        """Corrections by their names in the file."""
        return {quantity.name: quantity for quantity in self.corrections}

    @property
    def words(self) -> str:
        """Description within a sentence."""
        return f"the model discrepancy of {self.quantity}, a smooth function of {self.driver}"

    @property
    def span_words(self) -> str:
        """Range of validity within a sentence."""
        low, high = self.span
        unit = unit_of(self.driver)
        return f"{self.driver} from {amount(f'{low:.4g} to {high:.4g}', unit)}"

    def acts_in(self, specimen: Specimen) -> bool:
        """True if recordings of a kind of specimen have what it is added to, and what it follows."""
        same = specimen_of(self.kind).element == specimen.element
        corrected = self.quantity in _corrected(specimen) and self.driver in _drivers(specimen, self.quantity)
        return same and corrected

    def build(self) -> Unmodelled:
        """The effect that simulations apply."""
        numbers = [np.array([q.value for q in column]) for column in (self.knots, self.corrections)]
        return unmodelled(*numbers, specimen_of(self.kind).element, self.quantity, self.driver)


def read_remainder(entry: Mapping[str, Any], where: str) -> AddedDiscrepancy:
    """Check the entry of a file and build it.

    Raises:
        InputError: one line, for anything missing, unknown or impossible.
    """
    check_keys(entry, ("slug", "parameters", *WORDS), where)
    _check_words(entry, where)
    parameters = entry.get("parameters", {})
    if not isinstance(parameters, dict):
        raise InputError(f"{where}: parameters must be a table, [effect.parameters]")
    units = {"knot": unit_of(entry["driver"]), "correction": unit_of(entry["quantity"])}
    count = sum(name.startswith("knot_") for name in parameters)
    wanted = [f"{stem}_{k}" for k in range(1, max(count, LEAST) + 1) for stem in units]
    for name in wanted:
        if name not in parameters:
            raise InputError(f"{where}: {name} is missing; each knot needs its correction, {LEAST} at least")
    for name in parameters:
        if name not in wanted:
            raise InputError(f"{where}: unknown parameter {name!r}, {nearest(name, wanted)}")
    columns: dict[str, list[Quantity]] = {stem: [] for stem in units}
    for name in wanted:
        stem = name.partition("_")[0]
        dimension = KNOWN_UNITS[units[stem]].dimension
        columns[stem].append(read_quantity(name, parameters[name], dimension, f"{where}: {name}"))
    knots = [q.value for q in columns["knot"]]
    for k, step in enumerate(np.diff(knots), 2):
        if not step > 0.0:
            raise InputError(f"{where}: knot_{k} must be larger than knot_{k - 1}; knots ascend")
    words = (entry[word] for word in WORDS)
    return AddedDiscrepancy(*words, tuple(columns["knot"]), tuple(columns["correction"]))


def _check_words(entry: Mapping[str, Any], where: str) -> None:
    """Check that a kind can have a correction of this quantity that follows this driver."""
    kind, quantity, driver = (_word(entry, key, where) for key in WORDS)
    if kind not in SPECIMENS:
        raise InputError(f"{where}: kind is {kind!r}, {nearest(kind, SPECIMENS)}")
    specimen = specimen_of(kind)
    outputs = (*_corrected(specimen), *specimen.latent.readings)
    if quantity not in outputs:
        raise InputError(f"{where}: quantity is {quantity!r}, of kind {kind!r} {nearest(quantity, outputs)}")
    drivers = _drivers(specimen, quantity)
    if driver not in drivers:
        told = f"of kind {kind!r} {nearest(driver, drivers)}"
        raise InputError(f"{where}: driver of {quantity} is {driver!r}, {told}")


def _corrected(specimen: Specimen) -> tuple[str, ...]:
    """What a discrepancy may change in recordings of a kind of specimen."""
    return (*specimen.explained, *([WALL] if specimen.wall_drivers else []))


def _drivers(specimen: Specimen, quantity: str) -> tuple[str, ...]:
    """What a discrepancy of a quantity may follow in recordings of a kind of specimen."""
    return specimen.wall_drivers if quantity == WALL else specimen.output_drivers


def _word(entry: Mapping[str, Any], key: str, where: str) -> str:
    """A required word of an entry."""
    word = entry.get(key)
    if not isinstance(word, str):
        raise InputError(f"{where}: {key} must be a word, but it is {word!r}")
    return word


def remainder_entry(rest: AddedDiscrepancy) -> Any:
    """The entry of a file, which `read_remainder` reads back equal."""
    entry = tomlkit.table()
    entry["slug"] = rest.slug
    for word in WORDS:
        entry[word] = getattr(rest, word)
    parameters = tomlkit.table()
    for pair in zip(rest.knots, rest.corrections, strict=True):
        for quantity in pair:
            parameters[quantity.name] = quantity_entry(quantity, None)
    entry["parameters"] = parameters
    return entry
