"""`pneusma control`: a curvature held by the resistance of springs, on a plant that the controller does not
know."""

from pathlib import Path

import click

from ._common import FINITE, SEED, Finite, design_argument, done, notice, prepare, tell_model


@click.command("control")
@click.option(
    "--design", metavar="NAME|FILE.toml", help="Two springs, planar; that of the model, or pneusma2."
)
@click.option(
    "--model", type=click.Path(path_type=Path), help="A model on disk as the plant; else five effects."
)
@click.option("--level-1pm", type=FINITE, default=20.0, show_default=True, help="Curvature after the step.")
@click.option("--swing-1pm", type=FINITE, default=8.0, show_default=True, help="Amplitude of the sine.")
@click.option(
    "--pressure-kPa",
    "pressure",
    type=Finite(-100.0, 1000.0, min_open=True, max_open=True),
    default=20.0,
    show_default=True,
    help="Gauge pressure, constant.",
)
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of the noise.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for results.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def control_command(
    design: str | None, model: Path | None, level_1pm: float, swing_1pm: float, pressure: float, seed: int,
    out: Path, force: bool,
) -> None:  # fmt: skip
    """Drive an actuator to a curvature by resistances: a step, then a sine (docs/control.md).

    The plant has physics that the controller's model lacks. Each is run twice: without that physics in the
    controller's model, and with it. Writes report.html, report.json, control.csv and figures.
    Exit code 1 if the level is out of reach of the controller's own model. It is 1, too, if a plant has no
    equilibrium in some rows, and 2 if it has none in any row whose error counts.
    """
    design = None if design is None else design_argument(design)
    prepare()
    from fitting.control.sweep import USUAL_DESIGN, run_model, run_sweep, usual_loop
    from fitting.data.publish import check_free
    from fitting.inference.progress import Steps
    from fitting.report.results import save, text
    from fitting.specimens.saved_models import load_model
    from fitting.specimens.saved_models.left_out import only_on_instruments

    check_free(out, force)
    augmented = None if model is None else load_model(model)
    if augmented is not None:
        tell_model(augmented, {"design": design})
        for sentence in only_on_instruments(augmented):
            notice(sentence)
    loop = usual_loop(seed, level_1pm, swing_1pm, 1e3 * pressure)
    with Steps("control") as steps:
        if augmented is None:
            result = run_sweep(design or USUAL_DESIGN, loop=loop, progress=steps)
        else:
            result = run_model(design, augmented, loop, steps)
    files = save(result, out, force)
    click.echo(text(result))
    click.echo()
    done(files)
    raise SystemExit(0 if result.in_reach and result.balanced else 1)
