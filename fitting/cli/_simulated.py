"""Calculations and files of `pneusma simulate`, once its options are known to make sense.

`options` are the command's options by name. Pressures among them are in kPa.
"""

import json
import math
from pathlib import Path
from typing import Any

import click

from fitting.data.csv_text import csv_text
from fitting.report.table import Table, table_text
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without
from pneusma_jax.errors import InputError
from pneusma_jax.serial_chain.chain_files import describes_chain

from . import _common
from ._common import done, notice, table_argument
from ._drives import SpringInput, of_segment

NOT_CONVERGED = 1
"""Exit code of a state that has no result."""
ZERO_DECIMALS = 9
"""Number of decimals below which a quantity of a state counts as zero."""
SPRING_KEYS = (
    "alloy", "wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm", "active_coils", "free_length_mm",
)  # fmt: skip
"""Keys of `[geometry]` that a spring under a protocol takes over from the design that is named."""


def model_of(options: dict[str, Any]) -> AugmentedModel:
    """The model that `--model` names, or the base model; says what it adds."""
    return _common.model_of(options["model"], {key: options[key] for key in ("design", "alloy", "material")})


def overrides(options: dict[str, Any], model: AugmentedModel, design: bool = True) -> dict[str, str]:
    """Keys of `[geometry]`: those of the command line precede those of the model.

    Args:
        options: the command's options.
        model: model with tables of its own.
        design: false to leave out the model's design.
    """
    geometry = {key: value for key, value in model.tables.items() if design or key != "design"}
    for key in ("design", "alloy", "material"):
        if options[key] is not None:
            geometry[key] = options[key] if key == "design" else table_argument(options[key])
    return geometry


def state(inputs: list[SpringInput], options: dict[str, Any]) -> None:
    """One state, of an actuator or of a chain."""
    from fitting.simulate.state import actuator_state, described_actuator

    model = model_of(options)
    geometry = overrides(options, model)
    if options["out"] is not None:
        _check_out(options)
    pressure = 1e3 * options["pressure"]
    if describes_chain(geometry.get("design", "")):
        from fitting.simulate.chain_state import chain_state

        found: Any = chain_state(*_chain(geometry, options), pressure, _of_segments(inputs, geometry), model)
    else:
        if any(one.segment is not None for one in inputs):
            raise click.UsageError("SEGMENT.SPRING goes with the --design of a chain")
        specimen = described_actuator(options["geometry"], geometry)
        found = actuator_state(specimen, pressure, of_segment(inputs, None), model)
    for sentence in found.notices:
        notice(sentence)
    if options["as_json"]:
        click.echo(json.dumps(found.contract()))
    else:
        click.echo(_page(found, options["pressure"]))
    if options["out"] is not None:
        written = _write_state(found, options)
        if not options["as_json"]:  # which is one object on stdout, and nothing else
            done(written)
    if not found.converged:
        click.echo(f"{found.status}: {found.sentence}", err=True)
        click.get_current_context().exit(NOT_CONVERGED)


def _chain(geometry: dict[str, str], options: dict[str, Any]) -> tuple[Any, dict[str, str]]:
    """A chain's design, and what holds for all its segments."""
    if options["geometry"] is not None:
        raise click.UsageError(
            "--geometry goes with one actuator; a chain's segments have tables of their own"
        )
    from pneusma_jax.serial_chain.designs import load_chain

    return load_chain(geometry["design"]), {key: value for key, value in geometry.items() if key != "design"}


def _of_segments(inputs: list[SpringInput], geometry: dict[str, str]) -> list[dict[str, float]]:
    from pneusma_jax.serial_chain.designs import load_chain

    count = len(load_chain(geometry["design"]).designs)
    for one in inputs:
        if one.segment is not None and not 1 <= one.segment <= count:
            raise click.UsageError(f"{one.option}: there is no segment {one.segment}, the chain has {count}")
    return [of_segment(inputs, k) for k in range(1, count + 1)]


def _check_out(options: dict[str, Any]) -> None:
    from fitting.data.publish import check_free

    check_free(options["out"], options["force"])


