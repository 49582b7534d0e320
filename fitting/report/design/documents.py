"""Files of a design study beside its report: numbers, and the table that `simulate --design` takes."""

import dataclasses
from pathlib import Path
from typing import Any

import pneusma_jax as pj
from fitting.data.csv_text import csv_text
from fitting.design.result import Design, DesignResult
from fitting.design.study import Objective
from fitting.specimens.saved_models import AugmentedModel, render_model
from pneusma_jax.actuator.designs import GEOMETRY_KEYS
from pneusma_jax.calibration import Calibration, named_table
from pneusma_jax.calibration.records import Quantity
from pneusma_jax.calibration.toml import render_calibration
from pneusma_jax.serial_chain.chain_files import SCHEMA
from pneusma_jax.serial_chain.designs import KEYS, NUMBERS
from pneusma_jax.units import INTERNAL_UNITS, from_si

from .words import label_of, row_words, verdict

RESULT_SCHEMA = "pneusma-design/1"


def files(result: DesignResult) -> dict[str, str]:
    """Content of the files beside the report, by file name."""
    front = {} if result.front is None else {"front.csv": _front_csv(result)}
    model = {} if result.study.model.path is None else {"model.toml": render_model(_model(result))}
    return tables(result, result.made) | model | front


def _model(result: DesignResult) -> AugmentedModel:
    """The study's model for the design beside it: without dimensions, which `design.toml` has."""
    given, plan = result.study.model, result.model.plan
    chosen = {"alloy": plan.alloy, "material": plan.silicone}
    tables = {key: _absolute(table) for key, table in chosen.items() if table is not None}
    return dataclasses.replace(
        given,
        base={kind: numbers for kind, numbers in given.base.items() if kind != "actuator"},
        specimens={},
        tables={"design": "design.toml", **tables},
        description=f"model of pneusma design {result.study.name}; its dimensions are those of design.toml",
    )


def summary(result: DesignResult) -> dict[str, Any]:
    """The content of `report.json`."""
    study = result.study
    return {
        "schema": RESULT_SCHEMA,
        "study": study.name,
        "verdict": verdict(result),
        "warnings": result.notes,
        "design": _numbers(result, result.made),
        "before_rounding": _numbers(result, result.ideal),
        "of_the_tables": None if result.base is None else _numbers(result, result.base),
        "active": _active(result),
        "ends": _ends(result),
        "steps_not_taken": _steps_not_taken(result),
        "unexplained_gradient": result.conditions.left,
        "front": None if result.front is None else _front(result),
        "failures": _failures(result),
        "evaluations": result.evaluations,
        "equilibria": result.equilibria,
        "seed": study.seed,
    }


def _active(result: DesignResult) -> list[dict[str, Any]]:
    """Constraints that hold the design, with their multipliers."""
    rows = zip(result.model.groups, result.limits.conditions.rows, strict=False)
    return [
        {
            "constraint": result.study.constraints[r.constraint].name,
            "state": r.state,
            "segment": r.segment,
            "spring": r.part,
            "multiplier": float(m),
        }
        for r, m in rows
        if m > 0.0
    ]


def _ends(result: DesignResult) -> dict[str, dict[str, float]]:
    """Multipliers of parameters that are at an end of their range, by name."""
    conditions = result.limits.conditions
    rows = zip(result.model.space.free, conditions.low, conditions.high, strict=True)
    return {f.name: {"low": float(a), "high": float(b)} for f, a, b in rows if a > 0.0 or b > 0.0}


def _steps_not_taken(result: DesignResult) -> list[dict[str, Any]]:
    """Steps of a parameter that would help, and the constraints that forbid them."""
    return [
        {
            "parameter": result.model.space.free[step.parameter].name,
            "up": step.up,
            "breaks": list(dict.fromkeys(row_words(result, row) for row in step.rows)),
            "no_equilibrium": step.lost,
        }
        for step in result.limits.blocked
    ]


def _front(result: DesignResult) -> dict[str, Any]:
    """Designs of the front, and their hypervolume."""
    front = result.front
    pairs = zip(result.study.objectives, front.reference, strict=True)
    return {
        "designs": [_numbers(result, design) for design in front.designs],
        "hypervolume": front.hypervolume,
        "reference": {o.name: o.in_unit(x) for o, x in pairs},
        "made": front.made,
    }


def _failures(result: DesignResult) -> dict[str, dict[str, Any]]:
    """Probabilities of failure, by the name of the constraint."""
    return {
        name: {
            "draws": c.draws,
            "failures": c.failures,
            "probability": c.probability,
            "interval": list(c.interval),
            "lost": c.lost,
        }
        for name, c in result.chances.items()
    }


