"""`diagnose`: from a campaign to a conclusion.

A drive may turn between two rows, and then no row has its largest value. Such turning points can look like a
missing effect. So the search may be made twice: with drives as recorded, and with turning points added.
"""

import dataclasses
from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice
from typing import Protocol, TypeVar

import numpy as np

from fitting.calibrate.assumed import far_from_nominal
from fitting.data.recordings import Campaign, Recording, require_fitted, schema
from fitting.inference.notes import of_several
from fitting.inference.parallel import one_thread_per_matrix
from fitting.inference.readings import cautions
from fitting.specimens.reduction import reduction_notes
from fitting.specimens.registry import kind_of, specimen_of
from fitting.specimens.saved_models import AugmentedModel
from fitting.specimens.unsampled_turns import with_unsampled_turns
from fitting.specimens.zeros import offered
from pneusma_jax.errors import InputError
from pneusma_jax.model_discrepancy import EDGE

from .check import answers, asked_effects, checked
from .evaluate.base_tables import base_tables
from .evaluate.noise_used import slow_as_noise
from .evaluate.program import Program
from .evaluate.start import Start, begun_at, characterised, start_of
from .fit.base_fit import told_at_bound
from .fit.misread import misread_in
from .fit.standard_errors import stated_too_large
from .search.explain import explain, far_from_noise
from .search.steps import Explanation
from .settings import DEFAULT
from .verdict.conclude import conclude
from .verdict.conclusion import Conclusion
from .verdict.locate import drivers_of
from .verdict.text import unstated
from .verdict.turns import TriedTurns, as_recorded, with_turns

VALUES = DEFAULT.values
MISREAD = "with a column in another unit or of another sign"
TURNED = "with turning points between rows"
T = TypeVar("T")


@one_thread_per_matrix
def diagnose(
    campaign: Campaign,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    model: AugmentedModel | None = None,
    thorough: bool = False,
    asked: Sequence[str] = (),
) -> Conclusion:
    """Compare a campaign with the base model, and say what physics it leaves out.

    Args:
        campaign: recordings of one kind.
        seed: seed of the simulated nulls.
        progress: receives a line of text at every step.
        model: base model to start from, instead of the published one.
        thorough: fit twice as many candidates, and follow twice as many to the end.
        asked: slugs of effects about which the conclusion says what the recordings tell.

    Raises:
        InputError: recordings of several kinds, without variation or with too few values; an effect that
            recordings of their kind do not show.
    """
    kind = kind_of(campaign)
    asked = asked_effects(asked, kind)
    notes = checked(campaign)
    require_fitted(campaign.recordings, campaign.path)
    _refuse_few_values(campaign, _readings(campaign))
    start = start_of(campaign, kind, progress) if model is None else Start(f"the model {model.name}")
    start = dataclasses.replace(start, constants=base_tables(campaign, kind, start.tables))
    program = Program.of(
        campaign, kind, model=model, tables=start.tables, held=start.held, progress=progress
    )
    _refuse_few_values(campaign, program.observations(program.fitted))
    rebuilt = _rebuilding(campaign, model, start, progress)
    searched = _search(campaign, kind, seed, progress, model, thorough, rebuilt)
    explanation = searched(program)
    turned, about_turns = _worth_a_search(_with_turning_points(program, rebuilt), explanation, progress)
    if turned is None:
        progress("scoring recordings that were not fitted")
        conclusion = conclude(explanation)
    else:
        progress("looking for effects with turning points between rows")
        with_them = searched(turned)
        progress("scoring recordings that were not fitted")
        conclusion, said = with_turns(with_them, explanation)
        about_turns = [said]
        if conclusion.explanation.program.recordings is not program.recordings:
            explanation = with_them
    conclusion.start = start
    conclusion.notes = _notes(campaign, conclusion, explanation.program, model, [*notes, *about_turns])
    conclusion.asked = answers(asked, conclusion)
    return conclusion


def _readings(campaign: Campaign) -> int:
    """Number of readings of outputs in the recordings that are fitted. A program may count fewer values."""
    fitted = [recording for recording in campaign.recordings if recording.role == "fit"]
    return sum(int(np.isfinite(r.columns[name]).sum()) for r in fitted for name in r.outputs)


