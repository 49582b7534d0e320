"""Bodies that can be solved, from parameters: an actuator, or a chain of several, under one state."""

import dataclasses
from collections.abc import Mapping
from types import MappingProxyType

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

import pneusma_jax as pj
from fitting.inference.notes import joined
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without, missed_by_chain, of_states_at_rest
from pneusma_jax.actuator.designs import GEOMETRY_KEYS, SECTION_KEYS, design_gravity
from pneusma_jax.actuator.result import Validity
from pneusma_jax.calibration import Calibration, named_table
from pneusma_jax.errors import InputError, distrusted
from pneusma_jax.nitinol.spring import SpringResponse
from pneusma_jax.pipeline import Effect, changes_states
from pneusma_jax.program_cache import stored_jit
from pneusma_jax.serial_chain.chain_files import describes_chain
from pneusma_jax.serial_chain.designs import ChainDesign, load_chain, make_chain
from pneusma_jax.serial_chain.kinematics import arc_frame
from pneusma_jax.serial_chain.segments import ChainEquilibrium
from pneusma_jax.serial_chain.shape import ChainShape
from pneusma_jax.silicone import SiliconeLaw
from pneusma_jax.simulate.rest import solve_at_rest


@dataclasses.dataclass(frozen=True)
class Plan:
    """Tables and designs of a body, apart from its parameters.

    Attributes:
        tables: calibration tables of kind actuator, one per segment.
        chain: the chain's design, or None for a single actuator.
        alloy, silicone: given instead of the tables' own; None for those.
        model: constants that replace those of all tables, and effects beyond the base model.
    """

    tables: tuple[Calibration, ...]
    chain: ChainDesign | None
    alloy: str | None = None
    silicone: str | None = None
    model: AugmentedModel = BASE

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects of the model that change states; those of instruments and test stands are left out."""
        return tuple(filter(changes_states, self.model.effects))

    @property
    def springs(self) -> tuple[tuple[int, int], ...]:
        """Segment (from 1) and number of every spring."""
        return tuple((k, n) for k, t in enumerate(self.tables, 1) for n in pj.layout(t).spring_numbers)

    def dimensions(self) -> set[str]:
        """Dimensions that every segment has."""
        keys = [{key for key in (*GEOMETRY_KEYS, *SECTION_KEYS) if key in t.quantities} for t in self.tables]
        return set.intersection(*keys)

    def materials(self) -> tuple["Materials", ...]:
        """Alloy and silicone of every segment."""
        found = []
        for table in self.tables:
            alloy = None
            if pj.layout(table).spring_numbers:
                alloy = pj.load_alloy(alloy_of(self, table))
                alloy = dataclasses.replace(alloy, name="")  # names would make programs differ
            found.append(Materials(alloy, pj.load_silicone(silicone_of(self, table))))
        return tuple(found)


def plan_of(
    design: str,
    alloy: str | None = None,
    silicone: str | None = None,
    model: AugmentedModel = BASE,
) -> Plan:
    """Tables of a design, by name or path, with a model's numbers in them.

    Raises:
        InputError: if there is no such design.
    """
    chain = load_chain(design) if describes_chain(design) else None
    names = (design,) if chain is None else chain.designs
    return Plan(tuple(model.table("actuator", name) for name in names), chain, alloy, silicone, model)


def without_effect(plan: Plan) -> str | None:
    """Reason why a model's additions cannot act in a body; None where they can."""
    name = plan.model.shown_name
    if plan.model.remainders:
        return (
            f"{name} has an unnamed correction, which holds for the recordings it was made from alone; take "
            "its [[effect]] out of the file"
        )
    missed = missed_by_chain(plan.model) if plan.chain is not None else []
    if missed:
        return f"a chain takes numbers of {name}, but not its effects ({joined(missed)})"
    return None


