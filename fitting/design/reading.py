"""Studies as TOML.

    schema = "pneusma-study/1"
    name = "wider"
    design = "pneusma2"                # a table or chain; several to choose among: ["pneusma1", "pneusma2"]

    [free]
    wall_thickness = {made = "continuous", from = 0.6, to = 1.6, unit = "mm"}
    wire_diameter = {made = "catalogue", values = [0.15, 0.2, 0.25], unit = "mm"}
    active_coils = {made = "integer", from = 40, to = 70}

    [state.hot]
    pressure = {value = 30, unit = "kPa"}
    xi0_2 = 0.3

    [objective.area]
    quantity = "workspace_area"
    goal = "maximise"
    pressure = {from = 0, to = 50, unit = "kPa"}
    xi0_min = 0.3

    [constraint.shear]
    quantity = "shear_strain"
    at_most = "tested"

docs/design.md has every key.
"""

import dataclasses
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel, load_model
from pneusma_jax.calibration import load_calibration, named_table
from pneusma_jax.documents import read_document, shipped_names
from pneusma_jax.errors import InputError, nearest

from . import fields
from .bodies import Plan, plan_of, without_effect
from .buildable import check_ends, implied
from .free import read_free
from .functions import load_function
from .posterior_file import posterior_draws
from .space import Space
from .states import read_states
from .study import Study
from .uncertain import Sampler, sampler_of
from .unknown import read_uncertainty
from .useless import check_alloy, check_tolerances
from .wanted import read_constraints, read_objectives

SCHEMA = "pneusma-study/1"
TOP = (
    "schema", "name", "description", "design", "alloy", "material", "free", "state", "objective",
    "constraint", "uncertainty", "starts", "seed", "front_points", "optimiser", "model",
)  # fmt: skip
OPTIMISERS = ("slsqp", "trust-constr")
_EXAMPLES = resources.files("calibration_data").joinpath("examples", "design_studies")
MOST_CHOICES = 64
"""Maximum of combinations of designs, alloys and silicones: each is a search of its own."""


def study_examples() -> list[str]:
    """Names of the studies that come with the package, sorted; to be read by name and copied."""
    return shipped_names(_EXAMPLES)


def read_study(path: str | Path) -> Study:
    """Read and check a study.

    Args:
        path: path of the TOML file, or the name of a shipped one. Tables, functions and posteriors are
            searched from its folder.

    Raises:
        InputError: one line with file, key and remedy, for anything unknown, missing, contradictory or
            impossible.
    """
    if str(path) in study_examples():
        path = Path(str(_EXAMPLES.joinpath(f"{path}.toml")))
    elif not str(path).endswith(".toml"):
        raise InputError(f"there is no study {str(path)!r}, {nearest(str(path), study_examples())}")
    path = Path(path)
    return _study(read_document(path, path, "a study", SCHEMA, TOP), path)


def _study(document: dict[str, Any], path: Path) -> Study:
    model = _model(document, path)
    if "design" not in document and "design" not in model.tables:
        raise InputError(f"{path}: key 'design' is missing: which actuator or chain is to be improved?")
    designs, alloys, materials = (
        _tables(document, key, path, model) for key in ("design", "alloy", "material")
    )
    if len(designs) * len(alloys) * len(materials) > MOST_CHOICES:
        raise InputError(f"{path}: more than {MOST_CHOICES} combinations of design, alloy and material")
    for design in designs:
        _known("design", lambda design=design: plan_of(design), path)
        for table in plan_of(design).tables:  # an error in a design's own file is none of the study's
            for key in (k for k, chosen in (("alloy", alloys), ("material", materials)) if not all(chosen)):
                named_table(table, key)
    for key, kind, names in (("alloy", "alloy", alloys), ("material", "silicone", materials)):
        for name in filter(None, names):
            _known(key, lambda name=name, kind=kind: load_calibration(name, kind), path)
    try:
        plans = [plan_of(d, a, m, model) for d in designs for a in alloys for m in materials]
        for plan in plans:
            plan.materials()
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    states, driven = read_states(document.get("state", {}), plans, str(path))
    free = (*read_free(document.get("free", {}), plans, str(path)), *driven)
    if not free:
        raise InputError(f"{path}: nothing is free: name at least one parameter in [free]")
    objectives = read_objectives(document.get("objective", {}), states, plans, path)
    constraints = read_constraints(document.get("constraint", {}), states, plans, path)
    if not states and all(o.sweep is None for o in objectives):
        raise InputError(f"{path}: there is no state to solve: add a [state.NAME], or a workspace_area")
    uncertainty = None
    if "uncertainty" in document:
        uncertainty = read_uncertainty(document["uncertainty"], plans, path)
        check_tolerances(uncertainty, free, plans, path)
    check_alloy(document, uncertainty.priors if uncertainty else (), plans, path)
    study = Study(
        name=_name(document, path),
        path=path,
        designs=designs,
        alloys=alloys,
        materials=materials,
        free=free,
        states=states,
        objectives=objectives,
        constraints=constraints,
        uncertainty=uncertainty,
        starts=fields.whole(document, "starts", 8, 1, 256, str(path)),
        seed=fields.whole(document, "seed", 0, 0, 2**31 - 1, str(path)),
        points=fields.whole(document, "front_points", 9, 2, 50, str(path)),
        optimiser=fields.word(document, "optimiser", OPTIMISERS, str(path), "slsqp"),
        model=model,
    )
    _check_effects(study, plans)
    space = _check_whole(study, plans, [one.name for one in driven])
    return dataclasses.replace(study, constraints=(*constraints, *implied(space, plans)))


