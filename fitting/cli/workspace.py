"""`pneusma workspace`: where actuators and chains can bend."""

from pathlib import Path
from typing import Any

import click

from fitting.data.csv_text import csv_text
from fitting.report.text_table import words_table

from ._common import design_argument, done, notice, prepare, table_argument


@click.command("workspace", short_help="Curvature and bend angle over pressure and activation.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder for the results.")
@click.option(
    "--design", "designs", multiple=True, metavar="NAME|FILE.toml",
    help="A design, or the table of an actuator or chain; repeat for several. "
    "Default: pneuflex_s, pneusma1, pneusma2.",
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
@click.option(
    "--samples", type=click.IntRange(1, 100_000), default=500, show_default=True,
    help="Of a chain: combinations of its segments' states at each pressure.",
)  # fmt: skip
@click.option("--seed", type=int, default=0, show_default=True, help="Of those combinations.")
@click.option("--alloy", help="Name or path of an alloy table; the design's own by default.")
@click.option("--material", help="Name or path of a silicone table; the design's own by default.")
@click.option("--model", type=click.Path(path_type=Path), help="A model on disk, instead of the base model.")
def workspace_command(out: Path, designs: tuple[str, ...], **options: Any) -> None:
    """Reachable curvature and bend angle over pressure and activation (the source's Fig. 3.25).

    Held in a plane, one spring is heated at a time; an actuator that bends freely also has every two heated
    together. Writes workspace.csv with every state, workspace.png, activation.png, and direction.png where
    there is free bending. Of a chain: tips_NAME.csv and tips_NAME.png. A state without result is empty in the
    CSV, says why in its column `status`, and is counted here.
    """
    designs = tuple(design_argument(design) for design in designs)
    low, high = options["pressure_min"], options["pressure_max"]
    if not -100.0 < low < high < 1000.0:
        raise click.UsageError(
            "pressures must ascend from --pressure-kPa-min to --pressure-kPa-max, between -100 and 1000"
        )
    prepare()
    from fitting.data.files import check_folder, result_folder
    from fitting.simulate.workspace import DESIGNS
    from fitting.specimens.model_objects import BASE
    from fitting.specimens.saved_models import load_model
    from pneusma_jax.serial_chain.designs import describes_chain, load_chain

    check_folder(out)
    model = BASE if options["model"] is None else load_model(options["model"])
    chosen = list(dict.fromkeys(designs)) or (
        [model.tables["design"]] if "design" in model.tables else DESIGNS
    )
    chains = [load_chain(design) for design in chosen if describes_chain(design)]
    spaces, reaches = _computed([d for d in chosen if not describes_chain(d)], chains, options, model)
    folder = result_folder(out)
    for space in (*spaces, *reaches):
        for caution in space.cautions:
            notice(f"{getattr(space, 'design', None) or space.name}: {caution}")
    done(_written(folder, spaces) + _written_reaches(folder, reaches))


def _computed(designs: list[str], chains: list, options: dict[str, Any], model: Any) -> tuple[list, list]:
    """Every state, with a bar on a terminal."""
    import numpy as np
    from tqdm import tqdm

    from fitting.simulate.workspace import compute_chain_reach, compute_workspace

    pressure = 1e3 * np.linspace(options["pressure_min"], options["pressure_max"], options["pressures"])
    xi0 = np.linspace(1.0, options["xi0_min"], options["activations"])
    names = [options["alloy"], options["material"]]
    tables = [table_argument(name) if name is not None else None for name in names]
    for key, place in (("alloy", 0), ("material", 1)):
        tables[place] = tables[place] or model.tables.get(key)
    with tqdm(desc="solving", unit=" states", leave=False, disable=None) as bar:
        spaces = [compute_workspace(name, pressure, xi0, *tables, model, bar.update) for name in designs]
        reaches = [
            compute_chain_reach(
                chain, pressure, xi0, options["samples"], options["seed"], *tables, model, bar.update
            )
            for chain in chains
        ]
    return spaces, reaches


def _written(folder: Path, spaces: list) -> list[Path]:
    """Files of actuators, and their ranges as a table on stdout."""
    from fitting.data.files import write_whole
    from fitting.report.figures import save_figure
    from fitting.report.figures.workspace import activation_figure, direction_figure, workspace_figure
    from fitting.simulate.workspace import join_columns

    if not spaces:
        return []
    _report(spaces)
    written = [write_whole(folder / "workspace.csv", csv_text(join_columns(spaces)))]
    solved = [space for space in spaces if space.solved]
    for name, draw, shown in (
        ("workspace", workspace_figure, solved),
        ("activation", activation_figure, [space for space in solved if space.springs]),
        ("direction", direction_figure, [space for space in solved if not space.planar]),
    ):
        if shown:
            written.append(save_figure(draw(shown), folder / f"{name}.png"))
    return written


def _written_reaches(folder: Path, reaches: list) -> list[Path]:
    """Files of chains, and how far their tips reach."""
    import numpy as np

    from fitting.data.files import write_whole
    from fitting.report.figures import save_figure
    from fitting.report.figures.workspace import reach_figure

    written, rows = [], []
    for reach in reaches:
        found = 1e3 * reach.tip[np.isfinite(reach.tip).all(axis=1)]
        spans = [f"{low:.0f} to {high:.0f}" for low, high in zip(found.min(0), found.max(0), strict=True)]
        rows.append([reach.name, f"{reach.solved} of {len(reach.tip)}", *spans])
        written.append(write_whole(folder / f"tips_{reach.name}.csv", csv_text(reach.columns())))
        written.append(save_figure(reach_figure(reach), folder / f"tips_{reach.name}.png"))
    if rows:
        header = ("chain", "states found", "tip x [mm]", "tip y [mm]", "tip z [mm]")
        click.echo(words_table(header, rows))
    return written


def _report(spaces: list) -> None:
    """Ranges as a table on stdout."""
    import numpy as np

    rows = []
    for space in spaces:
        reached = [f"{space.solved} of {space.curvature.size}"]
        for values in (space.curvature, np.rad2deg(space.bend)):
            ends = (np.nanmin(values), np.nanmax(values)) if space.solved else (np.nan, np.nan)
            reached.append(f"{round(ends[0], 1) + 0.0} to {round(ends[1], 1) + 0.0}")
        rows.append([space.design, *reached])
    click.echo(words_table(("design", "states found", "curvature [1/m]", "bend angle [deg]"), rows))
