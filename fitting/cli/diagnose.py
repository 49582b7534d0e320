"""`pneusma diagnose`: say what physics the model leaves out where recordings contradict it."""

import shlex
from pathlib import Path

import click


@click.command("diagnose")
@click.argument("campaign", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of everything random.")
@click.option("--alloy", metavar="ALLOY", help="Alloy to compare with, a name or a path; fit identifies it.")
@click.option("--material", metavar="SILICONE", help="Silicone to compare with, a name or a path, or fit.")
@click.option("--model", metavar="FILE", help="Model to start from, as --model of simulate takes it.")
@click.option("--thorough", is_flag=True, help="Fit twice as many candidates; takes about twice as long.")
@click.option("--effect", "asked", metavar="SLUG", multiple=True, help="Ask about an effect; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print report.json to stdout.")
@click.option("--force", is_flag=True, help="Replace results that are in the folder already.")
def diagnose_command(
    campaign: Path,
    out: Path,
    seed: int,
    alloy: str | None,
    material: str | None,
    model: str | None,
    thorough: bool,
    asked: tuple[str, ...],
    as_json: bool,
    force: bool,
) -> None:
    """Compare CAMPAIGN (a folder of recordings, or one CSV) with the model and explain the mismatch.

    Refits the base model within its tolerances, tells whether what remains is more than noise, tries every
    effect of the catalogue that such recordings can show, and proves what it finds on recordings that were
    not fitted. --alloy and --material take the place of what the recordings name. Writes report.html,
    report.json, augmented.toml (a model that every other command takes with --model) and figures; where a law
    of the silicone was fitted first, material.toml, too.
    """
    from fitting.cli._common import done, notice, prepare, table_argument
    from fitting.data.publish import check_free, publish
    from fitting.data.recordings import read_campaign
    from fitting.inference.progress import Steps
    from fitting.specimens.saved_models.files import load_model

    named = {key: table_argument(x) for key, x in (("alloy", alloy), ("material", material)) if x}
    recordings = read_campaign(campaign)
    check_free(out, force)
    prepare()

    from fitting.diagnose import diagnose
    from fitting.diagnose.check import with_tables
    from fitting.report import render
    from fitting.report.diagnosis.report import report_of

    words = ["pneusma", "diagnose", str(campaign), "--out", str(out), "--seed", str(seed)]
    words += [word for key, x in (("--alloy", alloy), ("--material", material)) if x for word in (key, x)]
    words += (["--model", model] if model else []) + (["--thorough"] if thorough else [])
    words += [word for slug in asked for word in ("--effect", slug)]
    command = shlex.join(words)
    recordings = with_tables(recordings, named)
    start = load_model(model) if model else None
    with Steps("diagnosing", plain=True) as told:
        conclusion = diagnose(recordings, seed, told, start, thorough, asked)
    report = report_of(conclusion, recordings.title, command, seed, start)
    documents = render.documents(report)
    files = publish(out, documents, force)
    for text in recordings.notices + conclusion.notes:
        notice(text)
    if as_json:
        click.echo(documents["report.json"], nl=False)
        return
    for sentence in report.verdict:
        click.echo(sentence)
    for one in conclusion.asked:
        click.echo(one["text"])
    click.echo()
    done(files)
