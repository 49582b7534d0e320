"""`pneusma wiring`: filters that select many springs on one pair of wires."""

from pathlib import Path
from typing import Any

import click

from ._common import FINITE, Finite, design_argument, done, prepare


@click.command("wiring")
@click.option(
    "--design", default="pneusma2", show_default=True, metavar="NAME|FILE.toml", help="Whose springs."
)
@click.option("--springs", type=click.IntRange(2, 40), help="How many; as many as fit if left out.")
@click.option("--from-kHz", "low", type=FINITE, default=10.0, show_default=True, help="Lowest frequency.")
@click.option("--to-kHz", "high", type=FINITE, default=100.0, show_default=True, help="Highest frequency.")
@click.option(
    "--inductance-uH-max", "coil", type=FINITE, default=1000.0, show_default=True, help="Largest coil."
)
@click.option(
    "--crosstalk-percent",
    "allowed",
    type=Finite(0.0, 100.0, min_open=True, max_open=True),
    default=1.0,
    show_default=True,
    help="Allowed heating of another spring.",
)
@click.option(
    "--voltage", type=FINITE, default=3.0, show_default=True, help="Of the supply, root mean square [V]."
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for results.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def wiring_command(**options: Any) -> None:
    """Choose coils and capacitors so that the frequency of one supply selects the spring that it heats.

    Without --springs, finds how many fit between the frequencies. Exit code 1 where the crosstalk is not
    kept.
    """
    design = design_argument(options["design"])
    prepare()
    from fitting.data.publish import check_free
    from fitting.report.results import save, text
    from fitting.wiring.choose import MOST, Bounds, choose_filters, most_springs
    from fitting.wiring.springs import springs_of_design

    if options["out"] is not None:
        check_free(options["out"], options["force"])
    springs = springs_of_design(design)
    bounds = Bounds(
        1e3 * options["low"],
        1e3 * options["high"],
        (1e-6, 1e-6 * options["coil"]),
        voltage=options["voltage"],
    )
    allowed = 0.01 * options["allowed"]
    if options["springs"] is None:
        count, found = most_springs(springs, bounds, allowed)
        band = f"between {options['low']:g} and {options['high']:g} kHz"
        if found is None:
            click.echo(f"Not even two springs fit {band}; these are the best filters for two.")
        else:
            more = " or more" if count == MOST else ""
            click.echo(f"{count}{more} springs fit {band}.")
        result = found or choose_filters(springs, bounds, 2, allowed)
    else:
        result = choose_filters(springs, bounds, options["springs"], allowed)
    click.echo(text(result))
    if options["out"] is not None:
        done(save(result, options["out"], options["force"]))
    raise SystemExit(0 if result.kept else 1)
