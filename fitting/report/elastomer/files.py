"""Files of a fitted elastomer beside its report: the material, its parameters and curves as CSV."""

from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.material import material
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates
from fitting.data.csv_text import csv_rows

from ..characterisation import CSV_DIGITS, estimate_cells, with_caution
from . import text

PARAMETERS = (
    "fitted_to", "law", "chosen", "parameter", "value", "sd", "unit", "at_bound", "strain_min", "strain_max",
)  # fmt: skip
"""Columns of `parameters.csv`."""


def files(result: ElastomerCharacterisation) -> dict[str, str]:
    """Content of the files beside report and page, by file name."""
    found = {
        "material.toml": _table(result, result.whole, result.title),
        "parameters.csv": _parameters_csv(result),
        "curve.csv": _curve_csv(result),
    }
    if result.actuator is not result.whole:
        title = f"{result.title}, an actuator's range"
        found["material_actuator.toml"] = _table(result, result.actuator, title)
    return found


def _table(result: ElastomerCharacterisation, analysis: Analysis, title: str) -> str:
    """TOML text of the law that an analysis recommends, with its own `caution`."""
    return with_caution(material(analysis, result.samples, title), text.caution(result, analysis))


def _parameters_csv(result: ElastomerCharacterisation) -> str:
    analyses = [("whole", result.whole)]
    if result.actuator is not result.whole:
        analyses.append(("actuator", result.actuator))
    rows = [
        [
            fitted_to, law, "yes" if law == analysis.choice.chosen else "no", constant,
            *estimate_cells(estimate), analysis.strain_min, analysis.strain_max,
        ]
        for fitted_to, analysis in analyses
        for law, fit in analysis.fits.items()
        for constant, estimate in estimates(fit).items()
    ]  # fmt: skip
    return csv_rows(PARAMETERS, rows, digits=CSV_DIGITS)


def _curve_csv(result: ElastomerCharacterisation) -> str:
    samples, fits = result.samples, result.whole.fits
    models = {f"model_{name}_kPa": fit.predict(samples) / 1e3 for name, fit in fits.items()}
    header = ["recording", "role", "strain", "stress_kPa", *models]
    columns = zip(samples.owner, samples.strain, samples.stress / 1e3, *models.values(), strict=True)
    rows = [[samples.curves[k].name, samples.curves[k].role, *numbers] for k, *numbers in columns]
    return csv_rows(header, rows, digits=CSV_DIGITS)
