"""The campaign of `make demo` fitted with lmfit, a general curve-fitting package, beside `pneusma diagnose`.

    pip install lmfit; python -m benchmarks.other_tools

lmfit is told the law: once as published, once with the softening that the data conceal, which somebody has to
think of. The last pull is not fitted; the reduced chi-square on it is printed.
"""

import time

import numpy as np

from fitting.data.recordings import read_campaign
from pneusma_jax import enable_float64, load_silicone
from validation.examples.before_and_after import CAMPAIGN


def main() -> None:
    """Fit both models and print a table."""
    import lmfit

    enable_float64()
    base = load_silicone("dragon_skin_10_fast")
    recordings = read_campaign(CAMPAIGN).recordings
    rows = {
        role: [
            (
                np.asarray(base(r.columns["strain"])) / 1e3,
                np.asarray(r.columns["strain"]),
                r.columns["stress_kPa"],
            )
            for r in recordings
            if r.role == role
        ]
        for role in ("fit", "validation")
    }
    noise = recordings[0].noise["stress_kPa"]

    def residual(parameters: lmfit.Parameters, role: str) -> np.ndarray:
        found = []
        for virgin, strain, stress in rows[role]:
            most = np.maximum(np.maximum.accumulate(strain), 1e-9)
            kept = 1.0 - parameters["depth"] * (1.0 - strain / most)
            found.append((parameters["stiffness"] * virgin * kept - stress) / noise)
        return np.concatenate(found)

    for title, vary in (("as published", False), ("with the right softening, written by hand", True)):
        parameters = lmfit.Parameters()
        parameters.add("stiffness", 1.0, min=0.5, max=2.0)
        parameters.add("depth", 0.05 if vary else 0.0, min=0.0, max=0.9, vary=vary)
        begun = time.perf_counter()
        done = lmfit.minimize(residual, parameters, args=("fit",))
        seconds = time.perf_counter() - begun
        left = residual(done.params, "validation")
        values = ", ".join(
            f"{n} = {p.value:.4f} +- {p.stderr or 0.0:.4f}" for n, p in done.params.items() if p.vary
        )
        print(
            f"{title}: {values}; fitted {done.redchi:.2f}, held out {np.mean(left**2):.2f}; {seconds:.3f} s"
        )


if __name__ == "__main__":
    main()
