"""The content of `report.json`: all findings as numbers with units and as sentences."""

from typing import Any

import numpy as np

from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.fit import LawFit
from fitting.calibrate.elastomer.held_out import HeldOut, Score, Transfer
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates
from fitting.calibrate.elastomer.samples import Samples
from fitting.calibrate.result import SCHEMA
from fitting.inference.metrics import metrics
from pneusma_jax.units import from_si

from ..characterisation import estimates_json
from . import text


def content(result: ElastomerCharacterisation) -> dict[str, Any]:
    """The content of `report.json`; stresses and moduli in the unit beside them."""
    fit, samples = result.best, result.samples
    return {
        "schema": SCHEMA,
        "kind": "elastomer",
        "title": result.title,
        "real": samples.real,
        "verdict": text.verdict(result),
        "law": fit.law.law,
        "law_label": fit.law.label,
        "strain_min": result.whole.strain_min,
        "strain_max": result.whole.strain_max,
        "parameters": _estimates(fit),
        "metrics": _metrics(samples, fit, result.whole.scope),
        "metrics_by_recording": {
            curve.name: {"role": curve.role, **_metrics(samples, fit, samples.of(k))}
            for k, curve in enumerate(samples.curves)
        },
        "identifiability": text.identifiability_of(fit),
        "next_test": _next_test(result),
        "warnings": text.warnings(result),
        "fitting": _fitting(result),
        "choice": _choice(result.whole),
        "laws": {name: _law(result, result.whole, name) for name in result.whole.fits},
        "actuator": None if result.actuator is result.whole else _actuator(result),
        "notices": list(samples.notices),
        "seed": result.seed,
    }


def _estimates(fit: LawFit) -> dict[str, dict[str, Any]]:
    return estimates_json(estimates(fit))


def _metrics(samples: Samples, fit: LawFit, mask: np.ndarray) -> dict[str, float]:
    found = metrics(samples.stress[mask] / 1e6, fit.predict(samples)[mask] / 1e6)
    return {
        "mae_MPa": float(found["mae"]),
        "rmse_MPa": float(found["rmse"]),
        "rpd": float(found["rpd"]),
        "rpd_signed": float(found["rpd_signed"]),
    }


def _fitting(result: ElastomerCharacterisation) -> dict[str, Any]:
    samples, fit = result.samples, result.best
    return {
        "weighting": samples.weighting,
        "text": text.how_it_was_fitted(result),
        "noise": {
            curve.name: {"sigma_kPa": curve.noise / 1e3, "stated": curve.noise_stated}
            for curve in samples.curves
        },
        "specimens": {name: {"factor": value, "sd": sd} for name, (value, sd) in fit.factors.items()},
        "zeros": _zeros(result),
        "batch_sd": samples.batch,
        "residuals": {
            "rms_over_noise": fit.mean_square**0.5,
            "lag_1_autocorrelation": fit.lag_one,
            "correlation_time_samples": fit.correlation_time,
            "samples": int(fit.mask.sum()),
            "independent_samples": fit.independent,
            "standard_errors_multiplied_by": fit.inflation,
        },
    }


def _zeros(result: ElastomerCharacterisation) -> dict[str, dict[str, Any]]:
    """Zeros that were fitted, by recording and column."""
    found: dict[str, dict[str, Any]] = {}
    for zero, (value, sd) in result.best.zeros.items():
        column = "strain" if zero.quantity == "strain" else f"stress_{zero.unit}"
        shown = {"value": float(from_si(value, zero.unit)), "sd": float(from_si(sd, zero.unit))}
        found.setdefault(result.samples.curves[zero.curve].name, {})[column] = shown | {"unit": zero.unit}
    return found


def _choice(analysis: Analysis) -> dict[str, Any]:
    choice = analysis.choice
    past = {
        name: held.extrapolation for name, held in analysis.held.items() if held.extrapolation is not None
    }
    return {
        "chosen": choice.chosen,
        "reason": choice.reason,
        "by_interpolation": [ranked.name for ranked in choice.ranked],
        "by_extrapolation": sorted(past, key=past.get),
    }


