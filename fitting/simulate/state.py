"""One state of an actuator, from dimensions, pressure and the state of the springs."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import jax
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording, check_recording, resistance_range, schema, sidecar
from fitting.inference.notes import joined
from fitting.specimens.cautions import actuator_cautions, touching_angle
from fitting.specimens.model_objects import BASE, actuator_of, full_geometry, gravity_of, place
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import only_along_histories, shown_otherwise
from pneusma_jax.nitinol import SpringResponse
from pneusma_jax.program_cache import cached_program
from pneusma_jax.serial_chain.segments import chain_shape
from pneusma_jax.simulate.rest import solve_at_rest
from pneusma_jax.units import from_si

from .unmodelled import marked


def read_geometry(path: str | Path) -> dict[str, Any]:
    """The `[geometry]` table of a TOML file. A file that has nothing but its keys is one, too.

    Returns:
        Numbers by canonical key, in the units of the keys.

    Raises:
        InputError: if the file cannot be read, or has a wrong key, unit or number.
    """
    path = Path(path)
    document = sidecar.read_toml(path)
    allowed = (*schema.SIDECAR_KEYS, *schema.CAMPAIGN_KEYS)
    if "geometry" not in document and not any(key in allowed for key in document):
        document = {"geometry": document}
    settings = sidecar.check_settings(document, path, allowed)
    if not settings.get("geometry"):
        raise pj.InputError(f"{path}: there is no [geometry] table with dimensions in it")
    return settings["geometry"]


def described_actuator(
    geometry: str | Path | None, overrides: Mapping[str, Any], where: str = sidecar.COMMAND_LINE
) -> Recording:
    """A checked recording that describes an actuator; see `described_specimen`."""
    return described_specimen("actuator", geometry, overrides, where)


def described_specimen(
    kind: str, geometry: str | Path | None, overrides: Mapping[str, Any], where: str = sidecar.COMMAND_LINE
) -> Recording:
    """A checked recording that describes a specimen.

    Args:
        kind: kind of recording.
        geometry: TOML file with dimensions, or None for the nominal ones.
        overrides: keys of `[geometry]` that take precedence.
        where: place of the overrides, for messages.

    Raises:
        InputError: for impossible input, naming the file or the place.
    """
    stated = {} if geometry is None else read_geometry(geometry)
    stated |= sidecar.check_settings({"geometry": dict(overrides)}, where, ("geometry",))["geometry"]
    specimen = Recording(
        name=where,
        path=None if geometry is None else Path(geometry),
        kind=kind,
        geometry=stated,
        columns={"time_s": np.zeros(1)},
    )
    check_recording(specimen)
    return specimen


@dataclass
class ActuatorState:
    """A solved state and its inputs.

    Attributes:
        title: names of design, alloy and silicone.
        actuator: solved actuator.
        found: equilibrium as NumPy arrays; NaN where there is none.
        given: origin of each spring's state: `"given"`, `"from resistance"` or `"cold"`.
        notices: warnings in words.
        seen: instrument readings of `curvature`, `bend_angle` and `length`, where effects change them.
        segments: none; a `ChainState`, which has the same properties, has some.
    """

    segments: ClassVar[tuple[()]] = ()
    title: str
    actuator: pj.Actuator
    found: pj.Equilibrium
    given: dict[int, str]
    notices: list[str]
    seen: dict[str, Any] = field(default_factory=dict)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the springs that the design has."""
        return self.actuator.spring_numbers

    @property
    def planar(self) -> bool:
        """True if it bends in one plane only."""
        return self.actuator.planar

    @property
    def status(self) -> str:
        """Name of the outcome."""
        return pj.Status(int(self.found.status)).name

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        return pj.Status(int(self.found.status)).sentence

    @property
    def converged(self) -> bool:
        """True if there is a result."""
        return int(self.found.status) <= pj.Status.several_equilibria

    def quantities(self) -> list[tuple[str, float, str]]:
        """Quantities that describe the configuration: key without unit, value, unit."""
        found = self.found
        sides = {1: found.delta_1, 2: found.delta_2}
        if not self.planar and self.numbers:  # springs, whose places are the sides
            sides = dict(zip(self.numbers, found.spring_elongations, strict=True))
        bend = found.bend_angle if self.planar else np.linalg.norm(found.bend)
        shown = {"length": found.length, "bend_angle": bend, "curvature": bend / found.length} | self.seen
        rows = [(f"delta_{k}", float(from_si(value, "mm")), "mm") for k, value in sides.items()]
        rows.append(("length", float(from_si(shown["length"], "mm")), "mm"))
        rows.append(("bend_angle", float(from_si(shown["bend_angle"], "deg")), "deg"))
        if not self.planar:
            rows.append(("bend_direction", float(from_si(found.bend_direction, "deg")) % 360.0, "deg"))
        rows.append(("curvature", float(shown["curvature"]), "1/m"))
        return rows

    def as_chain(self) -> tuple[pj.SegmentChain, pj.ChainEquilibrium]:
        """The actuator as a chain of one segment, and that chain's equilibrium."""
        chain = pj.chain_of(self.actuator.with_loads())
        shape = chain_shape(chain, self.found.bend[None], self.found.length[None])
        return chain, pj.ChainEquilibrium((self.found,), shape)

    def contract(self) -> dict[str, Any]:
        """The object of `simulate --json`; null for missing values."""
        result: dict[str, Any] = {"status": self.status}
        for name, value, unit in self.quantities():
            result[f"{name}_{unit.replace('1/m', '1pm')}"] = _or_none(value)
        forces = {n: float(r.force) for n, r in zip(self.numbers, self.found.springs, strict=True)}
        for number in sorted({1, 2, *self.numbers}):
            result[f"force_{number}_N"] = _or_none(forces.get(number, math.nan))
        return result

    def spring_rows(self) -> list[list[str]]:
        """A table of the springs: name of the quantity, then one value per spring."""
        if not self.numbers:
            return []
        springs = self.found.springs
        rows = [["how its phase is known", *(self.given[n] for n in self.numbers)]]
        for name, values in {
            "martensite fraction xi0 [1]": [r.xi0 for r in springs],
            "pull [N]": [r.force for r in springs],
            "shear strain of the wire [1]": [r.gamma for r in springs],
            "residual strain [1]": [r.gamma_R for r in springs],
            "shear stress of the wire [MPa]": [from_si(r.stress, "MPa") for r in springs],
            "resistance [ohm]": [r.resistance for r in springs],
        }.items():
            rows.append([name, *(f"{float(value):.5g}" for value in values)])
        return rows


