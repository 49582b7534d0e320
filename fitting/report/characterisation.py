"""Shared parts of the reports on all characterised specimens: parameters as table, CSV and JSON."""

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fitting.calibrate.combinations import Combination
from fitting.calibrate.quoted import MERELY_PRIOR, merely_prior
from fitting.calibrate.result import SCHEMA, Estimate
from fitting.data.csv_text import csv_rows
from fitting.inference.lasting_noise import Lasting
from fitting.inference.notes import joined
from fitting.specimens.with_saved_model import Augmented
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.toml import render_calibration
from pneusma_jax.errors import counted
from pneusma_jax.units import amount

from .cells import number, percent, relative, told_apart, with_error
from .figures import RESIDUAL
from .table import Table

ERRORS = "± one standard error."
QUOTED = (
    "± one standard error; where the misfit is no parabola, the errors to either side (68 %). The 90 % "
    "interval is that of the profile likelihood. Of prior's: width of this interval over that of the prior's."
)
SIGNED = f"Signed: the same of {RESIDUAL}, so it is positive where the model is low."
"""Sentence on the signed relative difference of every table of errors."""
COMBINED = "These are known although single constants may not be. Stresses are those of a first pull."
CSV_DIGITS = 10
"""Number of significant digits in CSV files of results."""
MOST_NAMES = 12
"""Maximum number of recordings that a subtitle names."""


def ask(path: Path | None, model: Augmented | None = None) -> str:
    """Command that looks for missing physics in a campaign, beside that of a model on disk if any."""
    words = ["pneusma diagnose", *([] if path is None else [shlex.quote(str(path))])]
    if model is not None:
        words.append(f"--model {shlex.quote(str(model.model.path or 'MODEL'))}")
    return f"`{' '.join(words)}`"


def another_cause(
    moved: Sequence[str], zeros: Sequence[str], path: Path | None, model: Augmented | None = None
) -> list[str]:
    """A sentence that leads on where several constants moved far, or zeros of instruments seem to be off.

    Args:
        moved: sentences on constants that moved far.
        zeros: sentences on zeros.
        path: the campaign's folder.
        model: model on disk that was fitted, if any.
    """
    if (len(moved) < 2 and not zeros) or (model is not None and model.diagnosed_here):
        return []
    law, command = "law" if model is None else "model", ask(path, model)
    return [f"Physics that the {law} leaves out looks like this, too. {command} tells whether any is there."]


def doubtful(
    shifts: Mapping[str, float],
    drifts: Mapping[str, float],
    path: Path | None,
    model: Augmented | None = None,
) -> list[str]:
    """Sentences on constants that are not to be trusted although the law fits; empty where they may be.

    Constants that move, and noise that drifts, take up physics that the law leaves out. What is left then
    looks like noise.

    Args:
        shifts: shifts that chance hardly makes, see `improbable_shifts`.
        drifts: drifts of zeros of instruments that are large, in units of the noise, by output.
        path: the campaign's folder.
        model: model on disk that was fitted, if any. A diagnosis of the same campaign has looked already.
    """
    if not shifts and not drifts:
        return []
    looked = model is not None and model.diagnosed_here
    if looked:
        said = [
            "Do not trust these constants yet, although a diagnosis of this campaign has looked for missing "
            f"physics. The model {model.model.name} holds what it found."
        ]
    else:
        law = "law" if model is None else "model"
        said = [
            f"Do not trust these constants before {ask(path, model)} has looked for physics that the {law} "
            "leaves out."
        ]
    if shifts:
        sizes = sorted(map(abs, shifts.values()))
        by = " to ".join(dict.fromkeys(f"{size:.1f}" for size in (sizes[0], sizes[-1])))
        said.append(
            f"The fit moved {joined(list(shifts))} by {by} standard deviations of what was known before."
        )
    if drifts:
        each = joined(f"that of {name} by {size:.2g}" for name, size in drifts.items())
        said.append(
            f"The fit needs zeros of instruments that drift far: {each} times its noise. "
            "Simulated springs whose zeros drifted by their noise gave 0.8 to 1.05; other kinds were not "
            "measured."
        )
    causes = ["Sizes or an alloy other than stated"] * bool(shifts)
    causes += ["instruments that drift"] * bool(drifts)
    cause = " or ".join(causes)
    like = f"{cause[0].upper()}{cause[1:]} would look like that"
    if looked:
        return [*said, f"{like}: check them first. Intervals count none of this."]
    return [*said, f"{like}, too. Intervals count none of this."]


