"""`pneusma plan`: the protocol of the first campaign on a spring of a new alloy."""

from pathlib import Path

import click

from ._common import COUNT, FINITE, SEED
from .synthesise import numbers_of


@click.command("plan")
@click.argument("specimen", required=False)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the protocol.")
@click.option("--geometry", type=click.Path(path_type=Path), help="TOML with a [geometry] table.")
@click.option("--tests", type=COUNT, default=9, show_default=True, help="At most; one for validation on top.")
@click.option(
    "--for", "wanted", multiple=True, metavar="NAME", help="A constant that matters; repeat for several."
)
@click.option(
    "--noise", multiple=True, metavar="force_N=0.004", callback=numbers_of, help="An instrument's 1-sigma."
)
@click.option(
    "--misfit", type=FINITE, default=0.02, show_default=True, help="Share by which the law itself errs."
)
@click.option("--draws", type=COUNT, default=8, show_default=True, help="Alloys to average over.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of these alloys.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def plan_command(specimen, out, geometry, tests, wanted, noise, misfit, draws, seed, force) -> None:
    """Plan the first campaign for a laboratory with a new alloy: tests, strains, set-points, speeds, repeats.

    SPECIMEN is what is known of the alloy (a table's name or file) or of the spring (a TOML with [geometry]).
    Without it, the alloy is a nitinol that nobody has characterised, in the published spring. The tests are
    chosen by what the model expects them to tell about beta, k, a and b.

    Writes protocol.toml, protocol.csv, protocol.html, report.json and expected_sd.png.
    """
    from fitting.cli._common import done, prepare
    from fitting.data.publish import check_free
    from fitting.inference.progress import Steps
    from fitting.plan import plan_campaign
    from fitting.plan.specimen import described
    from fitting.report.results import save, text

    check_free(out, force)
    alloy, dimensions = described(specimen, geometry)
    prepare()
    chosen = {"wanted": wanted} if wanted else {}
    with Steps("planning", total=5) as progress:
        plan = plan_campaign(
            alloy, dimensions, tests=tests, noise=noise, misfit=misfit, draws=draws, seed=seed,
            progress=progress, **chosen,
        )  # fmt: skip
    files = save(plan, out, force)
    click.echo(text(plan))
    click.echo()
    done(files)
