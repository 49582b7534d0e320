"""Effects of a model that change nothing in a calculation, as sentences: none is left out silently."""

from fitting.inference.notes import joined
from pneusma_jax.errors import InputError
from pneusma_jax.pipeline import Effect, changes_equilibrium, changes_states

from .model import AddedEffect, AugmentedModel


def only_along_histories(model: AugmentedModel) -> list[str]:
    """The sentence on effects that only a history wakes, for states at rest; none where all act."""
    return _sentence(
        [slug for slug, effect in _built(model) if _asleep(effect)],
        "only along a history, so {it} {changes} nothing here",
    )


def only_on_instruments(model: AugmentedModel) -> list[str]:
    """The sentence on effects that change no state; none where all do."""
    return _sentence(
        [slug for slug, effect in _built(model) if not changes_states(effect)],
        "on what instruments or a test stand show, and {changes} nothing here",
    )


def of_states_at_rest(model: AugmentedModel) -> list[str]:
    """Sentences on all effects that change nothing in states at rest."""
    return only_along_histories(model) + only_on_instruments(model)


def shown_otherwise(model: AugmentedModel) -> list[str]:
    """Effects by which instruments show other values than a specimen has, by slug."""
    shows = lambda effect: type(effect).outputs is not Effect.outputs  # noqa: E731
    return [slug for slug, effect in _built(model) if shows(effect) and not changes_states(effect)]


def missed_by_chain(model: AugmentedModel, history: bool = False) -> list[str]:
    """What a chain would need of a model and does not carry, in words; empty where it can take the model.

    Effects of instruments change no chain, nor do those that only a history wakes in a state at rest.

    Args:
        model: model on disk.
        history: true for a history of the chain, false for its states at rest.
    """
    named = [slug for slug, effect in _built(model) if _moves(effect, history)]
    return named + ["an unnamed correction"] * bool(model.remainders)


def chain_without(model: AugmentedModel, history: bool = False) -> list[str]:
    """Sentences on effects of a model that a chain leaves out, because they do not change its shape.

    Args:
        model: model on disk.
        history: true for a history of the chain, false for its states at rest.

    Raises:
        InputError: if the model has effects that a chain would need and does not carry.
    """
    missed = missed_by_chain(model, history)
    if missed:
        raise InputError(
            f"{model.path or model.name}: a chain takes a model's numbers, but not its effects "
            f"({joined(missed)}); simulate one segment"
        )
    woken = [] if history else only_along_histories(model)
    slugs = [slug for slug, effect in _built(model) if history or not _asleep(effect)]
    if not slugs:
        return woken
    change = "it changes" if len(slugs) == 1 else "they change"
    return [*woken, f"a chain is without {joined(slugs)}: {change} what instruments show, not its shape"]


def _built(model: AugmentedModel) -> list[tuple[str, Effect]]:
    """Effects of the catalogue, each with its slug."""
    return [(one.slug, one.build()) for one in model.added if isinstance(one, AddedEffect)]


def _asleep(effect: Effect) -> bool:
    """True if an effect changes states, but none at rest."""
    return changes_states(effect) and not effect.acts_at_rest()


def _moves(effect: Effect, history: bool) -> bool:
    """True if an effect of the specimen, and not of an instrument, changes an equilibrium."""
    of_instrument = effect.component == "sensor"
    return not of_instrument and changes_equilibrium(effect) and (history or effect.acts_at_rest())


def _sentence(slugs: list[str], what: str) -> list[str]:
    """One sentence about effects, in the right number; none about none."""
    if not slugs:
        return []
    words = ("acts", "it", "changes") if len(slugs) == 1 else ("act", "they", "change")
    return [f"{joined(slugs)} {words[0]} {what.format(it=words[1], changes=words[2])}"]
