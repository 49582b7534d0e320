"""`pneusma reproduce`: the published figures and statements, by this model."""

from pathlib import Path

import click


@click.command("reproduce", short_help="Draw the published figures and check what the source states.")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def reproduce_command(out: Path, force: bool) -> None:
    """Draw the published figures that the model can draw, and check the source's statements by number.

    Writes report.html (the verdict first), statements.csv, report.json and one PNG per figure. Disagreements
    are counted, and explained where the reason is known.
    """
    from fitting.cli._common import done, prepare
    from fitting.data.publish import check_free
    from fitting.inference.progress import Steps
    from fitting.report.table import Table, table_text

    check_free(out, force)
    prepare()
    from validation.reproduction import ENTRIES, Verdict, reproduce, verdict_sentences

    with Steps("reproducing", total=len(ENTRIES), unit="figure") as progress:
        result = reproduce(progress=progress)
    files = result.save(out, force)
    rows = []
    for entry in result.entries:
        found = [judged.verdict for judged in result.about(entry)]
        rows.append([f"{entry.number}  {entry.title}", *(str(found.count(verdict)) for verdict in Verdict)])
    click.echo(table_text(Table(("figure", *(verdict.value for verdict in Verdict)), rows), indent=0))
    click.echo()
    for sentence in verdict_sentences(result):
        click.echo(sentence)
    click.echo()
    done(files)
