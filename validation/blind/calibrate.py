"""`python -m validation.blind.calibrate`: how likely it is that something unknown acts beside named effects.

Simulated campaigns of the independent generator are diagnosed, their truth known. Each gives the signs
(`fitting.diagnose.verdict.unknown`) and whether something acted that the diagnosis did not tell of. A logistic
curve through all of them becomes the table that the diagnosis reads. Seeds are development seeds, below 1000:
no campaign of the blind trial takes part.

The rows stand in `calibration.csv` beside this file. A campaign that has its row is not made again, so that the
command can be stopped at any time.
"""

import argparse
import csv
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit
from tqdm import tqdm

from fitting.data.csv_text import csv_rows
from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.verdict import unknown
from fitting.diagnose.verdict.unknown import Signs
from pneusma_jax import enable_float64
from pneusma_jax.files import write_whole

from .cases import KINDS, SIZES, write_case
from .proof.judge import strengths
from .proof.ledger import DEVELOPMENT
from .proof.places import commit
from .proof.run import chosen_cases

ROWS = Path(__file__).with_name("calibration.csv")
CURVE = Path(unknown.__file__).with_name(unknown.TABLE)
GROUPS = ("single", "masked", "pair", "outside")
SIGNS = tuple(Signs.__annotations__)
COLUMNS = ("seed", "case", "kind", "group", *SIGNS, "unknown_acts", "commit")
MINIMUM_EVIDENCE = 8.0
"""Minimum log Bayes factor of a concealed effect for it to act: below it, nothing could be named."""
RIDGE = 0.1
"""Weight of the squares of the slopes, against a curve that separates the campaigns altogether."""


def main(arguments=None):
    """Exit code 0; 2 where the request cannot be met."""
    parser = argparse.ArgumentParser(prog="python -m validation.blind.calibrate", description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="*", default=[], help="development seeds; none: only fit the curve")
    parser.add_argument("--kinds", nargs="*", default=KINDS, help="only campaigns of these kinds")
    parser.add_argument("--groups", nargs="*", default=GROUPS, help="only campaigns of these groups")
    parser.add_argument("--limit", type=int, default=60, help="campaigns of every seed")
    parser.add_argument("--budget-minutes", type=float, default=np.inf, help="begin no campaign later than this")
    chosen = parser.parse_args(arguments)
    late = [seed for seed in chosen.seeds if seed >= DEVELOPMENT]
    if late:
        print(f"calibrate: seed {late[0]} is one of the blind trial; take one below {DEVELOPMENT}", file=sys.stderr)
        return 2
    try:
        read_rows()
        cases = [
            (seed, case)
            for seed in chosen.seeds
            for case in chosen_cases("full", seed, chosen.limit, chosen.kinds, chosen.groups)
        ]
    except ValueError as problem:
        print(f"calibrate: {problem}", file=sys.stderr)
        return 2
    enable_float64()
    _diagnosed(cases, chosen.budget_minutes)
    table = curve_of(read_rows())
    write_whole(CURVE, table.encode())
    print(table)
    return 0


def _diagnosed(cases, minutes):
    """Add the rows of campaigns that have none."""
    rows, deadline, code = read_rows(), time.monotonic() + 60.0 * minutes, commit()
    known = {(row["seed"], row["case"]) for row in rows}
    for seed, case in tqdm([c for c in cases if (str(c[0]), c[1].name) not in known], unit="campaign", disable=None):
        if time.monotonic() > deadline:
            return
        with tempfile.TemporaryDirectory() as folder:
            truth = write_case(case, folder)
            conclusion = diagnose(read_campaign(folder), seed=1)
        signs = conclusion.signs
        told = set(conclusion.explanation_set).union(*({f.slug, *f.confusable} for f in conclusion.found))
        numbers = ["" if signs is None else f"{getattr(signs, name):.4g}" for name in SIGNS]
        acts = int(unknown_acts(truth, told))
        rows.append(dict(zip(COLUMNS, (seed, case.name, case.kind, case.group, *numbers, acts, code), strict=True)))
        write_rows(rows)


def unknown_acts(truth, told):
    """True if something acts, strongly enough to be named, that a diagnosis did not tell of.

    Args:
        truth: truth of a case, as `cases.truth_of` gives it.
        told: slugs of named effects, of those confusable with them, and of explanation sets.
    """
    if truth["group"] == "outside":
        return True
    strong = {s for s, worth in zip(truth["slugs"], strengths(truth), strict=True) if worth > MINIMUM_EVIDENCE}
    return not strong <= set(told)


