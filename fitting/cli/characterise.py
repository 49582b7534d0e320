"""`pneusma characterise`: fit a material to a campaign and report on it."""

from pathlib import Path

import click

from ._common import FINITE, SEED


def _fixed(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, dict] | None:
    """`NAME=VALUE` of `--fix` as changes to constants."""
    changes = {}
    for text in given:
        name, _, number = text.partition("=")
        try:
            changes[name.strip()] = {"value": float(number), "vary": False}
        except ValueError:
            raise click.BadParameter(f"{text!r} must be NAME=VALUE, for example p_5=0") from None
    return changes or None


@click.command("characterise")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option(
    "--law",
    type=click.Choice(["polynomial", "neo_hookean", "yeoh", "gent", "ogden", "all"]),
    help="Law of an elastomer; all of them are compared by default.",
)
@click.option("--terms", type=click.IntRange(1, 3), help="Terms of Ogden's law; 1 to 3 are tried by default.")
@click.option("--max-strain", type=FINITE, help="Leave out samples beyond this engineering strain.")
@click.option(
    "--weighting",
    type=click.Choice(["absolute", "relative"]),
    help="Residuals over the instrument's noise (default), or over that and 5 % of the stress.",
)
@click.option(
    "--fix",
    multiple=True,
    metavar="NAME=VALUE",
    callback=_fixed,
    help="Hold a constant, in its unit of files.",
)
@click.option(
    "--base", "--alloy", "base", metavar="ALLOY",
    help="Alloy to start from, a name or a path; fit identifies it, whatever the recordings name.",
)  # fmt: skip
@click.option(
    "--softer",
    type=click.Choice(["martensite", "austenite", "neither"]),
    help="The softer phase of an alloy that is to be found; without it martensite, unless tests contradict.",
)
@click.option("--material", metavar="SILICONE", help="Silicone to start from, a name or a path.")
@click.option("--model", metavar="FILE", help="Model to fit, as --model of simulate takes it.")
@click.option("--starts", type=click.IntRange(min=1), help="Fits in all, from different places.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of scattered starting points.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def characterise_command(
    campaign, out, law, terms, max_strain, weighting, fix, base, softer, material, model, starts, seed, force
) -> None:
    """Fit the material of CAMPAIGN (a folder of recordings, or one CSV) and write a report to --out.

    For elastomers: five hyperelastic laws with standard errors, compared by what they predict of data that
    they were not fitted to. Springs on a stand and wires give an alloy, tubes a silicone, whole actuators
    both, as far as their recordings leave them open. With --model its numbers and effects are fitted, and
    augmented.toml holds them. Writes alloy.toml or material.toml, report.json,
    report.html, parameters.csv and figures.
    """
    from fitting.calibrate.registry import characterise, pipeline_of
    from fitting.cli._common import done, notice, prepare, table_argument
    from fitting.data.publish import check_free
    from fitting.data.recordings import read_campaign
    from fitting.inference.progress import Steps
    from fitting.report.results import save, text
    from fitting.specimens.saved_models import load_model

    recordings = read_campaign(campaign)
    pipeline_of(recordings)
    loaded = load_model(model) if model else None
    check_free(out, force)
    prepare()
    with Steps("fitting", plain=True) as progress:
        result = characterise(
            recordings,
            law=law,
            terms=terms,
            max_strain=max_strain,
            weighting=weighting,
            adjust=fix,
            base=base and table_argument(base),
            softer=softer,
            material=material and table_argument(material),
            model=loaded,
            starts=starts,
            seed=seed,
            progress=progress,
        )
    files = save(result, out, force)
    for sentence in recordings.notices:
        notice(sentence)
    click.echo(text(result))
    click.echo()
    done(files)
