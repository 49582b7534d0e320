"""One state of a chain of segments: each segment's own state, and the shape of the chain."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import equinox as eqx
import jax
import numpy as np

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.specimens.model_objects import BASE, actuator_of, material_of
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without
from pneusma_jax.errors import counted
from pneusma_jax.serial_chain.designs import ChainDesign, make_chain
from pneusma_jax.units import from_si

from .state import ActuatorState, described_actuator, described_state, drive_of, refuse_unknown_springs


@dataclass
class ChainState:
    """A solved chain. What is shown of it has the names of `ActuatorState`.

    Attributes:
        design: content of its file.
        chain: solved chain.
        segments: segments from base to tip.
        found: equilibrium; its shape is NaN beyond a segment that has none.
        numbers: none; each segment has the numbers of its own springs.
    """

    numbers: ClassVar[tuple[()]] = ()

    design: ChainDesign
    chain: pj.SegmentChain
    segments: list[ActuatorState]
    found: pj.ChainEquilibrium

    @property
    def title(self) -> str:
        """Name of the design and number of segments."""
        return f"{self.design.name}, {counted(len(self.segments), 'segment')}"

    @property
    def status(self) -> str:
        """Name of the outcome: that of the segment that best explains a missing result, if any."""
        return pj.Status(int(self.found.status)).name

    @property
    def converged(self) -> bool:
        """True if every segment has a result."""
        return all(segment.converged for segment in self.segments)

    @property
    def sentence(self) -> str:
        """The outcome in words."""
        for number, segment in enumerate(self.segments, 1):
            if not segment.converged and segment.status == self.status:
                alone = not self.chain.loaded or self.status != pj.Status.no_equilibrium.name
                return (
                    f"segment {number}: {segment.sentence}"
                    if alone
                    else f"under its loads: {segment.sentence}"
                )
        return pj.Status.converged.sentence

    @property
    def stable(self) -> bool:
        """True if the equilibrium is stable; None without loads, for which it is not examined."""
        return self.found.stable is None or bool(self.found.stable)

    @property
    def tip(self) -> np.ndarray:
        """Position of the tip in the frame of the base [mm], shape (3,)."""
        return from_si(np.asarray(self.found.end_pose)[:3, 3], "mm")

    @property
    def clearance(self) -> float:
        """The smallest clearance of the chain [mm]; negative where parts would overlap."""
        return float(from_si(np.asarray(self.found.shape.clearance().smallest), "mm"))

    @property
    def notices(self) -> list[str]:
        """Warnings, with the segments that they concern."""
        whose: dict[str, list[int]] = {}
        for number, segment in enumerate(self.segments, 1):
            for sentence in segment.notices:
                whose.setdefault(sentence, []).append(number)
        named = {s: "all segments" if len(k) == len(self.segments) else _listed(k) for s, k in whose.items()}
        sentences = [f"{where}: {sentence}" for sentence, where in named.items()]
        if self.converged and not self.stable:
            sentences.append(
                "the chain would not stay in this equilibrium: a small push lets it buckle into another"
            )
        if self.converged and self.clearance < 0.0:
            bend = np.rad2deg(self.found.shape.total_bend)
            sentences.append(
                f"bent by {bend:.3g} degrees in all, so that parts of the chain overlap by "
                f"{-self.clearance:.3g} mm: contact is not modelled"
            )
        return sentences

    def quantities(self) -> list[tuple[str, float, str]]:
        """Name, value and unit of the tip's coordinates and the clearance; none without an equilibrium."""
        if not self.converged:
            return []
        tip = [(f"tip {axis}", float(x), "mm") for axis, x in zip("xyz", self.tip, strict=True)]
        return [*tip, ("clearance", self.clearance, "mm")]

    def spring_rows(self) -> list[list[str]]:
        """No table of springs: each segment has its own."""
        return []

    def as_chain(self) -> tuple[pj.SegmentChain, pj.ChainEquilibrium]:
        """The chain and its equilibrium."""
        return self.chain, self.found

    def contract(self) -> dict[str, Any]:
        """The object of `simulate --json` for a chain; null for missing values."""
        pose = np.asarray(self.found.end_pose)
        solved = bool(np.all(np.isfinite(pose)))
        return {
            "status": self.status,
            "tip_mm": self.tip.tolist() if solved else None,
            "tip_axes": pose[:3, :3].tolist() if solved else None,
            "clearance_mm": self.clearance if solved else None,
            "stable": self.stable if solved and self.chain.loaded else None,
            "segments": [segment.contract() for segment in self.segments],
        }


def _listed(numbers: Sequence[int]) -> str:
    word = "segment" if len(numbers) == 1 else "segments"
    return f"{word} {', '.join(map(str, numbers))}"


def chain_specimens(design: ChainDesign, overrides: Mapping[str, Any]) -> dict[str, Recording]:
    """Each design of a chain as the geometry of a recording, by its name or path.

    Args:
        design: chain from its file.
        overrides: keys of `[geometry]` that hold for all segments, such as `alloy`.

    Raises:
        InputError: for impossible input.
    """
    names = dict.fromkeys(design.designs)
    return {name: described_actuator(None, {**overrides, "design": name}) for name in names}


def build_chain(
    design: ChainDesign, specimens: Mapping[str, Recording], model: AugmentedModel = BASE
) -> pj.SegmentChain:
    """The chain of a design with a model's constants.

    Raises:
        InputError: if it cannot be built.
    """
    return make_chain(
        design,
        lambda name: actuator_of(specimens[name], model),
        lambda name: material_of(specimens[name], model).values().get("density"),
    )


@functools.partial(eqx.filter_jit, compiler_options={"xla_backend_optimization_level": 0})
def _solve_once(
    chain: pj.SegmentChain, pressure: Any, activations: tuple, states: tuple
) -> pj.ChainEquilibrium:
    """One state. Solving takes milliseconds without compiler optimisation, which would take seconds."""
    return pj.solve_chain(chain, pressure, activations, states, throw=False)


def chain_state(
    design: ChainDesign,
    overrides: Mapping[str, Any],
    pressure: float,
    given: Sequence[Mapping[str, float]],
    model: AugmentedModel = BASE,
) -> ChainState:
    """Solve one state of a chain.

    Args:
        design: chain from its file.
        overrides: keys of `[geometry]` that hold for all segments.
        pressure: gauge pressure in all segments [Pa].
        given: input of each segment, as `drive_of` takes it.
        model: model with constants of its own.

    Raises:
        InputError: for impossible input, or a model with effects that change a chain.
    """
    without = chain_without(model)
    specimens = chain_specimens(design, overrides)
    chain = build_chain(design, specimens, model)
    refuse_unknown_springs(given, [body.spring_numbers for body in chain.segments], design.name)
    drives = [
        drive_of(specimens[name], body, said, model)
        for name, body, said in zip(design.designs, chain.segments, given, strict=True)
    ]
    for drive in drives:
        drive.notices += without
    solved = _solve_once(
        chain,
        np.asarray(pressure),
        tuple(drive.activations for drive in drives),
        tuple(drive.states for drive in drives),
    )
    rows = zip(design.designs, chain.segments, jax.tree.map(np.asarray, solved.segments), drives, strict=True)
    segments = [described_state(specimens[name], body, found, drive) for name, body, found, drive in rows]
    return ChainState(design, chain, segments, solved)
