"""Judgement of one report against its truth, by the rules of the trial.

A truth names by slug what the generator concealed in a case. The group of a case says what that is
(docs/proof.md). It is nothing (`null`, `readout`), one effect (`single`, `masked`), two effects (`pair`), or
physics that the catalogue does not hold (`outside`).
"""

import numpy as np

from .truths import parameter_errors

UNMODELLED = "unmodelled"
"""Slug of physics that the catalogue does not hold."""
NULLS = ("null", "readout")
"""Groups in which nothing is concealed."""
CONFIDENT = 0.8
"""Minimum probability of a statement that counts as confident [1]."""
STRONG = 30.0
"""Minimum log Bayes factor of the true form, with the base refitted, for a strong effect."""
GOOD_CHI2 = 1.3
"""Maximum reduced chi-square of a model that holds on held-out recordings."""
LEAST_DECREASE = 0.95
"""Minimum decrease of the excess of reduced chi-square over 1 for a model that holds, as a part of it [1]."""


def judge(report, truth, timing=None):
    """Judgement of a report: a flat dictionary from which every rate is made.

    Its truth values are: `mismatch`, a contradiction was reported; `top`, the report's first names are those
    concealed; `covered`, they are in the reported set; `modelled` and `predicted`, the model holds on
    held-out recordings. `wrong` lists names that are confident and wrong.

    Args:
        report: content of report.json, or its replacement where the diagnosis failed.
        truth: truth of the case.
        timing: duration of the case [s].
    """
    true = set(truth["slugs"])
    row = {
        "name": truth["name"],
        "kind": truth["kind"],
        "group": truth["group"],
        "slugs": sorted(true),
        "outside": truth.get("outside", []),
        "readout": truth.get("readout"),
        "log_bayes": truth["log_bayes_post_refit"],
        "strong": _strong(truth),
        "seconds": (timing or {}).get("seconds"),
        "cpu_seconds": (timing or {}).get("cpu_seconds"),
    }
    if "error" in report:
        return row | {"error": report["error"]} | _nothing_said()
    return row | _said(report, true) | _place(report, truth) | _fit(report) | _probabilities(report, true) | {
        "parameters": parameter_errors(report, truth) if row["group"] in ("single", "pair", "masked") else [],
    }  # fmt: skip


def _strong(truth):
    """True if every effect of a case is a strong one by itself."""
    return truth["group"] not in NULLS and all(value is not None and value >= STRONG for value in strengths(truth))


def strengths(truth):
    """Log Bayes factor of every concealed effect of a truth; None where it has none."""
    return truth.get("log_bayes_each") or [truth["log_bayes_post_refit"]]


def _nothing_said():
    """Entries of a judgement where the diagnosis failed."""
    return {
        "mismatch": False, "said": [], "first": "error", "top": False, "covered": False, "wrong": [], "where_right": False,
        "confident_unmodelled": False, "before": None, "after": None, "modelled": False, "predicted": False, "base_sd": None, "stated": [],
        "marginal": [], "parameters": [],
    }  # fmt: skip


def _said(report, true):
    """What a report says of effects, judged.

    Args:
        report: content of report.json.
        true: slugs of what is concealed; empty for nothing.
    """
    effects = report.get("effects", [])
    names = [e["name"] for e in effects]
    unknown = report.get("unknown_probability", 0.0)
    close = {c for e in effects for c in e.get("confusable_with", [])}
    named = set(names) | set(report.get("explanation_set", [])) | close
    if UNMODELLED in true:
        top = UNMODELLED in names or unknown > 0.5
    elif not true:
        top = report["verdict"] == "consistent"
    else:
        top = set(names[: len(true)]) == true
    wrong = [
        e["name"] for e in effects
        if e["name"] not in true | {UNMODELLED} and e.get("probability", 0.0) > CONFIDENT
        and not set(e.get("confusable_with", [])) & true
    ]  # fmt: skip
    mismatch = report["verdict"] == "mismatch"
    return {
        "mismatch": mismatch,
        "said": names,
        "first": names[0] if names else (UNMODELLED if mismatch else "consistent"),
        "top": top,
        "covered": top or bool(true) and true <= named,
        "wrong": wrong,
        "confident_unmodelled": bool(true) and UNMODELLED not in true and unknown > CONFIDENT,
    }


def _place(report, truth):
    """Whether the named part of the model is right, one of the two strongest drivers, and either of them."""
    where = report.get("where", {})
    places = truth.get("where") or [{"component": truth["component"], "driver": truth["driver"]}]
    component = where.get("component") in {p["component"] for p in places}
    driver = bool(set(where.get("drivers", [])[:2]) & {d for p in places for d in p["driver"]})
    return {"component_right": component, "driver_right": driver, "where_right": component or driver}


def _fit(report):
    """Reduced chi-squares on held-out recordings without and with effects, and whether the model holds there.

    `base_sd` is the largest departure of a constant of the base model, in its standard deviations.
    """
    fit = report.get("fit", {})
    before, after = (fit.get(part, {}).get("reduced_chi2") for part in ("before", "after"))
    base = report.get("base_parameters", {})
    departures = [abs(p["departure_sd"]["with_effects"]) for p in base.values() if "departure_sd" in p]
    return {
        "before": before,
        "after": after,
        "modelled": holds(before, after),
        "predicted": holds(before, after) or holds(*_within_errors(fit)),
        "base_sd": max(departures) if departures else None,
    }


def _within_errors(fit):
    """Chi-squares of both models in units of the errors of prediction; None twice where a report has none."""
    found = fit.get("predictive_reduced_chi2") or {}
    return found.get("before"), found.get("after")


def holds(before, after):
    """True if a model meets one of the two criteria on held-out recordings.

    Args:
        before: reduced chi-square of the base model; None where there is none.
        after: that of the model with effects.
    """
    if after is None or not np.isfinite(after):
        return False
    if after <= GOOD_CHI2:
        return True
    return bool(before) and before > 1.0 and (after - 1.0) <= (1.0 - LEAST_DECREASE) * (before - 1.0)


def _probabilities(report, true):
    """Pairs of a stated probability and whether it is so.

    `stated` are those of all candidates, of no effect and of something unknown. `marginal` are those of the
    effects that the report names.
    """
    stated = [(c["probability"], c["name"] in true) for c in report.get("candidates", [])]
    if "no_effect_probability" in report:
        stated.append((report["no_effect_probability"], not true))
        stated.append((report.get("unknown_probability", 0.0), UNMODELLED in true))
    marginal = [(e["probability"], e["name"] in true) for e in report.get("effects", []) if "probability" in e]
    return {"stated": stated, "marginal": marginal}
