"""`make real-proof`: diagnose other laboratories' recordings, names hidden, and print one table.

    python tests/real/real_proof.py [--only a b.ecoflex_30 ...] [--out FILE.json]
"""

import argparse
import contextlib
import dataclasses
import io
import json
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

NOTEBOOK = Path(__file__).resolve().parents[2] / "notebooks" / "05_custom_model.ipynb"
MISSING = """No real recordings here. Put these repositories' data into one folder, under these names, and run
    make real-proof PNEUSMA_RECORDINGS=FOLDER
viscoelastic             xlsx files of uniaxial-loading-unloading-test, https://github.com/Chongran-Zhao/Viscoelastic-fitting
soft_robotics_materials  Tensile-Tests-Data, https://github.com/LucMarechal/Soft-Robotics-Materials-Database
tissue_phantoms          folder EF30_0T, https://github.com/abubakardawood/tissue-phantom-material-database
sma_react                folder cal_sample_1, https://github.com/maestrolab/SMA-REACT
bending_actuators        both FNN tables (experiment.csv, simulation_by_the_authors.csv),
                         https://github.com/HiroshanGunawardane/ML_SelectiveStiffness-"""


def main(arguments: list[str] | None = None) -> int:
    """Run studies and print their table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", help="studies (a, b, c, d, e), or single cases (b.ecoflex_30)")
    parser.add_argument("--out", type=Path, help="file for the table as JSON")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    from pneusma_jax.precision import enable_float64

    enable_float64()
    import real_campaigns
    from real_studies import STUDIES, answer

    from pneusma_jax.errors import InputError

    try:
        there = real_campaigns.available()
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    if not there:
        print(MISSING)
        return 0
    rows = []
    for study in STUDIES:
        wanted = {n: make for n, make in study.cases.items() if _asked(chosen.only, study.letter, n)}
        if not wanted:
            continue
        print(f"\n({study.letter}) {study.title}\n    true by design: {study.truth}")
        for make in wanted.values():
            with tempfile.TemporaryDirectory() as folder:
                found = answer(study, make(), Path(folder), chosen.seed)
            print(line(found), flush=True)
            rows.append(dataclasses.asdict(found) | {"study": study.letter, "cut": found.cut})
    if _asked(chosen.only, "e", "bending"):
        rows.append(own_base())
    if chosen.out:
        chosen.out.parent.mkdir(parents=True, exist_ok=True)
        chosen.out.write_text(json.dumps(rows, indent=1))
    return 0


def own_base() -> dict:
    """Run the notebook that brings its own base model, and print what its terms are worth."""
    import matplotlib

    matplotlib.use("Agg")
    book, space = json.loads(NOTEBOOK.read_text()), {}
    print("\n(e) bending actuators; their authors' simulation as one's own base\n    true by design: nobody knows")
    began = time.perf_counter()
    with contextlib.redirect_stdout(io.StringIO()):
        for cell in book["cells"]:
            if cell["cell_type"] == "code":
                exec(compile("".join(cell["source"]), NOTEBOOK.name, "exec"), space)
    result, seconds = space["result"], time.perf_counter() - began
    if result is None:
        print(f"    {MISSING}")
        return {"study": "e"}
    print("    " + result.report().replace("\n", "\n    ") + f"\n    {seconds:.0f} s")
    (before,), (after,) = (errors.values() for errors in result.errors())
    return {"study": "e", "named": list(result.named), "before": before, "after": after, "cut": 1.0 - after / before}


def line(found) -> str:
    """One case as a line of the table."""
    said = ", ".join(f"{slug} {p:.2f}" for slug, p in found.named.items()) or "consistent"
    return (
        f"    {found.case:28s} {'right' if found.right else 'WRONG'}  said: {said}; set:"
        f" {', '.join(found.explanation_set)}; kept out: {found.before:.3g} -> {found.after:.3g} {found.unit}"
        f" (-{100 * found.cut:.0f} %), {found.seconds:.0f} s"
    )


def _asked(only: list[str] | None, letter: str, case: str) -> bool:
    return not only or letter in only or f"{letter}.{case}" in only


if __name__ == "__main__":
    sys.exit(main())
