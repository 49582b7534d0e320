"""The response that a study's `[model]` describes."""

import functools
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from fitting.data.protocols.reading import load_protocol, protocol_examples
from fitting.data.recordings import Recording, read_campaign, schema
from fitting.simulate.state import described_actuator
from fitting.specimens.model_objects import BASE
from fitting.specimens.saved_models import AugmentedModel, load_model
from pneusma_jax.calibration import examples
from pneusma_jax.documents import word_of
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.serial_chain.chain_files import describes_chain
from pneusma_jax.serial_chain.designs import load_chain

from .responses import Response
from .responses.chain import chain_response
from .responses.closed_loop import loop_response
from .responses.course import POINTS, protocol_response, recording_response
from .responses.drives import MOST_POINTS, channel_of
from .responses.expression import expression_response
from .responses.noise import NoiseFor, noise_of
from .responses.state import state_response, workspace_response
from .study import Study

TABLES = ("design", "alloy", "material")
"""Keys of `[model]` that name a table of constants."""
SPECIMEN = (*TABLES, "geometry", "model")
KEYS = {
    "state": SPECIMEN,
    "workspace": SPECIMEN,
    "protocol": (*SPECIMEN, "protocol", "points"),
    "recording": ("recording", "model", "alloy", "material", "points"),
    "chain": ("design", "alloy", "material", "model"),
    "closed_loop": (*SPECIMEN, "points", "level_1pm", "swing_1pm", "controller"),
    "expression": ("outputs",),
}
"""Keys of `[model]` beside `through`, and beside channels such as `pressure_kPa`."""
DRIVEN = ("state", "workspace", "chain", "closed_loop")
"""Kinds whose `[model]` has channels."""


def response_of(study: Study, nominal: Mapping[str, float]) -> Response:
    """The model of a study.

    Args:
        study: the study as read.
        nominal: nominal values of the inputs; an expression knows no other numbers.

    Raises:
        InputError: for anything that cannot be.
    """
    model, where = study.model, f"{study.path}: [model]"
    through = model["through"]
    _check_keys(model, through, where)
    if through == "expression":
        if study.noise:
            raise InputError(f"{study.path}: [noise]: an expression has no channels; take an [input]")
        return expression_response(model, nominal, where)
    augmented = load_model(_place(study, model["model"])) if "model" in model else BASE
    known = {key: value for key, value in augmented.tables.items()}
    tables, geometry, notices = _tables_and_geometry(model, where)
    known |= {key: _place(study, name) for key, name in tables.items()}
    if through == "recording":
        return _recording(study, known, augmented, where)
    if describes_chain(known.get("design", "")) != (through == "chain"):
        words = "a chain" if through != "chain" else "one actuator"
        raise InputError(
            f"{where}: design {known.get('design', 'pneusma2')!r} is {words}, so through cannot be "
            f"{through!r}"
        )
    if through == "chain":
        chain, rest = load_chain(known["design"]), {k: v for k, v in known.items() if k != "design"}
        return chain_response(chain, rest, augmented, model, _noise_for(study), where)
    if not known.get("design", "pneusma2").endswith(".toml"):
        word_of(known.get("design", "pneusma2"), (*schema.DESIGNS, *examples()), f"{where} design")
    specimen = described_actuator(None, known | geometry, where)
    response = _of_actuator(study, specimen, augmented, where)
    return replace(response, notices=(*response.notices, *notices))


def _of_actuator(study: Study, specimen: Recording, model: AugmentedModel, where: str) -> Response:
    """The response of one actuator: a state, a workspace, a protocol or a closed loop.

    Args:
        study: the study.
        specimen: recording that describes the actuator.
        model: model on disk, or the base model.
        where: file and table, for messages.
    """
    through, noise_for = study.model["through"], _noise_for(study)
    if through == "protocol":
        return _protocol(study, specimen, model, where)
    if through == "closed_loop":
        return loop_response(specimen, model, study.model, _points(study.model, where), noise_for, where)
    build = state_response if through == "state" else workspace_response
    return build(specimen, model, study.model, noise_for, where)


def _noise_for(study: Study) -> NoiseFor:
    return functools.partial(noise_of, study.noise, where=f"{study.path}: [noise]")


def _check_keys(model: Mapping[str, Any], through: str, where: str) -> None:
    allowed = KEYS[through]
    for key in model:
        if key == "through" or key in allowed:
            continue
        own = through == "workspace" and key.startswith("activation_")
        own |= through == "chain" and key.startswith("segment_")
        given = through in DRIVEN and (through != "closed_loop" or key.startswith("pressure"))
        if given and (own or channel_of(key) is not None):
            continue
        shown = (*allowed, *(("pressure_kPa", "xi0_1") if through in DRIVEN else ()))
        raise InputError(f"{where}: unknown key {key!r} through {through!r}, {nearest(key, shown)}")


def _place(study: Study, name: Any) -> str:
    """A name, or a path that counts from the study's folder."""
    if not isinstance(name, str):
        raise InputError(f"{study.path}: [model]: {name!r} must be a name or a path, in quotes")
    is_path = name.endswith((".toml", ".csv")) or "/" in name or "\\" in name
    return str((study.folder / name).resolve()) if is_path else name


def _tables_and_geometry(
    model: Mapping[str, Any], where: str
) -> tuple[dict[str, Any], dict[str, Any], list[str]]:
    """Tables of constants, dimensions of the actuator, and notices about tables named among dimensions.

    Tables stand in `[model]` itself. Studies that name them in its `geometry` are read as well.

    Raises:
        InputError: if a table is named in both places, and not alike.
    """
    tables = {key: model[key] for key in TABLES if key in model}
    geometry, notices = model.get("geometry", {}), []
    if not isinstance(geometry, dict):
        raise InputError(f"{where} geometry must be a table of dimensions, as beside a recording")
    for key in (key for key in TABLES if key in geometry):
        if tables.setdefault(key, geometry[key]) != geometry[key]:
            raise InputError(
                f"{where}: {key} is {model[key]!r} here and {geometry[key]!r} in geometry; keep the first"
            )
        notices.append(f"{key} is named in [model] geometry; name it in [model] itself")
    return tables, {key: value for key, value in geometry.items() if key not in TABLES}, notices


def _points(model: Mapping[str, Any], where: str) -> int:
    points = model.get("points", POINTS)
    if isinstance(points, bool) or not isinstance(points, int) or not 2 <= points <= MOST_POINTS:
        raise InputError(f"{where} points = {points!r} must be a whole number from 2 to {MOST_POINTS}")
    return points


def _protocol(study: Study, specimen: Recording, model: AugmentedModel, where: str) -> Response:
    name = study.model.get("protocol")
    if name is None:
        raise InputError(f"{where} needs protocol, a file or one of {', '.join(protocol_examples())}")
    protocol = load_protocol(_place(study, name))
    return protocol_response(protocol, specimen, model, _points(study.model, where), _noise_for(study))


def _recording(study: Study, known: Mapping[str, str], model: AugmentedModel, where: str) -> Response:
    if "recording" not in study.model:
        raise InputError(f"{where} needs recording, the CSV of one")
    path = Path(_place(study, study.model["recording"]))
    if path.is_dir():
        raise InputError(f"{where} recording: {path} is a folder; name one recording's CSV in it")
    own = {key: known[key] for key in ("alloy", "material") if key in known}
    campaign = read_campaign(path, {"geometry": own} if own else None)
    return recording_response(campaign, model, _points(study.model, where), _noise_for(study), own)
