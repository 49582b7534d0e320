"""An actuator in one state, or in states along a driver; and the workspace that it reaches."""

from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.recordings import Recording
from fitting.specimens.cautions import touching_angle
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import only_along_histories
from pneusma_jax.errors import InputError
from pneusma_jax.simulate.rest import solve_at_rest

from .body import Body, body_of, tied
from .drives import (
    activation,
    drive_numbers,
    driven,
    points_of,
    read_channels,
    shown,
    spring_channel,
    units_of,
    worst,
)
from .noise import NoiseFor
from .response import Driver, Response
from .touching import TOUCHING, past

TOGETHER = 64
"""States side by side, as `solve_batch` has them: more leave the processor's cache."""


def state_response(
    specimen: Recording,
    model: AugmentedModel,
    settings: Mapping[str, Any],
    noise_for: NoiseFor,
    where: str,
) -> Response:
    """One state, or states along a driver.

    Args:
        specimen: the actuator.
        model: model with numbers and effects of its own.
        settings: a study's `[model]`.
        noise_for: white noise of channels; each point of the driver has its own.
        where: file and table, for messages.

    Raises:
        InputError: for what cannot be.
    """
    body, files = body_of(specimen, model)
    layout = body.layout
    channels, driver = read_channels(settings, layout.spring_numbers, where)
    noise = noise_for(units_of(channels))
    along = driver is not None
    names, limit = output_names(layout), touching_angle(specimen.geometry, model)

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        actuator, effects = body.build(values), body.effects(values)
        now = noise.on({n: driven(n, jnp.asarray(x), values) for n, x in channels.items()}, values)
        varied = {name: x for name, x in now.items() if x.ndim}
        fixed = {name: x for name, x in now.items() if not x.ndim}
        one = lambda point: state(body, actuator, effects, fixed | point, limit)  # noqa: E731
        outputs, status = jax.vmap(one)(varied) if along else one({})
        return outputs, worst(status)

    points = len(driver.values) if along else 1
    return Response(
        title=title_of(specimen, model),
        variables={**body.numbers, **drive_numbers(channels), **noise.variables},
        driver=driver,
        outputs=dict.fromkeys(names, along),
        answer=answer,
        files=files,
        notices=tuple(only_along_histories(model)),
        tied=tied(body.numbers),
        batch_size=max(1, TOGETHER // points),
    )


def title_of(specimen: Recording, model: AugmentedModel) -> str:
    """Design, and model if it is none of the shipped ones."""
    design = str(specimen.full_geometry()["design"]).rpartition("/")[2].removesuffix(".toml")
    return f"{design}, model {model.name}" if model.path is not None else design


def output_names(layout: pj.Layout) -> tuple[str, ...]:
    """Outputs of an actuator's state; see `described`."""
    planar = layout.bending_plane is not None
    bent = ("curvature_1pm", "bend_angle_deg", *(() if planar else ("bend_direction_deg",)), "length_mm")
    springs = [
        name for n in layout.spring_numbers for name in (f"force_{n}_N", f"resistance_{n}_ohm", f"xi0_{n}")
    ]
    return (*bent, *springs)


def state(
    body: Body, actuator: pj.Actuator, effects: tuple, channels: Mapping[str, Array], limit: float
) -> tuple[dict[str, Array], Array]:
    """Outputs of one state in the units of their names, and its status.

    Args:
        body: body that the actuator was built from.
        actuator: built.
        effects: effects that act in it, in their state at the start of a recording.
        channels: pressure and springs [SI], numbers.
        limit: angle past which the tip may touch the base [deg].
    """
    activations = []
    for number, spring in zip(actuator.spring_numbers, actuator.springs, strict=True):
        name = spring_channel(channels, number)
        cold = pj.MartensiteFraction(jnp.asarray(1.0))
        activations.append(cold if name is None else activation(spring.alloy, name, channels[name]))
    if effects:
        rest = solve_at_rest(
            actuator, channels["pressure"], tuple(activations), effects=effects,
            gravity=np.asarray(body.gravity),
        )  # fmt: skip
        found, seen = rest.found, rest.seen
    else:
        found = pj.solve(actuator, channels["pressure"], tuple(activations), throw=False)
        seen = {"curvature": found.curvature, "bend_angle": found.bend_angle, "length": found.length}
    return described(actuator, found, seen, limit), found.status


def described(
    actuator: pj.Actuator, found: pj.Equilibrium, seen: Mapping[str, Array], limit: float
) -> dict[str, Array]:
    """Outputs of a solved row in the units of their names, and `TOUCHING`.

    Free bending has a size and a direction.

    Args:
        actuator: that was solved.
        found: its equilibrium.
        seen: readings of instruments.
        limit: angle past which the tip may touch the base [deg].
    """
    outputs = {
        "curvature_1pm": seen["curvature"],
        "bend_angle_deg": shown("bend_angle_deg", seen["bend_angle"]),
    }
    if not actuator.planar:
        outputs = {
            "curvature_1pm": found.bend_magnitude / found.length,
            "bend_angle_deg": shown("bend_angle_deg", found.bend_magnitude),
            "bend_direction_deg": shown("bend_direction_deg", found.bend_direction),
        }
    outputs["length_mm"] = shown("length_mm", seen["length"])
    for number, response in zip(actuator.spring_numbers, found.springs, strict=True):
        outputs |= {
            f"force_{number}_N": response.force, f"resistance_{number}_ohm": response.resistance,
            f"xi0_{number}": response.xi0,
        }  # fmt: skip
    return outputs | {TOUCHING: past(found.bend_magnitude, limit)}


def workspace_response(
    specimen: Recording,
    model: AugmentedModel,
    settings: Mapping[str, Any],
    noise_for: NoiseFor,
    where: str,
) -> Response:
    """Reach of an actuator at each pressure: extremes over the activation of one spring.

    Args:
        specimen, model, settings, noise_for, where: the same as for `state_response`; `activation_K` are the
            fractions over which spring K goes.

    Raises:
        InputError: for what cannot be.
    """
    body, files = body_of(specimen, model)
    springs = body.layout.spring_numbers
    named = [key for key in settings if key.startswith("activation_")]
    if len(named) != 1 or not named[0][11:].isdecimal() or int(named[0][11:]) not in springs:
        there = " or ".join(f"activation_{n}" for n in springs) or "a design with springs"
        raise InputError(f"{where}: a workspace needs {there}, the martensite fractions of one spring")
    number = int(named[0][11:])
    fractions = np.atleast_1d(points_of(settings[named[0]], f"{where} {named[0]}"))
    if np.any((fractions < 0.0) | (fractions > 1.0)):
        raise InputError(f"{where} {named[0]} must be fractions from 0 (hot) to 1 (cold)")
    channels, driver = read_channels(settings, springs, where)
    pressure = np.atleast_1d(channels["pressure"])
    if np.ndim(channels["pressure"]) == 0 or set(channels) != {"pressure"}:
        raise InputError(
            f"{where}: a workspace goes over pressure_kPa = {{from, to, points}} and {named[0]} only"
        )
    driver, limit = Driver(driver.name, driver.values), touching_angle(specimen.geometry, model)
    noise = noise_for(units_of(channels))
    outputs = ("curvature_largest_1pm", "curvature_smallest_1pm", "bend_angle_largest_deg",
               "bend_angle_smallest_deg")  # fmt: skip

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        actuator, effects = body.build(values), body.effects(values)
        line = noise.on({"pressure": driven("pressure", jnp.asarray(pressure), values)}, values)["pressure"]
        one = lambda p, x: state(body, actuator, effects, {"pressure": p, f"xi0_{number}": x}, limit)  # noqa: E731
        grid, status = jax.vmap(jax.vmap(one, (None, 0)), (0, None))(line, jnp.asarray(fractions))
        found = {}
        for name, unit in (("curvature", "1pm"), ("bend_angle", "deg")):
            found[f"{name}_largest_{unit}"] = jnp.max(grid[f"{name}_{unit}"], axis=1)
            found[f"{name}_smallest_{unit}"] = jnp.min(grid[f"{name}_{unit}"], axis=1)
        return found | {TOUCHING: jnp.max(grid[TOUCHING], axis=1)}, worst(status)

    return Response(
        title=f"workspace of {title_of(specimen, model)}",
        variables={**body.numbers, **drive_numbers({"pressure": channels["pressure"]}), **noise.variables},
        driver=driver,
        outputs=dict.fromkeys(outputs, True),
        answer=answer,
        files=files,
        notices=tuple(only_along_histories(model)),
        tied=tied(body.numbers),
        batch_size=max(1, TOGETHER // (len(pressure) * len(fractions))),
    )