def _page(found: Any, pressure: float) -> str:
    """A state as text: the whole body's table, then one for each segment of a chain."""
    parts = [_tables(found, f"{found.title} at {pressure:g} kPa")]
    parts += [_tables(one, f"segment {number}: {one.title}") for number, one in enumerate(found.segments, 1)]
    return "\n\n".join(parts)


def _tables(found: Any, title: str) -> str:
    """Outcome, quantities and springs of one actuator or of a whole chain."""
    parts = [f"{title}: {found.status}", found.sentence, ""]
    if rows := [(name, _rounded(value), unit) for name, value, unit in found.quantities()]:
        parts.append(table_text(Table(("", "value", "unit"), rows)))
    if springs := found.spring_rows():
        header = ("", *(f"spring {number}" for number in found.numbers))
        parts += ["", table_text(Table(header, springs))]
    return "\n".join(parts)


def _rounded(value: float) -> str:
    """A number with six digits. What an iteration leaves of a zero is written 0, and never as -0."""
    return f"{round(value, ZERO_DECIMALS) + 0.0:.6g}"


def _write_state(found: Any, options: dict[str, Any]) -> list[Path]:
    """state.json and, where there is a shape, shape.png."""
    from fitting.data.publish import publish
    from fitting.report.figures import png
    from fitting.report.figures.shape import chain_figure

    documents: dict[str, Any] = {"state.json": json.dumps(found.contract(), indent=1) + "\n"}
    if found.converged:
        title = f"{found.title} at {options['pressure']:g} kPa"
        documents["shape.png"] = png(chain_figure(*found.as_chain(), title))
    return publish(options["out"], documents, options["force"])


def protocol(options: dict[str, Any]) -> None:
    """A protocol done to an actuator, a chain, a spring or a tube."""
    from fitting.data.protocols import load_protocol
    from fitting.data.publish import publish
    from fitting.report.figures import png
    from fitting.report.figures.protocol import protocol_figure

    _check_out(options)
    model = model_of(options)
    steps = load_protocol(table_argument(options["protocol"]))
    response = _response(steps, options, model)
    comments = [response.title, steps.description] if steps.description else [response.title]
    documents = {
        "model.csv": csv_text(response.columns, comments), "model.png": png(protocol_figure(response)),
    }  # fmt: skip
    if response.chain is not None:
        documents |= _chain_documents(response, options["animate"])
    written = publish(options["out"], documents, options["force"])
    for sentence in response.notices:
        notice(sentence)
    click.echo(_ends(response))
    done(written)


def _response(steps: Any, options: dict[str, Any], model: AugmentedModel) -> Any:
    from fitting.simulate.chain_state import build_chain, chain_specimens
    from fitting.simulate.protocol import run_chain_protocol, run_protocol
    from fitting.simulate.state import described_specimen

    geometry = overrides(options, model)
    if describes_chain(geometry.get("design", "")):
        design, rest = _chain(geometry, options)
        for sentence in chain_without(model, history=True):
            notice(sentence)
        specimens = chain_specimens(design, rest)
        chain = build_chain(design, specimens, model)
        return run_chain_protocol(steps, design.name, chain, [specimens[name] for name in design.designs])
    if options["animate"]:
        raise click.UsageError("--animate goes with the --protocol of a chain")
    if steps.kind == "spring" and "design" in geometry:
        design = described_specimen("actuator", None, {"design": geometry.pop("design")}).full_geometry()
        if "active_coils" not in design:
            raise InputError(f"{design['design']} has no spring, but {steps.path} is for one")
        geometry = {key: design[key] for key in SPRING_KEYS if key in design} | geometry
    elif steps.kind != "actuator":
        geometry.pop("design", None)
    return run_protocol(steps, described_specimen(steps.kind, options["geometry"], geometry), model)