def _law(result: ElastomerCharacterisation, analysis: Analysis, name: str) -> dict[str, Any]:
    fit, held = analysis.fits[name], analysis.held[name]
    ranked = next(entry for entry in analysis.choice.ranked if entry.name == name)
    modulus, sd = fit.shear_modulus()
    return {
        "label": fit.law.label,
        "parameters": _estimates(fit),
        "shear_modulus_kPa": {"value": modulus / 1e3, "sd": sd / 1e3},
        "covariance": {"parameters": list(fit.law.names), "correlation": _correlation(fit)},
        "metrics": _metrics(result.samples, fit, analysis.scope),
        "delta_aicc": ranked.aicc,
        "delta_bic": ranked.bic,
        "weight": ranked.weight,
        "monotone_where_tested": analysis.tested[name].monotone,
        "monotone_over_actuator": analysis.actuator[name].monotone,
        "status": fit.result.status.value,
        "identifiability": text.identifiability_of(fit),
        "held_out": _held_out(held),
        "drift": [
            {
                "parameter": entry.constant,
                "unit": entry.unit,
                "stretch": list(entry.reaches),
                "value": [_estimates(r.fit)[entry.constant]["value"] for r in held.ranges],
                "sd": [_estimates(r.fit)[entry.constant]["sd"] for r in held.ranges],
                "largest_change_in_standard_errors": entry.errors,
                "drifts": entry.drifts,
            }
            for entry in analysis.drifts[name]
        ],
    }


def _correlation(fit: LawFit) -> list[list[float]]:
    spread = np.sqrt(np.diag(fit.covariance))
    scale = np.where(spread > 0.0, spread, 1.0)
    return (fit.covariance / np.outer(scale, scale)).tolist()


def _score(score: Score | None) -> dict[str, float] | None:
    return None if score is None else {"rmse_kPa": score.rmse / 1e3, "rpd": score.rpd, "samples": score.count}


def _transfer(transfer: Transfer) -> dict[str, float]:
    scaled = {"best_factor": transfer.factor, "rmse_with_factor_kPa": transfer.rmse_scaled / 1e3}
    return {**_score(transfer.score), **scaled}


def _held_out(held: HeldOut) -> dict[str, Any]:
    return {
        "interpolation": _score(held.interpolation),
        "extrapolation_rpd": held.extrapolation,
        "gaps": [
            {"stretch_from": low, "stretch_to": high, **_score(score)} for low, high, score in held.bands
        ],
        "ranges": [
            {
                "stretch_max": r.reach,
                "inside": _score(r.inside),
                "next_to_stretch": r.following_reach,
                "next": _score(r.following),
                "beyond": _score(r.beyond),
            }
            for r in held.ranges
        ],
        "recordings_left_out": {name: _transfer(transfer) for name, transfer in held.recordings.items()},
        "validation": {name: _transfer(transfer) for name, transfer in held.validation.items()},
    }


def _actuator(result: ElastomerCharacterisation) -> dict[str, Any]:
    analysis = result.actuator
    name = analysis.choice.chosen
    return {
        "file": "material_actuator.toml",
        "strain_min": analysis.strain_min,
        "strain_max": analysis.strain_max,
        "choice": _choice(analysis),
        **_law(result, analysis, name),
    }


def _next_test(result: ElastomerCharacterisation) -> dict[str, Any]:
    test = result.next_test
    return {
        "text": test.text,
        "name": test.candidates[0].name,
        "stress_error_now_kPa": test.error_before / 1e3,
        "stress_error_now_by_cause_kPa": {cause: error / 1e3 for cause, error in test.before.items()},
        "candidates": [
            {
                "name": candidate.name,
                "text": candidate.text,
                "stress_error_after_kPa": candidate.error_after / 1e3,
                "after_by_cause_kPa": {cause: error / 1e3 for cause, error in candidate.after.items()},
                "information_nats": candidate.information,
            }
            for candidate in test.candidates
        ],
    }

