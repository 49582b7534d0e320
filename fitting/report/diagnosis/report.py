"""The report of a diagnosis: the verdict first, then its evidence."""

from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.text import exchange_sentences, place_text, verdict_sentences
from fitting.inference.notes import ended, joined
from fitting.specimens.saved_models import DIAGNOSIS, AugmentedModel
from fitting.specimens.saved_models.files import render_model
from pneusma_jax.calibration.toml import render_calibration
from pneusma_jax.errors import counted

from ..report import Block, Code, Picture, Points, Report, Section
from . import text
from .figures import drawn_outputs, outputs_not_drawn, probability_figure, recordings_figure, shown_recordings
from .model import model_of
from .payload import content
from .tables import (
    base_table,
    candidate_table,
    discrepancy_table,
    effect_table,
    noise_table,
    score_table,
    words_of,
)

CAPTIONS = {
    "recordings": "Recordings and the base model, refitted within its tolerances{found}. Residuals "
    "(measured less model) in standard deviations of the noise; shaded: within two{place}.",
    "probabilities": "How likely each candidate is the strongest explanation, by the evidence. The verdict "
    "tells how likely an effect acts at all, so its probabilities may be larger.",
}

SPIKES = (
    "A spike of one row may be the row that a spring remembers: later forces depend on its fraction, and "
    "draw it."
)


def report_of(
    conclusion: Conclusion, title: str, command: str, seed: int = 0, start: AugmentedModel | None = None
) -> Report:
    """The report of the conclusion.

    Args:
        conclusion: conclusion of a diagnosis.
        title: title of the campaign.
        command: command that makes the report again.
        seed: seed of the diagnosis, for the file of the model.
        start: model that the diagnosis started from.
    """
    x = conclusion.explanation
    source = f"{DIAGNOSIS} {title}, seed {seed}"
    simulated = all(recording.real is False for recording in x.program.recordings)
    return Report(
        title=f"Diagnosis: {title}",
        subtitle=text.question(conclusion),
        verdict=verdict_sentences(conclusion),
        warnings=[ended(note) for note in conclusion.notes],
        real=False if simulated else None,
        sections=[
            Section("Base model", [Points(text.base_model(conclusion))]),
            Section("Effects that were asked about", [Points([one["text"] for one in conclusion.asked])]),
            Section("Recordings and models", [
                Picture("recordings", recordings_caption(conclusion), lambda: recordings_figure(conclusion)),
            ]),
            Section("Where", [place_text(conclusion)]),
            Section("What", _findings(conclusion)),
            Section("Held-out recordings", [score_table(conclusion), text.race(conclusion)]),
            Section("Noise that recordings are judged by", [noise_table(conclusion)]),
            Section("What the base model's constants absorbed", _absorbed(conclusion)),
            *_discrepancy(conclusion),
            Section("Next experiment", [text.next_experiment(conclusion)]),
            Section("To make this page again", [Code(command)]),
        ],
        footer=f"{counted(x.tries, 'model was', 'models were')} fitted.",
        content=lambda: content(conclusion),
        files=lambda: {
            "augmented.toml": render_model(model_of(conclusion, source, start)),
            **{f"{name}.toml": render_calibration(table) for name, table in conclusion.start.tables.items()},
        },
    )  # fmt: skip


def recordings_caption(conclusion: Conclusion) -> str:
    """Caption of the recordings, which says how many of them are drawn."""
    count, drawn = len(conclusion.explanation.program.recordings), len(shown_recordings(conclusion))
    some = f" {drawn} of {count} recordings: those for validation and those of most misfit."
    found = "; and the model with what was found" if conclusion.changed else ""
    place = "; amber: the rows with most misfit" if conclusion.mismatch else ""
    caption = CAPTIONS["recordings"].format(found=found, place=place)
    remembers = conclusion.mismatch and "memory_row" in conclusion.explanation.base.evaluation.drivers
    hidden = outputs_not_drawn(conclusion)
    left = f" Not drawn, since the base model misses it less: {joined(hidden)}." if hidden else ""
    drawn_of = [conclusion.explanation.program.recordings[k] for k in shown_recordings(conclusion)]
    why = f" {said}" if (said := drawn_outputs(drawn_of)) else ""
    return caption + (f" {SPIKES}" if remembers else "") + (some if drawn < count else "") + left + why


def _findings(conclusion: Conclusion) -> list[Block]:
    """Effects that were found, and the candidates for them."""
    effects = [
        Section(words_of(found.slug), [text.effect(found), effect_table(conclusion, found)])
        for found in conclusion.reported
    ]
    candidates = candidate_table(conclusion)
    return [
        *(effects or [text.NOTHING_FOUND]),
        Picture("probabilities", CAPTIONS["probabilities"], lambda: probability_figure(conclusion)),
        candidates if candidates.rows else text.NO_CANDIDATE,
        text.untestable(conclusion),
        text.ask(conclusion),
    ]


def _absorbed(conclusion: Conclusion) -> list[Block]:
    table = base_table(conclusion)
    exchanged = exchange_sentences(conclusion, conclusion.exchanges)
    return [table if table.rows else text.ALL_EXACT, Points(exchanged)]


def _discrepancy(conclusion: Conclusion) -> list[Section]:
    """The model discrepancy that describes the remaining misfit, if there is one."""
    if conclusion.remainder is None:
        return []
    blocks = [text.discrepancy(conclusion), discrepancy_table(conclusion)]
    return [Section("Model discrepancy", blocks)]