def parameter_table(
    parameters: Mapping[str, Estimate], start: Mapping[str, float], share: Mapping[str, float | None]
) -> Table:
    """Table of parameters with their errors.

    Args:
        parameters: parameters by name.
        start: start value by name, in the unit of files.
        share: width of the 90 % interval over that of the prior by name, where there is a prior.
    """
    rows = [
        [
            name, estimate_text(e), e.unit, relative(e.value, e.sd), interval_text(e),
            percent(share.get(name)), number(start.get(name), ".4g"), remark(e),
        ]
        for name, e in parameters.items()
    ]  # fmt: skip
    header = ["parameter", "value", "unit", "relative error", "90 % interval", "of prior's", "start", ""]
    return Table(header, rows, QUOTED)


def estimate_text(estimate: Estimate) -> str:
    """Value and standard error, or errors to either side; a value at a bound usually has none."""
    if estimate.curved and 68 in estimate.interval:
        low, high = estimate.interval[68]
        below, above = max(estimate.value - low, 0.0), max(high - estimate.value, 0.0)
        value = told_apart(estimate.value, low, high)[0]
        return f"{value} (-{number(below, '.2g')} +{number(above, '.2g')})"
    without = estimate.at_bound and not math.isfinite(estimate.sd)
    return with_error(estimate.value, None if without else estimate.sd)


def interval_text(estimate: Estimate) -> str:
    """The 90 % interval, or the bound that the recordings give."""
    if 90 not in estimate.interval:
        return ""
    low, high = told_apart(*estimate.interval[90])
    if estimate.determined == (True, False):
        return f"above {low}"
    return f"below {high}" if estimate.determined == (False, True) else f"{low} to {high}"


def remark(estimate: Estimate) -> str:
    """Remark on an estimate beside its numbers."""
    if estimate.at_bound:
        return "at bound"
    if merely_prior(estimate):
        return "merely its prior"
    limits = {
        (True, False): "lower limit only",
        (False, True): "upper limit only",
        (False, False): "by priors",
    }
    return limits.get(estimate.determined, "")


def combination_table(found: Sequence[Combination]) -> Table:
    """Quantities that are known better than single constants, with their 90 % intervals."""
    rows = []
    for one in found:
        value, interval = told_apart(one.value, one.low, one.high)[0], told_apart(one.low, one.high)
        rows.append([one.name, value, " to ".join(interval), one.unit])
    return Table(["quantity", "value", "90 % interval", "unit"], rows, COMBINED)


def combinations_json(found: Sequence[Combination]) -> list[dict[str, Any]]:
    """The same as `report.json` has it."""
    return [{"name": c.name, "value": c.value, "interval90": [c.low, c.high], "unit": c.unit} for c in found]


def zeros_json(found: Lasting | None) -> dict[str, dict[str, float | bool]]:
    """Zeros of instruments as `report.json` has them, in units of the noise, by output; whether they show."""
    if found is None:
        return {}
    return {
        n: {"off": found.offset[n], "wanders": found.drift[n], "shown": n in found.told} for n in found.drift
    }


def with_caution(table: Calibration, said: str) -> str:
    """TOML text of a table with a `caution`; without one where nothing is said."""
    text = {key: words for key, words in table.text.items() if key != "caution"}
    return render_calibration(replace(table, text=text | ({"caution": said} if said else {})))


def fitted_only(
    parameters: Mapping[str, Estimate], identifiability: Sequence[Mapping[str, Any]]
) -> dict[str, Estimate]:
    """Parameters without those of specimens of which no recording was fitted; see `open_constants`."""
    entries = [entry for entry in identifiability if entry["kind"] == "not_fitted"]
    aside = {name for entry in entries for name in entry["parameters"]}
    return {name: estimate for name, estimate in parameters.items() if name not in aside}


