"""The ledger: one line for every scoring run, which is only ever appended to, and its table."""

import datetime
import json
from pathlib import Path

from .score import METHODS, rate_of, slope

LEDGER = Path(__file__).with_name("ledger.jsonl")
DEVELOPMENT = 1000
"""Seeds below this one are for development: their lines stay in the run's folder."""


def entry(score, plan, seed, label, commits, date=None, earlier=()):
    """A line of the ledger: settings, date, code, and every rate with its counts.

    Args:
        score: score from `score.scored`.
        plan, seed, label: identification of the run.
        commits: commits of the code that diagnosed.
        date: ISO date; today's if None.
        earlier: earlier lines, of which those with the same plan and seed are counted.
    """
    rows = score["rows"]
    return {
        "date": date or datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%MZ"),
        "commits": sorted(commits),
        "plan": plan,
        "seed": seed,
        "label": label,
        "scored_before": sum((e["plan"], e["seed"]) == (plan, seed) for e in earlier),
        "cases": len(rows),
        "groups": _counts(rows, "group"),
        "kinds": _counts(rows, "kind"),
        "rates": score["rates"],
        "reliability": score["reliability"],
        "parameters": score["parameters"],
        "times": score["times"],
        "methods": score["methods"],
    }


def _counts(rows, key):
    return {value: sum(r[key] == value for r in rows) for value in sorted({r[key] for r in rows})}


def lines(path):
    """Every line of a ledger, oldest first; none where there is no ledger."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]


def append(path, line):
    """Append a line; earlier ones stay unchanged."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line, sort_keys=True) + "\n")


WORDS = {
    "false_alarms": ("Nulls called a mismatch", "at most 2 %"),
    "readout_false_alarms": ("Nulls rounded, clipped or re-sampled, called a mismatch", "at most 2 %"),
    "named_first": ("Strong single effect named first", "at least 92 %"),
    "covered": ("Strong single effect in the reported set", "at least 97 %"),
    "confident_wrong": ("Strong single effect: confident (> 0.8) and wrong", "at most 2 %"),
    "confident_wrong_all": ("All cases: confident and wrong", "at most 1 %"),
    "confident_unmodelled": ("Strong single effect called unmodelled (> 0.8)", ""),
    "weak_detected": ("Weak single effect (log Bayes factor < 30) detected", ""),
    "weak_covered": ("... of those detected, in the reported set", ""),
    "pairs_both_named": ("Two effects, both named", "at least 75 %"),
    "strong_pairs_both_named": ("... where each alone is strong", ""),
    "pairs_covered": ("Two effects, both in the reported set", ""),
    "masked_detected": ("Masked effect detected", ""),
    "masked_named_first": ("Masked effect named first", ""),
    "masked_covered": ("Masked effect in the reported set", ""),
    "outside_unmodelled": ("Outside the catalogue: called unmodelled", "at least 85 %"),
    "outside_unmodelled_first": ("... and called that first, before any name", ""),
    "outside_where_right": ("... with the right component or driver", "at least 85 %"),
    "modelled": ("Named right: model holds on recordings not fitted", "at least 90 %"),
    "predicted": ("... or within the errors of its predictions", ""),
    "nulls_modelled": ("... of nulls, where nothing is missing", ""),
    "base_back": ("Named right: base back within 2 sigma", "most"),
    "right_with_unmodelled": ("Named right: `unmodelled` stands beside the name", ""),
    "errors": ("Diagnoses that failed", ""),
}


SLOPES = {
    "present": "Slope of what is so over the stated probability, of reported effects",
    "strongest": "... of every candidate, of nothing and of something unknown",
}
"""Reliabilities by their key in a line; older lines have none."""