def _name(document: dict[str, Any], path: Path) -> str:
    name = document.get("name", path.stem)
    if not isinstance(name, str) or not name.strip() or not name.isprintable():
        raise InputError(f"{path}: name must be a text of one line, but it is {name!r}")
    return name


def _model(document: dict[str, Any], path: Path) -> AugmentedModel:
    """The model that a study names; its path counts from the study's folder."""
    if "model" not in document:
        return BASE
    named = document["model"]
    if not isinstance(named, str):
        raise InputError(f"{path}: model must be the path of a model's TOML file, but it is {named!r}")
    return load_model(path.parent / named)


def _check_effects(study: Study, plans: Sequence[Plan]) -> None:
    """Refuse effects where they would not act."""
    if not study.model.added:
        return
    for why in filter(None, map(without_effect, plans)):
        raise InputError(f"{study.path}: model: {why}")


def _known(key: str, load: Callable[[], object], path: Path) -> None:
    """Load a table that a key of the study names, so that an error says which key."""
    try:
        load()
    except InputError as error:
        raise InputError(f"{path}: {key}: {error}") from None


def _tables(document: dict[str, Any], key: str, path: Path, model: AugmentedModel) -> tuple:
    """Tables to choose among, by default the model's; a path counts from the study's folder."""
    if key not in document:
        return (model.tables.get(key),)
    names = fields.names_of(document[key], f"{path}: {key}")
    return tuple(str((path.parent / n).resolve()) if n.endswith(".toml") else n for n in names)


def _check_whole(study: Study, plans: Sequence[Plan], drives: Sequence[str]) -> Space:
    """Checks of the whole study, once everything is read; `drives` are parameters that are no dimensions."""
    try:
        space = Space(study.free)
    except InputError as error:
        raise InputError(f"{study.path}: {error}") from None
    failing = [o for o in study.objectives if o.quantity == "failure_probability"]
    if failing and (study.uncertainty is None or not study.constraints):
        raise InputError(
            f"{study.path}: objective {failing[0].name!r}: a probability of failure needs "
            "[uncertainty] and constraints"
        )
    if failing and len(study.objectives) == len(failing):
        raise InputError(
            f"{study.path}: a probability of failure alone is no study: add what is wanted of the design"
        )
    if failing and study.objectives[0] is failing[0]:
        raise InputError(f"{study.path}: objective {failing[0].name!r} must not be the first one")
    for one in (*study.objectives, *study.constraints):
        if one.file is not None:
            load_function(one.file, one.function)
    if study.uncertainty is not None:
        for plan in plans:
            _check_uncertain(study, plan)
    _check_box(study, space)
    check_ends(space, drives, plans, str(study.path))
    return space


def _check_uncertain(study: Study, plan: Plan) -> None:
    materials, sampler = plan.materials()[0], sampler_of(study, plan)
    _check_fresh(study, sampler)
    if not sampler.names:
        raise InputError(f"{study.path}: [uncertainty] names nothing that is uncertain")
    if "silicone_stiffness" in sampler.names and not hasattr(materials.silicone, "stiffness"):
        raise InputError(
            f"{study.path}: [uncertainty]: `silicone_stiffness` needs a silicone with the law 'regularised'"
        )


def _check_fresh(study: Study, sampler: Sampler) -> None:
    """The posterior of the fresh draws must be of the same parameters, and another run."""
    given = study.uncertainty
    if given.fresh_posterior is None:
        return
    where = f"{study.path}: [uncertainty] fresh_posterior"
    fresh, _ = posterior_draws(given.fresh_posterior, given.specimen)
    if set(fresh) != set(sampler.posterior):
        raise InputError(
            f"{where} is of {', '.join(sorted(fresh))}, but posterior is of "
            f"{', '.join(sorted(sampler.posterior))}"
        )
    if all(np.array_equal(fresh[name], sampler.posterior[name]) for name in fresh):
        raise InputError(f"{where} has the very draws of posterior: run the sampler again with another seed")


def _check_box(study: Study, space: Space) -> None:
    """Bounds that depend on others must not cross anywhere at the corners of the box."""
    linked = [f for f in study.free if f.low.parameter or f.high.parameter]
    for one in linked:
        for end in (0.0, 1.0):
            place = [end] * len(space)
            low, high = (space.parameters(_moved(space, place, one.name, x))[one.name] for x in (0.0, 1.0))
            if not low < high:
                raise InputError(
                    f"{study.path}: [free] {one.name}: bounds are crossed where other parameters are "
                    "at an end of "
                    "their range"
                )


def _moved(space: Space, place: list[float], name: str, value: float) -> list[float]:
    return [value if n == name else x for n, x in zip(space.names, place, strict=True)]
