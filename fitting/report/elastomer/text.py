"""Sentences on the fit of an elastomer, for the laboratory."""

import math

import numpy as np

from fitting.calibrate.elastomer import drift, stability
from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.fit import LawFit
from fitting.calibrate.elastomer.held_out import HeldOut, Transfer
from fitting.calibrate.elastomer.model import Zero
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates
from fitting.calibrate.elastomer.samples import RELATIVE_SPREAD
from fitting.calibrate.identifiability import identifiability
from fitting.inference.noise import ACCURACY, within_accuracy
from fitting.inference.notes import joined
from fitting.inference.numbers import number
from pneusma_jax.units import amount, from_si

from ..cells import percent, with_error
from ..characterisation import estimate_text

CORRELATED = 0.3
"""Minimum lag-1 correlation of residuals that are called correlated."""
MOST_IN_A_SENTENCE = 4
"""Maximum number of constants of a law in a sentence; more are left to the table."""
SHAPED = 2.0
"""Minimum mean square of correlated residuals, in squares of the noise, that are no noise but a shape."""
MANY_PAIRS = 2
"""Maximum number of strongly correlated pairs that are listed singly."""
LARGE_HYSTERESIS = 0.03
"""Minimum reported hysteresis, as part of the stress; below it loading and unloading are one curve for most
purposes."""


def constants(fit: LawFit) -> str:
    """Constants of a law with errors and units, in one line."""
    parts = []
    for name, estimate in estimates(fit).items():
        parts.append(f"{name} = {amount(estimate_text(estimate), estimate.unit)}")
    return ", ".join(parts)


def kilopascal(value: float) -> str:
    """A stress [Pa] in kPa with three digits."""
    return f"{value / 1e3:.0f} kPa" if abs(value) >= 1e6 else f"{value / 1e3:.3g} kPa"


def verdict(result: ElastomerCharacterisation) -> list[str]:
    """The few most important sentences."""
    sentences = [_which_law(result.whole)]
    fit = result.whole.best
    if _shaped(fit):
        sentences.append(_left(result, result.whole))
    one_constant = {name: d for name, d in result.whole.drifts.items() if len(d) == 1}
    sentences += drift.verdict(result.whole.held, one_constant)
    sentences += _past_the_range(result.whole)
    if result.actuator is not result.whole:
        sentences.append(_for_an_actuator(result))
    return sentences


def left_by(result: ElastomerCharacterisation) -> list[str]:
    """Sentence on what the recommended law leaves beyond noise, by its name; empty where there is nothing."""
    return [_left(result, result.whole, _named(result.whole))] if _shaped(result.whole.best) else []


def caution(result: ElastomerCharacterisation, analysis: Analysis) -> str:
    """Why constants of an analysis are not to be trusted; empty where they are.

    They are, where an ordinary instrument whose noise nobody states may have made what the law leaves.
    """
    if not _shaped(analysis.best) or _is_accurate(result, analysis):
        return ""
    return _left(result, analysis, _named(analysis))


def _named(analysis: Analysis) -> str:
    """Name of the recommended law at the beginning of a sentence."""
    name = analysis.best.law.label
    return name[0].upper() + name[1:]


def _share(result: ElastomerCharacterisation, analysis: Analysis) -> float:
    """Root mean square error of the recommended law, over the range of the stresses that it was fitted to."""
    error = analysis.held[analysis.choice.chosen].ranges[-1].inside.rmse
    return error / float(np.ptp(result.samples.stress[analysis.best.mask]))


def _is_accurate(result: ElastomerCharacterisation, analysis: Analysis) -> bool:
    stated = any(curve.noise_stated for curve in result.samples.curves)
    return within_accuracy(_share(result, analysis), stated)


