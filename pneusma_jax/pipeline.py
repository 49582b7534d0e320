"""Missing physics joins the model through effects that act at named slots of a row.

A row of a recording runs through slots in a fixed order, each a value that the base model hands on unchanged:

    actuator   pressure -> [elongation -> phase -> stress -> pull -> resistance] per spring
                        -> [elastic -> softened -> wall] per fibre, load -> outputs
    spring     [compliance] elongation -> phase -> stress -> pull -> resistance -> outputs
    wire       temperature -> phase -> stress -> outputs      tube  as actuator
    elastomer  [compliance] elastic -> softened -> wall -> outputs
    before all rows of a wire: driven                         at the end of all rows: recorded

The silicone's stress goes through three slots. So the elastic stress is whole before anything softens it, and
softened before anything relaxes, in whatever order effects are given.

An effect is a module with a parameter whose neutral value means absent, and a method for each slot it acts
at. If it has a history, it also has a memory that is carried from row to row. Effects compose in the order in
which they are given. A pipeline without effects is the base model and adds nothing to the compiled program.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool

WALL = ("elastic", "softened", "wall")
"""Slots through which the stress of the silicone goes, in their order."""


class Known(eqx.Module):
    """Values of a row that are known when a slot is reached, by name. An unknown name is a `KeyError`.

    Row: `time`, `interval`, `pressure`, `temperature`, `cycle`, and the element: `actuator`, `spring`, `wire`
    or `silicone`. Spring: `number` (as recordings count, an int), `elongation`, `gamma`, `xi0`, `gamma_R`,
    `base_stress`, `stress`, `force`. Wall: `strain`, the law's stress there, `base`, and, at `wall`, that of
    the slots before it, `elastic`. Configuration: `delta_centre`, `bend`. After a row, `elastic_at` is a
    function from base stress and strain to that elastic stress.
    """

    values: dict[str, Any] = eqx.field(default_factory=dict)

    def __getitem__(self, name: str) -> Any:
        return self.values[name]

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def also(self, **more: Any) -> "Known":
        """The same, knowing more."""
        return Known(self.values | more)


class Effect(eqx.Module):
    """Physics that the base model leaves out.

    Class attributes:
        slug: name in the catalogue and in reports.
        component: where a report locates it.
        kinds: recordings that can show it: A actuator, S spring, W wire, E elastomer, T tube.
        sentence: what was left out, for a laboratory.
        sentences: the same by kind, for kinds whose recordings need other words; see `sentence_for`.
        literature: where the form comes from.
        lookalike: what is not in the catalogue and leaves the same misfit, as the subject of a sentence;
            empty if nothing is known to.
        lookalike_kinds: recordings in which that is so, as for `kinds`; all where empty.
        by_rate: true if only the clock tells it apart: without times of rows it cannot be tested.
        woken: true if only a history wakes it: at the start of a recording it changes nothing.
        leads: true if its resistance lies outside of the wire, so that a current heats nothing there.
        alike: terms that may change places without any change: parameters of each, in one order. The first of
            each term tells the terms apart.

    The methods below are the slots; each returns its value unchanged unless overridden. `memory` is what
    `begin` made and `remember` keeps; it is a pytree, `None` for an effect without history.
    """

    slug: ClassVar[str] = ""
    component: ClassVar[str] = "unknown"
    kinds: ClassVar[str] = ""
    sentence: ClassVar[str] = ""
    sentences: ClassVar[Mapping[str, str]] = MappingProxyType({})
    literature: ClassVar[str] = ""
    lookalike: ClassVar[str] = ""
    lookalike_kinds: ClassVar[str] = ""
    by_rate: ClassVar[bool] = False
    woken: ClassVar[bool] = False
    leads: ClassVar[bool] = False
    alike: ClassVar[tuple[tuple[str, ...], ...]] = ()

    @classmethod
    def sentence_for(cls, kind: str) -> str:
        """What was left out of recordings of a kind, a letter of `kinds`."""
        return cls.sentences.get(kind, cls.sentence)

    def acts_at_rest(self) -> bool:
        """True if it can change a state as at the start of a recording; of concrete parameters."""
        return not self.woken

    def begin(self, at: Known) -> Any:
        """Memory before the first row, at rest."""
        return None

    def remember(self, memory: Any, at: Known) -> Any:
        """Memory after a row, all of which is known."""
        return memory

    def pressure(self, value: Array, at: Known, memory: Any) -> Array:
        """Chamber pressure [Pa] from the recorded one."""
        return value

    def elongation(self, value: Array, at: Known, memory: Any) -> Array:
        """Elongation that the wire of a spring sees [m] from that of its ends."""
        return value

    def wire_resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """Resistance of the active wire [ohm] from the measured one; the inverse of `resistance`."""
        return value

    def compliance(self, value: Array, at: Known, memory: Any) -> Array:
        """Compliance between the specimen and the recorded length, shape (2,). The first number is the
        compliance without load [m/N]. The second is one over the force at which it is half as much [1/N].
        Both are 0 in the base model."""
        return value

    def temperature(self, value: Array, at: Known, memory: Any) -> Array:
        """Temperature [degC] at which the reversible curve is read, from that of the specimen."""
        return value

    def phase(self, value: Array, at: Known, memory: Any) -> Array:
        """Onset martensite fraction [1]."""
        return value

    def stress(self, value: Array, at: Known, memory: Any) -> Array:
        """Shear stress of a spring's wire, axial stress of a straight one [Pa]."""
        return value

    def pull(self, value: Array, at: Known, memory: Any) -> Array:
        """Force of a spring [N]."""
        return value

    def resistance(self, value: Array, at: Known, memory: Any) -> Array:
        """Measured resistance [ohm] from that of the active wire."""
        return value

    def elastic(self, value: Array, at: Known, memory: Any) -> Array:
        """Elastic engineering stress of fibres of the wall [Pa], shape (fibres,), from that of the law."""
        return value

    def softened(self, value: Array, at: Known, memory: Any) -> Array:
        """The same after damage, of all of the elastic stress."""
        return value

    def wall(self, value: Array, at: Known, memory: Any) -> Array:
        """Engineering stress of fibres of the wall [Pa], shape (fibres,), from the elastic one."""
        return value

    def load(self, value: tuple[Array, Array], at: Known, memory: Any) -> tuple[Array, Array]:
        """Pull [N] and first moments [N m] that resist the pressure, on top of springs and wall."""
        return value

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """Readings of the instruments, by canonical column name in SI."""
        return value

    def driven(self, value: dict[str, Array], time: Array) -> dict[str, Array]:
        """Drives in all rows, from their records, shape (rows,) each; of wires so far.

        For effects on the instrument of a drive, whose later readings tell what it missed before.
        """
        return value

    def recorded(self, value: dict[str, Array], time: Array) -> dict[str, Array]:
        """Records of the instruments in all rows, from their readings, shape (rows,) each.

        For effects on a channel's clock. Memories are not known here: the recording is complete.
        """
        return value