def remarks_on_states(model: AugmentedModel, design: str) -> list[str]:
    """Sentences on effects of a model that change nothing in a design's states; none where all act."""
    return chain_without(model) if describes_chain(design) else of_states_at_rest(model)


def alloy_of(plan: Plan, table: Calibration) -> Calibration:
    """Table of the alloy of a segment's springs, with the model's numbers in it."""
    return plan.model.table("alloy", plan.alloy or named_table(table, "alloy"))


def cautions_of(plan: Plan) -> list[str]:
    """What the tables and the model of a body say against their own numbers, each once."""
    found = list(plan.tables)
    found += [alloy_of(plan, table) for table in plan.tables if pj.layout(table).spring_numbers]
    found += [silicone_of(plan, table) for table in plan.tables]
    said = [(table.path or table.name, table.text.get("caution", "")) for table in found]
    said.append((plan.model.shown_name, plan.model.caution))
    return list(dict.fromkeys(distrusted(source, caution) for source, caution in said if caution))


def silicone_of(plan: Plan, table: Calibration) -> Calibration:
    """Table of the silicone of a segment, with the model's numbers in it."""
    return plan.model.table("silicone", plan.silicone or named_table(table, "material"))


class Materials(eqx.Module):
    """Constants of one segment.

    Attributes:
        alloy: alloy of the springs, or None.
        silicone: law of the wall.
    """

    alloy: pj.Alloy | None
    silicone: SiliconeLaw

    def with_draw(self, alloy: Mapping[str, Array], stiffness: Array | None) -> "Materials":
        """The same with drawn constants of the alloy and a drawn stiffness of the silicone."""
        changed = self.alloy
        if changed is not None and alloy:
            changed = dataclasses.replace(changed, **alloy)
        silicone = self.silicone
        if stiffness is not None:
            if not hasattr(silicone, "stiffness"):
                raise InputError(
                    "the uncertainty of `silicone_stiffness` needs a silicone with the law 'regularised'"
                )
            silicone = dataclasses.replace(silicone, stiffness=stiffness)
        return Materials(changed, silicone)


class Body(eqx.Module):
    """Segments with numbers.

    Attributes:
        segments: one or several.
        chain: the chain of the segments; None for a single segment.
        effects: effects beyond the base model, of a single segment.
        gravity: acceleration of gravity in the base frame [m/s2], which effects feel; None without effects.
    """

    segments: tuple[pj.Actuator, ...]
    chain: pj.SegmentChain | None
    effects: tuple[Effect, ...] = ()
    gravity: Array | None = None


class Solved(eqx.Module):
    """A body in equilibrium, as functions of users get it.

    Attributes:
        body: the body that was solved.
        pressure: gauge [Pa].
        segments: the equilibrium of each segment.
        end_pose: frame of the tip in the frame of the base, shape (4, 4) [m].
        chain: the equilibrium of the whole chain, or None.
    """

    body: Body
    pressure: Array
    segments: tuple[pj.Equilibrium, ...]
    end_pose: Float[Array, "4 4"]
    chain: pj.ChainEquilibrium | None

    @property
    def only(self) -> pj.Equilibrium:
        """The first segment."""
        return self.segments[0]

    @property
    def parts(self) -> tuple:
        """All but the body: of many states, what has a leading axis of rows."""
        return self.pressure, self.segments, self.end_pose, self.chain


def sizes_of(parameters: Mapping[str, Array], k: int) -> dict[str, Array]:
    """Dimensions of a segment, from 1: those of all, and its own; other parameters are left out."""
    of_all = {name: x for name, x in parameters.items() if name in GEOMETRY_KEYS or name in SECTION_KEYS}
    return of_all | {n.partition(".")[2]: x for n, x in parameters.items() if n.startswith(f"{k}.")}


