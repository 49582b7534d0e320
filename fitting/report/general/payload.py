"""The content of `report.json` of characterised wires, tubes and actuators."""

from typing import Any

from fitting.calibrate.assumed import notices_of
from fitting.calibrate.general.information import advice
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import Score, overall
from fitting.specimens import WIRE
from fitting.specimens.rows import MOST_ROWS
from pneusma_jax.units import constant_from_si

from .. import characterisation, profile_likelihood
from . import text, wires


def _named(column: str, measures: dict[str, float]) -> dict[str, float]:
    """Measures of errors, where the names of those with a unit end with it: `mae_strain_pct`.

    A report states stresses in MPa, like the calibrations of alloys.

    Args:
        column: column of the output, with its unit.
        measures: measures by their short names, see `fitting.inference.metrics`.
    """
    unit = "MPa" if column == "stress_MPa" else column
    renamed = {"mae": f"mae_{unit}", "rmse": f"rmse_{unit}"}
    return {renamed.get(name, name): value for name, value in measures.items()}


def _by_column(found: dict[str, dict[str, float]]) -> dict[str, Any] | None:
    """Measures of the first column, with those of further columns under `others`.

    Args:
        found: measures by column, the main output first; empty where no row was scored.
    """
    if not found:
        return None
    main, *further = found.items()
    others = {column: _named(column, measures) for column, measures in further}
    return {**_named(*main), **({"others": others} if others else {})}


def _score_json(score: Score) -> dict[str, Any]:
    """Errors of one output of one recording."""
    return {"role": score.role, **_named(score.column, score.metrics), "rms_over_noise": score.rms_over_noise}


def _model_json(result: GeneralCharacterisation) -> dict[str, Any]:
    """Effects of the model on disk that was fitted, and its fixed numbers; empty for the base model."""
    if result.model is None:
        return {}
    fixed = {
        one.name: {
            "value": float(constant_from_si(one.value, one.unit)),
            "unit": one.unit,
            "why": one.why,
        }
        for one in result.held()
    }
    effects = [
        {"name": added.slug, "parameters": dict(names)}
        for added, names in zip(result.model.acting, result.model.names, strict=True)
    ]
    return {"model": {"name": result.model.model.name, "effects": effects, "held": fixed}}


def _half_way(result: GeneralCharacterisation) -> dict[str, Any]:
    """Entry `half_way`: temperatures at which a wire is half transformed; empty if no recording shows it."""
    found = wires.middle(result) if result.specimen is WIRE else {}
    return {"half_way": found} if found else {}


def content(result: GeneralCharacterisation) -> dict[str, Any]:
    """The content of `report.json`."""
    return characterisation.content(
        result.kind, result.title, result.real, text.verdict(result), result.parameters,
        text.warnings(result), result.seed, _details(result),
    )  # fmt: skip


def most_rows(result: GeneralCharacterisation) -> int:
    """Number of rows to which longer recordings were reduced for this fit."""
    return MOST_ROWS if result.model is None else result.model.most_rows


def _details(result: GeneralCharacterisation) -> dict[str, Any]:
    """Entries that only reports of these kinds have: errors, model, notices, next test, how the fit went."""
    fit, scores = result.fit, {}
    for score in result.scores:
        scores.setdefault(score.name, {})[score.column] = _score_json(score)
    return {
        "metrics": _by_column(overall(result.scores, "fit")),
        "metrics_held_out": _by_column(overall(result.scores, "validation")),
        "metrics_by_recording": scores,
        **_model_json(result),
        "notices": notices_of(result.fit.recordings, result.fitted, most_rows(result)),
        **_half_way(result),
        "identifiability": result.identifiability,
        "profiles": profile_likelihood.document(result),
        "next_test": {
            "text": advice(result.repeats),
            "candidates": [
                {
                    "name": repeat.name,
                    "information_nats": repeat.information,
                    "shrinks": [{"parameter": n, "ratio": r} for n, r in repeat.shrinks],
                }
                for repeat in result.repeats
            ],
        },
        "fitting": {
            "reduced_chi_square": fit.reduced_chi_square,
            "standard_errors_multiplied_by": fit.inflation,
            "correlation_time_samples": fit.correlation_time,
            "zeros": characterisation.zeros_json(result.lasting),
            "starts_chi_square": list(fit.starts),
            "status": fit.result.status.value,
            "text": text.how_it_was_fitted(result),
        },
    }