def _numbers(result: DesignResult, design: Design) -> dict[str, Any]:
    study = result.study
    return {
        "choice": dataclasses.asdict(design.choice),
        "parameters": {
            f.name: {"value": from_si(design.parameters[f.name], f.unit), "unit": f.unit} for f in study.free
        },
        "objectives": {
            o.name: {"value": o.in_unit(x), "unit": o.unit} | _aimed(o, design.reached.get(k))
            for k, (o, x) in enumerate(zip(study.objectives, design.objectives, strict=True))
        },
        "violation": design.violation,
    }


def _aimed(one: Objective, reached: float | None) -> dict[str, float]:
    """Target and reached value of an objective whose own value is the distance between them."""
    if reached is None:
        return {}
    return {"target": from_si(one.target[0], one.unit), "reached": from_si(reached, one.unit)}


def _front_csv(result: DesignResult) -> str:
    study, designs, chances = result.study, result.front.designs, result.front.chances
    columns = {
        f"{label_of(o)} [{o.unit}]": [o.in_unit(d.objectives[k]) for d in designs]
        for k, o in enumerate(study.objectives)
    }
    return csv_text(
        columns
        | {
            f"{f.name} [{f.unit}]": [from_si(d.parameters[f.name], f.unit) for d in designs]
            for f in study.free
        }
        | ({"fails in fresh draws [1]": [c.probability for c in chances]} if chances else {})
    )


def tables(result: DesignResult, design: Design) -> dict[str, str]:
    """Tables of a design as TOML by file name; `design.toml` is the one for `simulate --design`."""
    plan, source = result.model.plan, f"pneusma design {result.study.name}"
    if plan.chain is None:
        return {"design.toml": render_calibration(_table(plan, 0, design, "design", source))}
    found = {
        f"segment_{k}.toml": render_calibration(_table(plan, k - 1, design, f"segment_{k}", source))
        for k in range(1, len(plan.tables) + 1)
    }
    return found | {"design.toml": _chain(plan, design, source)}


def _table(plan: Any, k: int, design: Design, name: str, source: str) -> Calibration:
    """Table of one segment with the design's dimensions."""
    table = plan.tables[k]
    changes = {n: x for n, x in design.parameters.items() if n in table.quantities}
    changes |= {n.partition(".")[2]: x for n, x in design.parameters.items() if n.startswith(f"{k + 1}.")}
    geometry = pj.design_geometry(table, **{n: x for n, x in changes.items() if n in GEOMETRY_KEYS})
    values = {n: float(getattr(geometry, n)) for n in GEOMETRY_KEYS if n in table.quantities} | changes
    quantities = {
        n: dataclasses.replace(q, value=values[n], status="assumed", source=source, prior=None)
        if n in values and abs(values[n] - q.value) > 1e-12 * abs(q.value)
        else q
        for n, q in table.quantities.items()
    }
    text = dict(table.text)
    for key, chosen in (("alloy", plan.alloy), ("material", plan.silicone)):
        if chosen is not None or key in text:
            text[key] = _absolute(chosen or named_table(table, key))
    what = f"{table.name}, designed anew"
    if plan.model.path is not None:
        what += "; its constants and effects are in model.toml beside it"
    return Calibration(name, table.kind, what, None, quantities, text, table.lines)


def _absolute(name: str) -> str:
    return str(Path(name).resolve()) if name.endswith(".toml") else name


def _chain(plan: Any, design: Design, source: str) -> str:
    """A chain's file with its segments' tables beside it."""
    chain = plan.chain
    origin = f'status = "assumed", source = "{source}"'
    entry = lambda value, dimension: (  # noqa: E731
        f'{{value = {float(value)!r}, unit = "{INTERNAL_UNITS[dimension]}", {origin}}}'
    )
    lines = [f'schema = "{SCHEMA}"', 'name = "design"', f'description = "{chain.name}, designed anew"']
    if chain.gravity is not None:
        lines += [
            f"gravity_{a} = {entry(g, 'acceleration')}" for a, g in zip("xyz", chain.gravity, strict=True)
        ]
    lines += [
        f"{key} = {entry(value, NUMBERS[key])}"
        for key, value in chain.numbers.items()
        if not key.startswith("gravity")
    ]
    lines += ["tip_follows = true"] if chain.tip_follows else []
    gap = design.parameters.get("connector")
    for k in range(len(chain.designs)):
        lines += [
            "",
            "[[segment]]",
            f'design = "segment_{k + 1}.toml"',
            f"angle = {entry(chain.angles[k], KEYS['angle'])}",
        ]
        if k < len(chain.connectors):
            length = chain.connectors[k] if gap is None else gap
            lines.append(f"connector = {entry(length, 'length')}")
            if chain.connector_masses and chain.connector_masses[k]:
                lines.append(f"connector_mass = {entry(chain.connector_masses[k], 'mass')}")
    return "\n".join(lines) + "\n"


__all__ = ["Quantity", "files", "summary", "tables"]
