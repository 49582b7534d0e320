"""Rates with exact intervals over judged cases, the detection curve, the confusion matrix, reliability.

Rows are judgements of cases (`judge.judge`). docs/proof.md explains the groups of cases and every rate.
"""

from collections import Counter

import numpy as np
from scipy.stats import binomtest

from .judge import NULLS, holds, judge

EDGES = (-np.inf, 3.0, 10.0, 20.0, 30.0, 60.0, 200.0, 1000.0, np.inf)
"""Edges of the detection curve's bins, in log Bayes factors."""
BINS = (0.0, 0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 1.0)
"""Edges of the bins of stated probabilities."""
METHODS = ("recalibration", "bic_stepwise", "gaussian_process", "sparse_regression")
"""Methods that are compared with the tool, in the order of the table."""
NAMING = ("false_alarms", "named_first", "covered", "confident_wrong", "pairs_both_named", "masked_named_first",
          "outside_unmodelled")  # fmt: skip
"""Rates that every method has."""
CLEARLY_LOWER = 0.98
"""Maximum ratio of two reduced chi-squares at which the first counts as lower [1]."""


def rate(hits):
    """Share of true values, with its 95 % Clopper-Pearson interval.

    Args:
        hits: truth values, one a case.

    Returns:
        `k` true ones of `n`, `rate` = k/n, and the interval `low`, `high`; None for these three if n is 0.
    """
    hits = [bool(h) for h in hits]
    return rate_of(sum(hits), len(hits))


def rate_of(k, n):
    """`rate` of `k` cases among `n`."""
    if n == 0:
        return {"k": 0, "n": 0, "rate": None, "low": None, "high": None}
    interval = binomtest(k, n).proportion_ci(method="exact")
    return {"k": k, "n": n, "rate": k / n, "low": float(interval.low), "high": float(interval.high)}


def rates(rows):
    """Every rate of judged cases, by name. A failed diagnosis counts as wrong."""
    null = [r for r in rows if r["group"] == "null"]
    readout = [r for r in rows if r["group"] == "readout"]
    single = [r for r in rows if r["group"] == "single" and r["strong"]]
    weak = [r for r in rows if r["group"] == "single" and not r["strong"]]
    pair = [r for r in rows if r["group"] == "pair"]
    strong_pair = [r for r in pair if r["strong"]]
    masked = [r for r in rows if r["group"] == "masked"]
    outside = [r for r in rows if r["group"] == "outside"]
    right = [r for r in single + pair + masked if r["top"]]
    of = lambda cases, key: rate(r[key] for r in cases)  # noqa: E731
    return {
        "false_alarms": of(null, "mismatch"),
        "readout_false_alarms": of(readout, "mismatch"),
        "named_first": of(single, "top"),
        "covered": of(single, "covered"),
        "confident_wrong": of(single, "wrong"),
        "confident_unmodelled": of(single, "confident_unmodelled"),
        "confident_wrong_all": of(rows, "wrong"),
        "weak_detected": of(weak, "mismatch"),
        "weak_covered": of([r for r in weak if r["mismatch"]], "covered"),
        "weak_confident_wrong": of(weak, "wrong"),
        "pairs_both_named": of(pair, "top"),
        "strong_pairs_both_named": of(strong_pair, "top"),
        "pairs_covered": of(pair, "covered"),
        "pairs_confident_wrong": of(pair, "wrong"),
        "masked_detected": of(masked, "mismatch"),
        "masked_named_first": of(masked, "top"),
        "masked_covered": of(masked, "covered"),
        "masked_confident_wrong": of(masked, "wrong"),
        "outside_unmodelled": of(outside, "top"),
        "outside_unmodelled_first": rate(r["first"] == "unmodelled" for r in outside),
        "outside_where_right": of(outside, "where_right"),
        "outside_confident_wrong": of(outside, "wrong"),
        "modelled": of(right, "modelled"),
        "predicted": of(right, "predicted"),
        "nulls_modelled": of([r for r in null if not r["mismatch"]], "modelled"),
        "base_back": rate(r["base_sd"] is not None and r["base_sd"] <= 2.0 for r in right),
        "right_with_unmodelled": rate("unmodelled" in r["said"] for r in right),
        "errors": rate("error" in r for r in rows),
    }


def parameter_summary(rows):
    """Errors of parameters with the same meaning in truth and tool, over correctly named cases."""
    errors = [p for r in rows if r["top"] for p in r["parameters"]]
    relative = [abs(p["relative"]) for p in errors]
    within = [abs(p["sd"]) <= 2.0 for p in errors if p["sd"] is not None]
    return {
        "count": len(errors),
        "median_relative_error": float(np.median(relative)) if errors else None,
        "within_2_sd": rate(within),
    }


def times(rows):
    """Median and upper decile of the duration by kind of specimen [s], and the median of processor time."""
    found = {}
    for kind in [*sorted({r["kind"] for r in rows}), "all"]:
        selected = [r for r in rows if kind in (r["kind"], "all") and r["seconds"] is not None]
        if selected:
            wall, cpu = ([r[key] for r in selected] for key in ("seconds", "cpu_seconds"))
            found[kind] = {
                "median_seconds": float(np.median(wall)),
                "upper_decile_seconds": float(np.quantile(wall, 0.9)),
                "median_cpu_seconds": float(np.median(cpu)),
            }
    return found


