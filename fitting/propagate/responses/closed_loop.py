"""An actuator in a closed loop whose controller does not know what varies: see docs/control.md."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.control import Loop, Plant, check_plane, usual_loop
from fitting.control.plant import Seen
from fitting.data.recordings import Recording
from fitting.specimens.cautions import touching_angle
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.errors import InputError

from .body import Body, body_of, tied
from .course import TOGETHER, kept_rows
from .drives import drive_numbers, driven, read_channels
from .noise import NoiseFor, WhiteNoise
from .response import Driver, Response
from .state import title_of
from .touching import TOUCHING, past

SETTLED = 10.0
"""Time from which the error counts [s]: the step's transient is over, as in `pneusma control`."""
KNOWS = ("base", "model")
"""Kinds of the controller's own model: the base model, or that of the plant, both at the nominal numbers."""


@dataclass(frozen=True)
class _Driven:
    """A controller that was planned, and plants that it drives.

    Attributes:
        body: body and effects of the plant, as functions of what varies.
        loop: task and settings; own: the controller's model; plan: its plan, from `Loop.planned`.
        noise: noise of the readings; pressure: gauge [Pa]; kept: rows that results are kept of.
        limit: angle past which the tip may touch the base [deg].
    """

    body: Body
    loop: Loop
    own: Plant
    plan: tuple[Array, Seen]
    noise: WhiteNoise
    pressure: float
    kept: np.ndarray
    limit: float

    def __call__(self, values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        """Outputs of a run on the plant of some values, and its status; see `response.Answer`."""
        gravity = jnp.asarray(self.body.gravity)
        plant = Plant(self.body.build(values), self.body.effects(values), gravity)
        pressure = driven("pressure", jnp.asarray(self.pressure), values)
        blank = jnp.zeros(self.plan[1].resistances.shape)
        read_noise = self.noise.on({"resistance": blank}, values)["resistance"]
        seen, observed, currents, _ = self.loop.driven(plant, self.own, self.plan, read_noise, pressure)
        status = jnp.where(jnp.all(seen.good), 0, int(pj.Status.no_equilibrium))
        touching = {TOUCHING: past(seen.bend, self.limit)}
        return self._errors(seen, observed) | self._of_springs(seen, currents) | touching, status

    def _errors(self, seen: Seen, observed: Seen) -> dict[str, Array]:
        """Curvature, and what controller and observer miss of it [1/m]."""
        error = jnp.asarray(self.loop.wanted) - seen.curvature
        late = jnp.asarray(self.loop.time >= SETTLED)
        return {
            "curvature_1pm": seen.curvature[self.kept],
            "error_1pm": error[self.kept],
            "observer_error_1pm": (observed.curvature - seen.curvature)[self.kept],
            "rmse_1pm": jnp.sqrt(jnp.sum(jnp.where(late, error, 0.0) ** 2) / jnp.sum(late)),
        }

    def _of_springs(self, seen: Seen, currents: Array) -> dict[str, Array]:
        """Current, resistance and fraction of each spring."""
        found = {}
        for k, number in enumerate(self.body.layout.spring_numbers):
            found |= {
                f"current_{number}_A": currents[self.kept, k],
                f"resistance_{number}_ohm": seen.resistances[self.kept, k],
                f"xi0_{number}": seen.fractions[self.kept, k],
            }
        return found


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
    channels, pressure = _pressure(settings, where)
    loop = _loop(settings, pressure, where)
    own, knows = _own_model(body, settings, where)
    noise, kept = noise_for({"resistance": "ohm"}), kept_rows(len(loop.time), points)
    return Response(
        title=f"closed loop of {title_of(specimen, model)}",
        variables={**body.numbers, **drive_numbers(channels), **noise.variables},
        driver=Driver("time_s", loop.time[kept]),
        outputs=_output_names(body),
        answer=_Driven(
            body, loop, own, loop.planned(own), noise, pressure, kept,
            touching_angle(specimen.geometry, model),
        ),
        files=files,
        notices=(f"the controller has the {knows} at the nominal numbers",),
        tied=tied(body.numbers),
        batch_size=TOGETHER,
        smooth=False,  # currents and readings have steps
    )


def _pressure(settings: Mapping[str, Any], where: str) -> tuple[dict[str, Any], float]:
    """The channels that a loop has, and the gauge pressure [Pa]."""
    given = {key: x for key, x in settings.items() if key.startswith("pressure")}
    channels, driver = read_channels(given, (), where)
    if driver is not None:
        raise InputError(f"{where}: the pressure of a closed loop is one number; its driver is the time")
    return channels, float(channels["pressure"])


def _own_model(body: Body, settings: Mapping[str, Any], where: str) -> tuple[Plant, str]:
    """The controller's own model at the nominal numbers, and its name in words."""
    built = body.build({})
    try:
        check_plane(built)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    knows = settings.get("controller", "base")
    if knows not in KNOWS:
        raise InputError(f"{where} controller = {knows!r} must be one of {', '.join(KNOWS)}")
    full = knows == "model"
    own = Plant(built, body.effects({}), jnp.asarray(body.gravity)) if full else Plant(built)
    return own, "model" if full else "base model"


def _loop(settings: Mapping[str, Any], pressure: float, where: str) -> Loop:
    sizes = {}
    for key in ("level_1pm", "swing_1pm"):
        if key in settings:
            value = settings[key]
            if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
                raise InputError(f"{where} {key} must be a curvature, but it is {value!r}")
            sizes[key.removesuffix("_1pm")] = float(value)
    try:
        return usual_loop(**sizes, pressure=pressure)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _output_names(body: Body) -> dict[str, bool]:
    springs = [
        name
        for n in body.layout.spring_numbers
        for name in (f"current_{n}_A", f"resistance_{n}_ohm", f"xi0_{n}")
    ]
    along = ("curvature_1pm", "error_1pm", "observer_error_1pm", *springs)
    return {**dict.fromkeys(along, True), "rmse_1pm": False}
