"""Sentences of the report of an alloy that was found from tests of springs on a stand.

`verdict` begins the report, `warnings` are listed below it, `how_it_was_fitted` and `phases` end it. The law
takes a spring's martensite fraction from its resistance.
"""

from fitting.calibrate.assumed import assumed, far_from_nominal, improbable_shifts
from fitting.calibrate.spring.misfit import missed
from fitting.calibrate.spring.modes import Mode
from fitting.calibrate.spring.other_fits import lead
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.problem import MISFIT, came_to_an_end
from fitting.calibrate.spring.scores import Score, overall
from fitting.calibrate.spring.stand_tests import SOFTER
from fitting.inference.least_squares import FitResult
from fitting.inference.notes import joined
from fitting.inference.numbers import number
from fitting.inference.serial_correlation import OVERSTATED, overstated_sentence
from pneusma_jax.errors import counted

from .. import profile_likelihood
from ..characterisation import another_cause, ask, doubtful, fitted_only, limits
from ..instrument_zeros import how_errors_grew, large_drifts, lasting_sentence, lasting_zeros, possible_zeros
from ..open_constants import first_sentence, grouped_warnings

OPEN_MIXING_RULE = (
    " If the alloy is no nitinol, its phases' resistances may mix by another rule: --base new_sma opens it."
)
"""What else to try where the law does not fit an alloy that was identified."""
OTHER_SOFTER_PHASE = " The tests were read with {} as the softer phase; --softer {} reads them otherwise."
"""What else to try where the softer phase was chosen by the tests' stiffness."""
CLOSE_CALL = 4.0
"""Maximum lead in chi-square, without a warning, of a best fit that only one start found [1]."""
SOME_ROWS = 0.01
"""Minimum share of a test's rows with a fraction outside 0 to 1 for a sentence [1]; noise leaves 0.3 %."""
BLIND_SHARE = 0.5
"""Minimum share of a test's rows with an uninformative resistance for a warning [1]."""


def verdict(result: SpringCharacterisation) -> list[str]:
    """The few most important sentences: doubts, what was found and how well it predicts, what stays open."""
    fitted = [test for test in result.tests if test.fitted]
    method = "identified from" if result.identify else "adjusted within its tolerances to"
    errors = overall(result.scores, "fit")
    tests = counted(len(fitted), "test")
    reduced = result.joint.reduced_chi_square
    misfit, warned = reduced > MISFIT, cautions(result)
    sentences = [*warned]
    sentences.append(f"The alloy was {method} {tests}.{_errors(errors)}{_held_out(result)}")
    if result.modes:
        sentences.append(mode_sentence(result.modes[0]))
    if misfit:
        unstated = assumed([test.recording for test in fitted])
        sentences += [f"The specimen may be another one. {text}." for text in unstated]
        rule_is_fixed = result.identify and "c" not in result.fitted
        sentences.append(
            f"Standard errors {how_errors_grew(result.joint.inflation, result.lasting)}."
            + (OPEN_MIXING_RULE if rule_is_fixed else "")
            + (OTHER_SOFTER_PHASE.format(result.softer, _other(result)) if result.softer else "")
        )
    elif result.joint.inflation > 1.0:
        joint = result.joint
        sentences.append(lasting_sentence(joint.correlation_time, joint.inflation, result.lasting))
    if reduced * result.joint.correlation_time < OVERSTATED:
        sentences.append(overstated_sentence(reduced))
    loose = [e for e in result.identifiability if e["kind"] not in ("at_bound", "not_fitted")]
    if loose:
        sentences.append(first_sentence(loose))
    elif not warned:
        sentences.append(
            "These tests determine every constant that was free, each better than was known before."
        )
    return sentences


def cautions(result: SpringCharacterisation) -> list[str]:
    """Sentences with which the report begins: the law misses its tests, or constants are doubtful."""
    return not_fitted(result) if result.joint.reduced_chi_square > MISFIT else doubts(result)


def doubts(result: SpringCharacterisation) -> list[str]:
    """Sentences on constants that are not to be trusted although the law fits; none if it does not fit."""
    if result.joint.reduced_chi_square > MISFIT:
        return []
    shifts = improbable_shifts(result.fitted, result.joint.values)
    return doubtful(shifts, large_drifts(result.lasting), result.path)


def not_fitted(result: SpringCharacterisation) -> list[str]:
    """Sentences on a law that misses its tests: by how much, where, and which command looks for the cause."""
    joint = result.joint
    misfits, reduced = missed(joint.problem, joint.values), number(joint.reduced_chi_square)
    (worst, output), rms = max(misfits.items(), key=lambda one: one[1])
    sentences = [
        f"The law does not fit these tests: the reduced chi-square is {reduced}, and noise alone would leave "
        f"1. It misses most in {worst}, where the {output} is off by {number(rms, '.2g')} times its noise.",
    ]
    outside = [score for score in result.scores if score.impossible > SOME_ROWS]
    if outside:
        far = max((float(x) for score in outside for x in score.xi0), key=lambda x: abs(x - 0.5))
        names = joined([score.name for score in outside])
        sentences.append(
            f"The resistance of {names} asks for martensite fractions outside 0 to 1 (as far as "
            f"{number(far, '.2g')}), which no wire has. A part of the resistance is not the wire's, or the "
            "stated sizes or alloy are wrong."
        )
    return [*sentences, f"The numbers are only the nearest fit. {ask(result.path)} looks for the cause."]