def _left(result: ElastomerCharacterisation, analysis: Analysis, law: str = "It") -> str:
    """A sentence about what the recommended law leaves beyond noise, and who looks for the cause."""
    left = f"{law} leaves {math.sqrt(analysis.best.mean_square):.2g} times the noise"
    if not _is_accurate(result, analysis):
        return f"{left}. `pneusma diagnose` looks for the cause."
    share = _share(result, analysis)
    return (
        f"{left}, {percent(share)} of the range. Nobody states the noise, and ordinary instruments are "
        f"accurate to {percent(ACCURACY)}."
    )


def _which_law(analysis: Analysis) -> str:
    fit, held = analysis.best, analysis.held[analysis.choice.chosen]
    only = len(analysis.fits) == 1
    text = "The one law that was fitted, " if only else "Recommended law, "
    text += (
        f"for strain {analysis.strain_min:.3g} to {analysis.strain_max:.3g}: {fit.law.label}{_numbers(fit)}. "
    )
    text += f"{analysis.choice.reason} " if analysis.choice.reason else ""
    gaps = held.interpolation
    if gaps:
        text += "Parts of the curve left out of the fit are predicted to "
        text += f"{kilopascal(gaps.rmse)} ({percent(gaps.rpd)}).{_on_others(held)}"
    return text.strip()


def _numbers(fit: LawFit) -> str:
    """Constants of a law, where they are few enough for a sentence."""
    return f", {constants(fit)}" if len(fit.values) <= MOST_IN_A_SENTENCE else ""


def _on_others(held: HeldOut) -> str:
    others = held.validation or held.recordings
    if not others:
        return ""
    worst = max(others.values(), key=lambda transfer: transfer.score.rmse)
    kind = "Validation recordings" if held.validation else "Recordings left out in turn"
    error = f"{kilopascal(worst.score.rmse)} ({percent(worst.score.rpd)})"
    return f" {kind} are predicted to {error} at worst.{_factor(worst)}"


def _factor(transfer: Transfer) -> str:
    """Remark that one factor explains most of an error, where it does."""
    if transfer.rmse_scaled > 0.6 * transfer.score.rmse:
        return ""
    harder = "stiffer" if transfer.factor > 1.0 else "softer"
    return (
        f" Most of that is because the specimen is {percent(abs(transfer.factor - 1.0))} {harder}: one "
        f"factor on its stress leaves {kilopascal(transfer.rmse_scaled)}."
    )


def _past_the_range(analysis: Analysis) -> list[str]:
    best, chosen = analysis.choice.best_extrapolation, analysis.choice.chosen
    if best is None:
        return []
    here = analysis.held[chosen].extrapolation
    text = (
        f"Past the stretch it was fitted to, {analysis.best.law.label} misses the next stretch of curve by "
        f"{percent(here)} (geometric mean over the ranges)."
    )
    if best != chosen:
        least = percent(analysis.held[best].extrapolation)
        label = analysis.fits[best].law.label
        text += f" {label[0].upper()}{label[1:]} misses it least, by {least}."
    return [text + " No law should be trusted beyond the stretch that was tested."]


def _for_an_actuator(result: ElastomerCharacterisation) -> str:
    analysis = result.actuator
    low, high = stability.ACTUATOR_STRAIN
    gaps = analysis.held[analysis.choice.chosen].interpolation
    accuracy = f" It predicts gaps in the curve to {kilopascal(gaps.rmse)}." if gaps else ""
    return (
        f"The wall of an actuator sees strains of {low:g} to {high:g}. To simulate one, use the fit to that "
        f"range (material_actuator.toml): {analysis.best.law.label}{_numbers(analysis.best)}.{accuracy} "
        f"{analysis.choice.reason}{_untested_side(analysis)}".replace("  ", " ")
    )


def _untested_side(analysis: Analysis) -> str:
    low, high = stability.ACTUATOR_STRAIN
    missing = []
    if analysis.strain_min > low + stability.COVERAGE_SLACK:
        missing.append(f"below strain {analysis.strain_min:.2g}")
    if analysis.strain_max < high - stability.COVERAGE_SLACK:
        missing.append(f"above strain {analysis.strain_max:.2g}")
    return f" Nothing was tested {' or '.join(missing)}: there it is the law's guess." if missing else ""


