"""The content of `report.json` of a characterised alloy."""

from typing import Any

from fitting.calibrate.spring.pipeline import SpringCharacterisation
from fitting.calibrate.spring.scores import Score, overall
from pneusma_jax.units import from_si

from .. import characterisation, profile_likelihood
from . import text


def _score_json(score: Score) -> dict[str, Any]:
    return {
        "role": score.role,
        **score.metrics,
        "blind_share": score.uninformed,
        "resistance_rms_over_noise": score.resistance_rms,
        "force_rms_over_noise": score.force_rms,
    }


def content(result: SpringCharacterisation) -> dict[str, Any]:
    """The content of `report.json`."""
    return characterisation.content(
        "spring", result.title, result.real, text.verdict(result), result.parameters, text.warnings(result),
        result.seed, _more(result),
    )  # fmt: skip


def _more(result: SpringCharacterisation) -> dict[str, Any]:
    joint = result.joint
    return {
        "metrics": overall(result.scores, "fit"),
        "metrics_held_out": overall(result.scores, "validation"),
        "metrics_by_recording": {s.name: _score_json(s) for s in result.scores if s.stress.size},
        "combinations": characterisation.combinations_json(result.combinations),
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
            "zeros": characterisation.zeros_json(result.lasting),
            "starts": [{"name": s.name, "chi_square": s.result.chi_square} for s in joint.starts],
            "stages": [
                {"name": s.name, "tests": list(s.tests), "parameters": list(s.parameters),
                 "skipped": s.skipped}
                for s in result.stages
            ],
            "text": text.how_it_was_fitted(result),
        },
        "tests": [{"name": t.name, "phase": t.phase, "reason": t.reason} for t in result.tests],
        "sd_given_geometry_SI": result.sd_given_geometry(),
        "notices": list(result.notices),
    }  # fmt: skip