def _other(result: SpringCharacterisation) -> str:
    """A phase that could have been taken as the softer one instead, for the option `--softer`."""
    return next(phase for phase in SOFTER if phase != result.softer)


def _errors(measures: dict[str, float] | None) -> str:
    """Sentence on the errors of fitted tests; empty where no row could be predicted."""
    if measures is None:
        return ""
    return (
        " Predicted from resistance alone, their shear stress is missed by "
        f"{measures['mae_MPa']:.2g} MPa on average ({100.0 * measures['rpd']:.2g} %)."
    )


def _held_out(result: SpringCharacterisation) -> str:
    """Sentence on the errors of tests that were not fitted."""
    errors = overall(result.scores, "validation")
    if errors is None:
        return " No test was held out."
    return f" Held-out tests are missed by {errors['mae_MPa']:.2g} MPa ({100.0 * errors['rpd']:.2g} %)."


def mode_sentence(mode: Mode) -> str:
    """Sentence on another parameter set that fits as well."""
    changes = ", ".join(
        f"{name} {'higher' if change > 0.0 else 'lower'} by {abs(change):.1f} standard errors"
        for name, change in mode.different
    )
    return (
        f"Two parameter sets fit equally well. From {mode.start} the fit ends elsewhere ({changes}), with a "
        f"chi-square only {mode.worse_by:+.1f} off. These tests do not choose between them."
        f"{'' if mode.converged else ' (That fit stalled before its end.)'}"
    )


def unended(fit: FitResult) -> list[str]:
    """A sentence on a joint fit that did not end well; none where it gained too little to go on."""
    return [] if came_to_an_end(fit) else [f"The joint fit did not end well. {fit.status.value}"]


def warnings(result: SpringCharacterisation) -> list[str]:
    """Warnings: bounds, parameters that never moved, fits that failed, uninformative resistances."""
    sentences = grouped_warnings(result.identifiability)
    sentences += unended(result.joint.result)
    ahead = lead(result.joint)
    if ahead > CLOSE_CALL:
        sentences.append(
            f"Of {len(result.joint.starts)} starts only one ended at the best fit, the next with a "
            f"chi-square larger by {ahead:.3g}. There may be a better fit; --starts tries more. Standard "
            "errors span the fits that were found."
        )
    recordings = [test.recording for test in result.tests]
    far = far_from_nominal(recordings, result.fitted, result.joint.values)
    zeros = lasting_zeros(result.lasting)
    cause = [] if doubts(result) else another_cause(far, zeros, result.path)
    sentences += [*far, *zeros, *cause, *limits(fitted_only(result.parameters, result.identifiability))]
    sentences += profile_likelihood.warnings(result)
    sentences += [blind_sentence(score) for score in result.scores if score.uninformed > BLIND_SHARE]
    return sentences


def blind_sentence(score: Score) -> str:
    """Sentence on the prediction of a test with an uninformative resistance."""
    return (
        f"{score.name}: in {100.0 * score.uninformed:.0f} % of the rows the resistance hardly tells the "
        "martensite fraction: near full heat the fraction goes as its eighth root. So the stress is "
        "predicted worse than the law is known. The fit takes the fraction from force and resistance "
        "together."
    )


def how_it_was_fitted(result: SpringCharacterisation) -> list[str]:
    """Sentences on stages, starts and noise."""
    joint = result.joint
    sentences = []
    for stage in result.stages:
        outcome = ", ".join(stage.parameters) if stage.result is not None else f"skipped: {stage.skipped}"
        tests = f" ({', '.join(stage.tests)})" if stage.tests else ""
        sentences.append(f"Stage: {stage.name}{tests}: {outcome}.")
    ends = ", ".join(
        f"from {s.name} {'none' if s.result.chi_square is None else format(s.result.chi_square, '.1f')}"
        for s in joint.starts
    )
    sentences.append(
        f"Joint fit of all tests by least squares from {counted(len(joint.starts), 'start')}; chi-square:"
        f" {ends}."
    )
    noise = "the noise as stated" + (", beside zeros that are off or drift" if joint.problem.zeros else "")
    sentences.append(
        f"Reduced chi-square {number(joint.reduced_chi_square)} over {noise}; force residuals are "
        f"correlated over {joint.correlation_time:.1f} samples. Standard errors "
        f"{how_errors_grew(joint.inflation, result.lasting)}."
    )
    sentences += possible_zeros(result)
    sentences.append(
        "The martensite fraction is no input: it changes slowly behind resistance and force, and its "
        "uncertainty is "
        "in the standard errors."
    )
    return sentences


def phases(result: SpringCharacterisation) -> list[str]:
    """A line for each test: its role, the phase in which its wire was taken to be, and why."""
    return [f"{t.name} ({t.recording.role}): {t.words}; {t.reason}." for t in result.tests]
