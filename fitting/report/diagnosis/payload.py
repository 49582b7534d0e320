"""The content of `report.json` of a diagnosis."""

from dataclasses import asdict

import numpy as np

from fitting.diagnose.evaluate.noise_used import noise_used
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.held_out import HeldOut
from fitting.diagnose.verdict.text import place_text

SCHEMA = "pneusma-diagnosis/1"


def content(conclusion: Conclusion) -> dict:
    """Content for outside programs."""
    explanation = conclusion.explanation
    candidates = [
        {"name": slug, "probability": p, "log_bayes_factor": _finite(bayes)}
        for slug, (p, bayes) in sorted(conclusion.candidates.items(), key=lambda c: -c[1][0])
    ]
    return {
        "schema": SCHEMA,
        "verdict": "mismatch" if conclusion.mismatch else "consistent",
        "p_value": float(explanation.p_value),
        "p_value_is_bound": bool(explanation.p_is_bound),
        "where": {
            "component": conclusion.component,
            "drivers": conclusion.place.drivers if conclusion.mismatch else [],
            "regions": conclusion.place.regions if conclusion.mismatch else [],
            "text": place_text(conclusion),
        },
        "effects": [
            {
                "name": f.slug,
                "probability": float(f.probability),
                "tentative": f.tentative,
                "strength": f.strength or None,
                "together": None if f.together is None else asdict(f.together),
                "parameters": f.parameters,
                "log_bayes_factor": _finite(f.bayes),
                "confusable_with": f.confusable,
                "text": f.text,
            }
            for f in conclusion.reported
        ],
        "candidates": candidates,
        "explanation_set": conclusion.explanation_set,
        "explanation_sets": conclusion.explanation_sets,
        "no_effect_probability": float(conclusion.nothing),
        "unknown_probability": float(conclusion.unknown),
        "fit": {
            "validated_on": conclusion.before.on,
            "how": conclusion.before.how,
            "before": _score(conclusion, conclusion.before),
            "after": _score(conclusion, conclusion.after),
            "averaged": _score(conclusion, conclusion.mean) | {"over": conclusion.members},
            "predictive_reduced_chi2": _predictive(conclusion),
        },
        "nameless_correction": _competitor(conclusion),
        "noise": [asdict(one) for one in noise_used(explanation.program)],
        "base_model": conclusion.start.words or "the published model",
        "base_tables": [asdict(table) for table in conclusion.start.constants],
        "base_parameters": _base(conclusion),
        "exchangeable": _exchangeable(conclusion),
        "not_testable_here": list(conclusion.untestable),
        "not_testable_because": conclusion.untestable,
        "remainder": _discrepancy(conclusion),
        "left": _left(conclusion),
        "misread": None if explanation.misread is None else asdict(explanation.misread),
        "repeats": None if conclusion.repeats is None else vars(conclusion.repeats),
        "turning_points": _turns(conclusion),
        "tries": explanation.tries,
        "next_experiment": conclusion.next_experiment,
        "notes": conclusion.notes,
        "asked": conclusion.asked,
    }


def _competitor(conclusion: Conclusion) -> dict | None:
    """The model discrepancy that competed with the named effects."""
    discrepancy = conclusion.discrepancy
    if discrepancy is None:
        return None
    scores = zip(("base", "named"), conclusion.explanation.left_out, strict=True)
    return {
        "quantity": discrepancy.quantity,
        "driver": discrepancy.driver,
        "log_bayes_factor": _finite(discrepancy.bayes),
        "reduced_chi2_left_out": _finite(discrepancy.left_out),
        "reduced_chi2_left_out_of": {name: float(x) for name, x in scores if np.isfinite(x)},
    }


def _finite(value: float) -> float:
    return float(np.clip(np.nan_to_num(value), -1e9, 1e9))


def _score(conclusion: Conclusion, score: HeldOut) -> dict:
    """Errors by canonical column, in that column's unit."""
    rmse = score.by_column(conclusion.explanation.program.kind)
    return {"rmse": rmse, "reduced_chi2": _finite(score.reduced_chi2)}


def _predictive(conclusion: Conclusion) -> dict | None:
    """Chi-squares per value of recordings for validation, in units of the errors of prediction."""
    scores = {"before": conclusion.before.predictive, "after": conclusion.after.predictive}
    return None if None in scores.values() else {name: _finite(value) for name, value in scores.items()}


def _discrepancy(conclusion: Conclusion) -> dict | None:
    """The remaining model discrepancy and its driver; SI, unknown outside the range of its knots."""
    rest = conclusion.remainder
    if rest is None:
        return None
    return {
        "quantity": rest.quantity,
        "driver": rest.driver,
        "knots": rest.knots.tolist(),
        "correction": rest.values.tolist(),
        "sd": rest.sd.tolist(),
        "reduced_chi2": {
            "before": _finite(conclusion.before.reduced_chi2),
            "after": _finite(conclusion.after.reduced_chi2),
        },
    }


def _turns(conclusion: Conclusion) -> dict | None:
    """Turning points between rows, where recordings do not tell them from effects without them."""
    rival = conclusion.without_turns
    if rival is None:
        return None
    return {
        "probability": float(rival.probability),
        "log_bayes_factor": _finite(rival.turns),
        "log_bayes_factor_of_effects": _finite(rival.effects),
        "instead_of": [f.slug for f in rival.found],
    }


def _left(conclusion: Conclusion) -> dict | None:
    """Misfit that names and the remainder clearly leave, and the regime of most of it."""
    left = conclusion.left
    if left is None:
        return None
    regime = left.regime
    return {
        "reduced_chi2": _finite(left.reduced_chi2),
        "noise": _finite(left.noise),
        "recordings": "not fitted" if left.held_out else "fitted",
        "explained_by_uncertainty": left.open,
        "names": list(left.names),
        "regime": None if regime is None else vars(regime),
    }


def _exchangeable(conclusion: Conclusion) -> list[dict]:
    """Constants within their tolerances, and strengths that explain the same with these as stated; SI."""
    items = conclusion.explanation.program.unknowns.items
    return [
        {
            "constant": items[one.constant].name,
            "effect": items[one.strength].effect,
            "parameter": items[one.strength].name,
            "value": float(items[one.strength].value(one.value)),
            "unit": items[one.strength].unit,
            "named": one.named,
        }
        for one in conclusion.exchanges
    ]


def _base(conclusion: Conclusion) -> dict:
    """Constants of the base model: nominal, refitted alone, refitted with the effects."""
    explanation, found = conclusion.explanation, {}
    final = conclusion.model[1]
    for k in explanation.program.unknowns.base:
        item = explanation.program.unknowns.items[k]
        found[item.name] = {
            "nominal": float(item.reference),
            "alone": float(item.value(explanation.base.u[k])),
            "with_effects": float(item.value(final.u[k])),
            "sd": item.spread(final.u[k], conclusion.sd(k)),
            "departure_sd": {
                "alone": float(explanation.base.u[k]),
                "with_effects": float(final.u[k]),
            },
        }
    return found
