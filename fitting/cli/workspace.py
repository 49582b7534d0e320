"""`pneusma workspace`: where actuators and chains can bend."""

import re
from pathlib import Path
from typing import Any

import click

from fitting.data.csv_text import csv_text
from fitting.report.table import Table, table_text

from ._common import (
    FINITE,
    SEED,
    Finite,
    design_argument,
    done,
    model_of,
    notice,
    prepare,
    table_argument,
    tell_model,
    tell_unused,
)

OF_SPRINGS = {"alloy": "--alloy", "xi0_min": "--xi0-min", "activations": "--activations"}
OF_CHAINS = {"samples": "--samples", "seed": "--seed"}


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
    type=FINITE,
    default=60.0,
    show_default=True,
    help="Highest gauge pressure.",
)
@click.option(
    "--pressure-kPa-min",
    "pressure_min",
    type=FINITE,
    default=0.0,
    show_default=True,
    help="Lowest gauge pressure.",
)
@click.option(
    "--pressures", type=click.IntRange(2, 2000), default=31, show_default=True, help="Steps of pressure."
)
@click.option(
    "--xi0-min", type=Finite(0.0, 1.0, max_open=True), default=0.1, show_default=True,
    help="Martensite fraction of the hottest spring; the coldest is at 1.",
)  # fmt: skip
@click.option(
    "--activations", type=click.IntRange(2, 2000), default=19, show_default=True, help="Steps of activation."
)
@click.option(
    "--samples", type=click.IntRange(1, 100_000), default=500, show_default=True,
    help="Of a chain: combinations of its segments' states at each pressure.",
)  # fmt: skip
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of those combinations.")
@click.option("--alloy", help="Name or path of an alloy table; the design's own by default.")
@click.option("--material", help="Name or path of a silicone table; the design's own by default.")
@click.option("--model", type=click.Path(path_type=Path), help="A model on disk, instead of the base model.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def workspace_command(out: Path, designs: tuple[str, ...], **options: Any) -> None:
    """Reachable curvature and bend angle over pressure and activation (the source's Fig. 3.25).

    Held in a plane, one spring is heated at a time; an actuator that bends freely also has every two heated
    together. Writes workspace.csv with every state, workspace.png, activation.png, and direction.png where
    there is free bending. A state without result is empty in the CSV, says why in its column `status`, and is
    counted here. Of a chain: tips_NAME.csv and tips_NAME.png; a tip without result is empty.
    """
    designs = tuple(design_argument(design) for design in designs)
    low, high = options["pressure_min"], options["pressure_max"]
    if not -100.0 < low < high < 1000.0:
        raise click.UsageError(
            "pressures must ascend from --pressure-kPa-min to --pressure-kPa-max, between -100 and 1000"
        )
    prepare()
    from fitting.data.publish import check_free, publish
    from fitting.simulate.workspace import DESIGNS
    from pneusma_jax.serial_chain.chain_files import describes_chain
    from pneusma_jax.serial_chain.designs import load_chain

    check_free(out, options["force"])
    model = model_of(options["model"])
    chosen = list(dict.fromkeys(designs)) or (
        [model.tables["design"]] if "design" in model.tables else DESIGNS
    )
    others = {key: options[key] for key in ("alloy", "material")}
    tell_model(model, *(others | {"design": design} for design in chosen))
    chains = [load_chain(design) for design in chosen if describes_chain(design)]
    spaces, reaches = _computed([d for d in chosen if not describes_chain(d)], chains, options, model)
    files = publish(out, _documents(spaces) | _reach_documents(reaches), options["force"])
    for space in (*spaces, *reaches):
        for caution in space.cautions:
            notice(f"{getattr(space, 'design', None) or space.name}: {caution}")
    if not any(space.springs for space in spaces) and not any(reach.fractions for reach in reaches):
        tell_unused(OF_SPRINGS, "there is no spring")
    if not reaches:
        tell_unused(OF_CHAINS, "there is no chain")
    _report(spaces, reaches)
    done(files)


def _computed(designs: list[str], chains: list, options: dict[str, Any], model: Any) -> tuple[list, list]:
    """Every state, with a bar on a terminal."""
    import numpy as np

    from fitting.inference.progress import Steps
    from fitting.simulate.workspace import compute_chain_reach, compute_workspace

    pressure = 1e3 * np.linspace(options["pressure_min"], options["pressure_max"], options["pressures"])
    xi0 = np.linspace(1.0, options["xi0_min"], options["activations"])
    names = [options["alloy"], options["material"]]
    tables = [table_argument(name) if name is not None else None for name in names]
    for key, place in (("alloy", 0), ("material", 1)):
        tables[place] = tables[place] or model.tables.get(key)
    with Steps("workspace", unit="state") as states:
        spaces, reaches = [], []
        for name in designs:
            states.say(f"states of {Path(name).stem}")
            spaces.append(compute_workspace(name, pressure, xi0, *tables, model, states.done))
        for chain in chains:
            states.say(f"tips of {chain.name}")
            shares = options["samples"], options["seed"]
            reaches.append(compute_chain_reach(chain, pressure, xi0, *shares, *tables, model, states.done))
    return spaces, reaches


def _documents(spaces: list) -> dict[str, str | bytes]:
    """Files of actuators, by name."""
    from fitting.report.figures import png
    from fitting.report.figures.workspace import activation_figure, direction_figure, workspace_figure
    from fitting.simulate.workspace import join_columns

    if not spaces:
        return {}
    solved = [space for space in spaces if space.solved]
    figures = (
        ("workspace", workspace_figure, solved),
        ("activation", activation_figure, [space for space in solved if space.springs]),
        ("direction", direction_figure, [space for space in solved if not space.planar]),
    )
    drawn = {f"{name}.png": png(draw(shown)) for name, draw, shown in figures if shown}
    return {"workspace.csv": csv_text(join_columns(spaces)), **drawn}


def _reach_documents(reaches: list) -> dict[str, str | bytes]:
    """Files of chains, by name."""
    from fitting.data.files import distinct_names
    from fitting.report.figures import png
    from fitting.report.figures.workspace import reach_figure

    documents: dict[str, str | bytes] = {}
    # a chain is named in its file, by any text
    names = distinct_names([re.sub(r"[^\w.() -]", "_", reach.name) for reach in reaches])
    for name, reach in zip(names, reaches, strict=True):
        documents[f"tips_{name}.csv"] = csv_text(reach.columns())
        documents[f"tips_{name}.png"] = png(reach_figure(reach))
    return documents


def _span(values: Any, digits: int) -> str:
    """The range of values in words, NaN left out; "none" where no state was found."""
    found = values[values == values]
    if not found.size:
        return "none"
    low, high = (round(float(end), digits) + 0.0 for end in (found.min(), found.max()))
    return f"{low:.{digits}f} to {high:.{digits}f}"


def _report(spaces: list, reaches: list) -> None:
    """Ranges as tables on stdout."""
    import numpy as np

    if spaces:
        rows = []
        for space in spaces:
            spans = [_span(values, 1) for values in (space.curvature, np.rad2deg(space.bend))]
            rows.append([space.design, f"{space.solved} of {space.curvature.size}", *spans])
        header = ("design", "states found", "curvature [1/m]", "bend angle [deg]")
        click.echo(table_text(Table(header, rows), indent=0))
    if reaches:
        rows = []
        for reach in reaches:
            found = 1e3 * reach.tip[np.isfinite(reach.tip).all(axis=1)]
            spans = [_span(values, 0) for values in found.T]
            rows.append([reach.name, f"{reach.solved} of {len(reach.tip)}", *spans])
        header = ("chain", "states found", "tip x [mm]", "tip y [mm]", "tip z [mm]")
        click.echo(table_text(Table(header, rows), indent=0))
