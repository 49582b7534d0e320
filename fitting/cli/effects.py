"""`pneusma effects`: the physics that the published model leaves out, listed, explained and drawn."""

from pathlib import Path

import click

from .synthesise import numbers_of


@click.command("effects")
@click.argument("effect", required=False)
@click.option("--plot", is_flag=True, help="Draw what the effect does to a typical recording.")
@click.option("--kind", metavar="KIND", help="Of that recording, such as wire; its first by default.")
@click.option(
    "--set", "values", multiple=True, metavar="angle=2.5", callback=numbers_of, help="A parameter, SI."
)
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the figure and its numbers.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
def effects_command(effect, plot, kind, values, out, force) -> None:
    """List the catalogue of missing physics, or explain one EFFECT by its name.

    With --plot, simulates a typical protocol without the effect and with it, and writes EFFECT_KIND.png and
    EFFECT_KIND.csv into the folder of --out.
    """
    from fitting.report.effects import catalogue_table, described

    from ._common import done, prepare

    if effect is None:
        if plot or kind or values or out:
            raise click.UsageError("name the effect to be drawn: pneusma effects EFFECT --plot --out DIR")
        click.echo(catalogue_table())
        return
    if plot != (out is not None):
        raise click.UsageError("--plot and --out belong together")
    if not plot and (kind or values):
        raise click.UsageError("--kind and --set choose what --plot draws")
    prepare()
    text = described(effect)
    if not plot:
        click.echo(text)
        return
    from fitting.data.publish import check_free
    from fitting.report.effects import signature
    from fitting.specimens import specimen_of

    check_free(out, force)
    found = signature(effect, specimen_of(kind).letter if kind else None, values)
    files = _write(found, out, force)
    click.echo(f"{text}\n")
    for column, change in found.largest().items():
        click.echo(f"  largest change of {column}: {change:.3g}")
    done(files)


def _write(found, out: Path, force: bool) -> list[Path]:
    """The figure and its numbers."""
    from fitting.data.csv_text import csv_text
    from fitting.data.publish import publish
    from fitting.report.effects.figure import signature_figure
    from fitting.report.figures import png

    columns = dict(sorted(found.drive.items(), key=lambda item: item[0] != "time_s"))
    for name, values in found.without.items():
        columns |= {name: values, f"{name.rpartition('_')[0] or name}_with_effect": found.present[name]}
    stem = f"{found.slug}_{found.kind}"
    numbers = ", ".join(f"{name} = {value:g}" for name, value in found.parameters.items())
    comment = f"simulated: {found.slug} ({numbers}); *_with_effect in the unit of its neighbour"
    documents = {f"{stem}.png": png(signature_figure(found)), f"{stem}.csv": csv_text(columns, [comment])}
    return publish(out, documents, force)
