"""`pneusma invert`: the pressure and phases that make an actuator or a chain do what is wanted."""

from pathlib import Path
from typing import Any

import click

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
    tell_unused,
)

GOALS = ("curvature_1pm", "bend_angle_deg", "length_mm")
"""Options that state a goal of an actuator by one number; they are columns of targets, too."""
VECTOR_GOALS = ("tip_mm", "direction")
"""Options that state a goal by three numbers, for columns such as `tip_x_mm` and `direction_x`."""
USUAL_DESIGN = "pneusma2"
"""Design where neither an option nor the model states one."""
OF_SPRINGS = {"alloy": "--alloy", "xi0_min": "--xi0-min", "xi0_max": "--xi0-max"}
"""Options that mean nothing for a design without springs."""
MOST_TARGETS_WITH_ALL_WAYS = 20
"""Maximum number of targets for which other solutions are looked for, too: each costs further searches."""


@click.command("invert")
@click.option(
    "--design", metavar="NAME|FILE.toml", help="Actuator or chain; that of the model, or pneusma2."
)
@click.option("--curvature-1pm", type=FINITE, help="Wanted curvature of an actuator.")
@click.option("--bend-angle-deg", type=FINITE, help="Wanted bend angle of an actuator.")
@click.option("--length-mm", type=FINITE, help="Wanted length of the centre line of an actuator.")
@click.option("--tip-mm", type=FINITE, nargs=3, metavar="X Y Z", help="Wanted place of the tip.")
@click.option("--direction", type=FINITE, nargs=3, metavar="X Y Z", help="Wanted direction of the tip.")
@click.option(
    "--targets", type=click.Path(path_type=Path), help="CSV of targets; with time_s, one after the other."
)
@click.option("--lumen", type=click.Path(path_type=Path), help="CSV of a centre line with a diameter.")
@click.option("--clearance-mm", type=Finite(0.0), help="To the lumen's wall; 0 by default.")
@click.option(
    "--pressure-kPa-max", "most", type=FINITE, default=50.0, show_default=True, help="Highest gauge pressure."
)
@click.option(
    "--pressure-kPa-min", "least", type=FINITE, default=0.0, show_default=True, help="Lowest gauge pressure."
)
@click.option(
    "--xi0-min", type=Finite(0.0, 1.0, max_open=True), default=0.1, show_default=True,
    help="Martensite fraction of the hottest spring.",
)  # fmt: skip
@click.option(
    "--xi0-max", type=Finite(0.0, 1.0, min_open=True),
    help="Martensite fraction of the coldest spring; by default that without a current in air of 22 degC.",
)  # fmt: skip
@click.option("--alloy", help="Name or path of an alloy table; the design's own by default.")
@click.option("--material", help="Name or path of a silicone table; the design's own by default.")
@click.option("--model", type=click.Path(path_type=Path), help="A model on disk, instead of the base model.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of the starts of chains.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for results.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def invert_command(**options: Any) -> None:
    """Find the pressure and the martensite fractions, resistances and currents for what is wanted.

    One target by options, many by --targets, or a --lumen that a chain is to follow. The least heating is
    chosen; other ways are listed. What cannot be reached is missed by as little as possible, and the bounds
    that hold it are named; the exit code then is 1. Targets with time respect what heated springs lose
    (docs/invert.md).
    """
    wanted = _wanted(options)
    if not -100.0 < options["least"] <= options["most"] < 1000.0:
        raise click.UsageError(
            "pressures must ascend from --pressure-kPa-min to --pressure-kPa-max, from -100 to 1000"
        )
    design = None if options["design"] is None else design_argument(options["design"])
    prepare()
    from fitting.data.publish import check_free
    from fitting.design.bodies import remarks_on_states
    from fitting.inference.progress import Steps
    from fitting.invert import Inverse, Limits
    from fitting.invert.lumen import read_lumen
    from fitting.invert.passage import pass_through
    from fitting.invert.targets import read_targets, targets_of
    from fitting.invert.trajectory import follow
    from fitting.report.results import save, text
    from pneusma_jax.pipeline import changes_states

    if options["out"] is not None:
        check_free(options["out"], options["force"])
    lumen = read_lumen(options["lumen"]) if options["lumen"] is not None else None
    targets = None
    if lumen is None:
        targets = (
            read_targets(options["targets"])
            if options["targets"] is not None
            else targets_of(wanted, "targets")
        )
    limits = Limits((1e3 * options["least"], 1e3 * options["most"]), options["xi0_min"], options["xi0_max"])
    model = model_of(options["model"], {"design": design} | {k: options[k] for k in ("alloy", "material")})
    design = design or model.tables.get("design", USUAL_DESIGN)
    changes = any(changes_states(effect) for effect in model.effects)
    if changes and (lumen is not None or targets.time is not None):
        raise click.UsageError(
            "effects of --model have no history here: give targets without time, and no --lumen"
        )
    tables = [
        model.tables.get(key) if options[key] is None else table_argument(options[key])
        for key in ("alloy", "material")
    ]
    with Steps("inverting", plain=True) as progress:
        progress("solving")
        inverse = Inverse(design, limits, *tables, options["seed"], model)
        for sentence in remarks_on_states(model, design):
            notice(sentence)
        if not inverse.springs:
            tell_unused(OF_SPRINGS, "there is no spring")
        if lumen is not None:
            result = pass_through(inverse, lumen, 1e-3 * (options["clearance_mm"] or 0.0))
            reached = result.passes
        elif targets.time is not None:
            result = follow(inverse, targets.goals, targets.wanted, targets.time)
            reached = bool(result.inversion.met.all())
        else:
            all_ways = len(targets.wanted) <= MOST_TARGETS_WITH_ALL_WAYS
            result = inverse.solve(targets.goals, targets.wanted, all_ways)
            reached = bool(result.met.all())
    click.echo(text(result))
    if options["out"] is not None:
        done(save(result, options["out"], options["force"]))
    raise SystemExit(0 if reached else 1)


def _wanted(options: dict[str, Any]) -> dict[str, list[float]]:
    """Columns of the one target that options describe; empty for `--targets` and `--lumen`.

    Raises:
        UsageError: if options say in no way what is wanted, or in more than one.
    """
    columns = {name: [options[name]] for name in GOALS if options[name] is not None}
    for name in VECTOR_GOALS:
        if options[name]:
            stem, _, unit = name.partition("_")
            columns |= {
                f"{stem}_{a}" + (f"_{unit}" if unit else ""): [x]
                for a, x in zip("xyz", options[name], strict=True)
            }
    ways = [bool(columns), options["targets"] is not None, options["lumen"] is not None]
    if options["clearance_mm"] is not None and options["lumen"] is None:
        raise click.UsageError("--clearance-mm is that to the wall of a --lumen, and there is none")
    if sum(ways) != 1:
        raise click.UsageError(
            "say what is wanted in one way: options such as --curvature-1pm, --targets, or --lumen"
        )
    return columns
