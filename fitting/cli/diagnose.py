"""`pneusma diagnose`: say what physics the model leaves out where recordings contradict it."""

from pathlib import Path
from typing import Any

import click

from ._common import SEED

SOME_FAILED = 1  # exit code


@click.command("diagnose")
@click.argument("campaigns", type=click.Path(path_type=Path), nargs=-1, required=True, metavar="CAMPAIGN...")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of everything random.")
@click.option("--alloy", metavar="ALLOY", help="Alloy to compare with, a name or a path; fit identifies it.")
@click.option("--material", metavar="SILICONE", help="Silicone to compare with, a name or a path, or fit.")
@click.option("--model", metavar="FILE", help="Model to start from, as --model of simulate takes it.")
@click.option("--thorough", is_flag=True, help="Fit twice as many candidates; takes about twice as long.")
@click.option("--effect", "asked", metavar="SLUG", multiple=True, help="Ask about an effect; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print report.json to stdout.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
@click.option("--resume", is_flag=True, help="Of several campaigns: keep those that are done and unchanged.")
@click.option(
    "--workers", type=click.IntRange(1, 256), help="Of several: start that many processes (extra cluster)."
)
@click.option(
    "--cluster", metavar="ADDRESS", help="Of several: a Dask scheduler, tcp://HOST:PORT (extra cluster)."
)
def diagnose_command(campaigns: tuple[Path, ...], out: Path, **options: Any) -> None:
    """Compare each CAMPAIGN (a folder of recordings, or one CSV) with the model and explain the mismatch.

    Refits the base model within its tolerances and tells whether what remains is more than noise. Then it
    tries every effect of the catalogue that such recordings can show. It proves what it finds on recordings
    that were not fitted. --alloy and --material take the place of what the recordings name. Writes
    report.html, report.json, figures and augmented.toml, a model that every other command takes with --model.
    If a law of the silicone was fitted first, it writes material.toml, too.

    Several campaigns get a folder each in --out as they are done, beside a table of all verdicts. One that
    cannot be used is reported and stops none of the others; the exit code is then 1.
    """
    if len(campaigns) > 1:
        _several(campaigns, out, options)
    elif options["resume"] or options["workers"] is not None or options["cluster"] is not None:
        raise click.UsageError("--resume, --workers and --cluster are for several campaigns")
    else:
        _one(campaigns[0], out, options)


def _asked(options: dict[str, Any]) -> Any:
    """Options of every campaign."""
    from fitting.cli._common import table_argument
    from fitting.diagnose.batch import Asked

    tables = {key: table_argument(options[key]) for key in ("alloy", "material") if options[key]}
    return Asked(options["seed"], tables, options["model"], options["thorough"], options["asked"])


def _one(campaign: Path, out: Path, options: dict[str, Any]) -> None:
    from fitting.cli._common import done, notice, prepare
    from fitting.data.publish import check_free, publish
    from fitting.data.recordings import read_campaign
    from fitting.inference.progress import Steps

    recordings = read_campaign(campaign)
    check_free(out, options["force"])
    prepare()

    from fitting.report import render
    from fitting.report.diagnosis.report import report_of
    from fitting.report.diagnosis.text import ask, base_model, untestable

    asked = _asked(options)
    start = asked.start()
    with Steps("diagnosing", plain=True) as told:
        conclusion = asked.conclusion(recordings, start, told)
    report = report_of(conclusion, recordings.title, asked.command(campaign, out), asked.seed, start)
    documents = render.documents(report)
    files = publish(out, documents, options["force"])
    for text in recordings.notices + conclusion.notes:
        notice(text)
    if options["as_json"]:
        click.echo(documents["report.json"], nl=False)
        return
    for sentence in report.verdict:
        click.echo(sentence)
    for one in conclusion.asked:
        click.echo(one["text"])
    for sentence in base_model(conclusion):
        click.echo(sentence)
    if not conclusion.named and not conclusion.asked:
        for sentence in filter(None, (untestable(conclusion), ask(conclusion))):
            click.echo(sentence)
    click.echo()
    done(files)


def _several(campaigns: tuple[Path, ...], out: Path, options: dict[str, Any]) -> None:
    from fitting.cli._common import check_places, done, notice, prepare, scheduler
    from fitting.cli._members import check_campaigns, free_store, watched
    from fitting.data.publish import MARK, check_free, publish

    force, resume = options["force"], options["resume"]
    check_places(options["workers"], options["cluster"])
    check_campaigns(campaigns)
    store = free_store(out / "diagnosed", "diagnoses", force, resume)
    check_free(out, force, goes_on=resume and store.holds_any)
    prepare()

    from fitting.diagnose.batch import Diagnosed, diagnose_batch, job_of
    from fitting.report.diagnosis.batch import present
    from fitting.report.results import save, text

    asked = _asked(options)
    asked.start()  # a model that is not there is refused at once, and not by every campaign
    job, files = job_of(campaigns, out, asked, present), []

    def write(member: Diagnosed) -> None:
        if member.done:
            files.extend(publish(out / member.name, member.documents, force or resume))

    with watched("diagnosing", len(campaigns), out, write) as (progress, finished, kept):
        with scheduler(options["workers"], options["cluster"]) as place:
            if force and not resume:
                store.clear()
            result = diagnose_batch(job, store, place, finished, kept, progress)
    for member in result.members:
        if member.problem:
            notice(f"{member.name}: {member.problem}")
    files += save(result, out, force=True)
    click.echo((out / MARK).read_text() if options["as_json"] else text(result), nl=not options["as_json"])
    if not options["as_json"]:
        click.echo()
        done(files)
    if not all(member.done for member in result.members):
        click.get_current_context().exit(SOME_FAILED)