def table(line):
    """Markdown of a line of the ledger: rates, slopes, then the methods side by side, then times."""
    head = (
        f"Plan `{line['plan']}`, seed {line['seed']}, {line['cases']} cases, {line['date'][:10]}, code "
        f"{', '.join(f'`{c}`' for c in line['commits'])}."
    )
    out = [head, "", "| What | Rate | 95 % interval | Goal |", "|---|---|---|---|"]
    for key, (words, goal) in WORDS.items():
        found = line["rates"].get(key)  # older lines lack some
        if found and found["n"]:
            out.append(f"| {words} | {_share(found)} | {_interval(found)} | {goal} |")
    return "\n".join([*out, *_slopes([line]), "", *_methods(line), *_times(line)])


def _slopes(several):
    """Rows of a table: how far stated probabilities are what they say, in runs together."""
    out = []
    for key, words in SLOPES.items():
        found = slope([one for line in several for one in line.get("reliability", {}).get(key, [])])
        if found:
            interval = f"{found['low']:.2f}-{found['high']:.2f}"
            out.append(f"| {words} | {found['slope']:.2f} of {found['n']} statements | {interval} | 0.8 to 1.2 |")
    return out


def table_of_several(several):
    """Markdown of the rates of several runs together: counts are added, intervals are those of the sums.

    Args:
        several: lines of runs on cases of their own. Lines with a label are left out, since their cases were
            opened before.

    Raises:
        ValueError: no line is left.
    """
    several = [line for line in several if not line["label"]]
    if not several:
        raise ValueError("no scoring run of fresh cases is chosen")
    cases = sum(line["cases"] for line in several)
    dates = sorted(line["date"][:10] for line in several)
    out = [f"{len(several)} runs of {dates[0]} to {dates[-1]}, {cases} cases.", ""]
    out += ["| What | Rate | 95 % interval | Goal |", "|---|---|---|---|"]
    for key, (words, goal) in WORDS.items():
        known = [line["rates"][key] for line in several if key in line["rates"]]
        found = rate_of(sum(one["k"] for one in known), sum(one["n"] for one in known))
        if found["n"]:
            out.append(f"| {words} | {_share(found)} | {_interval(found)} | {goal} |")
    return "\n".join([*out, *_slopes(several)])


def _methods(line):
    found = line["methods"]
    names = [m for m in ("pneusma diagnose", *METHODS) if m in found and found[m]["holds"]["n"]]
    if len(names) < 2:
        return []
    words = {k: WORDS[k][0] for k in ("false_alarms", "named_first", "covered", "confident_wrong", "pairs_both_named",
                                      "masked_named_first", "outside_unmodelled")}  # fmt: skip
    out = ["| On the same cases | " + " | ".join(n.replace("_", " ") for n in names) + " |", "|---" * (len(names) + 1) + "|"]
    for key, text in words.items():
        cells = [found[n]["rates"][key] for n in names]
        if cells[0]["n"]:
            out.append(f"| {text} | " + " | ".join(_share(c) for c in cells) + " |")
    middle = [found[n]["median_held_out"] for n in names]
    out.append("| Median reduced chi2 on values not fitted | " + " | ".join("-" if m is None else f"{m:.3g}" for m in middle) + " |")
    out.append("| Model holds on values not fitted | " + " | ".join(_share(found[n]["holds"]) for n in names) + " |")
    for key, text in (("tool_is_better", "`diagnose` has the lower error"), ("tool_is_worse", "`diagnose` has the higher error")):
        out.append(f"| {text} | " + " | ".join("" if n == names[0] else _share(found[n][key]) for n in names) + " |")
    return [*out, ""]


def _times(line):
    out = ["| Kind | Median time | Upper decile | Median processor time |", "|---|---|---|---|"]
    for kind, t in line["times"].items():
        out.append(
            f"| {kind} | {t['median_seconds']:.0f} s | {t['upper_decile_seconds']:.0f} s | {t['median_cpu_seconds']:.0f} s |"
        )
    return out if line["times"] else []


def _share(found):
    return f"{found['k']}/{found['n']} ({100 * found['rate']:.0f} %)" if found["n"] else "-"


def _interval(found):
    return f"{100 * found['low']:.1f}-{100 * found['high']:.1f} %"
