"""An actuator through a protocol, and any specimen through the inputs of a recording."""

from collections.abc import Collection, Mapping
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

import pneusma_jax as pj
from fitting.data.protocols.reading import PHASE, Protocol
from fitting.data.recordings import Campaign, Recording, notices_of_reading, schema
from fitting.inference.parameters import Parameter, Parameters
from fitting.simulate.protocol import check_resistances, drives
from fitting.specimens import specimen_of
from fitting.specimens.cautions import touching_angle
from fitting.specimens.model_objects import BASE
from fitting.specimens.priors import FIT
from fitting.specimens.reduction import reduced
from fitting.specimens.rows import MOST_ROWS, Rows
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.specimen import Model
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.records import Prior
from pneusma_jax.errors import InputError
from pneusma_jax.units import from_si

from .body import body_of, tied
from .drives import activation, drive_numbers, driven, units_of, worst
from .noise import NoiseFor, WhiteNoise
from .response import NOISE, NOT_FINITE, Driver, Response, Variable
from .state import described, output_names, title_of
from .touching import TOUCHING, past

POINTS = 41
"""Rows of a history that results are kept of, unless a study says otherwise: enough to draw a band."""
TOGETHER = 16
"""Histories side by side: each is a loop over rows, whose arrays then stay in the processor's cache."""
_READ_ONCE = dict.fromkeys(
    ("actuator", "spring"), ("phases that resistances tell are read once, at the nominal numbers",)
)
"""Notices by kind of recording."""


def kept_rows(rows: int, points: int) -> np.ndarray:
    """Numbers of rows of a history that results are kept of, evenly spaced, the first and last among them."""
    return np.unique(np.linspace(0, rows - 1, min(points, rows)).round().astype(int))


def protocol_response(
    protocol: Protocol,
    specimen: Recording,
    model: AugmentedModel,
    points: int,
    noise_for: NoiseFor,
) -> Response:
    """An actuator through a protocol, its springs' memory carried along.

    Args:
        protocol: protocol of kind actuator.
        specimen: the actuator.
        model: model with numbers and effects of its own.
        points: rows that results are kept of.
        noise_for: white noise of channels.

    Raises:
        InputError: for another kind, or a spring that is not there.
    """
    if protocol.kind != "actuator":
        raise InputError(
            f"{protocol.path}: a study takes protocols of an actuator, but this is of a {protocol.kind}"
        )
    check_resistances(protocol, specimen)
    body, files = body_of(specimen, model)
    _check(protocol, body.layout.spring_numbers)
    kept, limit = kept_rows(len(protocol), points), touching_angle(specimen.geometry, model)
    channels = {n: x for n, x in protocol.channels.items() if n.partition("_")[0] != "ambient"}
    slow = {
        n: x
        for n, x in channels.items()
        if n.partition("_")[0] in ("pressure", "xi0", "resistance", "temperature")
    }
    columns = {name: jnp.asarray(x) for name, x in channels.items()}
    noise = noise_for(units_of(slow))
    ambient = protocol.channels.get("ambient")

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        actuator = body.build(values)
        now = {name: driven(name, x, values) if name in slow else x for name, x in columns.items()}
        now = noise.on(now, values)
        moved = Moved(protocol, now)
        history = pj.simulate_history(
            actuator, now["pressure"], moved.drives(actuator), time=protocol.time,
            effects=body.effects(values), currents=moved.currents(actuator), ambient=ambient,
            gravity=np.asarray(body.gravity),
        )  # fmt: skip
        found, seen = jax.tree.map(lambda x: x[kept], (history.rows, history.seen))
        outputs = described(actuator, found, seen, limit)
        outputs[TOUCHING] = past(history.rows.bend_magnitude, limit)  # of every row, not of those kept alone
        return outputs, worst(history.rows.status)

    return Response(
        title=f"{protocol.name} of {title_of(specimen, model)}",
        variables={**body.numbers, **drive_numbers(slow), **noise.variables},
        driver=Driver("time_s", protocol.time[kept]),
        outputs=dict.fromkeys(output_names(body.layout), True),
        answer=answer,
        files=(*files, *((protocol.path,) if Path(protocol.path).exists() else ())),
        tied=tied(body.numbers),
        batch_size=TOGETHER,
    )