def curve(rows):
    """Detection over strength, single effects: per bin of the log Bayes factor its median, and three
    rates."""
    single = [r for r in rows if r["group"] == "single" and r["log_bayes"] is not None]
    found = []
    for low, high in zip(EDGES[:-1], EDGES[1:], strict=True):
        selected = [r for r in single if low <= r["log_bayes"] < high]
        if selected:
            found.append({
                "log_bayes": float(np.median([r["log_bayes"] for r in selected])),
                "detected": rate(r["mismatch"] for r in selected),
                "covered": rate(r["covered"] for r in selected),
                "named_first": rate(r["top"] for r in selected),
            })  # fmt: skip
    return found


def confusion(rows):
    """Counts of first-named causes by truth (strong single effects, nothing, something outside): {truth:
    {said: count}}."""
    found = {}
    for r in rows:
        if r["group"] in NULLS or (r["group"] in ("single", "outside") and r["strong"]):
            true = r["slugs"][0] if r["slugs"] else "consistent"
            found.setdefault(true, Counter())[r["first"]] += 1
    return {true: dict(said) for true, said in sorted(found.items())}


def reliability(rows, key="stated"):
    """Observed frequencies over stated probabilities, in bins of `BINS`.

    Args:
        rows: judgements.
        key: `stated` or `marginal`, the statements of a judgement that count (`judge`).

    Returns:
        By bin, the mean `stated` probability, and `so`, the rate at which such a statement was true.
    """
    pairs = [tuple(pair) for r in rows for pair in r[key]]
    found = []
    for low, high in zip(BINS[:-1], BINS[1:], strict=True):
        selected = [(p, true) for p, true in pairs if low <= p < high or (high == 1.0 and p >= 1.0)]
        if selected:
            found.append({"stated": float(np.mean([p for p, _ in selected])), "so": rate(true for _, true in selected)})
    return found


def slope(bins, draws=2000, seed=0):
    """Slope of observed frequencies over stated probabilities; it is 1 for calibrated probabilities.

    Args:
        bins: results of `reliability`; bins of the same statements in several runs may follow each other.
        draws: number of simulated tables for the interval, whose frequencies are drawn from the straight line.
        seed: seed of these tables.

    Returns:
        The slope by least squares, every statement counted, and its 95 % interval; None with fewer than two
        different probabilities.
    """
    stated, count = (np.array([pick(b) for b in bins], dtype=float) for pick in (lambda b: b["stated"], lambda b: b["so"]["n"]))
    hits = np.array([b["so"]["k"] for b in bins], dtype=float)
    if len(bins) < 2 or np.ptp(stated) == 0.0:
        return None
    centred = stated - np.average(stated, weights=count)
    along = lambda k: centred @ k / (centred**2 @ count)  # noqa: E731
    found = float(along(hits))
    line = np.clip(hits.sum() / count.sum() + found * centred, 0.0, 1.0)
    drawn = np.random.default_rng(seed).binomial(count.astype(int), line, (draws, len(bins)))
    low, high = np.quantile([along(k) for k in drawn], [0.025, 0.975])
    return {"slope": found, "low": float(low), "high": float(high), "n": int(count.sum())}


def methods(rows, others):
    """The tool and the other methods on the same cases: naming, and errors on held-out values.

    Args:
        rows: judged reports of the tool.
        others: judged answers of the same cases by method; cases without an answer are left out for all.
    """
    complete = [r["name"] for r in rows if all(r["name"] in mine for mine in others.values())] if others else []
    tool = {r["name"]: r for r in rows}
    found = {}
    for method, mine in {"pneusma diagnose": tool, **others}.items():
        chosen = [mine[name] for name in complete]
        concealed = [r for r in chosen if r["group"] not in NULLS and r["after"] is not None]
        pairs = [(tool[r["name"]]["after"], r["after"]) for r in concealed if tool[r["name"]]["after"] is not None]
        found[method] = {
            "rates": {k: v for k, v in rates(chosen).items() if k in NAMING},
            "median_held_out": float(np.median([r["after"] for r in concealed])) if concealed else None,
            "holds": rate(holds(tool[r["name"]]["before"], r["after"]) for r in chosen if r["group"] not in NULLS),
            "tool_is_better": rate(a <= CLEARLY_LOWER * b for a, b in pairs),
            "tool_is_worse": rate(b <= CLEARLY_LOWER * a for a, b in pairs),
        }
    return found


def scored(truths, reports, timings, answers):
    """All results of a run.

    Args:
        truths, reports, timings: truth, report and duration by case.
        answers: answers of the other methods by case and method, in the form of reports; may lack cases.
    """
    rows = [judge(reports[name], truth, timings.get(name)) for name, truth in truths.items()]
    others = {
        method: {
            name: judge(answers[name][method], truths[name]) for name in truths if method in answers.get(name, {})
        }
        for method in METHODS
    }
    others = {method: mine for method, mine in others.items() if mine}
    return {
        "rates": rates(rows),
        "times": times(rows),
        "parameters": parameter_summary(rows),
        "curve": curve(rows),
        "confusion": confusion(rows),
        "reliability": {"strongest": reliability(rows), "present": reliability(rows, "marginal")},
        "methods": methods(rows, others),
        "held_out": {
            "pneusma diagnose": {r["name"]: [r["before"], r["after"]] for r in rows if r["group"] not in NULLS},
            **{
                method: {n: [r["before"], r["after"]] for n, r in mine.items() if r["group"] not in NULLS}
                for method, mine in others.items()
            },
        },
        "rows": rows,
    }
