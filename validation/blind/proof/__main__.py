"""`python -m validation.blind.proof`: run the blind trial, score it, print its table, draw its figures.

    run      seal, diagnose (resumable), and score what is complete
    score    open the seals of the cases that have reports, score them, add a line to the ledger
    table    Markdown from the ledger
    figures  the four figures of a run
"""

import argparse
import sys
from pathlib import Path

from fitting.engine.place import place_of

from . import ledger, worker
from .figures import draw
from .places import Places, read, write
from .run import chosen_cases, keep_plan, run, truths
from .score import scored


def main(arguments=None):
    """Exit code 0; 2 where the request cannot be met."""
    chosen = _parser().parse_args(arguments)
    try:
        return chosen.action(chosen) or 0
    except ValueError as problem:
        print(f"proof: {problem}", file=sys.stderr)
        return 2
    except OSError as problem:  # a disk that is full, or may not be written to
        print(f"proof: {problem.filename or chosen.out}: {problem.strerror or problem}", file=sys.stderr)
        return 2


def _parser():
    parser = argparse.ArgumentParser(prog="python -m validation.blind.proof", description=__doc__.splitlines()[0])
    actions = parser.add_subparsers(required=True)
    one = argparse.ArgumentParser(add_help=False)
    one.add_argument("--plan", default="fixed", help="development, fixed, full or readout")
    one.add_argument("--seed", type=int, default=20261121)
    one.add_argument("--out", type=Path, default=Path("out/proof"), help="folder of all runs")
    one.add_argument("--label", default="", help="keeps the reports of another tool apart, on the same sealed cases")
    one.add_argument("--limit", type=int, help="only the first so many cases")
    one.add_argument("--workers", type=int, default=1, help="processes; 1 works in this one (extra cluster)")
    one.add_argument("--cluster", metavar="ADDRESS", help="a running Dask scheduler, tcp://HOST:PORT (extra cluster)")
    one.add_argument("--kinds", nargs="*", help="only cases of these kinds")
    one.add_argument("--groups", nargs="*", help="only null, single, masked, pair, outside or readout cases, or several of them")
    scoring = argparse.ArgumentParser(add_help=False)
    scoring.add_argument("--ledger", type=Path, help="another ledger than the project's")
    scoring.add_argument("--date", help="of the line in the ledger; now if absent")
    running = actions.add_parser("run", parents=[one, scoring])
    running.add_argument("--baselines", action="store_true", help="the other methods, too, on the same cases")
    running.add_argument("--budget-minutes", type=float, help="begin no case later than this; run again to go on")
    running.add_argument("--diagnose-seed", type=int, default=1)
    running.add_argument("--no-score", action="store_true", help="leave the truth sealed")
    running.set_defaults(action=_run)
    actions.add_parser("score", parents=[one, scoring]).set_defaults(action=_score)
    table = actions.add_parser("table")
    table.add_argument("--ledger", type=Path, default=ledger.LEDGER)
    table.add_argument("--plan", help="last line of this plan; the last line if absent")
    table.add_argument("--since", metavar="DATE", help="rates of all runs since then together, such as 2026-11-28")
    table.set_defaults(action=_table)
    figures = actions.add_parser("figures", parents=[one])
    figures.add_argument("--to", type=Path, help="folder for them; the run's own if absent")
    figures.set_defaults(action=_figures)
    return parser


def _places(chosen):
    return Places(chosen.out / f"{chosen.plan}-{chosen.seed}", chosen.label)


def _begin(chosen):
    """Requested cases and their places, if the plan is unchanged since the run began."""
    places = _places(chosen)
    cases = chosen_cases(chosen.plan, chosen.seed, chosen.limit, chosen.kinds, chosen.groups)
    keep_plan(places, chosen.plan, chosen.seed)
    return cases, places


def _scheduler(chosen):
    return place_of(chosen.workers if chosen.workers > 1 and not chosen.cluster else None, chosen.cluster)


def _run(chosen):
    cases, places = _begin(chosen)
    compare = worker.compare_folder if chosen.baselines else None
    with _scheduler(chosen) as place:
        done = run(cases, places, chosen.diagnose_seed, place, chosen.budget_minutes, compare=compare)
    print(f"{len(done)} of {len(cases)} cases are complete in {places.folder}")
    if chosen.no_score or not done:
        return
    _scored(chosen, done, places)


def _score(chosen):
    cases, places = _begin(chosen)
    done = [case for case in cases if places.report(case.name).exists()]
    if not done:
        raise ValueError(f"there is no report in {places.reports}")
    _scored(chosen, done, places)


def _scored(chosen, cases, places):
    """Open the seals of cases that all have a report, score them, and record the result."""
    with _scheduler(chosen) as place:
        found = truths(cases, places, place)
    reports = {case.name: read(places.report(case.name)) for case in cases}
    timings = {case.name: read(places.timing(case.name), {}) for case in cases}
    answers = {case.name: read(places.baselines(case.name), {}) for case in cases}
    score = scored(found, reports, timings, answers)
    write(places.score, score)
    own = places.folder / "ledger.jsonl" if chosen.seed < ledger.DEVELOPMENT else ledger.LEDGER
    path = chosen.ledger or own
    commits = {timing.get("commit", "unknown") for timing in timings.values()}
    line = ledger.entry(score, chosen.plan, chosen.seed, chosen.label, commits, chosen.date, ledger.lines(path))
    ledger.append(path, line)
    print(ledger.table(line))
    if len(commits) > 1:
        print(f"\nnote: the reports were made by {len(commits)} states of the code; --label keeps a later one apart")
    print(f"\nWritten: {places.score}; a line in {path}")


def _table(chosen):
    lines = [line for line in ledger.lines(chosen.ledger) if chosen.plan in (None, line["plan"])]
    if not lines:
        raise ValueError(f"no scoring run in {chosen.ledger}")
    if chosen.since:
        print(ledger.table_of_several([line for line in lines if line["date"] >= chosen.since]))
        return
    print(ledger.table(lines[-1]))


def _figures(chosen):

    places = _places(chosen)
    score = read(places.score)
    if score is None:
        raise ValueError(f"nothing is scored in {places.folder}")
    for path in draw(score, chosen.to or places.figures):
        print(path)


if __name__ == "__main__":
    sys.exit(main())