def _refuse_few_values(campaign: Campaign, count: int) -> None:
    """Raise an `InputError` for a campaign with too few values to fit.

    Args:
        campaign: named in the message.
        count: number of its values.
    """
    least = VALUES.minimum
    if count < least:
        raise InputError(
            f"{campaign.path}: {count} values to fit are too few to diagnose; {least} are needed"
        )


def _search(
    campaign: Campaign,
    kind: str,
    seed: int,
    progress: Callable[[str], None],
    model: AugmentedModel | None,
    thorough: bool,
    rebuilt: "Rebuilding",
) -> Callable[[Program], Explanation]:
    """A function that looks for effects in a program of the campaign, with turning points or without.

    It also tells whether a column may have been read in a wrong unit or with a wrong sign (`misread_in`).

    Args:
        campaign, seed, progress, model, thorough: as of `diagnose`.
        kind: kind of the recordings.
        rebuilt: see `Rebuilding`.
    """

    # They depend on the recordings alone, and both searches need them.
    calibrated = _made_once(characterised(campaign, kind, progress) if model is None else iter(()))

    def further_starts(program: Program) -> Iterator[np.ndarray]:
        return (begun_at(known, program.unknowns) for known in calibrated())

    def searched(program: Program) -> Explanation:
        rng, effort = np.random.default_rng(seed), 2 if thorough else 1
        explanation = explain(program, rng, progress, effort, further_starts)
        final, unexplained = explanation.program, far_from_noise(explanation)
        misread = misread_in(
            final,
            explanation.base,
            lambda recordings, nominal: rebuilt(final, recordings, MISREAD, nominal),
            unexplained,
        )
        explanation.misread = misread
        if explanation.second_look is not None:  # the verdict may be of this one
            explanation.second_look.misread = misread
        return explanation

    return searched


def _made_once(found: Iterator[T]) -> Callable[[], Iterator[T]]:
    """The items of an iterator from the first one on, each time it is called; each is made once, when needed.

    Args:
        found: makes the items.
    """
    known: list[T] = []

    def again() -> Iterator[T]:
        for k in count():
            if k == len(known):
                made = list(islice(found, 1))
                if not made:
                    return
                known.extend(made)
            yield known[k]

    return again


class Rebuilding(Protocol):
    """Makes a program of the same campaign, like a given one, from its recordings with other rows or
    values."""

    def __call__(
        self, program: Program, recordings: Sequence[Recording], with_what: str, nominal_alone: bool = False
    ) -> Program:
        """The program. The words say with what it is made, for those who wait; `nominal_alone` is as of
        `Program.of`."""


def _rebuilding(
    campaign: Campaign, model: AugmentedModel | None, start: Start, progress: Callable[[str], None]
) -> Rebuilding:
    """The `Rebuilding` of a campaign; the arguments are those of `diagnose`, and where its fits begin."""

    def rebuilt(
        program: Program, recordings: Sequence[Recording], with_what: str, nominal_alone: bool = False
    ) -> Program:
        whole = dataclasses.replace(campaign, recordings=list(recordings))
        return Program.of(
            whole,
            program.kind,
            model=model,
            tables=start.tables,
            held=start.held,
            like=program,
            progress=progress,
            again=with_what,
            nominal_alone=nominal_alone,
        )

    return rebuilt


def _with_turning_points(program: Program, rebuilt: Rebuilding) -> Program | None:
    """The program with turning points of drives between rows; None where there are none."""
    turned = [with_unsampled_turns(recording) for recording in program.recordings]
    if all(one is other for one, other in zip(turned, program.recordings, strict=True)):
        return None
    other = rebuilt(program, turned, TURNED)
    other.tally = program.tally  # a report counts all models that were fitted
    return other


def _worth_a_search(
    turned: Program | None, explanation: Explanation, progress: Callable[[str], None]
) -> tuple[Program | None, list[str]]:
    """The program with turning points if a search with them may find something else, and a note if not.

    Args:
        turned: program with turning points of drives between rows; None where there are none.
        explanation: result of the search without them.
        progress: as of `diagnose`.
    """
    if turned is None:
        return None, []
    progress("trying turning points between rows")
    tried = TriedTurns.beside(turned, explanation)
    if not tried.help_base:
        return None, []
    return (turned, []) if tried.matter() else (None, [as_recorded(explanation)])


