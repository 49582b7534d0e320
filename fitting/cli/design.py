"""`pneusma design`: the dimensions of an actuator or a chain that do best what is wanted."""

from pathlib import Path

import click


@click.command("design")
@click.argument("study", type=click.Path(path_type=Path), metavar="NAME|STUDY.toml")
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--force", is_flag=True, help="Start over, and replace results and evaluations in the folder.")
def design_command(study: Path, out: Path, force: bool) -> None:
    """Find the dimensions of an actuator or a chain that do best what STUDY.toml wants (docs/design.md).

    Writes report.html, report.json, design.toml for `simulate --design`, figures, front.csv where there are
    several objectives, and evaluations.jsonl as it goes. A study that was killed goes on from that file, and
    ends with the same results.
    """
    from fitting.cli._common import done, prepare
    from fitting.data.publish import check_free
    from fitting.inference.progress import Steps

    prepare()
    from fitting.design import read_study, run_study
    from fitting.report.results import save, text

    wanted = read_study(study)
    check_free(out, force)
    log = out / "evaluations.jsonl"
    if force:
        log.unlink(missing_ok=True)
    with Steps(f"design {wanted.name}") as steps:
        result = run_study(wanted, log, steps)
    files = save(result, out, force=True)
    click.echo(text(result))
    click.echo()
    done([*files, log])
