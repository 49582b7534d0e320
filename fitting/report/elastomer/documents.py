"""The files of a fitted elastomer: material, report as JSON and HTML, tables, figures."""

import json

from fitting.calibrate.elastomer.material import material
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates
from pneusma_jax.calibration.toml import render_calibration

from ..figures import png
from .json_report import plain, report
from .page import html_page
from .tables import csv_text


def documents(result: ElastomerCharacterisation) -> dict[str, str | bytes]:
    """Content of every file, by file name."""
    drawn = result.plot()
    content: dict[str, str | bytes] = {
        "material.toml": render_calibration(material(result.whole, result.samples, result.title)),
        "report.json": _json(result),
        "report.html": html_page(result, drawn),
        "parameters.csv": _parameters_csv(result),
        "curve.csv": _curve_csv(result),
        **{f"{name}.png": png(drawing) for name, drawing in drawn.items()},
    }
    if result.actuator is not result.whole:
        title = f"{result.title}, an actuator's range"
        content["material_actuator.toml"] = render_calibration(
            material(result.actuator, result.samples, title)
        )
    return content


def _parameters_csv(result: ElastomerCharacterisation) -> str:
    rows = []
    pairs = [("whole", result.whole)] + [("actuator", result.actuator)] * (
        result.actuator is not result.whole
    )
    for fitted_to, analysis in pairs:
        for name, fit in analysis.fits.items():
            for constant, e in estimates(fit).items():
                chosen = "yes" if name == analysis.choice.chosen else "no"
                bound = "yes" if e.at_bound else "no"
                ends = [analysis.strain_min, analysis.strain_max]
                rows.append([fitted_to, name, chosen, constant, e.value, e.sd, e.unit, bound, *ends])
    header = [
        "fitted_to",
        "law",
        "chosen",
        "parameter",
        "value",
        "sd",
        "unit",
        "at_bound",
        "strain_min",
        "strain_max",
    ]
    return csv_text(header, rows)


def _curve_csv(result: ElastomerCharacterisation) -> str:
    samples, fits = result.samples, result.whole.fits
    models = {f"model_{name}_kPa": fit.predict(samples) / 1e3 for name, fit in fits.items()}
    header = ["recording", "role", "strain", "stress_kPa", *models]
    rows = [
        [samples.curves[k].name, samples.curves[k].role, *numbers]
        for k, *numbers in zip(
            samples.owner, samples.strain, samples.stress / 1e3, *models.values(), strict=True
        )
    ]
    return csv_text(header, rows)


def _json(result: ElastomerCharacterisation) -> str:
    return json.dumps(plain(report(result)), indent=1, ensure_ascii=False, allow_nan=False) + "\n"
