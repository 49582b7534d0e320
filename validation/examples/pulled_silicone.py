"""The campaign of `make demo`: pulls of a silicone whose physics the published model lacks.

    python -m validation.examples.pulled_silicone FOLDER

The specimen is 3 % stiffer than the table says. Its stress falls by up to 15 % below the largest strain so
far, in another form than the catalogue has. The same seed gives the same bytes. The truth is written beside
the folder, not into it, so that no command can read it there.
"""

import argparse
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np

from pneusma_jax import enable_float64, load_silicone

SEED = 7
NOISE_KPA = 0.25  # Standard deviation of the load cell, over the area of the specimen
STIFFNESS = 1.03  # Factor on the stress of `dragon_skin_10_fast`
SOFTENING = 0.15  # Maximum loss of stress below the largest strain so far, as a share
RATE_PER_S = 0.02  # Strain rate
ROWS = 120
PULLS = {
    "pull_1": ("fit", (0.5, 0.5, 0.8)),
    "pull_2": ("fit", (0.3, 0.6)),
    "pull_3": ("fit", (0.8, 0.8)),
    "pull_4": ("validation", (0.4, 0.7, 0.7)),
}
SIDECAR = """kind = "elastomer"
role = "{role}"
specimen = "E1"
real = false

[source]
citation = "simulated by validation.examples.pulled_silicone, seed {seed}; not a measurement"

[noise]
stress_kPa = {noise}

[tolerance]
silicone_stiffness = 0.05
"""


def pulled(levels: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Time [s], and strain [1] up to each level and back to zero at a constant rate; shape (ROWS,)."""
    corners = np.concatenate([[0.0], *([level, 0.0] for level in levels)])
    path = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners)))])
    along = np.linspace(0.0, path[-1], ROWS)
    return along / RATE_PER_S, np.interp(along, path, corners)


def stresses(strain: np.ndarray) -> np.ndarray:
    """True engineering stress [kPa] along a history of strain [1], both of shape (rows,)."""
    most = np.maximum(np.maximum.accumulate(strain), 1e-9)
    lost = SOFTENING * (1.0 - strain / most)
    virgin = np.asarray(load_silicone("dragon_skin_10_fast")(strain)) / 1e3
    return STIFFNESS * virgin * (1.0 - lost)


def documents(
    stress_of: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda time, strain: stresses(strain),
    seed: int = SEED,
) -> dict[str, str]:
    """All files of the campaign by name.

    Args:
        stress_of: true stress [kPa] from time [s] and strain [1], each of shape (rows,).
        seed: seed of the noise.
    """
    rng = np.random.default_rng(seed)
    made = {"campaign.toml": 'title = "Simulated pulls of a silicone (the demonstration)"\n'}
    for name, (role, levels) in PULLS.items():
        time, strain = pulled(levels)
        stress = stress_of(time, strain) + NOISE_KPA * rng.standard_normal(strain.size)
        rows = [f"{t:.3f},{e:.5f},{s:.3f}" for t, e, s in zip(time, strain, stress, strict=True)]
        made[f"{name}.csv"] = "\n".join(["# simulated, not measured", "time_s,strain,stress_kPa", *rows, ""])
        made[f"{name}.toml"] = SIDECAR.format(role=role, seed=seed, noise=NOISE_KPA)
    return made


def truth() -> dict[str, object]:
    """True constants and physics of the specimen."""
    return {
        "schema": "pneusma-truth/1",
        "simulated": True,
        "kind": "elastomer",
        "seed": SEED,
        "parameters": {"silicone_stiffness": {"value": STIFFNESS, "nominal": 1.0, "unit": "1"}},
        "concealed": {
            "effect": "mullins_softening",
            "depth": SOFTENING,
            "form": "stress x (1 - depth (1 - strain / largest strain so far))",
        },
    }


def main() -> None:
    """Write the campaign, and its truth beside it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    enable_float64()
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in documents().items():
        (folder / name).write_text(text)
    folder.with_name(f"{folder.name}_truth.json").write_text(json.dumps(truth(), indent=1) + "\n")


if __name__ == "__main__":
    main()
