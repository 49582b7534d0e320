"""How often the standard errors that a diagnosis tells hold the truth of the independent generator.

    python benchmarks/found_errors.py --seed 953 --kinds wire tube elastomer --groups single --limit 45

Every campaign is diagnosed. Base constants, and strengths that mean the same in the generator's form and in
the candidate's, are compared with the truth, by the errors of the fit alone and by those that are told. Seeds
are those of development: no campaign of the blind trial takes part.
"""

import argparse
import tempfile

import numpy as np

from fitting.data.recordings import read_campaign
from fitting.diagnose import diagnose
from fitting.diagnose.verdict.conclusion import Conclusion
from pneusma_jax import enable_float64
from validation.blind.cases import KINDS, write_case
from validation.blind.proof.ledger import DEVELOPMENT
from validation.blind.proof.run import chosen_cases

SAME = {("channel_lag", "delay"), ("transformation_hysteresis", "gap_T"), ("series_resistance", "ohms")}
"""Strengths that mean the same in both forms."""
UNITS = {"E_m": 1e9, "E_a": 1e9, "G_m": 1e9, "G_a": 1e9}
"""SI per unit of the generator's constants, where it is not 1."""
MILLIMETRE = 1e-3


def truth_of(effect: str, name: str, truth: dict) -> float | None:
    """The true value of a number in the unit of the diagnosis; None where the forms do not share it."""
    if effect:
        own = truth["parameters"].get(effect)
        known = own and (effect, name) in SAME
        return own["amplitude"] * (1.0 + 0.5 * own.get("warming", 0.0)) if known else None
    stem = name.partition("__")[0]
    if f"{stem}_mm" in truth["base"]:
        return truth["base"][f"{stem}_mm"] * MILLIMETRE
    return truth["base"][stem] * UNITS.get(stem, 1.0) if stem in truth["base"] else None


def distances(conclusion: Conclusion, truth: dict) -> list[tuple[bool, float, float]]:
    """By number, whether it is a strength, and its distance from the truth in errors of the fit and in those
    told."""
    program, fit = conclusion.model
    found = []
    for k in fit.free:
        item = program.unknowns.items[k]
        true = truth_of(item.effect, item.name, truth)
        if true is None:
            continue
        errors = (item.spread(fit.u[k], sd) for sd in (fit.sd(k), conclusion.sd(k)))
        far = abs(float(item.value(fit.u[k])) - true)
        found.append((bool(item.effect), *(far / error for error in errors)))
    return found


def table(rows: list[tuple[bool, float, float]], title: str) -> None:
    """Print the shares within one, two and three errors."""
    for name, place in (("of the fit", 1), ("told", 2)):
        z = np.array([row[place] for row in rows])
        shares = " ".join(f"{np.mean(z < most):.2f}" for most in (1.0, 2.0, 3.0))
        spread = np.sqrt(np.mean(z**2))
        print(f"{title}, {len(z)} numbers, errors {name}: {shares}, root mean square {spread:.1f}")


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=953)
    parser.add_argument("--kinds", nargs="*", default=("wire", "tube", "elastomer"), choices=KINDS)
    parser.add_argument("--groups", nargs="*", default=("single", "pair", "outside"))
    parser.add_argument("--limit", type=int, default=45)
    chosen = parser.parse_args()
    if chosen.seed >= DEVELOPMENT:
        parser.error(f"seed {chosen.seed} is one of the blind trial; take one below {DEVELOPMENT}")
    enable_float64()
    rows: dict[str, list] = {"named": [], "nothing named": [], "strengths": []}
    for case in chosen_cases("full", chosen.seed, chosen.limit, chosen.kinds, chosen.groups):
        with tempfile.TemporaryDirectory() as folder:
            truth = write_case(case, folder)
            conclusion = diagnose(read_campaign(folder), seed=1)
        found = distances(conclusion, truth)
        rows["named" if conclusion.model[1].slugs else "nothing named"] += found
        rows["strengths"] += [one for one in found if one[0]]
        print(case.name, case.kind, *case.slugs, *(f"{z:.1f}" for *_, z in found), flush=True)
    for title, some in rows.items():
        if some:
            table(some, title)


if __name__ == "__main__":
    main()
