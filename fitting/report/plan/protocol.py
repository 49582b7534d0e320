"""A plan as a protocol for machines: tests as numbers and words, as TOML, CSV and JSON."""

from typing import Any

import tomlkit

from fitting.data.csv_text import csv_rows
from fitting.plan.candidates import HELD, HOLDS
from fitting.plan.plan import Plan, PlannedTest
from pneusma_jax.units import from_si

from .tables import setpoint, speed

SCHEMA = "pneusma-protocol/1"


def entries(plan: Plan) -> list[dict[str, Any]]:
    """Every test as numbers and words."""
    return [_entry(plan, number, test) for number, test in enumerate(plan.tests, start=1)]


def content(plan: Plan) -> dict[str, Any]:
    """The content of `report.json`."""
    return {"schema": SCHEMA, "tests": entries(plan), "expected": expected(plan)}


def files(plan: Plan) -> dict[str, str]:
    """The protocol as files, by name."""
    tests = entries(plan)
    return {"protocol.toml": _toml(plan, tests), "protocol.csv": _csv(tests)}


def _entry(plan: Plan, number: int, test: PlannedTest) -> dict[str, Any]:
    """One test as numbers and words."""
    candidate = test.candidate
    length = 1e3 * float(plan.spring.geometry.free_length)
    set_point = {"setpoint_share": candidate.share, "setpoint_ohm": round(setpoint(plan, test), 4)}
    return {
        "order": number,
        "name": candidate.name,
        "role": test.role,
        "repeats": test.repeats,
        "hold": HOLDS[candidate.hold],
        **(set_point if candidate.hold == HELD else {}),
        "strains_percent": [round(100.0 * s, 6) for s in candidate.strains],
        "peaks_mm": [round(length * s, 3) for s in candidate.strains],
        "rate_percent_per_s": round(100.0 * test.rate, 4),
        "speed_mm_per_s": round(speed(plan, test), 4),
        "sampling_s": test.sampling_s,
        "minutes": round(test.minutes, 2),
        "gain_nats": round(test.gain, 3),
        "what": candidate.words,
    }


def expected(plan: Plan) -> dict[str, dict[str, Any]]:
    """Expected value and uncertainty of each constant, in the unit of tables."""
    table = {}
    for k, name in enumerate(plan.knowledge.names):
        unit = plan.knowledge.table.quantities[name].unit
        sd = from_si(float(plan.knowledge.sd[k]), unit, difference=True)
        table[name] = {
            "first_guess": _short(from_si(float(plan.knowledge.mean[k]), unit, difference=True)),
            "sd_before": _short(sd),
            "sd_after": _short(sd * plan.sd[-1, k]),
            "told_best_by": plan.tellers[name][0].candidate.name,
            "sd_after_that_alone": _short(sd * plan.tellers[name][0].left),
            "unit": unit,
        }
    return table


def _short(value: float) -> float:
    return float(f"{value:.4g}")


def _toml(plan: Plan, found: list[dict[str, Any]]) -> str:
    document = tomlkit.document()
    document["schema"] = SCHEMA
    document["alloy"] = plan.knowledge.table.name
    document["wanted"] = list(plan.wanted)
    document["minutes"] = round(plan.minutes, 1)
    if plan.geometry:
        document["geometry"] = plan.geometry
    tests = tomlkit.aot()
    for fields in found:
        tests.append(tomlkit.item(fields))
    document["test"] = tests
    document["expected"] = {name: tomlkit.item(fields) for name, fields in expected(plan).items()}
    return tomlkit.dumps(document)


def _csv(found: list[dict[str, Any]]) -> str:
    names = list(dict.fromkeys(key for fields in found for key in fields))
    return csv_rows(names, [[_cell(fields.get(name, "")) for name in names] for fields in found])


def _cell(value: Any) -> Any:
    return " ".join(f"{one:g}" for one in value) if isinstance(value, list) else value