def build_body(
    plan: Plan,
    parameters: Mapping[str, Array],
    materials: tuple[Materials, ...],
    added: Mapping[str, Array] = MappingProxyType({}),
) -> Body:
    """A body of given dimensions; differentiable in them and in the materials.

    Args:
        plan: tables.
        parameters: values by name [SI]: a dimension of all segments, `2.wall_thickness` of one, `connector`.
            Other names are ignored.
        materials: materials of each segment.
        added: deviations of dimensions from those of the parameters and tables [SI], by name.

    Raises:
        ValueError: for impossible dimensions, if their numbers are known.
    """
    segments = []
    for k, (table, own) in enumerate(zip(plan.tables, materials, strict=True), 1):
        sizes = sizes_of(parameters, k)
        nominal = table.values()
        sizes |= {
            n: sizes.get(n, nominal[n]) + more for n, more in added.items() if n in sizes or n in nominal
        }
        segments.append(pj.make_actuator(table, own.alloy, own.silicone, **sizes))
    if plan.chain is None:
        gravity = jnp.asarray(design_gravity(plan.tables[0])) if plan.effects else None
        return Body(tuple(segments), None, plan.effects, gravity)
    chain = _chain(plan, segments)
    if "connector" in parameters:
        gaps = jnp.broadcast_to(jnp.asarray(parameters["connector"], float), jnp.shape(chain.connectors))
        chain = dataclasses.replace(chain, connectors=gaps)
    return Body(tuple(chain.segments), chain)


def _chain(plan: Plan, segments: list[pj.Actuator]) -> pj.SegmentChain:
    """The chain of segments that are built already, with the loads of its design.

    Under loads, all segments of one design are alike; the reader of studies sees to it.
    """
    first = dict(zip(reversed(plan.chain.designs), reversed(segments), strict=True))
    densities = {d: material_of(plan, k).values().get("density") for k, d in enumerate(plan.chain.designs)}
    chain = make_chain(plan.chain, first.__getitem__, densities.get)
    return chain if chain.loaded else dataclasses.replace(chain, segments=tuple(segments))


def by_segment(body: Body, fractions: Array) -> list[tuple[pj.MartensiteFraction, ...]]:
    """Martensite fractions of the springs of every segment; `fractions` has shape (springs,)."""
    drives, at = [], 0
    for segment in body.segments:
        count = len(segment.springs)
        drives.append(tuple(pj.MartensiteFraction(fractions[at + i]) for i in range(count)))
        at += count
    return drives


def solve_body(body: Body, pressure: Array, fractions: Array) -> Solved:
    """Equilibrium under a state; NaN where there is none. Effects act as at the start of a recording.

    Args:
        body: the body that is loaded.
        pressure: gauge [Pa].
        fractions: martensite fraction of every spring, segment by segment, shape (springs,).
    """
    drives = by_segment(body, fractions)
    if body.chain is None:
        found = (_at_rest if body.effects else _without_effects)(body, pressure, drives[0])
        return Solved(body, pressure, (found,), arc_frame(found.bend, found.length), None)
    whole = pj.solve_chain(body.chain, pressure, drives, throw=False)
    return Solved(body, pressure, whole.segments, whole.end_pose, whole)


def _without_effects(body: Body, pressure: Array, drives: tuple) -> pj.Equilibrium:
    return pj.solve(body.segments[0], pressure, drives, throw=False)


def _at_rest(body: Body, pressure: Array, drives: tuple) -> pj.Equilibrium:
    return solve_at_rest(
        body.segments[0], pressure, drives, effects=body.effects, gravity=body.gravity
    ).found


@stored_jit(pj.Equilibrium, Validity, SpringResponse, ChainEquilibrium, ChainShape)
def solve_states(body: Body, pressure: Array, fractions: Array) -> tuple:
    """Parts of many states of a body, see `Solved.parts`, each with a leading axis of rows."""
    return jax.vmap(lambda p, x: solve_body(body, p, x).parts)(pressure, fractions)


def material_of(plan: Plan, k: int) -> Calibration:
    """Table of the silicone of a segment, from 0."""
    return silicone_of(plan, plan.tables[k])
