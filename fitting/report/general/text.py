"""Sentences on tests of wires, tubes and actuators, for the laboratory."""


import numpy as np

from fitting.calibrate.assumed import far_from_nominal, improbable_shifts
from fitting.calibrate.general.fit import MISFIT
from fitting.calibrate.general.pipeline import GeneralCharacterisation
from fitting.calibrate.general.scores import overall
from fitting.inference.lasting_noise import Lasting
from fitting.inference.least_squares.result import Status
from fitting.inference.notes import joined
from fitting.inference.numbers import number
from fitting.inference.serial_correlation import OVERSTATED, overstated_sentence
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
from ..instrument_zeros import (
    error_factors,
    how_errors_grew,
    large_drifts,
    lasting_sentence,
    lasting_zeros,
    possible_zeros,
)
from ..open_constants import first_sentence, grouped_warnings
from . import wires


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
        sentences.append(first_sentence(open_, set(result.unseen)) if open_ else _told(result))
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
        *_guessed_noise(result),
    ]


def _guessed_noise(result: GeneralCharacterisation) -> list[str]:
    """Sentences on outputs of fitted recordings whose noise nobody states: a misfit may be lasting noise."""
    fitted = {recording.name: recording for recording in result.fit.recordings if recording.role == "fit"}
    silent = dict.fromkeys(
        score.column
        for score in result.scores
        if score.name in fitted and score.column not in fitted[score.name].noise
    )
    if not silent:
        return []
    return [
        f"Nobody states the noise of {joined(list(silent))}, so it was told by fast scatter. Errors that "
        "last over many rows look like misfit then, and a diagnosis may take them for noise. State the "
        "noise, under [noise]."
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
    sentences += grouped_warnings(result.identifiability, set(result.unseen))
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


NOISE_OF_RESIDUALS = (
    "These chi-squares are for the noise that readings tell. The best was fitted again with the noise that "
    "residuals tell; what follows is for that."
)


def how_it_was_fitted(result: GeneralCharacterisation) -> list[str]:
    """Sentences on starts, noise, priors."""
    fit = result.fit
    ends = ", ".join(f"{x:.1f}" for x in fit.starts)
    again = [NOISE_OF_RESIDUALS] if fit.noise_of_residuals else []
    return [
        f"Least squares over all recordings with role = fit from {len(fit.starts)} "
        f"{'start' if len(fit.starts) == 1 else 'starts'}; chi-square: {ends}. "
        f"{fit.result.status.value}",
        *again,
        f"Reduced chi-square {number(fit.reduced_chi_square)} over the noise as stated or estimated; "
        f"residuals are correlated over {fit.correlation_time:.1f} samples. Standard errors "
        f"{how_errors_grew(fit.inflation, result.lasting)}.",
        *possible_zeros(result),
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
