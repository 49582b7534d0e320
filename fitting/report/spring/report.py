"""The report of a characterised alloy."""

from typing import Any

from fitting.calibrate.spring.information import relative_to_prior
from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.scores import Score, overall
from pneusma_jax.units import from_si

from .. import profile_likelihood
from ..elastomer.tables import TextTable
from ..report import Report, Section, numbered, parameter_rows
from . import figures
from . import text as words

SCORE_NOTE = (
    "Shear stress predicted from elongation and resistance alone. MAE and RMSE in MPa; RPD is the mean "
    "relative "
    "difference (Eq. 2.52), signed and absolute; blind: rows whose resistance hardly tells the "
    "martensite fraction."
)


def report_of(result: SpringCharacterisation) -> Report:
    """Everything that is said about the result."""
    fitted = [test.name for test in result.tests if test.fitted]
    kept = [test.name for test in result.tests if not test.fitted]
    subtitle = f"Spring on a stand, {len(fitted)} tests fitted ({', '.join(fitted)})"
    subtitle += f", {len(kept)} held out ({', '.join(kept)})" if kept else ""
    loose = tuple(e["text"] for e in result.identifiability)
    nothing = ("Nothing: every free constant is known better than before.",)
    return Report(
        title=result.title,
        subtitle=subtitle,
        kind="spring",
        real=result.real,
        verdict=words.verdict(result),
        warnings=words.warnings(result),
        parameters=result.parameters,
        sections=[
            Section("Fit", figures=("fit",)),
            Section("Parameters", table=_parameters(result), note="± one standard error."),
            Section("Errors, test by test", table=_scores(result), note=SCORE_NOTE),
            Section("What these tests cannot tell", loose or nothing, figures=("profiles",)),
            Section("Other fits as good", tuple(words.mode_sentence(mode) for mode in result.modes)),
            Section("Which test next", (result.next_test.text,)),
            Section("Laws and phases", figures=("laws", "phase")),
            Section("What each test was taken to be", tuple(words.phases(result))),
            Section("How it was fitted", tuple(words.how_it_was_fitted(result))),
            Section("Notices", result.notices),
        ],
        tables={"alloy.toml": result.table()},
        more=_more(result),
        draw=lambda: figures.captioned(result),
        seed=result.seed,
    )


def _parameters(result: SpringCharacterisation) -> TextTable:
    start = {n: float(from_si(result.start[n], e.unit)) for n, e in result.fitted.items()}
    share = {name: relative_to_prior(entry) for name, entry in result.fitted.items()}
    return parameter_rows(result.parameters, start, share)


def _row(name: str, role: str, measures: dict[str, float], blind: float | None) -> list[str]:
    cells = [numbered(measures[key]) for key in ("mae_MPa", "rmse_MPa")]
    cells += [numbered(100.0 * measures[key]) for key in ("rpd", "rpd_signed")]
    return [name, role, *cells, "" if blind is None else f"{100.0 * blind:.0f}"]


def _scores(result: SpringCharacterisation) -> TextTable:
    rows = [_row(s.name, s.role, s.metrics, s.blind) for s in result.scores if s.stress.size]
    for role, name in (("fit", "all fitted"), ("validation", "all held out")):
        together = overall(list(result.scores), role)
        if together is not None:
            rows.append(_row(name, role, together, None))
    return TextTable(["test", "role", "MAE MPa", "RMSE MPa", "RPD %", "signed %", "blind %"], rows)


def _score_json(score: Score) -> dict[str, Any]:
    return {
        "role": score.role,
        **score.metrics,
        "blind_share": score.blind,
        "resistance_rms_over_noise": score.resistance_rms,
        "force_rms_over_noise": score.force_rms,
    }


def _more(result: SpringCharacterisation) -> dict[str, Any]:
    joint = result.joint
    return {
        "metrics": overall(list(result.scores), "fit"),
        "metrics_held_out": overall(list(result.scores), "validation"),
        "metrics_by_recording": {s.name: _score_json(s) for s in result.scores if s.stress.size},
        "identifiability": result.identifiability,
        "other_fits_as_good": [
            {"start": m.start, "chi_square_above": m.worse_by, "distance_sd": m.distance,
             "converged": m.converged,
             "values": {n: float(from_si(v, result.fitted[n].unit)) for n, v in m.values.items()}}
            for m in result.modes
        ],
        "profiles": profile_likelihood.document(result),
        "next_test": {
            "text": result.next_test.text,
            "candidates": [
                {"name": c.name, "text": c.text, "information_nats": c.information,
                 "shrinks": [{"parameter": n, "ratio": r} for n, r in c.shrinks]}
                for c in result.next_test.candidates
            ],
        },
        "fitting": {
            "reduced_chi_square": joint.reduced_chi_square,
            "standard_errors_multiplied_by": joint.inflation,
            "correlation_time_samples": joint.correlation_time,
            "starts": [{"name": s.name, "chi_square": s.result.chi_square} for s in joint.starts],
            "stages": [
                {"name": s.name, "tests": list(s.tests), "parameters": list(s.parameters),
                 "skipped": s.skipped}
                for s in result.stages
            ],
            "text": words.how_it_was_fitted(result),
        },
        "tests": [{"name": t.name, "phase": t.phase, "reason": t.reason} for t in result.tests],
        "sd_given_geometry_SI": result.sd_given_geometry(),
        "notices": list(result.notices),
    }  # fmt: skip
