"""`pneusma workspace`: where the designs can bend."""

from pathlib import Path

import click

from ._common import csv_text, done, notice, one_of, prepare, words_table

PLANAR = ("pneuflex_s", "pneuflex_t", "pneuflex_w", "pneusma1", "pneusma2")


@click.command("workspace", short_help="Curvature and bend angle over pressure and activation.")
@click.option(
    "--out", required=True, type=click.Path(path_type=Path), help="Folder for workspace.csv and the figures."
)
@click.option(
    "--design", "designs", multiple=True, metavar="NAME",
    help="A design; repeat for several. Default: pneuflex_s, pneusma1, pneusma2.",
)  # fmt: skip
@click.option(
    "--pressure-kPa-max",
    "pressure_max",
    type=float,
    default=60.0,
    show_default=True,
    help="Highest gauge pressure.",
)
@click.option(
    "--pressure-kPa-min",
    "pressure_min",
    type=float,
    default=0.0,
    show_default=True,
    help="Lowest gauge pressure.",
)
@click.option(
    "--pressures", type=click.IntRange(2, 2000), default=31, show_default=True, help="Steps of pressure."
)
@click.option(
    "--xi0-min", type=click.FloatRange(0.0, 1.0, max_open=True), default=0.1, show_default=True,
    help="Martensite fraction of the hottest spring; the coldest is at 1.",
)  # fmt: skip
@click.option(
    "--activations", type=click.IntRange(2, 2000), default=19, show_default=True, help="Steps of activation."
)
@click.option("--alloy", default="krl35", show_default=True, help="Name or path of an alloy table.")
@click.option(
    "--material", default="dragon_skin_10_fast", show_default=True, help="Name or path of a silicone table."
)
def workspace_command(
    out: Path,
    designs: tuple[str, ...],
    pressure_min: float,
    pressure_max: float,
    pressures: int,
    xi0_min: float,
    activations: int,
    alloy: str,
    material: str,
) -> None:
    """Reachable curvature and bend angle over pressure and activation (the source's Fig. 3.25).

    In a design with two springs one is heated at a time. Writes workspace.csv with every state, workspace.png
    and activation.png. A state without result is empty in the CSV, says why in its column `status`, and is
    counted here.
    """
    for design in designs:
        one_of("--design", design, PLANAR)
    if not -100.0 < pressure_min < pressure_max < 1000.0:
        raise click.UsageError(
            "pressures must ascend from --pressure-kPa-min to --pressure-kPa-max, between -100 and 1000"
        )
    prepare()
    import numpy as np

    from fitting.report.figures import save_figure
    from fitting.report.files import check_folder, result_folder, write_whole
    from fitting.report.workspace_figure import activation_figure, workspace_figure
    from fitting.workspace import DESIGNS, compute_workspace, join_columns

    check_folder(out)
    pressure = 1e3 * np.linspace(pressure_min, pressure_max, pressures)
    xi0 = np.linspace(1.0, xi0_min, activations)
    chosen = list(dict.fromkeys(designs)) or DESIGNS
    spaces = [compute_workspace(design, pressure, xi0, alloy, material) for design in chosen]
    folder = result_folder(out)
    _report(spaces)
    written = [write_whole(folder / "workspace.csv", csv_text(join_columns(spaces)))]
    solved = [space for space in spaces if space.solved]
    if solved:
        written.append(save_figure(workspace_figure(solved), folder / "workspace.png"))
    heated = [space for space in solved if space.heated != (0,)]
    if heated:
        written.append(save_figure(activation_figure(heated), folder / "activation.png"))
    done(written)


def _report(spaces: list) -> None:
    """Ranges as a table on stdout, what to read with care on stderr."""
    import numpy as np

    rows = []
    for space in spaces:
        reached = [f"{space.solved} of {space.curvature.size}"]
        for values in (space.curvature, np.rad2deg(space.bend)):
            ends = (np.nanmin(values), np.nanmax(values)) if space.solved else (np.nan, np.nan)
            reached.append(f"{round(ends[0], 1) + 0.0} to {round(ends[1], 1) + 0.0}")
        rows.append([space.design, *reached])
        for caution in space.cautions:
            notice(f"{space.design}: {caution}")
    click.echo(words_table(("design", "states found", "curvature [1/m]", "bend angle [deg]"), rows))
