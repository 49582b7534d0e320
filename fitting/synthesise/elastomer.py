"""A simulated campaign of pulls of a stiffening silicone, with several specimens, noise and a seed.

The curve is Ogden's with two terms, close to a soft platinum silicone: 41 kPa at small strain, stiffening
past a stretch of three. Each specimen's stress is that curve times its own factor (batch spread). The load
cell's noise is a first-order process, as from filtered amplifiers. `python -m fitting.synthesise.elastomer
FOLDER` writes the campaign that ships in `calibration_data/examples/elastomer`.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.data.recordings import Recording, write_recording
from pneusma_jax.files import write_whole
from pneusma_jax.precision import enable_float64
from pneusma_jax.silicone import Ogden, SiliconeLaw

SEED = 20240611
BATCH = 0.05
"""Relative standard deviation between specimens."""
NOISE = 1.0e3
"""Marginal standard deviation of the stress [Pa]."""
MEMORY = 0.5
"""Correlation of the noise in neighbouring samples."""
SAMPLES = 200
TRUTH = {"mu": (45.0e3, 1.2e3), "alpha": (1.7, 5.0)}
"""Constants of the curve: moduli [Pa] and exponents [1]."""


@dataclass(frozen=True)
class Pull:
    """One pull to failure.

    Attributes:
        specimen: name of the specimen; pulls of one specimen share its factor.
        stretch: largest stretch [1].
        rate: strain rate [1/s].
        role: `fit` or `validation`.
    """

    specimen: str
    stretch: float
    rate: float
    role: str = "fit"


PULLS = (
    Pull("A", 4.0, 0.10),
    Pull("A", 3.0, 0.02),
    Pull("B", 4.0, 0.10),
    Pull("C", 3.5, 0.10, "validation"),
)


def true_law() -> Ogden:
    """The curve of the shipped campaign; float64 must be on."""
    return Ogden(np.array(TRUTH["mu"]), np.array(TRUTH["alpha"]))


def simulate_pulls(
    law: SiliconeLaw,
    pulls: Sequence[Pull] = PULLS,
    seed: int = SEED,
    noise: float = NOISE,
    memory: float = MEMORY,
    batch: float = BATCH,
    samples: int = SAMPLES,
) -> tuple[list[Recording], Mapping[str, float]]:
    """Simulate pulls to failure from rest.

    Args:
        law: engineering stress [Pa] over engineering strain.
        pulls: pulls to simulate.
        seed: seed of the random numbers; the same seed gives the same campaign.
        noise: marginal standard deviation of the stress [Pa].
        memory: correlation of the noise in neighbouring samples, 0 to below 1.
        batch: relative standard deviation between specimens; 0 for identical ones.
        samples: number of rows of each recording.

    Returns:
        The recordings, named `pull_1`, `pull_2`, ..., and each specimen's factor.
    """
    random = np.random.default_rng(seed)
    factors = {
        name: 1.0 + batch * random.standard_normal() for name in sorted({pull.specimen for pull in pulls})
    }
    recordings = []
    for number, pull in enumerate(pulls, start=1):
        strain = np.linspace(0.0, pull.stretch - 1.0, samples)
        stress = factors[pull.specimen] * np.asarray(law(strain)) + noise * _coloured(random, samples, memory)
        recordings.append(_recording(f"pull_{number}", pull, strain, stress, noise, batch, seed))
    return recordings, factors


def _coloured(random: np.random.Generator, count: int, memory: float) -> np.ndarray:
    """First-order noise of unit variance."""
    white = random.standard_normal(count)
    series = np.empty(count)
    series[0] = white[0]
    for k in range(1, count):
        series[k] = memory * series[k - 1] + np.sqrt(1.0 - memory**2) * white[k]
    return series


def _recording(
    name: str, pull: Pull, strain: np.ndarray, stress: np.ndarray, noise: float, batch: float, seed: int
) -> Recording:
    return Recording(
        name=name,
        path=None,
        kind="elastomer",
        role=pull.role,
        specimen=pull.specimen,
        real=False,
        source={"citation": f"simulated by fitting.synthesise.elastomer, seed {seed}; not a measurement"},
        noise={"stress_kPa": noise / 1e3},
        tolerance={"silicone_stiffness": batch} if batch > 0.0 else {},
        columns={
            "time_s": np.round(strain / pull.rate, 4),
            "strain": np.round(strain, 6),
            "stress_kPa": np.round(stress / 1e3, 4),
        },
        comments=["simulated, not measured"],
    )


def write_example(folder: str | Path) -> None:
    """Write the shipped campaign, with a `campaign.toml` that describes it."""
    recordings, _ = simulate_pulls(true_law())
    for recording in recordings:
        write_recording(recording, folder)
    title = "Simulated pulls of a stiffening silicone"
    write_whole(Path(folder, "campaign.toml"), f'title = "{title}"\n')


if __name__ == "__main__":
    enable_float64()
    write_example(sys.argv[1])
