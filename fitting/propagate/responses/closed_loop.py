"""An actuator in a closed loop whose controller does not know what varies: see docs/control.md."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.control import Loop, Plant, check_plane, usual_loop
from fitting.data.recordings import Recording
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.errors import InputError

from .body import Body, body_of, tied
from .course import TOGETHER, kept_rows
from .drives import drive_numbers, driven, read_channels
from .noise import NoiseFor
from .response import Driver, Response
from .state import title_of

SETTLED = 10.0
"""Time from which the error counts [s]: the step's transient is over, as in `pneusma control`."""
KNOWS = ("base", "model")
"""Kinds of the controller's own model: the base model, or that of the plant, both at the nominal numbers."""


def loop_response(
    specimen: Recording,
    model: AugmentedModel,
    settings: Mapping[str, Any],
    points: int,
    noise_for: NoiseFor,
    where: str,
) -> Response:
    """A step of curvature, held, then a sine about it, by the resistances of two springs.

    The plant varies, and so does the pressure inside it. The controller has the nominal numbers, always.

    Args:
        specimen: the actuator.
        model: model of the plant, with numbers and effects of its own.
        settings: a study's `[model]`: `pressure_kPa`, `level_1pm`, `swing_1pm`, and what the `controller`
            knows, of `KNOWS`.
        points: rows that results are kept of.
        noise_for: white noise of the readings, `resistance_ohm`.
        where: file and table, for messages.

    Raises:
        InputError: for an actuator that no loop can drive, or a setting that cannot be.
    """
    body, files = body_of(specimen, model)
    channels, driver = read_channels(
        {key: x for key, x in settings.items() if key.startswith("pressure")}, (), where
    )
    if driver is not None:
        raise InputError(f"{where}: the pressure of a closed loop is one number; its driver is the time")
    loop = _loop(settings, float(channels["pressure"]), where)
    plan_body = body.build({})
    try:
        check_plane(plan_body)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    knows = settings.get("controller", "base")
    if knows not in KNOWS:
        raise InputError(f"{where} controller = {knows!r} must be one of {', '.join(KNOWS)}")
    own = Plant(plan_body, body.effects({}) if knows == "model" else ())
    noise = noise_for({"resistance": "ohm"})
    kept = kept_rows(len(loop.time), points)
    plan = loop.planned(own)

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        plant = Plant(body.build(values), body.effects(values))
        pressure = driven("pressure", jnp.asarray(channels["pressure"]), values)
        read_noise = noise.on({"resistance": jnp.zeros(plan[1].resistances.shape)}, values)["resistance"]
        seen, observed, currents, _ = loop.driven(plant, own, plan, read_noise, pressure)
        error = jnp.asarray(loop.wanted) - seen.curvature
        late = jnp.asarray(loop.time >= SETTLED)
        outputs = {
            "curvature_1pm": seen.curvature[kept],
            "error_1pm": error[kept],
            "observer_error_1pm": (observed.curvature - seen.curvature)[kept],
            "rmse_1pm": jnp.sqrt(jnp.sum(jnp.where(late, error, 0.0) ** 2) / jnp.sum(late)),
        }
        for k, number in enumerate(body.layout.spring_numbers):
            outputs |= {
                f"current_{number}_A": currents[kept, k],
                f"resistance_{number}_ohm": seen.resistances[kept, k],
                f"xi0_{number}": seen.fractions[kept, k],
            }
        lost = int(pj.Status.no_equilibrium)
        return outputs, jnp.where(jnp.all(seen.good), 0, lost)

    return Response(
        title=f"closed loop of {title_of(specimen, model)}",
        known={**body.numbers, **drive_numbers(channels), **noise.known},
        driver=Driver("time_s", loop.time[kept]),
        outputs=_output_names(body),
        answer=answer,
        files=files,
        notices=(
            f"the controller has the {'base model' if knows == 'base' else 'model'} at the nominal numbers",
        ),
        tied=tied(body.numbers),
        side_by_side=TOGETHER,
        smooth=False,  # currents and readings have steps
    )


def _loop(settings: Mapping[str, Any], pressure: float, where: str) -> Loop:
    sizes = {}
    for key in ("level_1pm", "swing_1pm"):
        if key in settings:
            value = settings[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
                raise InputError(f"{where} {key} must be a curvature, but it is {value!r}")
            sizes[key.removesuffix("_1pm")] = float(value)
    return dataclasses.replace(usual_loop(**sizes), pressure=pressure)


def _output_names(body: Body) -> dict[str, bool]:
    springs = [
        name
        for n in body.layout.spring_numbers
        for name in (f"current_{n}_A", f"resistance_{n}_ohm", f"xi0_{n}")
    ]
    along = ("curvature_1pm", "error_1pm", "observer_error_1pm", *springs)
    return {**dict.fromkeys(along, True), "rmse_1pm": False}
