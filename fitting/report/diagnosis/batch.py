"""The report of many diagnoses: verdicts, how often each effect is named first, failed campaigns."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from fitting.data.csv_text import csv_rows
from fitting.diagnose.batch import Diagnosed, Diagnoses
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.inference.notes import ended, joined
from fitting.specimens.saved_models import AugmentedModel
from pneusma_jax.errors import counted
from pneusma_jax.units import amount

from .. import render
from ..cells import number, with_error
from ..report import Points, Report, Section
from ..table import Table
from .report import report_of as diagnosis_report
from .tables import words_of

SCHEMA = "pneusma-diagnosis-batch/1"
EFFECT_KEYS = ("name", "probability", "tentative", "strength", "together", "parameters")
"""Keys of an effect that are copied from a campaign's own `report.json`."""
HEADER = ("campaign", "verdict", "effects, their probabilities and strengths", "base model", "with effects")
"""Columns of the table; the last two are reduced chi-squares."""
NOTE = (
    "The strength of an effect has its standard error. Perhaps: the name is hardly likelier than not, or the "
    "error is larger than the strength. The last columns are reduced chi-squares on recordings that were not "
    "fitted, or on all where none was held out. Each campaign has a folder of its own with its report."
)
NO_EFFECT = {"name": "", "probability": None, "tentative": None, "strength": None, "parameters": {}}
"""Entry of a campaign without effects, for its row in `campaigns.csv`."""


def present(
    conclusion: Conclusion, title: str, command: str, seed: int, start: AugmentedModel | None
) -> tuple[Sequence[str], Mapping[str, bytes]]:
    """Sentences and documents of one diagnosis, in the form of `fitting.diagnose.batch.Present`.

    Args:
        conclusion: the diagnosis.
        title: title of the campaign.
        command: command line that repeats the diagnosis.
        seed: seed of the diagnosis.
        start: model on disk that it started from; None for the published one.
    """
    report = diagnosis_report(conclusion, title, command, seed, start)
    documents = render.documents(report).items()
    as_bytes = {name: body.encode() if isinstance(body, str) else body for name, body in documents}
    return list(report.verdict), as_bytes


def verdict(result: Diagnoses) -> list[str]:
    """The few most important sentences."""
    done = [member for member in result.members if member.done]
    mismatched = [member for member in done if member.content["verdict"] == "mismatch"]
    were = "was" if len(done) == 1 else "were"
    said = [
        f"{len(done)} of {counted(len(result.members), 'campaign')} {were} diagnosed; the model leaves "
        f"physics out in {len(mismatched)} of them."
    ]
    first = [_effects(member)[0] for member in mismatched if _effects(member)]
    for words, tentative in (("Named first", False), ("Named first with a perhaps", True)):
        counts = Counter(effect["name"] for effect in first if effect["tentative"] is tentative)
        names = [f"{words_of(slug)} ({count})" for slug, count in counts.most_common()]
        said += [f"{words}: {joined(names)}."] if names else []
    said += [f"{m.name} was not diagnosed: {m.problem}." for m in result.members if not m.done]
    return said + [f"{member.name}: {member.problem}." for member in done if member.problem]


def _effects(member: Diagnosed) -> list[dict[str, Any]]:
    """Effects of a campaign's report, the most probable first; empty where it has none or failed."""
    return member.content.get("effects", [])


def _name(effect: dict[str, Any]) -> str:
    """An effect with its probability, and its strength with the error of that."""
    perhaps = "perhaps " if effect["tentative"] else ""
    name = f"{perhaps}{words_of(effect['name'])} {effect['probability']:.2f}"
    if effect["strength"] is None:
        return name
    strength, entry = _strength(effect)
    size = amount(with_error(entry["value"], entry["sd"]), entry["unit"])
    return f"{name} ({strength} = {size})"


def _strength(effect: dict[str, Any]) -> tuple[str | None, dict[str, Any]]:
    """Name of an effect's strength, and its entry: value, sd and unit. Empty where it has none.

    Of terms that the recordings do not tell apart it is their sum.
    """
    if together := effect.get("together"):
        return " + ".join(together["names"]), together
    return effect["strength"], effect["parameters"].get(effect["strength"], {})


def _row(member: Diagnosed) -> list[str]:
    """Cells of a campaign, as many as in `HEADER`."""
    if not member.done:
        return [member.name, "failed", "", "", ""]
    names = [_name(effect) for effect in _effects(member)]
    fit = member.content["fit"]
    before, after = (fit[when]["reduced_chi2"] for when in ("before", "after"))
    return [member.name, member.content["verdict"], ", ".join(names), number(before), number(after)]


def _csv(result: Diagnoses) -> str:
    """`campaigns.csv`: a row for each effect of each campaign, or one for a campaign without effects."""
    header = [
        "campaign",
        "path",
        "verdict",
        "effect",
        "probability",
        "tentative",
        "strength",
        "value",
        "standard_error",
        "unit",
        "chi2_base",
        "chi2_with_effects",
        "problem",
    ]
    rows = []
    for member in result.members:
        fit = member.content.get("fit", {})
        scores = [fit[when]["reduced_chi2"] if fit else None for when in ("before", "after")]
        outcome = member.content.get("verdict", "failed")
        for effect in _effects(member) or [NO_EFFECT]:
            strength, size = _strength(effect)
            cells = [*(effect[key] for key in ("name", "probability", "tentative")), strength]
            cells += [size.get(key) for key in ("value", "sd", "unit")]
            rows.append([member.name, str(member.path), outcome, *cells, *scores, member.problem])
    return csv_rows(header, rows)


def _content(result: Diagnoses) -> dict[str, Any]:
    """Content of the `report.json` of all campaigns."""
    members = [
        {
            "name": member.name,
            "path": str(member.path),
            "verdict": member.content.get("verdict"),
            "effects": [{key: e.get(key) for key in EFFECT_KEYS} for e in _effects(member)],
            "problem": member.problem or None,
        }
        for member in result.members
    ]
    return {"schema": SCHEMA, "verdict": verdict(result), "seed": result.seed, "campaigns": members}


def report_of(result: Diagnoses) -> Report:
    """The report of the campaigns together."""
    notes = [f"{member.name}: {ended(note)}" for member in result.members for note in member.notes]
    return Report(
        title=f"{len(result.members)} diagnoses",
        subtitle="Does the published model explain these campaigns?",
        verdict=verdict(result),
        sections=[
            Section("Campaigns", [Table(HEADER, [_row(member) for member in result.members], NOTE)]),
            Section("Notes", [Points(notes)]),
        ],
        footer=f"pneusma diagnose, seed {result.seed}",
        content=lambda: _content(result),
        files=lambda: {"campaigns.csv": _csv(result)},
    )
