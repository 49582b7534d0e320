"""The model that a diagnosis leads to, for `augmented.toml`."""

from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.probabilities import UNMODELLED
from fitting.diagnose.verdict.text import verdict_sentences
from fitting.specimens import specimen_of
from fitting.specimens.saved_models import AddedDiscrepancy, AddedEffect, AugmentedModel, add_effect, fitted
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.calibration.records import Prior, Quantity
from pneusma_jax.model_discrepancy import unit_of

MATERIAL = "material"
"""Name of the table of a law that was fitted first, beside the model."""


def model_of(conclusion: Conclusion, source: str, start: AugmentedModel | None = None) -> AugmentedModel:
    """The base model with its refitted constants, the effects that were found, and a model discrepancy.

    Args:
        conclusion: conclusion of a diagnosis.
        source: description of the data that it was fitted to, for the file.
        start: model that the diagnosis started from, whose constants and effects are kept. A diagnosis reads
            no constants of single specimens.
    """
    program, fit = conclusion.model
    start = start or AugmentedModel()
    common: dict[str, dict[str, Quantity]] = {kind: dict(table) for kind, table in start.base.items()}
    own: dict[str, dict[str, dict[str, Quantity]]] = {}
    specimens = list(dict.fromkeys(r.specimen for r in program.recordings))
    kinds = specimen_of(program.kind).tables  # alpha_1 is an alloy's resistance, and an exponent of Ogden's
    for k in program.unknowns.base:
        item = program.unknowns.items[k]
        name, _, number = item.name.partition("__")
        kind = next((table for table in kinds if name in QUANTITIES[table]), None)
        if kind is None:
            continue
        sd = item.spread(fit.u[k], conclusion.sd(k))
        quantity = fitted(kind, name, float(item.value(fit.u[k])), source, sd)
        place = own.setdefault(specimens[int(number) - 1], {}) if number else common
        place.setdefault(kind, {})[name] = quantity
    first = program.recordings[0]
    tables = {
        key: str(first.full_geometry()[key])
        for key in ("design", "alloy", "material")
        if first.full_geometry().get(key) not in (None, "fit")
    }
    if conclusion.start.tables:  # a law that was fitted first, whose constants these are
        tables |= dict.fromkeys(conclusion.start.tables, f"{MATERIAL}.toml")
    added = *start.added, *_clipped_effects(conclusion, source), *_discrepancy(conclusion, source)
    unexplained = conclusion.mismatch and not conclusion.named
    caution = verdict_sentences(conclusion)[0] if unexplained else ""
    tables = {**start.tables, **tables}
    return AugmentedModel(common, added, tables, own, "augmented", source, caution=caution)


def _discrepancy(conclusion: Conclusion, source: str) -> list[AddedDiscrepancy]:
    """The model discrepancy, if one was fitted."""
    rest = conclusion.remainder
    if rest is None:
        return []
    numbers = zip(rest.knots, rest.values, rest.sd, strict=True)
    knots, corrections = [], []
    for k, (at, value, sd) in enumerate(numbers, 1):
        knots.append(Quantity(f"knot_{k}", float(at), unit_of(rest.driver), "fitted", source))
        prior = Prior(mean=float(value), sd=float(sd)) if sd > 0.0 else None
        corrections.append(
            Quantity(f"correction_{k}", float(value), unit_of(rest.quantity), "fitted", source, prior)
        )
    kind = conclusion.explanation.program.kind
    return [AddedDiscrepancy(kind, rest.quantity, rest.driver, tuple(knots), tuple(corrections))]


def _clipped_effects(conclusion: Conclusion, source: str) -> list[AddedEffect]:
    """Effects clipped to their physical bounds, which rounding may exceed."""
    (program, fit), found = conclusion.model, []
    for f in conclusion.found:
        if f.slug == UNMODELLED:
            continue
        (effect,) = program.unknowns.effects(fit.u, [f.slug])
        found.append(add_effect(effect, source, {name: entry["sd"] for name, entry in f.parameters.items()}))
    return found
