"""Sentences on tests of wires, tubes and actuators, for the laboratory."""

from collections.abc import Mapping, Sequence, Set
from typing import Any

import numpy as np

from fitting.calibrate.assumed import far_from_nominal, improbable_shifts
from fitting.calibrate.general.fit import MISFIT
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import overall
from fitting.inference.lasting_noise import Lasting
from fitting.inference.least_squares.result import Status
from fitting.inference.noise import OVERSTATED, overstated_sentence
from fitting.inference.notes import joined
from fitting.inference.numbers import number
from fitting.specimens import BY_TEMPERATURE, WIRE, kind_of, specimen_of
from fitting.specimens.actuator_phase import UNSETTLED, understated
from fitting.specimens.saved_model_notes import notes_on
from fitting.specimens.spring_by_temperature import ELECTRICAL
from pneusma_jax.effects import find_effect
from pneusma_jax.errors import counted
from pneusma_jax.units import amount

from .. import profile_likelihood
from ..characterisation import another_cause, ask, doubtful, fitted_only, limits
from ..figures import axis_label
from . import wires

TELLING = 0.1
"""Growth of an error by zeros that are off, from which the report speaks of them: a digit of an error bar."""

LARGE_DRIFT = 2.0
"""Minimum drift of a zero, in units of the noise, at which the report begins with it.

In four simulated campaigns of springs zeros drifted by the noise, and were estimated at 0.8 to 1.05. Where 5
or 10 % of a wire stayed cold without the law knowing it, three campaigns had drifts of 6.7 to 19. A zero that
is off by a constant says nothing: load cells are, and the fit counts it."""


def verdict(result: GeneralCharacterisation) -> list[str]:
    """The few most important sentences."""
    fit = result.fit
    count = sum(recording.role == "fit" for recording in fit.recordings)
    method = "identified from" if result.identify else "adjusted within its tolerances to"
    misses = fit.reduced_chi_square > MISFIT
    warned = cautions(result)
    sentences = [*warned]
    sentences += [f"The {result.specimen.noun} was {method} {counted(count, 'recording')}.{_missed(result)}"]
    sentences += untold(result)[:1] + (wires.verdict(result) if result.specimen is WIRE else [])
    if not misses and fit.inflation > 1.0:
        sentences.append(lasting_sentence(fit.correlation_time, fit.inflation, result.lasting))
    if fit.reduced_chi_square * fit.correlation_time < OVERSTATED:  # correlated noise was enlarged
        sentences.append(overstated_sentence(fit.reduced_chi_square))
    other = ("at_bound", "end_of_range", "absent", "not_fitted")
    open_ = [e for e in result.identifiability if e["kind"] not in other]
    if open_ or not warned:
        sentences.append(open_[0]["text"] if open_ else _told(result))
    return sentences


def cautions(result: GeneralCharacterisation) -> list[str]:
    """Sentences with which the report begins: the law misses its recordings, or constants are doubtful."""
    return _not_fitted(result) if result.fit.reduced_chi_square > MISFIT else doubts(result)


def _not_fitted(result: GeneralCharacterisation) -> list[str]:
    """Sentences on a law that misses its recordings: by how much, where, and which command tells why."""
    law, why = law_of(result), "the cause" if result.model is None else "what the model still leaves out"
    worst = max((s for s in result.scores if s.role == "fit"), key=lambda s: s.rms_over_noise)
    return [
        f"{law[0].upper()}{law[1:]} does not fit these recordings: the reduced chi-square is "
        f"{number(result.fit.reduced_chi_square)}, and {worst.name} is missed by "
        f"{number(worst.rms_over_noise, '.2g')} times its noise.",
        "The numbers are only the nearest fit, not constants of nature. "
        f"{_counted(result.fit.inflation, result.lasting)} "
        f"{ask(result.campaign.path, result.model)} looks for {why}.",
    ]


def doubts(result: GeneralCharacterisation) -> list[str]:
    """Sentences on constants that are not to be trusted although the law fits; see `doubtful`."""
    if result.fit.reduced_chi_square > MISFIT:
        return []
    shifts = improbable_shifts(result.fitted, result.fit.result.values)
    return doubtful(shifts, large_drifts(result.lasting), result.campaign.path, result.model)


def _told(result: GeneralCharacterisation) -> str:
    """A sentence where no constant stays open: all were told, or all but those that stopped at a bound."""
    stopped = [name for name, entry in result.fitted.items() if entry.free and entry.at_bound]
    if not stopped:
        return "From these recordings every free constant is known better than before."
    return (
        "From these recordings every free constant is known better than before, except "
        f"{joined(stopped)}, at a bound."
    )


