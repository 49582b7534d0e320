"""Calculations and files of `pneusma simulate`, once its options are known to make sense."""

import json
import math
from pathlib import Path
from typing import Any

import click

from fitting.data.csv_text import csv_text
from fitting.report.table import Table, table_text
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.saved_models.left_out import chain_without
from pneusma_jax.errors import InputError, counted
from pneusma_jax.serial_chain.chain_files import describes_chain

from . import _common
from ._common import done, notice, table_argument
from ._drives import Said, of_segment

NOT_CONVERGED = 1  # exit code
SPRING_KEYS = (
    "alloy", "wire_diameter_mm", "mandrel_diameter_mm", "initial_pitch_mm", "active_coils", "free_length_mm",
)  # fmt: skip


def model_of(options: dict[str, Any]) -> AugmentedModel:
    """The model that `--model` names, or the base model; says what it adds."""
    return _common.model_of(options["model"], {key: options[key] for key in ("design", "alloy", "material")})


def overrides(options: dict[str, Any], model: AugmentedModel, design: bool = True) -> dict[str, str]:
    """Settings of the specimen from the command line and, below it, from the model."""
    known = {key: value for key, value in model.tables.items() if design or key != "design"}
    for key in ("design", "alloy", "material"):
        if options[key] is not None:
            known[key] = options[key] if key == "design" else table_argument(options[key])
    return known


def state(said: list[Said], options: dict[str, Any]) -> None:
    """One state, of an actuator or of a chain."""
    from fitting.simulate.state import actuator_state, described_actuator

    model = model_of(options)
    known = overrides(options, model)
    if options["out"] is not None:
        _check_out(options)
    pressure = 1e3 * options["pressure"]
    if describes_chain(known.get("design", "")):
        from fitting.simulate.chain_state import chain_state

        found: Any = chain_state(*_chain(known, options), pressure, _of_segments(said, known), model)
    else:
        if any(one.segment is not None for one in said):
            raise click.UsageError("SEGMENT.SPRING goes with the --design of a chain")
        specimen = described_actuator(options["geometry"], known)
        found = actuator_state(specimen, pressure, of_segment(said, None), model)
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


def _chain(known: dict[str, str], options: dict[str, Any]) -> tuple[Any, dict[str, str]]:
    """A chain's design, and what holds for all its segments."""
    if options["geometry"] is not None:
        raise click.UsageError(
            "--geometry goes with one actuator; a chain's segments have tables of their own"
        )
    from pneusma_jax.serial_chain.designs import load_chain

    return load_chain(known["design"]), {key: value for key, value in known.items() if key != "design"}


def _of_segments(said: list[Said], known: dict[str, str]) -> list[dict[str, float]]:
    from pneusma_jax.serial_chain.designs import load_chain

    count = len(load_chain(known["design"]).designs)
    for one in said:
        if one.segment is not None and not 1 <= one.segment <= count:
            raise click.UsageError(f"{one.option}: there is no segment {one.segment}, the chain has {count}")
    return [of_segment(said, k) for k in range(1, count + 1)]


def _check_out(options: dict[str, Any]) -> None:
    from fitting.data.publish import check_free

    check_free(options["out"], options["force"])


def _page(found: Any, pressure: float) -> str:
    """A state as words."""
    segments = getattr(found, "segments", None)
    if segments is None:
        return _words(found, f"{found.title} at {pressure:g} kPa")
    x, y, z = found.tip
    parts = [f"{found.design.name}, {counted(len(segments), 'segment')} at {pressure:g} kPa: {found.status}"]
    parts += [found.sentence, ""]
    if found.converged:
        rows = [("tip x", f"{x:.6g}", "mm"), ("tip y", f"{y:.6g}", "mm"), ("tip z", f"{z:.6g}", "mm")]
        rows = [(name, f"{round(float(value), 9) + 0.0:.6g}", unit) for name, value, unit in rows]
        parts += [
            table_text(Table(("", "value", "unit"), [*rows, ("clearance", f"{found.clearance:.6g}", "mm")]))
        ]
    for number, segment in enumerate(segments, 1):
        parts += ["", _words(segment, f"segment {number}: {segment.title}")]
    return "\n".join(parts)


def _words(found: Any, title: str) -> str:
    """The state of one actuator as words."""
    parts = [f"{title}: {found.status}", found.sentence, ""]
    rows = [(n, f"{round(v, 9) + 0.0:.6g}", u) for n, v, u in found.quantities()]
    parts.append(table_text(Table(("", "value", "unit"), rows)))
    springs = found.spring_rows()
    if springs:
        header = ("", *(f"spring {number}" for number in found.numbers))
        parts += ["", table_text(Table(header, springs))]
    return "\n".join(parts)


