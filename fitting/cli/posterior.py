"""`pneusma posterior`: sample the posterior of the parameters of a campaign."""

from pathlib import Path

import click

from ._common import COUNT, SEED


@click.command("posterior")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option(
    "--model",
    metavar="FILE",
    help="Model to sample, as --model of simulate takes it, or a table of constants whose priors are used.",
)
@click.option(
    "--sampler",
    type=click.Choice(["auto", "emcee", "nuts", "tempered"]),
    default="auto",
    show_default=True,
    help="emcee: ensembles around the fit. nuts: chains that follow gradients, for curved valleys. tempered: "
    "ensembles that start from the prior, for several modes, with evidence. auto: a pilot chooses one of the "
    "first two.",
)
@click.option(
    "--walkers", type=click.IntRange(2), help="Of each ensemble; by default 32, or four times the parameters."
)
@click.option("--ensembles", type=COUNT, default=4, show_default=True, help="Independent ones, for R-hat.")
@click.option(
    "--max-steps", type=COUNT, default=20000, show_default=True, help="Budget of steps of each ensemble."
)
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of everything random.")
@click.option("--resume", is_flag=True, help="Continue the chains in --out with the same data and settings.")
@click.option("--law", help="Elastomers: the law to fit and sample; by default the one that predicts best.")
@click.option("--force", is_flag=True, help="Replace results and chains that are in the folder already.")
def posterior_command(
    campaign, out, model, sampler, walkers, ensembles, max_steps, seed, resume, law, force
) -> None:
    """Sample the posterior of the parameters of CAMPAIGN (a folder of recordings, or one CSV).

    Fits first, then runs independent chains until they agree and are longer than 50 autocorrelation
    times, or says that they have not converged within --max-steps. Writes chain.h5 as it goes, then
    report.html, report.json, summary.csv, posterior.nc (for ArviZ) and figures. An interrupted run goes on
    with --resume.
    """
    from fitting.cli._common import done, notice, prepare, table_argument
    from fitting.data.publish import check_free
    from fitting.data.recordings import read_campaign
    from fitting.inference.progress import Steps
    from fitting.report.results import save, text
    from fitting.sample.campaign import sample_problem
    from fitting.sample.command import chain_file, problem_for
    from fitting.sample.settings import Settings

    recordings = read_campaign(campaign)
    settings = Settings(walkers, ensembles, max_steps, seed, sampler=sampler)
    chain = chain_file(out, resume, force, settings)
    check_free(out, force, goes_on=resume)
    prepare()
    with Steps("fitting") as progress:
        problem = problem_for(recordings, model and table_argument(model), law, seed, progress)
    result = sample_problem(problem, file=chain, resume=resume, **vars(settings))
    files = save(result, out, force=True)
    for sentence in recordings.notices:
        notice(sentence)
    click.echo(text(result))
    click.echo()
    done([*files, chain])
