"""`pneusma characterise-batch`: many specimens, one table, one summary."""

from pathlib import Path

import click

from ._common import SEED

SOME_FAILED = 1  # exit code


@click.command("characterise-batch")
@click.argument("campaigns", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option("--out", type=click.Path(path_type=Path), required=True, help="Folder for the results.")
@click.option("--seed", type=SEED, default=0, show_default=True, help="Of scattered starting points.")
@click.option("--force", is_flag=True, help="Write into a folder that holds other files, too.")
@click.option(
    "--resume", is_flag=True, help="Go on with what an earlier run has fitted, if nothing of it changed."
)
@click.option(
    "--workers", type=click.IntRange(1, 256), help="Start that many processes here (extra cluster)."
)
@click.option(
    "--cluster", metavar="ADDRESS", help="A running Dask scheduler, tcp://HOST:PORT (extra cluster)."
)
@click.option(
    "--together",
    is_flag=True,
    help="Also sample the joint posterior of all specimens (tubes, wires, springs).",
)
def characterise_batch_command(campaigns, out, seed, force, resume, workers, cluster, together) -> None:
    """Characterise CAMPAIGNS (folders of recordings), and all of them together.

    Writes a folder of results for each campaign as it is done. A table over specimens has a hierarchical
    summary of every constant that two or more inform. A campaign that cannot be used is reported and stops
    none of the others; the exit code is then 1.
    """
    from fitting.calibrate.batch import Member, characterise_batch
    from fitting.cli._common import done, notice, prepare, scheduler
    from fitting.cli._members import check_campaigns, free_store, watched
    from fitting.data.publish import check_free
    from fitting.report.results import save, text

    check_campaigns(campaigns)
    store = free_store(out / "fitted", "fits", force, resume)
    check_free(out, force, goes_on=resume and store.holds_any)
    prepare()
    files: list[Path] = []

    def write(member: Member) -> None:
        if member.result is None:
            notice(f"{member.name}: {member.problem}")
        else:
            files.extend(save(member.result, out / member.name, force or resume))

    with watched("characterising", len(campaigns), out, write) as (progress, finished, kept):
        with scheduler(workers, cluster) as place:
            if force and not resume:
                store.clear()
            batch = characterise_batch(campaigns, finished, progress, store, place, kept, seed=seed)
    for member in batch.done:
        if member.problem:
            notice(f"{member.name}: {member.problem}")
    files += save(batch, out, force=True)
    click.echo(text(batch))
    click.echo()
    done(files)
    if together:
        folder = "together" if all(m.name != "together" for m in batch.members) else "all_together"
        done(_together(batch, out / folder, seed, force, resume))
    if any(member.result is None for member in batch.members):
        click.get_current_context().exit(SOME_FAILED)


def _together(batch, out: Path, seed: int, force: bool, resume: bool) -> list[Path]:
    """Sample the joint posterior of all specimens that were fitted, say what it found, and write it."""
    from fitting.report.results import save, text
    from fitting.sample.hierarchy import sample_together

    out.mkdir(parents=True, exist_ok=True)
    chain = out / "chain.h5"
    if force and not resume:
        chain.unlink(missing_ok=True)
    fits = {member.name: member.result for member in batch.done}
    joint = sample_together(fits, file=chain, resume=resume and chain.exists(), seed=seed)
    click.echo(text(joint))
    click.echo()
    return save(joint, out, force=True)