def _write_state(found: Any, options: dict[str, Any]) -> list[Path]:
    """state.json and, where there is a shape, shape.png."""
    import jax

    import pneusma_jax as pj
    from fitting.data.publish import publish
    from fitting.report.figures import png
    from fitting.report.figures.shape import chain_figure
    from pneusma_jax.serial_chain.segments import chain_shape

    state = {"state.json": json.dumps(found.contract(), indent=1) + "\n"}
    if not found.converged:
        return publish(options["out"], state, options["force"])
    if hasattr(found, "chain"):
        chain, solved, title = found.chain, found.found, found.design.name
    else:
        chain, title = pj.chain_of(found.actuator.with_loads()), found.title
        one = jax.tree.map(lambda x: x, found.found)
        shape = chain_shape(chain, one.bend[None], one.length[None])
        solved = pj.ChainEquilibrium((one,), shape)
    title = f"{title} at {options['pressure']:g} kPa"
    shape = {"shape.png": png(chain_figure(chain, solved, title))}
    return publish(options["out"], state | shape, options["force"])


def protocol(options: dict[str, Any]) -> None:
    """A protocol done to an actuator, a chain, a spring or a tube."""
    from fitting.data.protocols import load_protocol
    from fitting.data.publish import publish
    from fitting.report.figures import png
    from fitting.report.figures.protocol import protocol_figure

    _check_out(options)
    model = model_of(options)
    steps = load_protocol(table_argument(options["protocol"]))
    course = _course(steps, options, model)
    comments = [course.title, steps.description] if steps.description else [course.title]
    documents = {
        "model.csv": csv_text(course.columns, comments), "model.png": png(protocol_figure(course)),
    }  # fmt: skip
    if course.chain is not None:
        documents |= _chain_documents(course, options["animate"])
    written = publish(options["out"], documents, options["force"])
    for sentence in course.notices:
        notice(sentence)
    click.echo(_ends(course))
    done(written)


def _course(steps: Any, options: dict[str, Any], model: AugmentedModel) -> Any:
    from fitting.simulate.chain_state import build_chain, chain_specimens
    from fitting.simulate.protocol import run_chain_protocol, run_protocol
    from fitting.simulate.state import described_specimen

    known = overrides(options, model)
    if describes_chain(known.get("design", "")):
        design, rest = _chain(known, options)
        for sentence in chain_without(model, history=True):
            notice(sentence)
        specimens = chain_specimens(design, rest)
        chain = build_chain(design, specimens, model)
        return run_chain_protocol(steps, design.name, chain, [specimens[name] for name in design.designs])
    if options["animate"]:
        raise click.UsageError("--animate goes with the --protocol of a chain")
    if steps.kind == "spring" and "design" in known:
        design = described_specimen("actuator", None, {"design": known.pop("design")}).full_geometry()
        if "active_coils" not in design:
            raise InputError(f"{design['design']} has no spring, but {steps.path} is for one")
        known = {key: design[key] for key in SPRING_KEYS if key in design} | known
    elif steps.kind != "actuator":
        known.pop("design", None)
    return run_protocol(steps, described_specimen(steps.kind, options["geometry"], known), model)


def _chain_documents(course: Any, animate: bool) -> dict[str, bytes]:
    """Figures of the chain's last shape and of its motion, by file name."""
    import jax
    import numpy as np

    from fitting.report.figures import png
    from fitting.report.figures.shape import animation, chain_figure
    from pneusma_jax.serial_chain.segments import ChainEquilibrium

    chain, history = course.chain
    good = np.flatnonzero(np.asarray(history.converged))
    if not good.size:
        return {}
    at = lambda tree: jax.tree.map(lambda leaf: np.asarray(leaf)[good[-1]], tree)  # noqa: E731
    last = ChainEquilibrium(
        tuple(at(part.rows) for part in history.segments), history.shape.row(int(good[-1]))
    )
    title = f"{course.title}, after {course.inputs['time_s'][good[-1]]:g} s"
    documents = {"shape.png": png(chain_figure(chain, last, title))}
    if animate:
        documents["motion.gif"] = animation(chain, history, course.pressure, course.inputs["time_s"])
    return documents


def _ends(course: Any) -> str:
    """Start, largest distance and end of each output."""
    import numpy as np

    rows = []
    for name, values in course.outputs.items():
        held = values[np.isfinite(values)]
        ends = [held[0], held.min(), held.max(), held[-1]] if held.size else [math.nan] * 4
        rows.append([name, str(held.size), *(f"{float(v):.5g}" for v in ends)])
    return f"{course.title}\n" + table_text(Table(("output", "rows", "start", "least", "most", "end"), rows))


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
