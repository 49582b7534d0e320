"""`pneusma simulate`: one state of an actuator or a chain, a protocol, or every row of a recording."""

from pathlib import Path
from typing import Any

import click

from ._common import FINITE, design_argument, prepare
from ._drives import spring_inputs, spring_options

POINT_ONLY = "--pressure-kPa, --xi0-K and --resistance-K-ohm"


@click.command("simulate", short_help="Predict one state of an actuator, a protocol, or a recording.")
@click.argument("recording", required=False, type=click.Path(path_type=Path), metavar="[RECORDING.csv]")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for results; needed but for one state.")
@click.option(
    "--design", metavar="NAME|FILE.toml",
    help="A design by name, or the table of an actuator or chain (docs/actuators.md). Default: pneusma2.",
)  # fmt: skip
@click.option("--pressure-kPa", "pressure", type=FINITE, help="Gauge pressure.")
@spring_options
@click.option("--protocol", metavar="NAME|FILE.toml", help="What is done over time (docs/protocols.md).")
@click.option(
    "--geometry",
    type=click.Path(path_type=Path),
    help="TOML file with a [geometry] table, as beside a recording.",
)
@click.option("--alloy", help="Name or path of an alloy table. Default: krl35.")
@click.option("--material", help="Name or path of a silicone table. Default: dragon_skin_10_fast.")
@click.option("--model", type=click.Path(path_type=Path), help="A model on disk, instead of the base model.")
@click.option(
    "--raw-resistance", is_flag=True, help="Take every measured resistance as it is, noise included."
)
@click.option("--animate", is_flag=True, help="Of a chain's protocol: write motion.gif, too.")
@click.option("--json", "as_json", is_flag=True, help="Print the state as one JSON object.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def simulate_command(recording: Path | None, **options: Any) -> None:
    """Predict one state of an actuator or chain, a protocol, or every row of a recording.

    One state: at --pressure-kPa and the springs' martensite fractions or resistances; springs that nothing is
    said of are cold. Their residual strain is that of Eqs. 3.1 and 3.2 at the given fraction after the
    pre-strain 0.1924. Exit code 1 if force and moment cannot be balanced: a sentence on stderr says why, and
    the numbers are null. With --out, state.json and shape.png are written.

    --protocol: writes model.csv and model.png to --out; of a chain shape.png, too.

    RECORDING.csv: writes model.csv (the recording's columns and model_<output> for each), states.csv and
    model.png to --out. The springs' memory is carried from row to row.
    """
    inputs = spring_inputs(options)
    _check_choices(recording, inputs, options)
    if options["design"] is not None:
        options["design"] = design_argument(options["design"])
    prepare()
    from . import _simulated

    if recording is not None:
        _simulated.recording(recording, options)
    elif options["protocol"] is not None:
        _simulated.protocol(options)
    else:
        _simulated.state(inputs, options)


def _check_choices(recording: Path | None, inputs: list, options: dict[str, Any]) -> None:
    """Refuse options that contradict each other, before anything slow is loaded."""
    point = bool(inputs) or options["pressure"] is not None or options["as_json"]
    for what, given in (("a recording", recording), ("a protocol", options["protocol"])):
        if given is not None and point:
            raise click.UsageError(f"{what} brings its own inputs; leave out {POINT_ONLY} and --json")
        if given is not None and options["out"] is None:
            raise click.UsageError(f"{what} needs --out DIR for its results")
    if recording is not None and options["protocol"] is not None:
        raise click.UsageError("give either a recording or --protocol, not both")
    if options["raw_resistance"] and recording is None:
        raise click.UsageError("--raw-resistance goes with a recording; name its CSV first")
    if options["animate"] and options["protocol"] is None:
        raise click.UsageError("--animate goes with the --protocol of a chain")
    if recording is None and options["protocol"] is None:
        pressure = options["pressure"]
        if pressure is None:
            raise click.UsageError("--pressure-kPa is missing (or --protocol, or a recording's CSV)")
        if not -100.0 < pressure < 1000.0:
            raise click.UsageError(
                f"--pressure-kPa {pressure:g} must be a gauge pressure between -100 and 1000"
            )
