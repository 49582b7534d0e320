"""A chain of segments in one state, or in states along the pressure."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array

import pneusma_jax as pj
from fitting.simulate.chain_state import chain_specimens
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without
from pneusma_jax.errors import InputError
from pneusma_jax.serial_chain.designs import ChainDesign, make_chain

from .body import Body, body_of, tied
from .drives import (
    activation,
    channel_of,
    drive_numbers,
    driven,
    read_channels,
    shown,
    spring_channel,
    units_of,
    worst,
)
from .noise import NoiseFor
from .response import Response, Variable
from .touching import TOUCHING, overlapping


def chain_response(
    design: ChainDesign,
    overrides: Mapping[str, Any],
    model: AugmentedModel,
    settings: Mapping[str, Any],
    noise_for: NoiseFor,
    where: str,
) -> Response:
    """A chain of segments; those of one design share their numbers.

    Args:
        design: design of the chain, from its file.
        overrides: keys of `[geometry]` that hold for all segments.
        model: model with numbers of its own.
        settings: a study's `[model]`: `xi0_K` is of spring K of all segments, `segment_N = {xi0_K = ...}` of
            one.
        noise_for: white noise of channels; one of a single segment is `2.xi0_1`.
        where: file and table, for messages.

    Raises:
        InputError: for what cannot be.
    """
    without = tuple(chain_without(model))
    model = dataclasses.replace(model, added=())
    specimens = chain_specimens(design, overrides)
    found = {name: body_of(specimen, model) for name, specimen in specimens.items()}
    bodies = {name: body for name, (body, _) in found.items()}
    springs = tuple(sorted({n for body in bodies.values() for n in body.layout.spring_numbers}))
    own = _of_segments(settings, len(design.designs), springs, where)
    channels, driver = read_channels(settings, springs, where)
    several = len(bodies) > 1
    noise = noise_for(units_of(channels | own))
    numbers = {
        (f"{_short(name)}.{key}" if several else key): known
        for name, body in bodies.items()
        for key, known in body.numbers.items()
    }

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        built = {name: _built(name, body, values, several) for name, body in bodies.items()}
        densities = {
            name: body.silicone(_own(name, values, several)).values().get("density")
            for name, body in bodies.items()
        }
        chain = make_chain(design, built.__getitem__, densities.__getitem__)
        now = noise.on({n: driven(n, jnp.asarray(x), values) for n, x in (channels | own).items()}, values)
        varied = {name: x for name, x in now.items() if x.ndim}
        fixed = {name: x for name, x in now.items() if not x.ndim}
        one = lambda point: _state(chain, fixed | point)  # noqa: E731
        outputs, status = jax.vmap(one)(varied) if driver is not None else one({})
        return outputs, worst(status)

    along = driver is not None
    names = ["tip_x_mm", "tip_y_mm", "tip_z_mm"]
    names += [f"bend_angle_{k}_deg" for k in range(1, len(design.designs) + 1)]
    files = {file for _, found_files in found.values() for file in found_files}
    files |= {design.path} if design.path.exists() else set()
    variables: dict[str, Variable] = {**numbers, **drive_numbers(channels | own), **noise.variables}
    return Response(
        title=f"chain {design.name}",
        variables=variables,
        driver=driver,
        outputs=dict.fromkeys(names, along),
        answer=answer,
        files=tuple(sorted(files)),
        notices=without,
        tied={} if several else tied(numbers),
        batch_size=16,
    )


def _short(name: str) -> str:
    return name.rpartition("/")[2].removesuffix(".toml")


def _own(name: str, values: Mapping[str, Array], several: bool) -> dict[str, Array]:
    before = f"{_short(name)}." if several else ""
    return {key.removeprefix(before): x for key, x in values.items() if key.startswith(before)}


def _built(name: str, body: Body, values: Mapping[str, Array], several: bool) -> pj.Actuator:
    own = {key: x for key, x in _own(name, values, several).items() if key in body.numbers}
    return body.build(own)


def _of_segments(
    settings: Mapping[str, Any], count: int, springs: tuple[int, ...], where: str
) -> dict[str, Any]:
    """Channels of single segments, `2.xi0_1`."""
    found = {}
    for key, table in settings.items():
        if not key.startswith("segment_"):
            continue
        number = key.removeprefix("segment_")
        if number not in map(str, range(1, count + 1)):
            raise InputError(f"{where} {key}: there is no such segment, the chain has {count}")
        if not isinstance(table, dict):
            raise InputError(f"{where} {key} must be a table, such as {{xi0_1 = 0.4}}, but it is {table!r}")
        for name in table:
            if channel_of(name) is None or name.startswith("pressure"):
                raise InputError(
                    f"{where} {key}: unknown key {name!r}; a segment has fixed xi0_K or resistance_K_ohm only"
                )
        channels, driver = read_channels({"pressure_kPa": 0.0, **table}, springs, f"{where} {key}")
        if driver is not None:
            raise InputError(f"{where} {key}: a segment has fixed xi0_K or resistance_K_ohm only")
        found |= {f"{number}.{name}": x for name, x in channels.items() if name != "pressure"}
    return found


def _state(chain: pj.SegmentChain, channels: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
    activations = []
    for k, body in enumerate(chain.segments, 1):
        own = []
        for number, spring in zip(body.spring_numbers, body.springs, strict=True):
            name = spring_channel(channels, number, f"{k}.") or spring_channel(channels, number)
            if name is None:
                own.append(pj.MartensiteFraction(jnp.asarray(1.0)))
            else:
                own.append(activation(spring.alloy, name.rpartition(".")[2], channels[name]))
        activations.append(tuple(own))
    found = pj.solve_chain(chain, channels["pressure"], activations, throw=False)
    tip = found.end_pose[:3, 3]
    outputs = {f"tip_{axis}_mm": shown("tip_mm", tip[k]) for k, axis in enumerate("xyz")}
    for k, segment in enumerate(found.segments, 1):
        outputs[f"bend_angle_{k}_deg"] = shown("bend_angle_deg", segment.bend_magnitude)
    return outputs | {TOUCHING: overlapping(found.shape)}, found.status
