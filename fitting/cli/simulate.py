"""`pneusma simulate`: one state of an actuator, or every row of a recording."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from ._common import csv_text, done, notice, one_of, prepare, table_argument, words_table

NOT_CONVERGED = 1  # exit code
DESIGNS = ("pneusma1", "pneusma2", "pneuflex_s", "pneuflex_t", "pneuflex_w", "triad")
HORIZONTAL = {  # what a figure is drawn over
    "actuator": ("time_s",),
    "spring": ("time_s",),
    "elastomer": ("strain",),
    "tube": ("pressure_kPa",),
}
POINT_ONLY = "--pressure-kPa, --xi0-K and --resistance-K-ohm"


def _spring_options(command: Callable) -> Callable:
    """`--xi0-K` and `--resistance-K-ohm` for the three springs."""
    for k in (3, 2, 1):
        xi0 = click.option(
            f"--xi0-{k}", f"xi0_{k}", type=float, help=f"Martensite fraction of spring {k} (1: cold)."
        )
        ohm = click.option(f"--resistance-{k}-ohm", f"resistance_{k}", type=float, help="Or its resistance.")
        command = xi0(ohm(command))
    return command


@click.command("simulate", short_help="Predict one state of an actuator, or every row of a recording.")
@click.argument("recording", required=False, type=click.Path(path_type=Path), metavar="[RECORDING.csv]")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the results of a recording.")
@click.option("--design", metavar="NAME", help=f"One of {', '.join(DESIGNS)}. Default: pneusma2.")
@click.option("--pressure-kPa", "pressure", type=float, help="Gauge pressure.")
@_spring_options
@click.option(
    "--geometry",
    type=click.Path(path_type=Path),
    help="TOML file with a [geometry] table, as beside a recording.",
)
@click.option("--alloy", help="Name or path of an alloy table. Default: krl35.")
@click.option("--material", help="Name or path of a silicone table. Default: dragon_skin_10_fast.")
@click.option(
    "--raw-resistance", is_flag=True, help="Take every measured resistance as it is, noise included."
)
@click.option("--json", "as_json", is_flag=True, help="Print the state as one JSON object.")
def simulate_command(recording: Path | None, **options: Any) -> None:
    """Predict one state of an actuator, or every row of a recording.

    Without RECORDING.csv: the state at --pressure-kPa and the springs' martensite fractions or resistances;
    springs that nothing is said of are cold. Their residual strain is that of Eqs. 3.1 and 3.2 at the given
    fraction after the pre-strain 0.1924. Exit code 1 if force and moment cannot be balanced: a sentence on
    stderr says why, and the numbers are null.

    With RECORDING.csv: writes model.csv (the recording's columns and model_<output> for each), states.csv and
    model.png to --out. The springs' memory is carried from row to row.
    """
    given = {
        key: value
        for key, value in options.items()
        if key.startswith(("xi0_", "resistance_")) and value is not None
    }
    _check_choices(recording, given, options)
    prepare()
    if recording is None:
        _state(given, options)
    else:
        _recording(recording, options)


def _check_choices(recording: Path | None, given: dict[str, float], options: dict[str, Any]) -> None:
    """Refuse options that contradict each other, before anything slow is loaded."""
    if options["design"] is not None:
        one_of("--design", options["design"], DESIGNS)
    if recording is not None:
        if given or options["pressure"] is not None or options["as_json"]:
            raise click.UsageError(f"a recording brings its own inputs; leave out {POINT_ONLY} and --json")
        if options["out"] is None:
            raise click.UsageError("a recording needs --out DIR for its results")
        return
    if options["out"] is not None or options["raw_resistance"]:
        raise click.UsageError("--out and --raw-resistance go with a recording; name its CSV first")
    if options["pressure"] is None:
        raise click.UsageError("--pressure-kPa is missing (or name a recording's CSV)")
    _check_inputs(options["pressure"], given)


def _check_inputs(pressure: float, given: dict[str, float]) -> None:
    if not -100.0 < pressure < 1000.0:
        raise click.UsageError(f"--pressure-kPa {pressure:g} must be a gauge pressure between -100 and 1000")
    for name, value in given.items():
        number = name[-1]
        if name.startswith("xi0") and not 0.0 <= value <= 1.0:
            raise click.UsageError(f"--xi0-{number} {value:g} must be a fraction from 0 (hot) to 1 (cold)")
        if name.startswith("resistance") and not (value > 0.0 and math.isfinite(value)):
            raise click.UsageError(f"--resistance-{number}-ohm {value:g} must be a positive number of ohms")
        if name.startswith("xi0") and f"resistance_{number}" in given:
            raise click.UsageError(f"give either --xi0-{number} or --resistance-{number}-ohm, not both")


def _overrides(options: dict[str, Any]) -> dict[str, str]:
    """What the command line says about the specimen."""
    said = {"design": options["design"], "alloy": options["alloy"], "material": options["material"]}
    return {
        key: value if key == "design" else table_argument(value)
        for key, value in said.items()
        if value is not None
    }


def _state(given: dict[str, float], options: dict[str, Any]) -> None:
    from fitting.simulation.state import actuator_state, described_actuator

    specimen = described_actuator(options["geometry"], _overrides(options))
    state = actuator_state(specimen, 1e3 * options["pressure"], given)
    for sentence in state.notices:
        notice(sentence)
    if options["as_json"]:
        click.echo(json.dumps(state.contract()))
    else:
        click.echo(_words(state, options["pressure"]))
    if not state.converged:
        click.echo(f"{state.status}: {state.sentence}", err=True)
        click.get_current_context().exit(NOT_CONVERGED)


def _words(state: Any, pressure: float) -> str:
    """The state as a page."""
    parts = [f"{state.title} at {pressure:g} kPa: {state.status}", state.sentence, ""]
    parts.append(
        words_table(
            ("", "value", "unit"), [(n, f"{round(v, 9) + 0.0:.6g}", u) for n, v, u in state.quantities()], 2
        )
    )
    springs = state.spring_rows()
    if springs:
        header = ("", *(f"spring {number}" for number in state.numbers))
        parts += ["", words_table(header, springs, 2)]
    return "\n".join(parts)


def _recording(path: Path, options: dict[str, Any]) -> None:
    from fitting.recordings import read_campaign
    from fitting.report.figures import recording_figure, save_figure
    from fitting.report.files import check_folder, result_folder, write_whole
    from fitting.simulation import predict
    from fitting.simulation.state import read_geometry

    if path.is_dir():
        raise click.UsageError(f"{path} is a folder; name one recording's CSV in it")
    check_folder(options["out"])
    geometry = {} if options["geometry"] is None else read_geometry(options["geometry"])
    geometry |= _overrides(options)
    recording = read_campaign(path, {"geometry": geometry} if geometry else None).recordings[0]
    prediction = predict(recording, denoise=not options["raw_resistance"])
    if not prediction.outputs:
        raise click.UsageError(f"{path}: this recording holds nothing that the model predicts")
    folder = result_folder(options["out"])
    for sentence in recording.notices + prediction.notices:
        notice(sentence)
    model = {f"model_{name}": values for name, values in prediction.outputs.items()}
    written = [write_whole(folder / "model.csv", csv_text(recording.columns | model, recording.comments))]
    if prediction.states:
        clock = {name: recording.columns[name] for name in ("time_s",) if name in recording.columns}
        written.append(write_whole(folder / "states.csv", csv_text(clock | prediction.states)))
    horizontal = next(name for name in HORIZONTAL[recording.kind] if name in recording.columns)
    compared = {name: (recording.columns[name], values) for name, values in prediction.outputs.items()}
    figure = recording_figure(
        f"{recording.name} ({recording.kind})",
        (horizontal, recording.columns[horizontal]),
        compared,
        recording.noise,
    )
    written.append(save_figure(figure, folder / "model.png"))
    click.echo(_misfits(compared, recording.noise))
    done(written)


def _misfits(compared: dict[str, tuple], noise: dict[str, float]) -> str:
    """How far the model is from the recording, for each output."""
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
    return words_table(("output", "samples", "rmse", "mean of recording - model", "noise"), rows)