class Moved:
    """A protocol whose channels a row has changed."""

    def __init__(self, protocol: Protocol, channels: Mapping[str, Array]):
        self._protocol, self._channels = protocol, channels

    def drives(self, actuator: pj.Actuator) -> tuple:
        """Drives of each spring."""
        as_stated = drives(self._heated, actuator)
        found = []
        for number, stated in zip(actuator.spring_numbers, as_stated, strict=True):
            name = next((f"{stem}_{number}" for stem in PHASE if f"{stem}_{number}" in self._channels), None)
            if name is None or name.partition("_")[0] in ("current", "duty"):
                found.append(stated)
            else:
                spring = actuator.springs[actuator.spring_numbers.index(number)]
                found.append(activation(spring.alloy, name, self._channels[name]))
        return tuple(found)

    @property
    def _heated(self) -> Protocol:
        """The protocol with the channels that it alone knows to read: currents and duty cycles."""
        own = {
            name: x for name, x in self._protocol.channels.items()
            if name.partition("_")[0] in ("pressure", "ambient", "current", "duty")
        }  # fmt: skip
        p = self._protocol
        return Protocol(p.name, p.description, p.kind, p.path, p.time, own, p.supply)

    def currents(self, actuator: pj.Actuator) -> tuple:
        """Currents as effects read them."""
        driven_by = self.drives(actuator)
        return tuple(drive.current if isinstance(drive, pj.Heating) else None for drive in driven_by)


def _check(protocol: Protocol, springs: tuple[int, ...]) -> None:
    for name in protocol.channels:
        stem, _, number = name.rpartition(".")[2].partition("_")
        if "." in name:
            raise InputError(f"{protocol.path}: channel {name!r} is of a segment, but this is no chain")
        if stem in PHASE and int(number) not in springs:
            there = ", ".join(map(str, springs)) or "none"
            raise InputError(
                f"{protocol.path}: channel {name!r}, but the springs that are there are: {there}"
            )


def recording_response(
    campaign: Campaign,
    model: AugmentedModel,
    points: int,
    noise_for: NoiseFor,
    named: Collection[str] = (),
) -> Response:
    """Model's answer to a recording's inputs, which replaces the measurement.

    Names are those of `pneusma posterior`. Dimensions have the tolerances of a fit of the recording.
    Constants of alloy and silicone have the priors of their tables, as through a state. A tolerance that the
    recording states of its own tables comes before them. Phases that resistances tell are read once, at the
    nominal numbers.

    Args:
        campaign: campaign of one recording.
        model: model with numbers and effects of its own.
        points: rows that results are kept of.
        noise_for: white noise of measured inputs. Where rows are means of readings, the noise is that of a
            mean.
        named: keys of `[geometry]` of tables that the study or its model names in place of the recording's.

    Raises:
        InputError: if the recording cannot be predicted.
    """
    recording, kind = campaign.recordings[0], campaign.kinds[0]
    own = specimen_of(kind) if model is BASE else Augmented(kind, model)
    parameters = own.parameters_for(campaign)
    start = {name: entry.value for name, entry in parameters.items()}
    rows = own.prepared(start, own.rows_for(campaign))[0]
    there = np.flatnonzero(np.asarray(rows.mask))
    kept = there[kept_rows(len(there), points)]
    driver, limit = _driver(recording, rows, kept), touching_angle(recording.geometry, model)
    noise = _noise_of_inputs(noise_for, recording, rows, own)
    columns = {
        schema.quantity_and_unit(name)[0]: name for name in recording.outputs
        if schema.quantity_and_unit(name)[0] in own.outputs
    }  # fmt: skip
    if not columns:
        raise InputError(f"{recording.path}: this recording holds nothing that the model predicts")

    def answer(values: Mapping[str, Array]) -> tuple[dict[str, Array], Array]:
        numbers = {name: x for name, x in values.items() if name != NOISE}
        noisy = eqx.tree_at(lambda r: r.inputs, rows, noise.on(rows.inputs, values))
        found = own.predict({**start, **numbers}, noisy)
        outputs = {
            column: from_si(found[quantity][kept], schema.quantity_and_unit(column)[1])
            for quantity, column in columns.items()
        }
        good = jnp.all(jnp.stack([jnp.all(jnp.isfinite(x)) for x in outputs.values()]))
        if "bend_angle" in found:
            outputs[TOUCHING] = past(found["bend_angle"][there], limit)
        return outputs, jnp.where(good, 0, NOT_FINITE)

    tables = _tables_of(campaign, own, model)
    variables = _variables_of(parameters, noise, tables, rows, named, recording.tolerance is not None)
    files = [recording.path, model.path, *(table.path for table in tables.values())]
    return Response(
        title=f"{recording.name} ({kind})",
        variables=variables,
        driver=driver,
        outputs=dict.fromkeys(columns.values(), True),
        answer=answer,
        files=tuple(Path(p) for p in files if p is not None and Path(p).exists()),
        notices=(*_READ_ONCE.get(kind, ()), *notices_of_reading(campaign.recordings)),
        batch_size=TOGETHER,
    )  # fmt: skip


