"""The report of a custom base model: misfit, fitted parameters, errors before and after."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from fitting.diagnose.custom_model import Explained
from fitting.inference.notes import joined
from pneusma_jax.errors import counted

from . import figures as house
from .cells import number
from .report import Picture, Points, Report, Section
from .table import Table

SCHEMA = "pneusma-custom-model/1"
LEFT_OUT = "recordings left out in turn"
WIDENED = "± one standard error, widened by what the model leaves."
ERRORS = "Root mean square errors in the unit of the output. Recordings of role validation were never fitted."
CAPTION = (
    "Every measured value against its prediction, by the refitted base (orange) and with the terms that "
    "entered (blue). A perfect model lies on the line."
)


def report_of(explained: Explained) -> Report:
    """The report of the result."""
    recordings = explained.problem.recordings
    fitted = sum(recording.role == "fit" for recording in recordings)
    return Report(
        title="A custom base model",
        subtitle=f"What does it miss of {counted(len(recordings), 'recording')} ({fitted} fitted)?",
        verdict=_verdict(explained),
        sections=[
            Section("Measured and predicted", [Picture("predictions", CAPTION, lambda: figure(explained))]),
            Section("What it misses", [Points([_named(explained, name) for name in explained.named])]),
            Section("Parameters", [_parameters(explained)]),
            Section("How the terms were chosen", [Points(_steps(explained))]),
            Section("Errors, recording by recording", [_errors(explained)]),
        ],
        content=lambda: content(explained),
    )


def _verdict(explained: Explained) -> list[str]:
    named = joined(explained.named)
    found = f"The base misses {named}." if named else (
        "None of the candidates is missing from the base: it stays as it is."
    )  # fmt: skip
    sentences = [found, f"{LEFT_OUT}: chi-square per value {explained.before:.1f} -> {explained.after:.1f}"]
    if any(recording.role == "validation" for recording in explained.problem.recordings):
        before, after = explained.errors()
        sentences += [
            f"never fitted: RMSE of {output} {number(before[output])} -> {number(after[output])}"
            for output in before
        ]
    return [f"{sentence[0].upper()}{sentence[1:].rstrip('.')}." for sentence in sentences]


def _named(explained: Explained, name: str) -> str:
    return f"{name}: {explained.problem.model.term(name).sentence}"


def _parameters(explained: Explained) -> Table:
    """Parameters of the accepted terms, then those of the base."""
    rows, terms = [], {}
    for name in explained.named:
        term = explained.problem.model.term(name)
        terms |= {term.full(key): spec for key, spec in term.specs.items()}
    for name, spec in terms.items():
        ends = f"{number(spec.low)} to {number(spec.high)}"
        rows.append([name, _estimate(explained, name), spec.unit, ends, spec.text])
    for name in explained.final.result.parameters:
        if name not in terms:
            parameter = explained.final.result.parameters[name]
            ends = f"{number(parameter.min)} to {number(parameter.max)}"
            rows.append([name, _estimate(explained, name), parameter.unit, ends, "of the base"])
    return Table(["parameter", "value", "unit", "within", "what it is"], rows, WIDENED)


def _estimate(explained: Explained, name: str) -> str:
    return explained.estimate(name).replace("+/-", "±")


def _steps(explained: Explained) -> list[str]:
    sentences = []
    for step in explained.stages:
        best = step.candidates[0]
        close = f" Not told from it: {joined(step.close)}." if step.chosen and step.close else ""
        sentences.append(
            f"After {', '.join(('the base', *step.present))}: {step.chosen or 'nothing'} enters "
            f"(best: {best.name}, log Bayes factor {number(best.log_bayes_factor, '.1f')}).{close}"
        )
    return sentences


def _errors(explained: Explained) -> Table:
    rows = []
    for recording in explained.problem.recordings:
        before, after = explained.errors_of(recording.name)
        rows += [
            [recording.name, recording.role, output, number(before[output]), number(after[output])]
            for output in before
        ]
    return Table(["recording", "role", "output", "base, refitted", "with the terms"], rows, ERRORS)


def content(explained: Explained) -> dict[str, Any]:
    """The content of `report.json`."""
    parameters = explained.final.result.parameters
    wider = np.sqrt(explained.inflation)
    return {
        "schema": SCHEMA,
        "verdict": _verdict(explained),
        "terms": list(explained.named),
        "parameters": {
            name: {
                "value": parameters[name].value,
                "sd": None if parameters[name].standard_error is None
                else parameters[name].standard_error * wider,
                "at_bound": parameters[name].at_bound,
            }
            for name in parameters
        },
        "steps": [
            {
                "present": list(step.present), "entered": step.chosen, "not_told_apart": step.close,
                "candidates": [
                    {
                        "name": candidate.name, "log_bayes_factor": candidate.log_bayes_factor,
                        "chi_square_left_out": candidate.left_out,
                    }
                    for candidate in step.candidates
                ],
            }
            for step in explained.stages
        ],
        "chi_square_per_value_left_out": {"before": explained.before, "after": explained.after},
        "rmse": {
            recording.name: dict(zip(("before", "after"), explained.errors_of(recording.name), strict=True))
            for recording in explained.problem.recordings
        },
    }  # fmt: skip


def figure(explained: Explained) -> Figure:
    """Figure of prediction over measurement for every output: the refitted base, and with the accepted
    terms."""
    data = explained.problem.data
    models = {"base, refitted": (explained.base, house.ORANGE)}
    if explained.named:
        models["with the terms"] = (explained.final, house.BLUE)
    drawn = Figure(figsize=(1.0 + 4.0 * len(data.measured), 4.2), layout="constrained")
    panels = drawn.subplots(1, len(data.measured), squeeze=False)[0]
    for panel, (output, measured) in zip(panels, data.measured.items(), strict=True):
        counted = data.weight[output] > 0.0
        for label, (fit, colour) in models.items():
            predicted = explained.problem.outputs(fit.result.values)[output]
            panel.plot(measured[counted], predicted[counted], ".", color=colour, markersize=3, label=label)
        ends = [measured[counted].min(), measured[counted].max()]
        panel.plot(ends, ends, color=house.BLACK, linewidth=0.8)
        panel.set_xlabel(f"{output}, measured")
        panel.set_ylabel(f"{output}, predicted")
        house.legend_above(panel)
    return drawn