def limits(parameters: Mapping[str, Estimate]) -> list[str]:
    """Sentences about constants that the recordings do not bracket, and about those that merely repeat their
    priors."""
    own = {name: e for name, e in parameters.items() if not merely_prior(e)}
    with_ends = lambda ends: [name for name, e in own.items() if e.determined == ends]  # noqa: E731
    said = []
    prior = [name for name, e in parameters.items() if merely_prior(e)]
    if prior:
        are = "is merely its prior" if len(prior) == 1 else "are merely their priors"
        said.append(
            f"{joined(prior)} {are}: the quoted interval is more than {100.0 * MERELY_PRIOR:.0f} % as wide "
            "as the prior's."
        )
    for ends, word in (((True, False), "lower"), ((False, True), "upper")):
        names = with_ends(ends)
        if names:
            each = "; ".join(f"{n} {amount(interval_text(parameters[n]), parameters[n].unit)}" for n in names)
            said.append(
                f"Of {joined(names)} the recordings give only {'an' if word == 'upper' else 'a'} {word} "
                f"limit ({each}). The other end comes from the prior, or from the bound of the search."
            )
    names = with_ends((False, False))
    if names:
        said.append(
            f"Both ends of the interval of {joined(names)} come from priors or bounds more than from the "
            "recordings."
        )
    return said


def estimate_json(estimate: Estimate) -> dict[str, Any]:
    """An estimate as `report.json` has it."""
    found = {"value": estimate.value, "sd": estimate.sd, "unit": estimate.unit, "at_bound": estimate.at_bound}
    if not estimate.interval:
        return found
    low, high = estimate.determined
    return found | {
        **{f"interval{percent}": list(ends) for percent, ends in estimate.interval.items()},
        "profile_is_no_parabola": estimate.curved,
        "recordings_bound": "both" if low and high else "below" if low else "above" if high else "none",
        "width_over_prior": estimate.of_prior,
        "merely_prior": merely_prior(estimate),
    }


def estimates_json(parameters: Mapping[str, Estimate]) -> dict[str, dict[str, Any]]:
    """Estimates by name for `report.json`."""
    return {name: estimate_json(estimate) for name, estimate in parameters.items()}


def estimate_cells(estimate: Estimate) -> list[object]:
    """Value, standard error, unit and bound of an estimate for CSV files."""
    return [estimate.value, estimate.sd, estimate.unit, "yes" if estimate.at_bound else "no"]


def parameters_csv(parameters: Mapping[str, Estimate]) -> str:
    """`parameters.csv`: one row for each parameter."""
    header = ["parameter", "value", "sd", "unit", "at_bound", "low90", "high90"]
    rows = [
        [name, *estimate_cells(estimate), *estimate.interval.get(90, (math.nan, math.nan))]
        for name, estimate in parameters.items()
    ]
    return csv_rows(header, rows, digits=CSV_DIGITS)


def content(
    kind: str,
    title: str,
    real: bool | None,
    verdict: Sequence[str],
    parameters: Mapping[str, Estimate],
    warnings: Sequence[str],
    seed: int,
    more: Mapping[str, Any],
) -> dict[str, Any]:
    """The content of `report.json`: entries of all kinds, around those of one kind (`more`)."""
    return {
        "schema": SCHEMA,
        "kind": kind,
        "title": title,
        "real": real,
        "verdict": verdict,
        "parameters": estimates_json(parameters),
        "warnings": warnings,
        **more,
        "seed": seed,
    }


def subtitle(what: str, recordings: str, fitted: Sequence[str], held_out: Sequence[str]) -> str:
    """Subtitle: specimen and fitted recordings.

    Args:
        what: name of the specimen, `"Wire"`.
        recordings: word for such recordings, `"test"`; the plural is made with an s.
        fitted: names of the fitted recordings.
        held_out: names of the recordings that only score.
    """
    rest = f", {len(held_out)} held out ({_names(held_out)})" if held_out else ""
    return f"{what}, {counted(len(fitted), recordings)} fitted ({_names(fitted)}){rest}"


def _names(names: Sequence[str]) -> str:
    more = len(names) - MOST_NAMES
    return ", ".join(names[:MOST_NAMES]) + (f" and {more} more" if more > 0 else "")


def footer(seed: int) -> str:
    """Footer with program and version."""
    return f"pneusma characterise, seed {seed}"
