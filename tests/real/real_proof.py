"""`make real-proof`: diagnose other laboratories' recordings, names hidden, and print one table.

    python tests/real/real_proof.py [--only a b.ecoflex_30 ...] [--out FILE.json]
"""

import argparse
import dataclasses
import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

MISSING = (
    "No real recordings here: PROVENANCE.md of each study's folder names the public repository; put the folders into"
    " one and run: make real-proof PNEUSMA_RECORDINGS=FOLDER"
)


def main(arguments: list[str] | None = None) -> int:
    """Run studies and print their table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", help="studies (a, b, c, d), or single cases (b.ecoflex_30)")
    parser.add_argument("--out", type=Path, help="file for the table as JSON")
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args(arguments)
    from pneusma_jax.precision import enable_float64

    enable_float64()
    from real_campaigns import available
    from real_studies import STUDIES, answer

    if not available():
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
    if chosen.out:
        chosen.out.parent.mkdir(parents=True, exist_ok=True)
        chosen.out.write_text(json.dumps(rows, indent=1))
    return 0


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