def _variables_of(
    parameters: Parameters,
    noise: WhiteNoise,
    tables: Mapping[str, Calibration],
    rows: Rows,
    named: Collection[str],
    stated: bool,
) -> dict[str, Variable]:
    """Numbers of a recording's model that may vary, with their priors.

    Args:
        parameters: those of a fit of the recording.
        noise: white noise of measured inputs.
        tables: tables of alloy and silicone by their key in `[geometry]`.
        rows: the recording as arrays.
        named: keys of tables that are named in place of the recording's.
        stated: true if the recording states tolerances; they are those of its own tables.
    """
    variables = {
        name: Variable(float(e.value), e.unit, _prior(e), "recording") for name, e in parameters.items()
    } | noise.variables
    for key, table in tables.items():
        free = key in named or not stated
        for name, quantity in table.quantities.items():
            if name in rows.base and (name not in variables or (free and quantity.prior is not None)):
                value = float(rows.base[name])
                variables[name] = Variable(value, quantity.unit, quantity.prior, table.kind)
    for name, value in rows.base.items():
        variables.setdefault(name, Variable(float(value), "", None, ""))
    return variables


def _tables_of(campaign: Campaign, own: Model, model: AugmentedModel) -> dict[str, Calibration]:
    """Tables of alloy and silicone by their key in `[geometry]`, with the model's numbers in them.

    A table that is to be identified is left out: a fit has its priors already.
    """
    described = own.described(campaign) if isinstance(own, Augmented) else campaign
    recording, found = described.recordings[0], {}
    for key, kind in (("alloy", "alloy"), ("material", "silicone")):
        if kind in specimen_of(recording.kind).tables and str(recording.table(key)) != FIT:
            found[key] = model.table(kind, recording.table(key), recording.specimen)
    return found


def _noise_of_inputs(noise_for: NoiseFor, recording: Recording, rows: Rows, model: Model) -> WhiteNoise:
    """Noise of what the recording measured of its inputs, of a row of the model."""
    units = dict(map(schema.quantity_and_unit, recording.columns))
    channels = {n: u for n, u in units.items() if n in rows.inputs and not n.startswith("resistance")}
    noise = noise_for(channels)  # not of resistances: phases are read from them once
    block = reduced(recording, getattr(model, "most_rows", MOST_ROWS)).block
    return WhiteNoise({name: sd / np.sqrt(block) for name, sd in noise.sd.items()})


def _prior(entry: Parameter) -> Prior | None:
    return Prior(entry.prior.mean, entry.prior.sd, entry.min, entry.max) if entry.prior else None


def _driver(recording: Recording, rows: object, kept: np.ndarray) -> Driver:
    """Quantity that a figure is drawn over: an elastomer's strain, a tube's pressure, else time."""
    over = specimen_of(recording.kind).simulated_over
    if over == "time":
        return Driver("time_s", np.asarray(rows.time)[kept])
    column = recording.column(over)
    unit = schema.quantity_and_unit(column)[1]
    return Driver(column, np.asarray(from_si(np.asarray(rows.inputs[over])[kept], unit)))