def mimicked_in(effect: type[Effect], kind: str) -> bool:
    """True if an effect's `lookalike` leaves the same misfit in recordings of a kind, given by its letter."""
    return bool(effect.lookalike) and kind in (effect.lookalike_kinds or effect.kinds)


class Switched(eqx.Module):
    """An effect that may be off, for programs that hold many and need few at a time. An effect that is off is
    skipped at run time, and so is a slot at which all are off. The switch is an argument of the compiled
    program. While off, an effect must be at its neutral value; its derivatives there are zero.

    Attributes:
        effect: the effect that acts while on.
        on: shape ().
    """

    effect: Effect
    on: Bool[Array, ""]


class Pipeline(eqx.Module):
    """Effects bound to their memories and to what is known of the row: what the model's slots call.

    Attributes:
        effects: effects, in the order in which they act.
        memories: one per effect.
        known: values of the row so far.
    """

    effects: tuple[Effect | Switched, ...] = ()
    memories: tuple[Any, ...] = ()
    known: Known = eqx.field(default_factory=Known)

    @classmethod
    def begin(cls, effects: tuple[Effect | Switched, ...], **known: Any) -> "Pipeline":
        """Effects with their memories at rest."""
        at = Known(known)
        return cls(tuple(effects), tuple(_own(effect).begin(at) for effect in effects), at)

    def with_known(self, **more: Any) -> "Pipeline":
        """The same pipeline further along the row."""
        return Pipeline(self.effects, self.memories, self.known.also(**more)) if self.effects else self

    def without_leads(self) -> "Pipeline":
        """The same pipeline without resistances outside of the wires; itself if there are none."""
        pairs = zip(self.effects, self.memories, strict=True)
        kept = [(effect, memory) for effect, memory in pairs if not _own(effect).leads]
        if len(kept) == len(self.effects):
            return self
        return Pipeline(tuple(e for e, _ in kept), tuple(m for _, m in kept), self.known)

    def apply(self, slot: str, value: Any, **more: Any) -> Any:
        """A value after every effect that acts at a slot."""
        at = self.known.also(**more) if self.effects else self.known
        pairs = zip(self.effects, self.memories, strict=True)
        acting = [(effect, memory) for effect, memory in pairs if _overrides(effect, slot)]

        if len(acting) == 1:
            return _acting(acting[0][0], slot, value, at, acting[0][1])

        def all_of_them(value: Any) -> Any:
            for effect, memory in acting:
                value = _acting(effect, slot, value, at, memory)
            return value

        return self.where_acting(slot, all_of_them, lambda x: x, value)

    def elastic_stress(self, base: Array, strain: Array) -> Array:
        """Elastic stress of fibres of the wall, softened, from that of the law [Pa]; shapes (fibres,)."""
        elastic = self.apply("elastic", base, strain=strain, base=base)
        return self.apply("softened", elastic, strain=strain, base=base)

    def wall_stress(self, base: Array, strain: Array) -> Array:
        """Stress of fibres of the wall after all effects, from that of the law [Pa]; shapes (fibres,)."""
        elastic = self.elastic_stress(base, strain)
        return self.apply("wall", elastic, strain=strain, base=base, elastic=elastic)

    def where_acting(self, slots: str | tuple[str, ...], act: Callable, idle: Callable, *values: Any) -> Any:
        """`act(*values)` where any effect at one of the slots is on, `idle(*values)` where all are off; only
        the one that is needed is computed."""
        return _chosen([e for e in self.effects if _overrides_any(e, slots)], act, idle, *values)

    def acts_at(self, slots: str | tuple[str, ...]) -> bool:
        """True if any effect overrides a slot, or one of several; decided while tracing."""
        return any(_overrides_any(effect, slots) for effect in self.effects)

    def remembered(self, **more: Any) -> tuple[Any, ...]:
        """Memories after the row."""
        at = self.known.also(**more, elastic_at=self.elastic_stress)
        pairs = zip(self.effects, self.memories, strict=True)
        return tuple(_acting(effect, "remember", memory, at) for effect, memory in pairs)


