"""An actuator whose numbers may vary: constants of the alloy and the silicone, dimensions, effects."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.specimens.model_objects import geometry_of, gravity_of, law_of, material_of, named_table
from fitting.specimens.saved_models import AddedEffect, AugmentedModel
from pneusma_jax.actuator.designs import GEOMETRY_KEYS, design_loads
from pneusma_jax.calibration import Calibration, load_calibration
from pneusma_jax.calibration.keys import KINDS, QUANTITIES
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.errors import InputError
from pneusma_jax.nitinol import Alloy

from .response import Variable

FACTOR = "silicone_stiffness"
SIZES = ("width", "height")
TIED = {
    "free_length": (
        ("active_coils", "initial_pitch"),
        "the free length of a spring follows its coils and pitch",
    ),
    "attached_length": (("length",), "the attached length of the springs follows the length of the tube"),
}
"""Dimensions that follow others unless a study names them: what they follow, and the sentence."""


@dataclass(frozen=True)
class Body:
    """An actuator as a pure function of numbers.

    Attributes:
        tables: tables by kind, with the model's numbers in them; no alloy if there are no springs.
        geometry: nominal dimensions.
        law: name of the silicone's law, or None for the table's own.
        added: effects of the model, each with the names of its parameters in a study.
        gravity: its acceleration for effects [m/s2].
        numbers: everything that may vary, by name.
    """

    tables: Mapping[str, Calibration]
    geometry: pj.Geometry
    law: str | None
    added: tuple[tuple[AddedEffect, Mapping[str, str]], ...]
    gravity: tuple[float, float, float]
    numbers: Mapping[str, Variable]

    @property
    def layout(self) -> pj.Layout:
        """Places of springs and fibre."""
        return pj.layout(self.tables["actuator"])

    def build(self, values: Mapping[str, Array]) -> pj.Actuator:
        """The actuator; differentiable in the values.

        Args:
            values: SI, by names of `numbers`; the rest is nominal.
        """
        alloy, silicone = (self._table(kind, values) for kind in ("alloy", "silicone"))
        sizes = {key: values[key] for key in (*GEOMETRY_KEYS, *SIZES) if key in values}
        law = pj.load_silicone(silicone) if self.law is None else pj.load_silicone(silicone, self.law)
        body = pj.make_actuator(
            self.tables["actuator"],
            None if alloy is None else Alloy.from_calibration(alloy),
            law,
            self.geometry,
            **sizes,
        )
        loads = design_loads(self.tables["actuator"], body, silicone.values().get("density"))
        return body.with_loads(*loads)

    def silicone(self, values: Mapping[str, Array]) -> Calibration:
        """Table of the wall's silicone with values of some of its numbers."""
        return self._table("silicone", values)

    def effects(self, values: Mapping[str, Array]) -> tuple[pj.pipeline.Effect, ...]:
        """The model's effects."""
        return tuple(
            added.build({key: values[name] for key, name in names.items() if name in values})
            for added, names in self.added
        )

    def _table(self, kind: str, values: Mapping[str, Array]) -> Calibration | None:
        if kind not in self.tables:
            return None
        table = self.tables[kind]
        own = {}
        for name in self.numbers:
            stem = name.rpartition(".")[2]
            if name in values and self.numbers[name].table == kind:
                old = table.quantities.get(stem, Quantity(stem, 1.0, "1", "assumed", "no factor"))
                own[stem] = dataclasses.replace(old, value=values[name])
        return dataclasses.replace(table, quantities={**table.quantities, **own})


def body_of(specimen: Recording, model: AugmentedModel) -> tuple[Body, tuple[Path, ...]]:
    """The actuator that a specimen is, and the files that say so.

    Raises:
        InputError: if it cannot be built.
    """
    design = load_calibration(specimen.full_geometry()["design"], "actuator")
    design = dataclasses.replace(
        design, quantities={**design.quantities, **model.quantities("actuator", specimen.specimen)}
    )
    tables = {"silicone": material_of(specimen, model), "actuator": design}
    if pj.layout(design).spring_numbers:
        tables["alloy"] = model.table("alloy", named_table(specimen, "alloy"), specimen.specimen)
    geometry, stated = geometry_of(specimen, model), specimen.geometry.get("law")
    own = stated is None or (stated == "polynomial" and tables["silicone"].text["law"] == "regularised")
    law_of(specimen, model)  # says what is wrong with the law, if anything is
    numbers = _numbers(tables, geometry)
    added = []
    for effect in model.added:
        if not isinstance(effect, AddedEffect):
            raise InputError(
                f"{model.path}: what is left unmodelled cannot be propagated; take the effects only"
            )
        names = {key: f"{effect.slug}_{key}" for key in effect.parameters}
        if any(name in numbers for name in names.values()):
            raise InputError(f"{model.path}: the effect {effect.slug} is there twice; a study takes it once")
        added.append((effect, names))
        own_numbers = {k: Variable(q.value, q.unit, q.prior, "effect") for k, q in effect.parameters.items()}
        numbers |= {names[k]: variable for k, variable in own_numbers.items()}
    body = Body(tables, geometry, None if own else stated, tuple(added), tuple(gravity_of(specimen)), numbers)
    try:
        body.build({})
    except ValueError as error:
        raise InputError(f"{design.path}: {error}") from None
    files = [table.path for table in tables.values()] + [model.path]
    return body, tuple(path for path in files if path is not None and Path(path).exists())


def _numbers(tables: Mapping[str, Calibration], geometry: pj.Geometry) -> dict[str, Variable]:
    """Everything that may vary, by name; of equal names in two tables both have their table before them."""
    alloy = {field.name for field in dataclasses.fields(Alloy) if field.name != "name"}
    found: dict[str, dict[str, Variable]] = {}
    for kind, table in tables.items():
        for name, quantity in table.quantities.items():
            varies = {
                "alloy": name in alloy, "silicone": name in QUANTITIES["silicone"],
                "actuator": name in (*GEOMETRY_KEYS, *SIZES),
            }[kind]  # fmt: skip
            if varies:
                value = float(getattr(geometry, name)) if name in GEOMETRY_KEYS else quantity.value
                found.setdefault(name, {})[kind] = Variable(value, quantity.unit, quantity.prior, kind)
    found.setdefault(FACTOR, {}).setdefault("silicone", Variable(1.0, "1", None, "silicone"))
    return {
        name if len(kinds) == 1 else f"{kind}.{name}": known
        for name, kinds in found.items()
        for kind, known in sorted(kinds.items(), key=lambda entry: KINDS.index(entry[0]))
    }


def tied(numbers: Mapping[str, Variable]) -> dict[str, str]:
    """Dimensions that follow others, with the sentence that says so."""
    return {
        name: sentence
        for name, (followed, sentence) in TIED.items()
        if name in numbers and all(other in numbers for other in followed)
    }
