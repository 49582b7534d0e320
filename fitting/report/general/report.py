"""The report of characterised wires, tubes and actuators."""

from typing import Any

from fitting.calibrate.assumed import notices_of
from fitting.calibrate.general.information import advice
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import Score, overall
from fitting.calibrate.general.tables import geometry_toml, tables
from fitting.calibrate.spring.alloy_table import KELVIN
from fitting.calibrate.spring.information import relative_to_prior
from fitting.specimens import WIRE
from fitting.specimens.rows import MOST_ROWS
from fitting.specimens.saved_models.files import render_model
from pneusma_jax.units import from_si

from .. import profile_likelihood
from ..elastomer.tables import TextTable
from ..report import Report, Section, numbered, parameter_rows
from . import figures, wires
from . import text as words

SCORE_NOTE = (
    "MAE and RMSE in the unit of the column; RPD is the mean relative difference (Eq. 2.52), absolute "
    "and signed; the last column is the misfit over the noise."
)


def report_of(result: GeneralCharacterisation) -> Report:
    """Everything that is said about the result."""
    kept = [r.name for r in result.fit.recordings if r.role == "validation"]
    count = len(result.fit.recordings) - len(kept)
    subtitle = f"{result.specimen.noun.capitalize()}, {count} recordings fitted"
    subtitle += f", {len(kept)} held out ({', '.join(kept)})" if kept else ""
    loose = tuple(e["text"] for e in result.identifiability)
    drawn = ("parameters", "profiles")
    geometry = geometry_toml(result) if len(result.campaign.specimens()) == 1 else ""
    return Report(
        title=result.title,
        subtitle=subtitle,
        kind=result.kind,
        real=result.real,
        verdict=words.verdict(result),
        warnings=words.warnings(result),
        parameters=result.parameters,
        sections=[
            Section("Fit", figures=("fit",)),
            Section("Parameters", table=_parameters(result), note="± one standard error."),
            Section("What a resistance would have told", tuple(words.untold(result))),
            Section("The model", tuple(words.about_the_model(result)), _held(result), HELD_NOTE),
            Section("Errors, recording by recording", table=_scores(result), note=SCORE_NOTE),
            Section("What these recordings cannot tell", loose or (NOTHING,), figures=drawn),
            Section("Which test next", (advice(result.repeats),)),
            Section("What the model leaves", figures=("residuals",)),
            Section("How it was fitted", tuple(words.how_it_was_fitted(result))),
            Section("Notices", tuple(notices_of(result.fit.recordings, _most_rows(result)))),
        ],
        tables=tables(result),
        more=_more(result),
        draw=lambda: figures.captioned(result),
        seed=result.seed,
        csv=({"geometry.toml": geometry} if geometry else {}) | _augmented(result),
    )


def _most_rows(result: GeneralCharacterisation) -> int:
    return MOST_ROWS if result.model is None else result.model.most_rows


HELD_NOTE = "Numbers that were held."
NOTHING = "Nothing: everything that was free is known better than before."


def _parameters(result: GeneralCharacterisation) -> TextTable:
    start = {n: float(from_si(result.start[n], e.unit, e.unit == KELVIN)) for n, e in result.fitted.items()}
    share = {name: relative_to_prior(entry) for name, entry in result.fitted.items()}
    start |= {name: e.value for name, e in result.parameters.items() if name not in start}
    share |= dict.fromkeys(result.unseen, 1.0)
    return parameter_rows(result.parameters, start, share)


def _augmented(result: GeneralCharacterisation) -> dict[str, str]:
    """The model on disk with the numbers found, as a file that every command takes with `--model`."""
    model = result.augmented()
    return {} if model is None else {"augmented.toml": render_model(model)}


def _held(result: GeneralCharacterisation) -> TextTable | None:
    rows = [
        [one.name, f"{from_si(one.value, one.unit, one.unit == KELVIN):.6g}", one.unit, one.why]
        for one in result.held()
    ]
    return TextTable(["number", "value", "unit", "why"], rows) if rows else None


def _row(name: str, role: str, column: str, measures: dict[str, float], rms: float | None) -> list[str]:
    cells = [numbered(measures[key]) for key in ("mae", "rmse")]
    cells += [numbered(100.0 * measures[key]) for key in ("rpd", "rpd_signed")]
    return [name, role, column, *cells, "" if rms is None else numbered(rms)]


def _scores(result: GeneralCharacterisation) -> TextTable:
    rows = [_row(s.name, s.role, s.column, s.metrics, s.rms_over_noise) for s in result.scores]
    for role, name in (("fit", "all fitted"), ("validation", "all held out")):
        for column, measures in overall(result.scores, role).items():
            rows.append(_row(name, role, column, measures, None))
    return TextTable(["recording", "role", "column", "MAE", "RMSE", "RPD %", "signed %", "over noise"], rows)


def _named(column: str, measures: dict[str, float]) -> dict[str, float]:
    """Measures under names that carry the column; those of a stress in MPa as alloys have them."""
    unit = "MPa" if column == "stress_MPa" else column
    renamed = {"mae": f"mae_{unit}", "rmse": f"rmse_{unit}"}
    return {renamed.get(name, name): value for name, value in measures.items()}


def _by_column(found: dict[str, dict[str, float]]) -> dict[str, Any] | None:
    """Measures of the first column, those of others under `others`."""
    if not found:
        return None
    first, *more = found.items()
    others = {column: _named(column, m) for column, m in more}
    return {**_named(*first), **({"others": others} if others else {})}


def _score_json(score: Score) -> dict[str, Any]:
    return {"role": score.role, **_named(score.column, score.metrics), "rms_over_noise": score.rms_over_noise}


def _model_json(result: GeneralCharacterisation) -> dict[str, Any]:
    if result.model is None:
        return {}
    held = {
        one.name: {
            "value": float(from_si(one.value, one.unit, one.unit == KELVIN)),
            "unit": one.unit,
            "why": one.why,
        }
        for one in result.held()
    }
    effects = [
        {"name": added.slug, "parameters": dict(names)}
        for added, names in zip(result.model.acting, result.model.names, strict=True)
    ]
    return {"model": {"name": result.model.model.name, "effects": effects, "held": held}}


def _half_way(result: GeneralCharacterisation) -> dict[str, Any]:
    """Where a wire is half-way through its transformation, if its recordings show it."""
    found = wires.middle(result) if result.specimen is WIRE else {}
    return {"half_way": found} if found else {}


def _more(result: GeneralCharacterisation) -> dict[str, Any]:
    fit, per = result.fit, {}
    for score in result.scores:
        per.setdefault(score.name, {})[score.column] = _score_json(score)
    return {
        "metrics": _by_column(overall(result.scores, "fit")),
        "metrics_held_out": _by_column(overall(result.scores, "validation")),
        "metrics_by_recording": per,
        **_model_json(result),
        "notices": notices_of(result.fit.recordings, _most_rows(result)),
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
            "starts_chi_square": list(fit.starts),
            "status": fit.result.status.value,
            "text": words.how_it_was_fitted(result),
        },
    }
