"""A base function with named slots, terms that act there, and both as one function."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from jaxtyping import Array

from fitting.inference.parameters import Parameters
from pneusma_jax.effects import Spec
from pneusma_jax.errors import InputError, nearest

Values = Mapping[str, Array]
Slot = Callable[[str, Array], Array]
Base = Callable[[Values, Mapping[str, Array], Mapping[str, Array], Slot], dict[str, Array]]
BETWEEN = "__"
"""Between a term's name and its parameter's, as one name: `leak__share`."""


@dataclass(frozen=True)
class Term:
    """One piece of physics that the base may miss.

    Attributes:
        name: a Python identifier.
        sentence: statement about the world, for a report.
        slot: slot of the base at which it acts.
        specs: its parameters: neutral value (absent), physical bounds, typical value, unit, text; `shape` for
            those that mean nothing while the term is absent.
        apply: `apply(value, own, columns, facts)`: the slot's value with the term. `own` holds its
            parameters; with all neutral the value must come back unchanged.
    """

    name: str
    sentence: str
    slot: str
    specs: Mapping[str, Spec]
    apply: Callable[[Array, Values, Mapping[str, Array], Mapping[str, Array]], Array]

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or BETWEEN in self.name:
            raise InputError(f"term {self.name!r}: a name must be a Python identifier without {BETWEEN!r}")
        if not any(not spec.shape for spec in self.specs.values()):
            raise InputError(f"term {self.name!r}: one parameter at least must not be a shape")
        for key, spec in self.specs.items():
            if not spec.low <= spec.neutral <= spec.high or not spec.low <= spec.typical <= spec.high:
                raise InputError(
                    f"term {self.name!r}: the neutral or typical value of {key} lies outside"
                    f" [{spec.low:g}, {spec.high:g}]"
                )

    def full(self, key: str) -> str:
        """Name of a parameter among all of a model."""
        return f"{self.name}{BETWEEN}{key}"

    @property
    def amplitudes(self) -> list[str]:
        """Full names of the parameters that are not shapes."""
        return [self.full(key) for key, spec in self.specs.items() if not spec.shape]


@dataclass(frozen=True)
class OwnModel:
    """A base model and the terms that may be missing from it.

    Attributes:
        base: function of one recording, `base(values, columns, facts, slot)`, that gives outputs by name,
            each of shape (rows, ...). `values` are its parameters, `columns` the quantities that change from
            row to row, `facts` the fixed ones. `slot(name, value)` returns the value with the terms that act
            there.
        parameters: parameters of the base, with priors and bounds.
        terms: candidates, in the order in which they act at a slot.
    """

    base: Base
    parameters: Parameters
    terms: Sequence[Term]

    def __post_init__(self) -> None:
        names = [term.name for term in self.terms]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice:
            raise InputError(f"there are two terms of the name {twice!r}; give one another")

    def term(self, name: str) -> Term:
        """A candidate by name.

        Raises:
            InputError: if there is none; names the nearest.
        """
        found = next((term for term in self.terms if term.name == name), None)
        if found is None:
            raise InputError(f"there is no term {name!r}, {nearest(name, [t.name for t in self.terms])}")
        return found

    def predict(
        self, values: Values, columns: Mapping[str, Array], facts: Mapping[str, Array]
    ) -> dict[str, Array]:
        """Outputs of one recording; terms without parameters among the values are not there."""
        present = {name.partition(BETWEEN)[0] for name in values if BETWEEN in name}

        def slot(name: str, value: Array) -> Array:
            for term in self.terms:
                if term.slot == name and term.name in present:
                    own = {key: values[term.full(key)] for key in term.specs}
                    value = term.apply(value, own, columns, facts)
            return value

        return self.base({name: values[name] for name in self.parameters}, columns, facts, slot)

    def check_slots(self, columns: Mapping[str, Array], facts: Mapping[str, Array]) -> None:
        """Refuse terms at slots that the base does not have.

        Raises:
            InputError: names the slot and the nearest there is.
        """
        seen: list[str] = []

        def slot(name: str, value: Array) -> Array:
            seen.append(name)
            return value

        self.base({name: p.value for name, p in self.parameters.items()}, columns, facts, slot)
        for term in self.terms:
            if term.slot not in seen:
                raise InputError(
                    f"term {term.name!r} acts at {term.slot!r}, but the base has no such slot;"
                    f" {nearest(term.slot, seen)}"
                )

    def with_terms(self, present: Sequence[str] = ()) -> Parameters:
        """Parameters of the base and of some terms."""
        parameters = self.parameters.copy()
        for name in present:
            term = self.term(name)
            for key, spec in term.specs.items():
                start = spec.typical if spec.shape else spec.neutral
                parameters.add(term.full(key), start, min=spec.low, max=spec.high, unit=spec.unit)
        return parameters

    def neutral(self) -> dict[str, float]:
        """Parameters of all terms, absent; shapes at typical values."""
        return {
            term.full(key): spec.typical if spec.shape else spec.neutral
            for term in self.terms
            for key, spec in term.specs.items()
        }