def _chain_documents(response: Any, animate: bool) -> dict[str, bytes]:
    """Figures of the chain's last shape and of its motion, by file name."""
    import jax
    import numpy as np

    from fitting.report.figures import png
    from fitting.report.figures.shape import animation, chain_figure
    from pneusma_jax.serial_chain.segments import ChainEquilibrium

    chain, history = response.chain
    good = np.flatnonzero(np.asarray(history.converged))
    if not good.size:
        return {}
    at = lambda tree: jax.tree.map(lambda leaf: np.asarray(leaf)[good[-1]], tree)  # noqa: E731
    last = ChainEquilibrium(
        tuple(at(part.rows) for part in history.segments), history.shape.row(int(good[-1]))
    )
    title = f"{response.title}, after {response.inputs['time_s'][good[-1]]:g} s"
    documents = {"shape.png": png(chain_figure(chain, last, title))}
    if animate:
        documents["motion.gif"] = animation(chain, history, response.pressure, response.inputs["time_s"])
    return documents


def _ends(response: Any) -> str:
    """Number of rows, first, smallest, largest and last value of each output."""
    import numpy as np

    rows = []
    for name, values in response.outputs.items():
        held = values[np.isfinite(values)]
        ends = [held[0], held.min(), held.max(), held[-1]] if held.size else [math.nan] * 4
        rows.append([name, str(held.size), *(f"{float(v):.5g}" for v in ends)])
    table = Table(("output", "rows", "start", "least", "most", "end"), rows)
    return f"{response.title}\n{table_text(table)}"


def recording(path: Path, options: dict[str, Any]) -> None:
    """The model beside a recording."""
    from fitting.data.publish import publish
    from fitting.data.recordings import read_campaign
    from fitting.report.figures import png, recording_figure
    from fitting.simulate import predict
    from fitting.simulate.state import read_geometry
    from fitting.specimens import specimen_of

    if path.is_dir():
        raise click.UsageError(f"{path} is a folder; name one recording's CSV in it")
    _check_out(options)
    model = model_of(options)
    geometry = {} if options["geometry"] is None else read_geometry(options["geometry"])
    geometry |= overrides(options, model, design=False)
    if describes_chain(geometry.get("design", "")):
        raise InputError(f"{geometry['design']}: a recording is of one actuator, not of a chain")
    recording = read_campaign(path, {"geometry": geometry} if geometry else None).recordings[0]
    prediction = predict(recording, denoise=not options["raw_resistance"], model=model)
    if not prediction.outputs:
        raise click.UsageError(f"{path}: this recording holds nothing that the model predicts")
    columns = {f"model_{name}": values for name, values in prediction.outputs.items()} | prediction.marks
    beside = csv_text(recording.columns | columns, recording.comments)
    documents: dict[str, str | bytes] = {"model.csv": beside}
    if prediction.states:
        clock = {name: recording.columns[name] for name in ("time_s",) if name in recording.columns}
        documents["states.csv"] = csv_text(clock | prediction.states)
    horizontal = recording.column(specimen_of(recording.kind).simulated_over)
    compared = {name: (recording.columns[name], values) for name, values in prediction.outputs.items()}
    title, over = f"{recording.name} ({recording.kind})", (horizontal, recording.columns[horizontal])
    figure = recording_figure(title, over, compared, recording.noise)
    written = publish(options["out"], documents | {"model.png": png(figure)}, options["force"])
    for sentence in dict.fromkeys(recording.notices + prediction.notices):
        notice(sentence)
    click.echo(_misfits(compared, recording.noise))
    done(written)


def _misfits(compared: dict[str, tuple], noise: dict[str, float]) -> str:
    """Distance of the model from the recording, for each output."""
    import numpy as np

    rows = []
    for name, (measured, predicted) in compared.items():
        off = measured - predicted
        off = off[np.isfinite(off)]
        rmse = float(np.sqrt(np.mean(off**2))) if off.size else math.nan
        stated = f"{noise[name]:.3g}" if name in noise else "not stated"
        rows.append(
            [name, str(off.size), f"{rmse:.4g}", f"{np.mean(off) if off.size else math.nan:.4g}", stated]
        )
    header = ("output", "samples", "rmse", "mean of measured - model", "noise")
    return table_text(Table(header, rows), indent=0)