def _counted(inflation: float, lasting: Lasting | None) -> str:
    """Sentence on what errors count of a misfit."""
    if factors := error_factors(inflation, lasting):
        return f"Their standard errors were {factors}."
    return "Their standard errors do not count what is missed."


def error_factors(inflation: float, lasting: Lasting | None) -> str:
    """What the errors of a fit were multiplied by, and for what; empty where they are those of the fit alone.

    Args:
        inflation: factor for misfit and serial correlation.
        lasting: zeros of instruments that widen errors, or None.
    """
    grown = _grown(lasting) if _told_zeros(lasting) else 1.0
    zeros = f"by up to {number(grown, '.2g')} for zeros of instruments" if grown >= 1.0 + TELLING else ""
    own = f"by {number(inflation, '.2g')} for misfit and correlation" if inflation > 1.0 else ""
    return f"multiplied {' and '.join(filter(None, (own, zeros)))}" if own or zeros else ""


def how_errors_grew(inflation: float, lasting: Lasting | None) -> str:
    """The same as the end of a sentence on standard errors."""
    factors = error_factors(inflation, lasting)
    return f"were {factors}" if factors else "were not multiplied"


def _grown(lasting: Lasting | None) -> float:
    """Largest growth of an error by zeros of instruments, where errors count them."""
    if lasting is None or lasting.fitted_beside_zeros:
        return 1.0
    return float(np.sqrt(np.max(lasting.variance, initial=1.0)))


def _told_zeros(lasting: Lasting | None) -> list[str]:
    """Columns whose zeros are off, where they changed the fit or its errors."""
    if lasting is None or (_grown(lasting) < 1.0 + TELLING and not lasting.fitted_beside_zeros):
        return []
    return [name for name in lasting.drift if lasting.offset[name] + lasting.drift[name] > TELLING]


def lasting_sentence(time: float, inflation: float, lasting: Lasting | None) -> str:
    """Sentence on errors with serial correlation."""
    return (
        f"Residuals are correlated over about {time:.0f} samples, so that fewer samples count. The cause is "
        "an instrument that drifts, or a law that is not quite followed. Standard errors were "
        f"{error_factors(inflation, lasting)}."
    )


def lasting_zeros(found: Lasting | None) -> list[str]:
    """Zeros of instruments that are off or drift, in words, where they changed the fit or its errors."""
    seen = _told_zeros(found)
    if found is None or not seen:
        return []
    sizes = "; ".join(_zero(found, name) for name in seen)
    done = f"Errors were multiplied by up to {number(_grown(found), '.2g')} for that"
    if found.fitted_beside_zeros:
        done = "Constants were fitted beside such zeros, and intervals count these as noise alone"
    return [
        f"The residuals change slowly, as if instruments had wrong zeros: {sizes}. "
        f"{done}. Read the instruments at rest before and after each test."
    ]


def large_drifts(found: Lasting | None) -> dict[str, float]:
    """Large drifts of zeros that changed the fit or its errors, in units of the noise, by output."""
    if found is None:
        return {}
    return {name: found.drift[name] for name in _told_zeros(found) if found.drift[name] >= LARGE_DRIFT}


def _zero(found: Lasting, name: str) -> str:
    """Words on the zero of an output, in units of its noise."""
    offset, drift = (number(size[name], ".2g") for size in (found.offset, found.drift))
    return f"that of {name} is off by {offset} times its noise, and drifts by {drift} times"


def law_of(result: GeneralCharacterisation) -> str:
    """Name of the fitted law: the base law, with the effects of a model on disk if it has any."""
    effects = [] if result.model is None else [a.slug.replace("_", " ") for a in result.model.acting]
    if result.model is not None and result.model.discrepancies:
        effects.append("a model discrepancy")
    return result.specimen.law + (f" with {joined(effects)}" if effects else "")


def by_temperature(result: GeneralCharacterisation) -> bool:
    """True for a spring without resistance, whose phase follows its temperature."""
    return result.specimen is BY_TEMPERATURE


def untold(result: GeneralCharacterisation) -> list[str]:
    """Sentence on the constants that a resistance would have identified, for a spring without one."""
    if not by_temperature(result):
        return []
    return [
        "No resistance was recorded, so the martensite fraction follows the temperature on one curve (T_mid, "
        "T_width).",
        "A resistance would have told the fraction itself, row by row. It would have shown how far the metal "
        "lags behind the thermometer, and whether heating and cooling differ. Here such a lag or hysteresis "
        "remains as misfit.",
        "It would also have told the constants of the resistivity "
        f"({', '.join(ELECTRICAL)}). They are the table's, so alloy.toml does not turn "
        "a measured resistance into a phase.",
        "`pneusma diagnose` needs the resistance of a spring; record it, best with four wires, in the same "
        "rows.",
    ]