def warnings(result: ElastomerCharacterisation) -> list[str]:
    """Warnings: laws that turn back, hysteresis, constants at bounds, simulated data."""
    found = []
    for analysis in {id(a): a for a in (result.whole, result.actuator)}.values():
        name = analysis.choice.chosen
        found += _instabilities(analysis.best, analysis.tested[name], analysis.actuator[name])
    for name, check in result.whole.tested.items():
        if not check.monotone and name != result.whole.choice.chosen:
            label = result.whole.fits[name].law.label
            found.append(
                f"{label[0].upper()}{label[1:]} falls from strain {check.falls_from:.2g} on inside the "
                "tested range, as no solid does, and was passed over."
            )
    for curve in result.samples.curves:
        if curve.hysteresis is not None and abs(curve.hysteresis) > LARGE_HYSTERESIS:
            found.append(
                f"{curve.name}: stress going up is {percent(curve.hysteresis)} higher than coming down at "
                "the same strain. A hyperelastic law is one curve: it runs through the middle of this loop."
            )
    for fit in result.whole.fits.values():
        if not fit.result.success:
            found.append(f"{fit.law.label}: {fit.result.status.value} It was passed over.")
    return list(dict.fromkeys(found))


def _instabilities(fit: LawFit, tested: stability.Stability, actuator: stability.Stability) -> list[str]:
    """Sentences about behaviour of a fitted law that no solid shows."""
    found = []
    low, high = stability.ACTUATOR_STRAIN
    if not tested.monotone:
        found.append(
            f"The fitted {fit.law.label} law falls from strain {tested.falls_from:.2g} on, inside the "
            "tested range. It breaks Drucker's condition there, and an equilibrium solved with it may jump."
        )
    outside = actuator.falls_from
    if outside is not None and not tested.strain_min <= outside <= tested.strain_max:
        found.append(
            f"Outside the test the fitted {fit.law.label} law turns back at strain {outside:.2g}, within an "
            f"actuator's range ({low:g} to {high:g}). Do not simulate there with it."
        )
    if fit.law.law == "polynomial":
        rest = fit.stress(np.zeros(1))[0]
        if abs(rest) > 3.0 * fit.sd[-1] and abs(rest) > 0.0:
            found.append(
                f"The polynomial carries {rest / 1e3:.3g} kPa at zero strain (p_{len(fit.values)}). It is a "
                "zero error of the load cell, or the price of a poor fit; in a simulation, a stress at rest."
            )
    if fit.law.law == "ogden" and np.any(fit.values[0::2] * fit.values[1::2] <= 0.0):
        found.append("A term of the Ogden law has mu alpha <= 0 and adds no stiffness: fewer terms would do.")
    return found


def how_it_was_fitted(result: ElastomerCharacterisation) -> list[str]:
    """Sentences on weighting, noise, meaning of the standard errors, specimens."""
    samples, fit = result.samples, result.best
    sentences = [_weighting(result), *_noise(result), _errors(fit), *_zeros(result)]
    if fit.factors:
        factors = ", ".join(
            f"{name} {with_error(value, sd)}"
            for name, (value, sd) in fit.factors.items()
        )
        sentences.append(
            f"Each specimen has its own factor on the stress, known beforehand to {percent(samples.batch)} "
            "around one: "
            f"{factors}. The constants describe the material, so their errors include this spread."
        )
    elif samples.batch > 0.0:
        sentences.append(
            f"One specimen was fitted. The standard errors are for it alone; another specimen may differ by "
            f"{percent(samples.batch)} (silicone_stiffness in the material file)."
        )
    return sentences


