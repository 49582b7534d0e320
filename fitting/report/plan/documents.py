"""A plan on disk: protocol.toml and protocol.csv for machines, protocol.html for people, the figure."""

import json
from typing import Any

import tomlkit

from fitting.data.csv_text import csv_text
from fitting.plan.candidates import HELD, HOLDS
from fitting.plan.plan import Plan, PlannedTest
from fitting.report import html
from fitting.report.figures import png
from pneusma_jax.units import from_si

from .figure import plan_figure
from .text import (
    CONSTANTS,
    TABLE,
    comparison,
    constant_rows,
    preparation,
    reasons,
    setpoint,
    speed,
    table_row,
    verdict,
)

SCHEMA = "pneusma-protocol/1"


def documents(plan: Plan) -> dict[str, str | bytes]:
    """Content of every file of a plan, by file name."""
    entries = [entry(plan, number, test) for number, test in enumerate(plan.tests, start=1)]
    drawing = plan_figure(plan)
    summary = {"schema": SCHEMA, "tests": entries, "expected": expected(plan)}
    return {
        "protocol.toml": _toml(plan, entries),
        "protocol.csv": _csv(entries),
        "protocol.html": _page(plan, drawing),
        "expected_sd.png": png(drawing),
        "report.json": json.dumps(summary, indent=1) + "\n",
    }


def entry(plan: Plan, number: int, test: PlannedTest) -> dict[str, Any]:
    """One test as numbers and words."""
    what = test.candidate
    length = 1e3 * float(plan.spring.geometry.free_length)
    held = {"setpoint_share": what.share, "setpoint_ohm": round(setpoint(plan, test), 4)}
    return {
        "order": number,
        "name": what.name,
        "role": test.role,
        "repeats": test.repeats,
        "hold": HOLDS[what.hold],
        **(held if what.hold == HELD else {}),
        "strains_percent": [round(100.0 * s, 6) for s in what.strains],
        "peaks_mm": [round(length * s, 3) for s in what.strains],
        "rate_percent_per_s": round(100.0 * test.rate, 4),
        "speed_mm_per_s": round(speed(plan, test), 4),
        "sampling_s": test.sampling_s,
        "minutes": round(test.minutes, 2),
        "gain_nats": round(test.gain, 3),
        "what": what.words,
    }


def expected(plan: Plan) -> dict[str, dict[str, Any]]:
    """What each constant is expected to be known to, in the unit of tables."""
    table = {}
    for k, name in enumerate(plan.knowledge.names):
        unit = plan.knowledge.table.quantities[name].unit
        sd = from_si(float(plan.knowledge.sd[k]), unit, difference=True)
        table[name] = {
            "first_guess": _short(from_si(float(plan.knowledge.mean[k]), unit, difference=True)),
            "sd_before": _short(sd),
            "sd_after": _short(sd * plan.sd[-1, k]),
            "unit": unit,
        }
    return table


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _toml(plan: Plan, entries: list[dict[str, Any]]) -> str:
    document = tomlkit.document()
    document["schema"] = SCHEMA
    document["alloy"] = plan.knowledge.table.name
    document["wanted"] = list(plan.wanted)
    document["minutes"] = round(plan.minutes, 1)
    if plan.geometry:
        document["geometry"] = plan.geometry
    tests = tomlkit.aot()
    for fields in entries:
        tests.append(tomlkit.item(fields))
    document["test"] = tests
    document["expected"] = {name: tomlkit.item(fields) for name, fields in expected(plan).items()}
    return tomlkit.dumps(document)


def _csv(entries: list[dict[str, Any]]) -> str:
    names = list(dict.fromkeys(key for fields in entries for key in fields))
    joined = lambda x: " ".join(f"{v:g}" for v in x) if isinstance(x, list) else x  # noqa: E731
    return csv_text({name: [joined(fields.get(name, "")) for fields in entries] for name in names})


def _page(plan: Plan, drawing: Any) -> str:
    title = f"First campaign for {plan.knowledge.table.name}"
    caption = (
        "Expected 1-sigma of each constant after each test, in units of what is known before the first one"
        " (median over possible alloys). Bold: the constants that the tests were chosen for."
    )
    parts = [
        html.heading(title, 1),
        html.paragraph("A protocol chosen by expected information, before any data", "subtitle"),
        html.verdict(verdict(plan)),
        html.heading("Before you start"),
        html.bullets(preparation(plan)),
        html.heading("Tests, in this order"),
        html.table(TABLE, [table_row(plan, test) for test in plan.tests]),
        html.heading("What they are expected to give"),
        html.figure(drawing, caption),
        html.table(CONSTANTS, constant_rows(plan)),
        html.paragraph(comparison(plan)),
        html.heading("What will stay unknown"),
        html.bullets(plan.loose) or html.paragraph("Nothing stands out."),
        html.heading("How this was chosen"),
        html.bullets(reasons(plan)),
    ]
    return html.page(title, parts)