def _or_none(value: float) -> float | None:
    return value if math.isfinite(value) else None


@dataclass
class Drive:
    """Drive of the springs of one actuator in one state.

    Attributes:
        activations, states: activation and memory of each spring.
        given: origin of each spring's state, for people.
        notices: warnings in words.
    """

    activations: tuple[Any, ...]
    states: tuple[pj.SpringState, ...]
    given: dict[int, str]
    notices: list[str]


def refuse_unknown_springs(
    given: Sequence[Mapping[str, float]], numbers: Sequence[tuple[int, ...]], design: str
) -> None:
    """Refuse inputs of springs that no body has for which they are given.

    Args:
        given: input of each body, as `drive_of` takes it.
        numbers: numbers of the springs of each body.
        design: name of the design or chain.

    Raises:
        InputError: naming the input and the springs that there are.
    """
    for name in dict.fromkeys(name for said in given for name in said):
        number = int(name.rpartition("_")[2])
        asked = [own for said, own in zip(given, numbers, strict=True) if name in said]
        if not any(number in own for own in asked):
            there = ", ".join(map(str, sorted({k for own in asked for k in own}))) or "none"
            raise pj.InputError(
                f"{name} cannot be used: {design} has no spring {number} (it has: {there})"
            )


def drive_of(
    specimen: Recording, actuator: pj.Actuator, given: Mapping[str, float], model: AugmentedModel = BASE
) -> Drive:
    """Activations and memories of a specimen's springs.

    Args:
        specimen: recording from `described_actuator`.
        actuator: actuator built from it.
        given: `xi0_K` [1] or `resistance_K` [ohm] for spring K; other springs are cold.
        model: model with constants of its own.

    Raises:
        InputError: for a resistance that the alloy cannot show.
    """
    _check_resistances(specimen, given)
    notices, activations, known = [*specimen.notices], [], {}
    for name in given:
        number = int(name.rpartition("_")[2])
        if number not in actuator.spring_numbers:
            available = ", ".join(map(str, actuator.spring_numbers)) or "none"
            design = _word(specimen, "design")
            notices.append(f"{design} has no spring {number} (it has: {available}); {name} is left out")
    for number in actuator.spring_numbers:
        if f"resistance_{number}" in given:
            activations.append(pj.Resistance(given[f"resistance_{number}"]))
        else:
            activations.append(pj.MartensiteFraction(given.get(f"xi0_{number}", 1.0)))
        words = {f"resistance_{number}": "from resistance", f"xi0_{number}": "given"}
        known[number] = next((words[key] for key in words if key in given), "cold")
    prestrain = full_geometry(specimen, model)["prestrain"] if actuator.springs else 0.0
    states = tuple(pj.SpringState.fresh(prestrain) for _ in actuator.springs)
    return Drive(tuple(activations), states, known, notices)