def about_the_model(result: GeneralCharacterisation) -> list[str]:
    """Sentences on a model on disk, and on its priors that these recordings had made themselves."""
    if result.model is None:
        return []
    model = result.model.model
    sentences = [f"Fitted with the model {model.name}{f' ({model.path})' if model.path else ''}."]
    for added in result.model.acting:
        sentence = find_effect(added.slug).sentence_for(specimen_of(kind_of(result.campaign)).letter)
        sentences.append(f"{added.slug}: {sentence}")
    return [*sentences, *notes_on(result.model, result.campaign)]


def _missed(result: GeneralCharacterisation) -> str:
    parts = []
    for role, word in (("fit", "Fitted"), ("validation", "Held-out")):
        found = overall(result.scores, role)
        texts = [
            f"{axis_label(column).rsplit(' [', 1)[0]} by {_rms(m['rmse'], column)} RMS "
            f"(mean relative difference {100.0 * m['rpd']:.2g} %)"
            for column, m in found.items()
        ]
        if texts:
            parts.append(f"{word} recordings are missed in {', '.join(texts)}")
    return "".join(f" {part}." for part in parts)


def _rms(value: float, column: str) -> str:
    label = axis_label(column)
    return amount(f"{value:.3g}", label[label.rindex("[") + 1 : -1] if "[" in label else "")


def warnings(result: GeneralCharacterisation) -> list[str]:
    """Warnings: bounds, parameters that never moved, fits that did not end well, errors that are unknown."""
    sentences = [*wires.warnings(result)] if result.specimen is WIRE else []
    sentences += _grouped_warnings(result.identifiability, set(result.unseen))
    if not result.fit.result.success:
        sentences.append(_unended(result.fit.result.status))
    sentences += _unsettled(result) + _understated(result) + _without_error(result)
    ends = [x for x in result.fit.starts if x == x]
    best = min(ends, default=0.0)
    if len(ends) > 1 and sum(x < best + 1.0 for x in ends) == 1:
        sentences.append(
            "Only one of the starts ended at the best fit: there may be a better one that none found."
        )
    far = far_from_nominal(result.fit.recordings, result.fitted, result.fit.result.values)
    zeros = lasting_zeros(result.lasting)
    said = [] if doubts(result) else another_cause(far, zeros, result.campaign.path, result.model)
    sentences += [*far, *zeros, *said]
    own = fitted_only(result.parameters, result.identifiability)
    return sentences + limits(own) + profile_likelihood.warnings(result)


def _unended(status: Status) -> str:
    """Sentences on a fit that did not end well, with the option of `pneusma characterise` that may help."""
    option = (
        " The command has a fixed number of steps; `--starts` begins in more places."
        if status is Status.MAX_STEPS
        else ""
    )
    return f"The fit did not end well. {status.value}{option}"


def _without_error(result: GeneralCharacterisation) -> list[str]:
    """Sentences on constants that have no error, because the misfit jumps within it."""
    jumping, sentences = result.information.jumping, []
    if found := [name for name in jumping if not result.parameters[name].interval]:
        sentences += [
            f"No error of {joined(found)} is quoted: the misfit jumps so near to the fit that its slope "
            "there says nothing about an interval. `pneusma posterior` samples the misfit itself."
        ]
    unfollowed = result.information.unfollowed
    if followed := [name for name in jumping if name not in unfollowed]:
        sentences += [
            f"The errors of the other constants allow for other values of {joined(followed)}, but for no "
            "jump."
        ]
    if unfollowed:
        sentences += [
            f"The errors of the other constants hold only for {joined(unfollowed)} as found. Its slope at "
            "the fit says nothing, so that they cannot allow for other values."
        ]
    return sentences


def _unsettled(result: GeneralCharacterisation) -> list[str]:
    """Sentence on recordings whose martensite fractions ended at no solution."""
    pairs = zip(result.fit.recordings, result.fit.rows, strict=True)
    found = [recording.name for recording, rows in pairs if np.any(rows.extra.get(UNSETTLED, False))]
    if not found:
        return []
    return [
        f"The martensite fractions of {joined(found)} did not settle under this model. Those are used that "
        "come closest to the measured resistances. Errors of constants do not count this."
    ]


