"""Sentences of the page of a diagnosis; verdict and place have theirs in `fitting.diagnose.verdict.text`."""

from fitting.calibrate.assumed import default_tolerances
from fitting.diagnose.verdict.conclusion import Conclusion
from fitting.diagnose.verdict.misfit_text import not_fitted, went
from fitting.diagnose.verdict.probabilities import UNMODELLED, Found
from fitting.diagnose.verdict.text import base_named
from fitting.inference.notes import capital, joined
from pneusma_jax.errors import counted
from pneusma_jax.units import amount, from_si

from ..cells import number
from .tables import file_unit, shown_knots

NOTHING_FOUND = "Nothing needs to be added to the base model."
NO_CANDIDATE = "No candidate came near explaining anything."
ALL_EXACT = "The recordings state every constant as exact."


def question(conclusion: Conclusion) -> str:
    """The question of the diagnosis."""
    program = conclusion.explanation.program
    model = base_named(conclusion) if conclusion.start.words else "the published model"
    return (
        f"Does {model} explain {counted(len(program.recordings), 'recording')} of kind {program.kind} "
        f"({sum(map(bool, program.fitted))} fitted)? If not, what does it leave out?"
    )


def base_model(conclusion: Conclusion) -> list[str]:
    """Sentences on the constants that the recordings are compared with, and how well these are known."""
    program, start = conclusion.explanation.program, conclusion.start
    whole = f"The recordings are compared with {start.words}." if start.words else ""
    tolerances = default_tolerances(program.recordings, program.unknowns.parameters())
    said = [whole, *(table.text for table in start.constants), *(f"{capital(one)}." for one in tolerances)]
    resting = program.specimen.latent.resting(program.stacked)
    names = [recording.name for recording, still in zip(program.recordings, resting, strict=False) if still]
    if names:
        said.append(
            f"The martensite fraction was taken as constant in {joined(names)}, near full heat: one that "
            "changes would explain no more than noise there."
        )
    return [one for one in said if one]


def effect(found: Found) -> str:
    """Description of an effect and its probability."""
    sure = f"Probability {found.probability:.2f}, log Bayes factor {number(found.bayes)}."
    terms = found.together
    if terms is not None:
        sure += (
            f" The recordings hardly tell the terms of {joined(terms.names)} apart: one takes up what "
            f"another leaves. They tell the sum: {terms.words}."
        )
    named = found.slug == UNMODELLED and found.bayes > 0.0  # the text says already which names leave too much
    alike = [] if named else found.confusable
    close = f" The recordings do not tell it from {', '.join(alike)}." if alike else ""
    perhaps = " The name is tentative: something else may act in its place." if found.tentative else ""
    return f"{found.text} {sure}{perhaps}{close}"


def untestable(conclusion: Conclusion) -> str:
    """Effects that these recordings cannot show, by the reason; empty where there are none."""
    reasons = conclusion.untestable
    told = [
        f"{joined([slug for slug in reasons if reasons[slug] == why])} ({why})"
        for why in dict.fromkeys(reasons.values())
    ]
    return f"Not testable with these recordings: {'; '.join(told)}." if told else ""


def ask(conclusion: Conclusion) -> str:
    """A sentence on how to ask about one effect."""
    kind = conclusion.explanation.program.kind
    return (
        "`--effect NAME` asks about one effect: whether it was tried, and what to record where it cannot be "
        f"tested. `pneusma effects` lists all, with the kinds that show them; recordings of kind {kind} have "
        f"{counted(len(conclusion.candidates), 'candidate')}."
    )


def race(conclusion: Conclusion) -> str:
    """Comparison of named effects with a model discrepancy, by cross-validation over the fitted
    recordings."""
    discrepancy, x = conclusion.discrepancy, conclusion.explanation
    if discrepancy is None or not x.final.slugs:
        return ""
    base, named = x.left_out
    return (
        "To choose effects, fitted recordings or parts of them were predicted by fits without them. These "
        "need not be the parts that the table is of, so the numbers differ. The reduced chi-square is "
        f"{number(base)} by the base model and {number(named)} with {joined(x.final.slugs)}. A model "
        f"discrepancy ({discrepancy.quantity.replace('_', ' ')} as a smooth function of "
        f"{discrepancy.driver.replace('_', ' ')}) "
        f"in place of names gives {number(discrepancy.left_out)}. Beside it constants move to first order, "
        "and zeros of instruments drift."
    )


def discrepancy(conclusion: Conclusion) -> str:
    """Sentence on the model discrepancy that describes the remaining misfit."""
    rest, names = conclusion.remainder, conclusion.explanation.final.slugs
    along = file_unit(rest.driver, conclusion.explanation.program.kind)
    first, *_, last = from_si(shown_knots(rest), along)
    span = amount(f"{rest.driver} between {number(first, '.4g')} and {number(last, '.4g')}", along)
    return (
        f"With {joined([*names, f'a smooth function of {span}, added to {rest.quantity}'])}, "
        f"the misfit of {not_fitted(conclusion.before.how)} "
        f"{went(conclusion.before.reduced_chi2, conclusion.after.reduced_chi2)}. It describes and does not "
        "explain. It is in augmented.toml as unmodelled; outside that range it is unknown, and simulations "
        "with the model hold it and say so."
    )


def next_experiment(conclusion: Conclusion) -> str:
    """Recommendation of the next measurement."""
    found, misread = conclusion.next_experiment, conclusion.explanation.misread
    if conclusion.mismatch and misread is not None:
        return f"None before it is known what {misread.column} holds. Then run this diagnosis again."
    if found:
        return found["text"]
    if conclusion.within_accuracy or not (conclusion.mismatch or conclusion.explanation.program.noise_stated):
        return "State the noise of the instruments, under [noise]: a smaller misfit may count then."
    if not conclusion.mismatch:
        return "None is needed."
    if conclusion.repeats is not None:
        return (
            "Repeat a recording at half the rate: what a pump or mains hum adds keeps its period in time, "
            "what the machine adds keeps the one along its travel."
        )
    return (
        "Repeat a recording as it was: what comes again in the same rows belongs to the specimen or the "
        "stand, what does not belongs to that one test."
    )
