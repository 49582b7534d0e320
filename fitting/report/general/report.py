"""The report of characterised wires, tubes and actuators."""

from fitting.calibrate.assumed import notices_of
from fitting.calibrate.general.information import advice
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import overall
from fitting.calibrate.general.tables import geometry_toml, tables
from pneusma_jax.units import constant_from_si

from .. import characterisation
from ..cautions import model_of, table_of
from ..cells import number
from ..open_constants import open_sentences
from ..report import Points, Report, Section
from ..table import Table
from . import text
from .figures import pictures
from .payload import content, most_rows

SCORES = (
    "MAE and RMSE in the unit of the column. RPD is the mean relative difference (Eq. 2.52 of the "
    f"dissertation) of absolute values. {characterisation.SIGNED} The last column is the misfit over the "
    "noise."
)
HELD = "Numbers that were held."
NOTHING = "Nothing: everything that was free is known better than before."


def report_of(result: GeneralCharacterisation) -> Report:
    """The report of the result."""
    drawn = pictures(result)
    loose = open_sentences(result.identifiability, set(result.unseen)) or [NOTHING]
    notices = notices_of(result.fit.recordings, result.fitted, most_rows(result))
    verdict = text.verdict(result)
    return Report(
        title=result.title,
        subtitle=_subtitle(result),
        verdict=verdict,
        warnings=[said for said in text.warnings(result) if said not in verdict],
        real=result.real,
        sections=[
            Section("Fit", [drawn["fit"]]),
            Section("Parameters", [_parameters(result)]),
            Section("What a resistance would have told", [Points(text.untold(result))]),
            Section("The model", [Points(text.about_the_model(result)), _held(result)]),
            Section("Errors, recording by recording", [_scores(result)]),
            Section("What these recordings cannot tell",
                    [Points(loose), *(drawn[name] for name in ("parameters", "profiles") if name in drawn)]),
            Section("Next test", [advice(result.repeats)]),
            Section("What the model leaves", [drawn["residuals"]]),
            Section("How it was fitted", [Points(text.how_it_was_fitted(result))]),
            Section("Notices", [Points(notices)]),
        ],
        window=f"{result.title}: characterisation",
        footer=characterisation.footer(result.seed),
        content=lambda: content(result),
        files=lambda: _files(result),
    )  # fmt: skip


def _subtitle(result: GeneralCharacterisation) -> str:
    recordings = result.fit.recordings
    held_out = [recording.name for recording in recordings if recording.role == "validation"]
    fitted = [recording.name for recording in recordings if recording.role != "validation"]
    return characterisation.subtitle(result.specimen.noun.capitalize(), "recording", fitted, held_out)


def _files(result: GeneralCharacterisation) -> dict[str, str]:
    """Constants for other commands, and `parameters.csv`; `augmented.toml` for a model on disk."""
    found = {name: table_of(table, result) for name, table in tables(result).items()}
    found["parameters.csv"] = characterisation.parameters_csv(result.parameters)
    geometry = geometry_toml(result) if len(result.campaign.specimens()) == 1 else ""
    if geometry:
        found["geometry.toml"] = geometry
    model = result.augmented()
    return found if model is None else found | {"augmented.toml": model_of(model, result)}


def _parameters(result: GeneralCharacterisation) -> Table:
    start = {n: float(constant_from_si(result.start[n], e.unit)) for n, e in result.fitted.items()}
    share = {name: estimate.of_prior for name, estimate in result.parameters.items()}
    start |= {name: e.value for name, e in result.parameters.items() if name not in start}
    return characterisation.parameter_table(result.parameters, start, share)


def _held(result: GeneralCharacterisation) -> Table:
    rows = [
        [one.name, number(constant_from_si(one.value, one.unit), ".6g"), one.unit, one.why]
        for one in result.held()
    ]
    return Table(["number", "value", "unit", "why"], rows, HELD)


def _row(name: str, role: str, column: str, measures: dict[str, float], rms: float | None) -> list[str]:
    cells = [number(measures[key]) for key in ("mae", "rmse")]
    cells += [number(100.0 * measures[key]) for key in ("rpd", "rpd_signed")]
    return [name, role, column, *cells, number(rms)]


def _scores(result: GeneralCharacterisation) -> Table:
    rows = [_row(s.name, s.role, s.column, s.metrics, s.rms_over_noise) for s in result.scores]
    for role, name in (("fit", "all fitted"), ("validation", "all held out")):
        for column, measures in overall(result.scores, role).items():
            rows.append(_row(name, role, column, measures, None))
    header = ["recording", "role", "column", "MAE", "RMSE", "RPD %", "signed %", "over noise"]
    return Table(header, rows, SCORES)
