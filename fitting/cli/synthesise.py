"""`pneusma synthesise`: a simulated campaign with a known truth."""

from pathlib import Path

import click

from pneusma_jax.errors import counted

from ._common import COUNT, FINITE, SEED


def numbers_of(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, float]:
    """`NAME=VALUE`, any number of times."""
    numbers: dict[str, float] = {}
    for text in given:
        name, _, value = (part.strip() for part in text.partition("="))
        try:
            number = float(value)
        except ValueError:
            raise click.BadParameter(f"{text!r} must be NAME=VALUE, for example {option.metavar}") from None
        if name in numbers:
            raise click.BadParameter(f"{name} is given twice; keep one")
        numbers[name] = number
    return numbers


@click.command("synthesise")
@click.argument("kind")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the campaign.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Same seed, same files.")
@click.option("--alloy", metavar="NAME", help="Nominal alloy, a name or a file; krl35 (wire: niti_wire).")
@click.option("--design", metavar="NAME", help="Of an actuator; pneusma2 by default.")
@click.option(
    "--spread",
    type=click.Choice(["tolerance", "prior", "none"]),
    default="tolerance",
    show_default=True,
    help="How far the truth lies from the nominal numbers; prior: a new alloy, from the table's priors.",
)
@click.option(
    "--tolerance", multiple=True, metavar="G_m=0.05", callback=numbers_of, help="Relative 1-sigma; 0: exact."
)
@click.option(
    "--truth", multiple=True, metavar="G_m=3.2", callback=numbers_of, help="A true number, in file units."
)
@click.option(
    "--noise", multiple=True, metavar="force_N=0.004", callback=numbers_of, help="An instrument's 1-sigma."
)
@click.option("--noise-time", "noise_time_s", type=FINITE, default=0.0, help="Correlation time of noise [s].")
@click.option("--drift", type=FINITE, default=0.0, help="Wander of a zero over a test [sigmas].")
@click.option("--tests", type=COUNT, help="Set-points (spring), stresses (wire), pulls or runs.")
@click.option("--interval", "interval_s", type=FINITE, metavar="S", help="Seconds between samples.")
@click.option("--ambient", "ambient_degC", type=FINITE, metavar="DEGC", help="Temperature of the laboratory.")
@click.option("--hide-truth", is_flag=True, help="For blind cases: no truth.json, no seed in the files.")
@click.option("--force", is_flag=True, help="Replace files that are in the folder already.")
def synthesise_command(kind: str, out: Path, hide_truth: bool, force: bool, **wishes: object) -> None:
    """Simulate a campaign of KIND (spring, wire, elastomer, tube, actuator) with instruments, a controller
    and a specimen that is not quite nominal.

    Writes recordings (real = false), campaign.toml and truth.json, which says what the specimen really was.

    A spring is tested cold, hot and at resistances that a PID controller holds by heating. At high strain it
    cannot hold them. The cold test is done in a chamber in which the wire is all martensite. --ambient 22
    shows what a warm room does.
    """
    from fitting.cli._common import done, prepare
    from fitting.synthesise import synthesise, write_synthetic
    from fitting.synthesise.registry import check_folder

    check_folder(out, force)
    prepare()
    made = synthesise(kind, reveal=not hide_truth, **wishes)
    files = write_synthetic(made, out, not hide_truth, force)
    rows = sum(len(recording) for recording in made.recordings)
    click.echo(f"{made.title}: {counted(len(made.recordings), 'recording')}, {counted(rows, 'row')}")
    done(files)
