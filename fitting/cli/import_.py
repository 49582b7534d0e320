"""`pneusma import`: raw laboratory files in, recordings out, after showing what was understood."""

from pathlib import Path

import click

from ._common import FINITE

SOME_REFUSED = 1  # exit code


@click.command("import", epilog="Formats are recognised by content; `pneusma import --formats` lists them.")
@click.argument("sources", nargs=-1, type=click.Path(path_type=Path), metavar="SOURCE...")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for the recordings.")
@click.option("--kind", help="spring, wire, elastomer, tube or actuator; from the file by default.")
@click.option("--format", "format_", metavar="NAME", help="Raw format, where a file could be of several.")
@click.option(
    "--map",
    "columns",
    multiple=True,
    metavar="QUANTITY=COLUMN",
    help='Column of a quantity by heading or number, e.g. strain="Engineering Strain" or stress=3.',
)
@click.option(
    "--unit", "units", multiple=True, metavar="QUANTITY=UNIT", help="Unit of a raw column, e.g. stress=MPa."
)
@click.option(
    "--scale", "scales", multiple=True, metavar="QUANTITY=FACTOR", help="Factor on a quantity, e.g. force=-1."
)
@click.option(
    "--dimension",
    "dimensions",
    multiple=True,
    metavar="NAME=SIZE",
    help="Size of the specimen, e.g. gauge_length_mm=50, or wire_diameter_mm=0.25 of a spring.",
)
@click.option(
    "--constant",
    "constants",
    multiple=True,
    metavar="NAME_UNIT=VALUE",
    help="What did not change during the test and is not in the file, e.g. temperature_degC=22.",
)
@click.option(
    "--subtract",
    "subtracted",
    multiple=True,
    metavar="NAME_UNIT=VALUE",
    help="What is taken off a column: a zero, or pressure_kPa=101.325 of an absolute pressure.",
)
@click.option(
    "--compression/--tension",
    "compression",
    default=None,
    help="The specimen was pressed (strain and stress become negative), or pulled; from the file by default.",
)
@click.option(
    "--slack",
    metavar="auto|fit|keep|STRAIN",
    help="Slack at the start. auto: found and taken off. fit: left to every fit, with the load cell's zero. "
    "keep: left as it is. STRAIN: where the specimen grew taut (mm of a spring).",
)
@click.option(
    "--rows",
    multiple=True,
    metavar="[TEST=]FIRST:LAST",
    help="Rows to keep, as messages number them, both included: 1:350, 20: or :99,120:. All others are left"
    " out. Of several tests, TEST names the one that is meant.",
)
@click.option(
    "--sheet", metavar="NAME", help="Sheet to read, by name or number; all that hold a test by default."
)
@click.option(
    "--circuit",
    "circuit",
    multiple=True,
    metavar="NAME=VALUE",
    help="Circuit of a raw voltage: adjust_V and set_ohm of Eq. 2.50 of Allen's dissertation; gain and"
    " offset_V of an amplifier.",
)
@click.option(
    "--interval", "interval_s", type=FINITE, metavar="S", help="Seconds between rows of a file without clock."
)
@click.option(
    "--speed",
    metavar="10mm/min",
    help="Constant speed of a machine whose file has no displacement: it is made of the clock, of one ramp.",
)
@click.option("--licence", help="Who may use these numbers, and how; not needed for numbers of your own.")
@click.option("--citation", help="Who measured them.")
@click.option(
    "--specimen",
    help="Name of the specimen; recordings of one specimen share parameters. Of a file with several tests, it"
    " picks the one that is called so.",
)
@click.option(
    "--successive",
    is_flag=True,
    help="The files are tests of one specimen, one after the other in this order: join them, so that what it"
    " remembers is seen.",
)
@click.option("--role", default="fit", show_default=True, help="fit, or validation.")
@click.option("--preview", is_flag=True, help="Show what was understood and write nothing.")
@click.option("--force", is_flag=True, help="Replace recordings of the same name in the folder.")
@click.option("--formats", "list_formats", is_flag=True, help="List the raw formats that are known.")
def import_command(
    sources: tuple[Path, ...],
    out: Path | None,
    format_: str | None,
    preview: bool,
    force: bool,
    list_formats: bool,
    **stated: object,
) -> None:
    """Turn raw files of a laboratory into recordings (NAME.csv and NAME.toml).

    SOURCE is a text file (.lvm, too), an .xlsx, .xlsm or .mat, or a folder of them (.xls and .ods by the
    extra workbooks); each test in a file becomes a recording. What was understood is printed: kind, columns,
    units, ranges, rows dropped and why; lines that begin with "check" are to be looked at. Nothing is
    written with --preview, nor if a file that you name cannot be used, nor if an option is of use for
    nothing. Of a folder, a file that cannot be used gets a line of its own and stops none of the others; the
    exit code is then 1.
    """
    from fitting.data.importers import FORMATS, import_files, left_in_folders, make_options, raw_files
    from fitting.data.importers.preview import describe_all
    from fitting.data.publish import MARK
    from fitting.data.recordings import write_recordings
    from pneusma_jax.errors import InputError, counted

    if list_formats:
        for known in FORMATS:
            click.echo(f"{known.name:<20}{'refused: ' * known.refuses}{known.about}")
        return
    if not sources:
        raise click.UsageError("name one or more files to import")
    if out is None and not preview:
        raise click.UsageError("name a folder with --out DIR, or only look with --preview")
    # `stated` has the other options under the names of their parameters, which are those of `make_options`
    options = make_options(format=format_, **stated)
    folder = next((source for source in sources if source.is_dir()), None)
    if options.successive and folder is not None:
        raise click.UsageError(
            f"--successive: {folder} is a folder; name its files in the order of the tests"
        )
    if out is not None and (out / MARK).exists() and not force:
        raise InputError(f"{out}: results of another command are here, not recordings; choose another folder")
    refused: list[InputError] = []
    files, aside = raw_files(sources, refused)
    from_folders = [file for file in files if file not in sources]
    recordings = import_files(files, options, from_folders, refused)
    for text in describe_all(recordings):
        click.echo(text + "\n")
    for file in aside:
        click.echo(f"left aside: {file} holds no table of numbers")
    for line in left_in_folders(sources):
        click.echo(f"check: left aside: {line}")
    named = [one for one in recordings if one.specimen == one.name]
    if len(named) > 1 and not options.specimen:
        click.echo(
            f"check: each of {len(named)} recordings is taken as a specimen of its own, with its own"
            " constants; if they are of one, --specimen NAME says so"
        )
    if preview:
        click.echo("nothing written (--preview)")
    else:
        for target in write_recordings(recordings, out, force):
            click.echo(f"wrote {target} and {target.with_suffix('.toml').name}")
    for error in refused:
        click.echo(f"pneusma: {error}", err=True)
    if refused:
        click.echo(f"pneusma: {counted(len(refused), 'file')} of the folder not imported", err=True)
        click.get_current_context().exit(SOME_REFUSED)