def read_rows(path=ROWS):
    """Rows of the table, as text by column; none where there is no table.

    Raises:
        ValueError: the table has other columns.
    """
    if not path.exists():
        return []
    with path.open(encoding="utf-8", newline="") as file:
        table = csv.DictReader(file)
        rows = list(table)
    if tuple(table.fieldnames or ()) != COLUMNS:
        raise ValueError(f"{path}: its columns are not {', '.join(COLUMNS)}: rows of older code cannot be used")
    return rows


def write_rows(rows, path=ROWS):
    """Write the table whole or not at all."""
    write_whole(path, csv_rows(COLUMNS, ([row[c] for c in COLUMNS] for row in rows)).encode())


def curve_of(rows):
    """The curve as TOML, with what it was fitted to. Campaigns in which nothing was named do not count.

    Raises:
        ValueError: fewer than ten campaigns of either answer.
    """
    named = [row for row in rows if row["kept"]]
    x = np.array([Signs(*(float(row[name]) for name in SIGNS)).scaled for row in named])
    y = np.array([float(row["unknown_acts"]) for row in named])
    if min(y.sum(), (1.0 - y).sum()) < 10:
        raise ValueError(f"{len(y)} campaigns with names, {int(y.sum())} with something unknown: ten of each are needed")
    weight = weights(rows, [row["group"] for row in named])
    odds = fitted(x, y, weight)
    other = [fitted(*(np.delete(part, k, 0) for part in (x, y, weight)), odds) @ x[k] for k in range(len(y))]
    seeds = ", ".join(sorted({row["seed"] for row in named}, key=int))
    return "\n".join([
        "# Odds that something unknown acts beside named effects; made by `python -m validation.blind.calibrate`.",
        f'date = "{datetime.now(UTC):%Y-%m-%d}"',
        f"seeds = [{seeds}]",
        f"campaigns = {len(y)}",
        f"with_something_unknown = {int(y.sum())}",
        f"log_loss = {log_loss(x @ odds, y, weight):.4f}",
        f"log_loss_left_out = {log_loss(np.array(other), y, weight):.4f}",
        "",
        "[odds]",
        *(f"{name} = {value:.4f}" for name, value in zip(("constant", *SIGNS), odds, strict=True)),
        "",
    ])  # fmt: skip


def weights(rows, groups):
    """Weights of campaigns by their groups, so that groups count as in the full plan of the trial.

    Args:
        rows: all campaigns, those without names among them.
        groups: groups of the campaigns that get a weight.
    """
    _, strong, weaker, pairs, masked, outside = SIZES["full"]
    plan = dict(zip(GROUPS, (strong + weaker, masked, pairs, outside), strict=True))
    made = [row["group"] for row in rows]
    found = np.array([plan[group] / made.count(group) for group in groups])
    return found / found.mean()


def fitted(x, y, weight, start=None):
    """Coefficients of a logistic curve, (signs,): no sign lowers the probability.

    Args:
        x: signs of every campaign, (campaigns, signs), the first one constant.
        y: 1 where something unknown acts, (campaigns,).
        weight: weight of every campaign, mean 1, (campaigns,).
        start: coefficients to begin with; zero if None.
    """
    sign = 2.0 * y - 1.0

    def cost(b):
        """Sum of the log losses with the ridge, and its derivative."""
        pull = 2.0 * RIDGE * np.array([0.0, *b[1:]])
        slope = -(weight * sign * expit(-sign * (x @ b))) @ x + pull
        return len(y) * log_loss(x @ b, y, weight) + RIDGE * b[1:] @ b[1:], slope

    low = [(None, None)] + [(0.0, None)] * (x.shape[1] - 1)
    begin = np.zeros(x.shape[1]) if start is None else start
    return minimize(cost, begin, jac=True, bounds=low, method="L-BFGS-B").x


def log_loss(odds, y, weight):
    """Weighted mean of the negative log-probability of the answers, nat."""
    return float(np.mean(weight * np.logaddexp(0.0, -(2.0 * y - 1.0) * odds)))


if __name__ == "__main__":
    sys.exit(main())