def actuator_state(
    specimen: Recording, pressure: float, given: Mapping[str, float], model: AugmentedModel = BASE
) -> ActuatorState:
    """Solve one state.

    Args:
        specimen: recording from `described_actuator`.
        pressure: gauge pressure [Pa].
        given: spring inputs as for `drive_of`.
        model: model in place of the base model; its effects act as at the start of a recording.

    Raises:
        InputError: for a resistance that the alloy cannot show, a spring that the design lacks, or impossible
            dimensions.
    """
    actuator = actuator_of(specimen, model)
    refuse_unknown_springs([given], [actuator.spring_numbers], _word(specimen, "design"))
    drive = drive_of(specimen, actuator, given, model)
    if not model.added:
        found = _solved(actuator, np.asarray(pressure), drive.activations, drive.states)
        return described_state(specimen, actuator, found, drive)
    rest = solve_at_rest(
        actuator, np.asarray(pressure), drive.activations, drive.states,
        effects=model.effects, gravity=gravity_of(specimen),
    )  # fmt: skip
    found, seen = jax.tree.map(np.asarray, (rest.found, rest.seen))
    bent = () if actuator.planar else ("curvature", "bend_angle")
    drive.notices += marked(model, seen, "actuator", bent)[1] + only_along_histories(model)
    if readers := shown_otherwise(model):
        drive.notices.append(f"by {joined(readers)} this shape is what instruments show, not the true one")
    if not actuator.planar:  # instruments read the plane of sides 1 and 2; free bending has a magnitude
        seen = {"length": seen["length"]}
    return described_state(specimen, actuator, found, drive, seen, model)


def _solved(actuator: pj.Actuator, pressure: Any, activations: tuple, states: tuple) -> pj.Equilibrium:
    """One state, as NumPy arrays: JAX would compile every small conversion that follows."""
    leaves = _solve_once(actuator, pressure, activations, states)
    response = SpringResponse(**dict.fromkeys(_names(SpringResponse), 0.0))
    apart = ("springs", "validity", "side_direction")
    others = {name: 0.0 for name in _names(pj.Equilibrium) if name not in apart}
    like = pj.Equilibrium(
        **others, springs=(response,) * len(actuator.springs), validity=pj.Validity(0.0, 0.0, 0.0, 0.0),
        side_direction=tuple(float(x) for x in actuator.side_direction),
    )  # fmt: skip
    return jax.tree.unflatten(jax.tree.structure(like), [np.asarray(leaf) for leaf in leaves])


def _names(module: type) -> list[str]:
    return [field.name for field in dataclasses.fields(module)]


def _leaves(actuator: pj.Actuator, pressure: Any, activations: tuple, states: tuple) -> list[Any]:
    """Arrays of the equilibrium, in the order of its fields."""
    return jax.tree.leaves(pj.solve(actuator, pressure, activations, states, throw=False))


_solve_once = cached_program(_leaves, "one state of an actuator", {"xla_backend_optimization_level": 0})
"""Solving takes milliseconds without compiler optimisation, which would take seconds."""


def described_state(
    specimen: Recording,
    actuator: pj.Actuator,
    found: pj.Equilibrium,
    drive: Drive,
    seen: dict[str, Any] | None = None,
    model: AugmentedModel | None = None,
) -> ActuatorState:
    """A solved state with its texts.

    Args:
        specimen, actuator, drive: specimen, actuator and drive that were solved.
        found: equilibrium as NumPy arrays.
        seen: instrument readings, see `ActuatorState`.
        model: model that was solved; the base model if None.
    """
    limit = touching_angle(specimen.full_geometry(), model)
    notices = drive.notices + actuator_cautions(actuator, found, limit)
    parts = ("design", "alloy", "material") if actuator.springs else ("design", "material")
    title = ", ".join(_word(specimen, key) for key in parts)
    return ActuatorState(title, actuator, found, drive.given, notices, seen or {})


def _word(specimen: Recording, key: str) -> str:
    """Name of a table without its folder."""
    return Path(str(specimen.full_geometry()[key])).name.removesuffix(".toml")


def _check_resistances(specimen: Recording, given: Mapping[str, float]) -> None:
    bounds = resistance_range(specimen)
    for name, value in given.items():
        if bounds and name.startswith("resistance") and not bounds[0] <= value <= bounds[1]:
            geometry, option = specimen.full_geometry(), f"--{name.replace('_', '-')}-ohm"
            raise pj.InputError(
                f"{place(specimen)}: {option} {value:g} cannot be: half to twice the range of alloy"
                f" {geometry['alloy']!r} on a spring of {geometry['active_coils']:g} coils is"
                f" {bounds[0]:.3g} to {bounds[1]:.3g} ohm"
            )
