"""`pneusma propagate`: uncertainty of inputs through the model, in chunks that survive a kill."""

from contextlib import suppress
from pathlib import Path

import click


@click.command("propagate")
@click.argument("study", type=click.Path(path_type=Path), metavar="STUDY.toml")
@click.option("--out", type=click.Path(path_type=Path), help="For chunks and results; not for --check alone.")
@click.option("--resume", is_flag=True, help="Go on with the chunks in --out, or add rows to a study.")
@click.option("--force", is_flag=True, help="Replace chunks and results that are in the folder already.")
@click.option(
    "--devices", type=click.IntRange(1, 256), help="CPU devices of this process. Default: its cores."
)
@click.option(
    "--workers", type=click.IntRange(1, 256), help="Start that many processes here (extra cluster)."
)
@click.option(
    "--cluster", metavar="ADDRESS", help="A running Dask scheduler, tcp://HOST:PORT (extra cluster)."
)
@click.option("--check", is_flag=True, help="Read the study, say what it would do, and compute nothing.")
def propagate_command(study, out, resume, force, devices, workers, cluster, check) -> None:
    """Propagate what STUDY.toml says of the inputs through the model (docs/propagate.md).

    Writes chunks of rows to --out as they are done, then report.html, report.json, tables and figures. A run
    that was ended goes on with --resume, and leaves the same bytes. More [sampling] rows in the file and
    --resume add rows.
    """
    from fitting.cli._common import check_places, done, notice, scheduler

    if out is None and not check:
        raise click.UsageError("Missing option '--out': the folder for chunks and results.")
    check_places(workers, cluster)
    _prepare(1 if workers or cluster else devices)
    from fitting.data.publish import check_free
    from fitting.engine import Rate
    from fitting.propagate import begun, build_problem, propagate, read_study
    from fitting.report.propagate import plan_text, speed
    from fitting.report.results import save, text

    problem = build_problem(read_study(study))
    if out is not None:
        check_free(out, force or begun(out))  # of what has begun, `propagate` says how to go on
    for sentence in problem.notices:
        notice(sentence)
    if check:
        click.echo(plan_text(problem))
        return
    with scheduler(workers, cluster) as place:
        result = propagate(
            problem, out, place, resume, force, lambda rows, there: Rate("propagating", rows, there)
        )
    files = save(result, out, force=True)
    click.echo(text(result))
    click.echo(f"\n{speed(result)}")
    done([*files, out / "chunks"])


def _prepare(devices: int | None) -> None:
    """Float64, and as many CPU devices as asked for: that must be said before JAX computes anything."""
    import os

    import jax

    from fitting.cli._common import prepare

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if jax.config.jax_num_cpu_devices < 1:
        with suppress(RuntimeError):  # this process has computed already, as in tests: its devices stay
            jax.config.update("jax_num_cpu_devices", devices or cores)
    prepare()
