"""Tables of the fit of an elastomer: of one law's constants, of all laws, of their drift, of the next test.

Every law is fitted to the whole curve, to ranges of growing reach, and to the curve with gaps
(`fitting.calibrate.elastomer.held_out`).
"""

from collections.abc import Sequence

import numpy as np

from fitting.calibrate.elastomer.analysis import Analysis
from fitting.calibrate.elastomer.next_test import NextTest
from fitting.calibrate.elastomer.pipeline import ElastomerCharacterisation, estimates

from ..cells import number, relative, with_error
from ..characterisation import ERRORS, estimate_text, remark
from ..table import Table

LAWS_NOTE = (
    "Best first, by the mean square error in gaps of the curve over each recording's noise. So errors in kPa "
    "and % may have another order. The law taken is emphasised. Free: constants. Errors "
    "are root mean square or relative (Eq. 2.52 with absolute differences). Next: error on the stretch that "
    "follows a fitted range, geometric mean over the ranges. AICc and BIC count independent samples and are "
    "differences to the best law."
)
MODULI_NOTE = "Initial shear modulus in kPa, ± one standard error."
NEXT_TEST_NOTE = (
    "Expected root mean square error of the stress over an actuator's strains, after each test, "
    "and its causes."
)


def _kilopascal(value: float | None) -> str:
    """A cell with a stress, given in Pa."""
    return number(None if value is None else value / 1e3)


def _percent(value: float | None) -> str:
    """A cell with a relative error, given as a number [1]."""
    return number(None if value is None else 100.0 * value)


def parameter_table(result: ElastomerCharacterisation) -> Table:
    """Table of the selected law's constants, for the whole range and for an actuator's."""
    analyses = [("whole range", result.whole)]
    if result.actuator is not result.whole:
        analyses.append(("actuator's range", result.actuator))
    rows = [
        [name, estimate_text(e), e.unit, relative(e.value, e.sd), analysis.best.law.label, where, remark(e)]
        for where, analysis in analyses
        for name, e in estimates(analysis.best).items()
    ]
    return Table(["constant", "value", "unit", "relative error", "law", "fitted to", ""], rows, ERRORS)


def law_table(analysis: Analysis) -> Table:
    """Table of every law with its errors, best first.

    It has columns for errors on other recordings only if some law was tested on such recordings.
    """
    has_validation = any(held.validation for held in analysis.held.values())
    has_others = any(held.recordings for held in analysis.held.values())
    header = ["law", "free", "fit kPa", "gaps kPa", "gaps %", "next %"]
    header += ["other pull kPa"] * has_others + ["validation kPa"] * has_validation
    header += ["dAICc", "dBIC", "monotone"]
    rows = []
    for ranked in analysis.choice.ranked:
        held = analysis.held[ranked.name]
        gaps = held.interpolation
        row = [
            analysis.fits[ranked.name].law.label,
            str(ranked.constants),
            _kilopascal(held.ranges[-1].inside.rmse),
        ]
        row += [_kilopascal(gaps and gaps.rmse), _percent(gaps and gaps.rpd), _percent(held.extrapolation)]
        for has_column, transfers in ((has_others, held.recordings), (has_validation, held.validation)):
            if has_column:
                squares = [t.score.rmse**2 for t in transfers.values()]
                row.append(_kilopascal(float(np.sqrt(np.mean(squares))) if squares else None))
        row += [number(ranked.aicc, ".1f"), number(ranked.bic, ".1f")]
        rows.append([*row, "yes" if ranked.usable else "NO"])
    names = [ranked.name for ranked in analysis.choice.ranked]
    return Table(header, rows, LAWS_NOTE, chosen=names.index(analysis.choice.chosen))


def drift_table(analysis: Analysis) -> Table:
    """Table of every law's initial shear modulus, fitted to ranges of growing reach, and its largest drift.

    The drift is that of the constant that moves by most of its standard errors.
    """
    reaches = [r.reach for r in next(iter(analysis.held.values())).ranges]
    header = ["law", *(f"to stretch {reach:.3g}" for reach in reaches), "largest drift"]
    rows = []
    for ranked in analysis.choice.ranked:
        cells = []
        for r in analysis.held[ranked.name].ranges:
            modulus, sd = r.fit.shear_modulus()
            cells.append(with_error(modulus / 1e3, sd / 1e3) if sd != 0.0 else _kilopascal(modulus))
        drifting = [d for d in analysis.drifts[ranked.name] if d.drifts]
        worst = max(drifting, key=lambda d: d.errors, default=None)
        largest = f"{worst.constant} {worst.errors:.0f} sd" if worst else "none"
        rows.append([analysis.fits[ranked.name].law.label, *cells, largest])
    return Table(header, rows, MODULI_NOTE)


def next_test_table(test: NextTest, causes: Sequence[str]) -> Table:
    """Table of the expected error of the stress now and after each test; the first test is the best.

    Args:
        test: the comparison of possible next tests.
        causes: causes of the error, as named in it; each has a column.
    """
    header = ["test", "error left (kPa)", *(f"from {cause}" for cause in causes), "information (nats)"]
    now = [_kilopascal(test.error_before), *(_kilopascal(test.before[cause]) for cause in causes)]
    rows = [["as it stands", *now, ""]]
    for candidate in test.candidates:
        errors = [candidate.error_after, *(candidate.after[cause] for cause in causes)]
        rows.append([candidate.text, *map(_kilopascal, errors), number(candidate.information, ".2g")])
    return Table(header, rows, NEXT_TEST_NOTE, chosen=1)  # row 0 is the present state, and 1 the best test