def _understated(result: GeneralCharacterisation) -> list[str]:
    """Sentence on resistances that scatter far more than their stated noise."""
    pairs = zip(result.fit.recordings, result.fit.rows, strict=True)
    found = [
        f"that of spring {n} in {recording.name} by a factor of {number(ratio, '.2g')}"
        for recording, rows in pairs
        if "ohms" in rows.extra
        for n, ratio in understated(rows).items()
    ]
    if not found:
        return []
    return [
        f"Resistances scatter far more than their noise, as stated or found: {joined(found)}. Martensite "
        "fractions are smoothed by the scatter. Errors of constants count the smaller noise."
    ]


TOGETHER = {
    "at_bound": (
        "stopped at their bounds: the data, or another cause of misfit, pull them further than they may go. "
        "They have no errors. The errors of the other constants hold if the true values are these bounds."
    ),
    "one_sided": (
        "stopped at their bounds: the data, or another cause of misfit, pull them further than they may go. "
        "Their errors, of the profile likelihoods, have one side only. The errors of the other constants "
        "hold if the true values are these bounds."
    ),
    "end_of_range": (
        "are at ends of their ranges, where the law has special forms. They have no errors. The errors of "
        "the other constants hold if the true values are these ends. `pneusma diagnose` leaves them open "
        "within their ranges, so the errors that it quotes are larger."
    ),
    "at_start": "are still at the values they started from: these recordings do not show them.",
    "held": (
        "are still at the values they started from. They were held, because only a recording that takes the "
        "load off would show them."
    ),
    "absent": "",
}
"""Sentences about several parameters with the same status; empty where each has its own."""


def _grouped_warnings(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> list[str]:
    """Warnings about single parameters, with one sentence for all of the same status.

    Args:
        entries: entries of `GeneralCharacterisation.identifiability`.
        held: names of the parameters that were held because no recording shows them.
    """
    sentences = []
    for status in TOGETHER:
        if status == "end_of_range":  # which needs no warning
            continue
        same_status = [e for e in entries if _status(e, held) == status]
        names = [name for e in same_status for name in e["parameters"]]
        if TOGETHER[status] and len(names) > 1:
            sentences.append(f"{', '.join(names[:-1])} and {names[-1]} {TOGETHER[status]}")
        else:
            sentences += [e["text"] for e in same_status]
    return sentences


def open_sentences(entries: Sequence[Mapping[str, Any]], held: Set[str] = frozenset()) -> list[str]:
    """A sentence for every entry, and one for all parameters of the same status; as `_grouped_warnings`."""
    by_status: dict[str, list[Mapping[str, Any]]] = {}
    for entry in entries:
        by_status.setdefault(_status(entry, held), []).append(entry)
    said = []
    for status, same in by_status.items():
        names = [name for entry in same for name in entry["parameters"]]
        if len(same) > 1 and TOGETHER.get(status):
            said.append(f"{joined(names)} {TOGETHER[status]}")
        else:
            said += [entry["text"] for entry in same]
    return said


def _status(entry: Mapping[str, Any], held: Set[str]) -> str:
    """Key of `TOGETHER` of an entry, or its kind."""
    if entry["kind"] == "at_start":
        return "held" if set(entry["parameters"]) <= held else "at_start"
    return "one_sided" if entry["kind"] == "at_bound" and entry.get("one_sided") else entry["kind"]


def how_it_was_fitted(result: GeneralCharacterisation) -> list[str]:
    """Sentences on starts, noise, priors."""
    fit = result.fit
    ends = ", ".join(f"{x:.1f}" for x in fit.starts)
    return [
        f"Least squares over all recordings with role = fit from {len(fit.starts)} "
        f"{'start' if len(fit.starts) == 1 else 'starts'}; chi-square: {ends}. "
        f"{fit.result.status.value}",
        f"Reduced chi-square {number(fit.reduced_chi_square)} over the noise as stated or estimated; "
        f"residuals are correlated over {fit.correlation_time:.1f} samples. Standard errors "
        f"{how_errors_grew(fit.inflation, result.lasting)}.",
        _priors(result),
        *_specimens(result),
    ]


def _specimens(result: GeneralCharacterisation) -> list[str]:
    """Sentence on the specimens of the numbered names."""
    numbers = sorted({int(name.rpartition("__")[2]) for name in result.fitted if "__" in name})
    specimens = list(result.campaign.specimens())
    owners = [f"__{k} for {specimens[k - 1]}" for k in numbers]
    return [f"Numbers of single specimens end in {', '.join(owners)}."] if owners else []


def _priors(result: GeneralCharacterisation) -> str:
    said = "Every free number has a prior: the tolerance that the recordings state, or that of its table."
    if result.model is None:
        return said
    return (
        "Base numbers have the prior of the model's file, or the tolerance that the recordings state. "
        "Parameters of effects without a prior in the file have a flat one between their physical bounds."
    )
