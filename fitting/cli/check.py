"""`pneusma check`: does the installed model compute what it should?"""

import click

from ._common import prepare

FAILED = 1  # exit code


@click.command("check", short_help="Check the installed model against exact values.")
@click.option("--failed", "only_failed", is_flag=True, help="Print only what fails.")
def check_command(only_failed: bool) -> None:
    """Check the installed model against hand-derived values, and its derivatives against differences.

    Prints one line per claim: PASS or FAIL, the model's value, the expected one, and the error beside its
    limit. The error is relative; it is absolute where zero is expected. Exit code 1 if anything fails.
    """
    prepare()
    from validation.self_check import run

    click.echo(f"{'':4}  {'value':>16} {'expected':>16} {'error':>8} {'limit':>8}  claim")
    group, count, failed = "", 0, 0
    for outcome in run():
        claim = outcome.claim
        count += 1
        failed += not outcome.passed
        if outcome.passed and only_failed:
            continue
        if claim.group != group:
            group = claim.group
            click.echo(f"\n{group}")
        verdict = "PASS" if outcome.passed else "FAIL"
        numbers = f"{outcome.value:16.9g} {outcome.expected:16.9g} {outcome.error:8.1e} {claim.limit:8.0e}"
        problem = f" ({' '.join(outcome.problem.split())})" if outcome.problem else ""
        click.echo(f"{verdict:4}  {numbers}  {claim.name}{problem}")
    click.echo(f"\n{count - failed} of {count} claims hold" + (f"; {failed} FAIL" if failed else ""))
    if failed:
        click.get_current_context().exit(FAILED)