def _zeros(result: ElastomerCharacterisation) -> list[str]:
    """Zeros that the fit found, a sentence for each recording."""
    found = []
    for k, curve in enumerate(result.samples.curves):
        own = {zero: of for zero, of in result.best.zeros.items() if zero.curve == k}
        parts = [
            f"{zero.quantity} {amount(_estimate(zero, *of), zero.unit)}"
            for zero, of in own.items()
        ]
        if parts:
            found.append(
                f"{curve.name}: the zeros were fitted with the law, as its [zero] asks: "
                f"{joined(parts)}. Strain is counted from there, as (strain - zero) / (1 + zero); the "
                "constants' errors include those of the zeros."
            )
    return found


def _estimate(zero: Zero, value: float, sd: float) -> str:
    """A zero with its standard error, in the unit that it is shown in."""
    shown = (float(from_si(x, zero.unit)) for x in (value, sd))
    return with_error(*shown)


def _weighting(result: ElastomerCharacterisation) -> str:
    if result.samples.weighting == "relative":
        return (
            "Least squares of engineering stress over engineering strain. Residuals were divided by the "
            f"instrument's noise and {percent(RELATIVE_SPREAD)} of the stress together, so that small "
            "stresses count too."
        )
    return (
        "Least squares of engineering stress over engineering strain, unweighted within a recording. "
        "Residuals were divided by the instrument's noise, the same for all samples. So large stresses "
        "decide where a law cannot follow."
    )


def _noise(result: ElastomerCharacterisation) -> list[str]:
    sentences = []
    for stated in (True, False):
        curves = [curve for curve in result.samples.curves if curve.noise_stated is stated]
        if curves:
            values = ", ".join(f"{curve.name} {kilopascal(curve.noise)}" for curve in curves)
            how = (
                "stated in the sidecar"
                if stated
                else "estimated from how far samples lie off their neighbours' chord"
            )
            sentences.append(f"Noise of the stress (1 sigma), {how}: {values}.")
    return sentences


def _shaped(fit: LawFit) -> bool:
    """True if a law leaves more than noise, even noise that is correlated."""
    return fit.lag_one >= CORRELATED and fit.mean_square > SHAPED


def _errors(fit: LawFit) -> str:
    if fit.lag_one < CORRELATED:
        kind = "the residuals look independent"
    elif _shaped(fit):
        kind = "what is left is mostly the shape of the law, not noise"
    else:
        kind = "the noise is serially correlated"
    grown = f"multiplied by {number(fit.inflation)}" if fit.inflation != 1.0 else "not multiplied"
    return (
        f"Residuals of {fit.law.label}: {math.sqrt(fit.mean_square):.3g} times the noise, neighbouring ones "
        "correlated with "
        f"{fit.lag_one:.2f} ({kind}). {fit.mask.sum()} samples therefore count as {fit.independent:.0f} "
        f"independent ones, and the standard errors were {grown}."
    )


def identifiability_of(fit: LawFit) -> list[dict]:
    """Undetermined directions of a law's constants, in the unit of files."""
    free = fit.free
    names = [fit.law.names[k] for k in free]
    return identifiability(names, fit.values[free], fit.covariance[np.ix_(free, free)], fit.at_bound)


def identifiability_sentences(fit: LawFit) -> list[str]:
    """The same as sentences; many correlated pairs become one."""
    found = identifiability_of(fit)
    pairs = [entry for entry in found if entry["kind"] == "correlation"]
    if len(pairs) > MANY_PAIRS:
        names = [name for name in fit.law.names if any(name in entry["parameters"] for entry in pairs)]
        strongest = max(abs(entry["correlation"]) for entry in pairs)
        together = (
            f"{joined(names)} are known only together (correlations up to "
            f"{strongest:.3f}): the curve they make is what was measured, not each of them."
        )
        return [together, *(entry["text"] for entry in found if entry["kind"] != "correlation")]
    texts = [entry["text"] for entry in found]
    return texts or [f"Every constant of the {fit.law.label} law is determined on its own by these data."]