def _notes(
    campaign: Campaign,
    conclusion: Conclusion,
    program: Program,
    model: AugmentedModel | None,
    found: Sequence[str],
) -> list[str]:
    """All that a reader of a conclusion should know.

    Args:
        campaign: the recordings as they were read.
        conclusion: the conclusion, with its own notes.
        program: program of the search from which it comes, with the outliers that the search left aside.
        model: base model to start from; None for the published one.
        found: notes of the checks before.
    """
    outliers = [one.text for one in program.outliers]
    whole = [recording.whole for recording in program.recordings]
    readings = [*cautions(program.recordings), *reduction_notes(program.recordings), *offered(whole)]
    notes = [
        *stated_too_large(*conclusion.model), *_assumed_specimen(conclusion), *_moved(conclusion),
        *slow_as_noise(program), *_untimed(program),
        *conclusion.start.notes, *found,
        *specimen_of(program.kind).notes(campaign), *readings, *outliers, *_beyond_saved(conclusion, model),
        *_at_bounds(conclusion), *conclusion.notes,
    ]  # fmt: skip
    if conclusion.explanation.together:
        why = (
            ", because only they contradict the base model, or they contradict what the others say"
            if conclusion.mismatch
            else ""
        )
        notes.append(
            f"The validation recordings were fitted like all others{why}. Each score is of a recording that "
            "was left out of the fit which predicts it"
        )
    return of_several(notes, [recording.name for recording in program.recordings])


def _at_bounds(conclusion: Conclusion) -> list[str]:
    """A note on constants of a contradicted base model that only their bounds held.

    If the base model is not contradicted, the verdict itself says so.
    """
    program, fit = conclusion.model
    names = told_at_bound(program, fit)
    if not names or not conclusion.mismatch:
        return []
    one = len(names) == 1
    return [
        f"{', '.join(names)} of the base model {'is' if one else 'are'} at "
        f"{'its bound' if one else 'their bounds'}, "
        "wherever its fit began: the base model is wrong in form, or these recordings are of another "
        "specimen than is stated"
    ]


def _assumed_specimen(conclusion: Conclusion) -> list[str]:
    """A note where recordings do not state their specimen: another one looks like missing physics."""
    silent = unstated(conclusion)
    if not silent:
        return []
    return [
        f"{', '.join(silent)}: no [geometry] is stated, so the source's specimen was taken; if yours is of "
        "another size or material, that is what is missing, and this verdict says nothing. State it beside "
        "the recordings"
    ]


def _moved(conclusion: Conclusion) -> list[str]:
    """Notes on constants that the model moves far in units of a tolerance that nobody stated."""
    program, fit = conclusion.model
    free, values = program.unknowns.parameters(), program.unknowns.values(fit.u)
    return [one.rstrip(".") for one in far_from_nominal(program.recordings, free, values)]


def _untimed(program: Program) -> list[str]:
    """A note where no recording has a clock of its own."""
    if not program.untimed:
        return []
    return [
        f"time_s only counts rows, since the files have no clock: {', '.join(program.untimed)} cannot be "
        f"tested. If you know the time between rows, import with --interval, or remove `{schema.CLOCK}` from "
        "[source] of the sidecars"
    ]


def _beyond_saved(conclusion: Conclusion, model: AugmentedModel | None) -> list[str]:
    """Notes on rows outside the range in which a discrepancy of the model on disk was fitted."""
    program, found = conclusion.explanation.program, []
    drivers = drivers_of(program, conclusion.explanation.base) if model and model.remainders else {}
    for discrepancy in model.remainders if model else ():
        low, high = discrepancy.span
        low, high = low - EDGE * (high - low), high + EDGE * (high - low)
        values = drivers.get(discrepancy.driver)
        there = np.asarray(program.stacked.mask)[: len(program.recordings)]
        beyond = there if values is None else there & ~((values >= low) & (values <= high))
        if beyond.any():
            found.append(
                f"{discrepancy.words}, was seen for {discrepancy.span_words} only; beyond it is held at its "
                f"end value in {int(beyond.sum())} of {int(there.sum())} rows"
            )
    return found
