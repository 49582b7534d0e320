"""Sentences on a model on disk that is fitted, and its refusal for recordings of which it says nothing."""

from fitting.data.recordings import Campaign
from fitting.inference.notes import capital, joined
from fitting.inference.numbers import number
from fitting.inference.parameters import Parameters
from pneusma_jax.errors import InputError, counted

from .registry import specimen_of
from .saved_models import AddedDiscrepancy, AugmentedModel
from .with_saved_model import Augmented

MUCH_NARROWER = 2.0
"""Minimum ratio of a constant's prior without a model on disk to that of its file for a note [1]."""


def notes_on(model: Augmented, campaign: Campaign) -> list[str]:
    """Sentences on model discrepancies, which no fit changes, and on priors that do not count again."""
    sentences = []
    for rest in model.discrepancies:
        sentences.append(
            f"{capital(rest.words)}, is added as the file states it, and was not fitted here. "
            f"It was seen for {rest.span_words} only. "
            "Errors of its corrections are in no other error."
        )
        if rest in model.reused:
            knots = counted(len(rest.knots), "knot")
            sentences[-1] += f" It comes from these recordings: its {knots} count as fitted numbers."
    for rest in model.idle:
        sentences.append(f"{capital(rest.words)}, does not act in recordings of kind {model.kind}.")
    spent = model.spent(campaign)
    if spent:
        sentences.append(
            f"The file's priors of {joined(spent)} come from these recordings and are not counted again."
        )
    return sentences + _narrowed(model, campaign)


def _narrowed(model: Augmented, campaign: Campaign) -> list[str]:
    """A sentence on base constants that the file knows much better than recordings of this kind alone."""
    campaign, told = model.described(campaign), []
    for name, entry in model.specimen.parameters_for(campaign, **model.options(campaign, {})).items():
        quantity = model.quantity(campaign, name)
        if quantity is None or quantity.prior is None or model.is_from_here(quantity):
            continue
        if entry.prior is None:
            told.append(f"{name} (it has none without the file)")
        elif entry.prior.sd >= MUCH_NARROWER * quantity.prior.sd:
            told.append(f"{name} by a factor of {number(entry.prior.sd / quantity.prior.sd, '.2g')}")
    if not told:
        return []
    return [
        "The file's priors do not come from these recordings, and narrow those of "
        f"{joined(told)}. If this is another specimen, widen them in the file."
    ]


def absent_effects(model: Augmented, parameters: Parameters) -> dict[str, str]:
    """Amplitudes of effects that a fit leaves at zero, by name, with a sentence each."""
    found = {}
    for name, slug, spec in model.specs():
        entry = parameters[name]
        if entry.at_bound and not spec.shape and abs(entry.value - spec.neutral) <= 1e-6 * spec.high:
            found[name] = (
                f"{name} ended at {spec.neutral:g}, where {slug} is absent: these recordings do not ask "
                "for it."
            )
    return found


def check_kind(model: AugmentedModel, kind: str) -> None:
    """Refuse a model that says nothing about recordings of a kind.

    Raises:
        InputError: one line that says what the model holds.
    """
    tables = specimen_of(kind).tables
    some = any(table in tables for own in (model.base, *model.specimens.values()) for table in own)
    if some or model.tables or Augmented(kind, model).more_than_base:
        return
    named = (one.words if isinstance(one, AddedDiscrepancy) else one.slug for one in model.added)
    held = "; ".join(named) or "no effect"
    raise InputError(
        f"{model.path or model.name}: nothing in this model acts in recordings of kind {kind} ({held})"
    )