def _own(effect: Effect | Switched) -> Effect:
    return effect.effect if isinstance(effect, Switched) else effect


def _overrides(effect: Effect | Switched, method: str) -> bool:
    return getattr(type(_own(effect)), method) is not getattr(Effect, method)


def _overrides_any(effect: Effect | Switched, slots: str | tuple[str, ...]) -> bool:
    return any(_overrides(effect, slot) for slot in ((slots,) if isinstance(slots, str) else slots))


def _chosen(acting: list[Effect | Switched], act: Callable, idle: Callable, *values: Any) -> Any:
    """Result of values where effects act, any of which may be off."""
    if not acting:
        return idle(*values)
    if not all(isinstance(effect, Switched) for effect in acting):
        return act(*values)
    on = jnp.any(jnp.stack([effect.on for effect in acting if isinstance(effect, Switched)]))
    return jax.lax.cond(on, act, idle, *jax.tree.map(jnp.asarray, values))


def _acting(effect: Effect | Switched, method: str, value: Any, *more: Any) -> Any:
    """A value after one effect's method."""
    act = lambda x: getattr(_own(effect), method)(x, *more)  # noqa: E731
    return _chosen([effect] if _overrides(effect, method) else [], act, lambda x: x, value)


PLAIN = Pipeline()


def changes_equilibrium(effect: Effect) -> bool:
    """True if an effect changes what a specimen does at given phases; false if only readings, or its
    resistance."""
    slots = ("pressure", "elongation", "temperature", "phase", "stress", "pull", *WALL, "load")
    return any(_overrides(effect, slot) for slot in slots)


def changes_states(effect: Effect) -> bool:
    """True if an effect changes what a specimen does, or its resistance; false if only instruments or a test
    stand have it."""
    return changes_equilibrium(effect) or any(
        _overrides(effect, slot) for slot in ("resistance", "wire_resistance")
    )


TOLD = "told_"
"""Before the names by which slots hand values of rows to `recorded`; no instrument shows them."""


def as_recorded(
    effects: tuple[Effect | Switched, ...], seen: dict[str, Array], time: Array
) -> dict[str, Array]:
    """Channels of a whole recording, shape (rows,) each, after every effect on their clocks."""
    told = {name: course for name, course in seen.items() if name.startswith(TOLD)}
    for effect in effects:
        seen = _acting(effect, "recorded", seen, time) | told  # which no instrument's clock moves
    return {name: course for name, course in seen.items() if name not in told}


def as_driven(
    effects: tuple[Effect | Switched, ...], told: dict[str, Array], time: Array
) -> dict[str, Array]:
    """Drives of a whole recording, shape (rows,) each, before every effect on their instruments."""
    for effect in effects:
        told = _acting(effect, "driven", told, time)
    return told
