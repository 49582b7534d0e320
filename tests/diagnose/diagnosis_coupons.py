"""Pull tests of a silicone with a known truth, in files."""

import equinox as eqx
import numpy as np

from pneusma_jax.silicone import load_silicone

NOISE = 0.25  # kPa
SIDECAR = """kind = "elastomer"
role = "{role}"
specimen = "E"
real = false
[noise]
stress_kPa = {noise}
[tolerance]
silicone_stiffness = 0.05
"""


_stress = eqx.filter_jit(lambda law, strain: law(strain))  # one program a length, not one for each operation


def curve(strain):
    """Order-4 base curve of the source's silicone, kPa, by the package's own law (the truth differs beyond it)."""
    return np.asarray(_stress(load_silicone("dragon_skin_10_fast"), np.asarray(strain, float))) / 1e3


def course(levels, rows=90):
    """Strain that goes up to each level and back to zero."""
    corners = np.concatenate([[0.0], *([level, 0.0] for level in levels)])
    return np.interp(np.linspace(0, len(corners) - 1, rows), np.arange(len(corners)), corners)


def softened(strain, depth):
    """Stress that is lower by up to `depth` below the largest strain so far, linearly in the distance to it."""
    most = np.maximum.accumulate(strain)
    return (
        curve(strain)
        * 1.03
        * (1.0 - depth * np.where(most > 0.0, 1.0 - strain / np.where(most > 0, most, 1.0), 0.0))
    )


COURSES = [0.5, 0.5, 0.8], [0.3, 0.6], [0.8, 0.8], [0.4, 0.7, 0.7]


def write(folder, law, seed=3, courses=COURSES):
    """Four pulls; the last one is for validation."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    for k, levels in enumerate(courses, 1):
        strain = course(levels)
        stress = law(strain) + NOISE * rng.standard_normal(strain.size)
        time = np.linspace(0.0, 120.0, strain.size)
        lines = [f"{t:.4f},{e:.6f},{s:.5f}" for t, e, s in zip(time, strain, stress, strict=True)]
        (folder / f"pull_{k}.csv").write_text("time_s,strain,stress_kPa\n" + "\n".join(lines) + "\n")
        role = "validation" if k == 4 else "fit"
        (folder / f"pull_{k}.toml").write_text(SIDECAR.format(role=role, noise=NOISE))
    return folder


def put(folder, name, strain, stress, sidecar=None, time=None):
    """A recording; empty fields where a number is NaN."""
    folder.mkdir(parents=True, exist_ok=True)
    time = np.linspace(0.0, 120.0, len(strain)) if time is None else time
    text = lambda x: "" if np.isnan(x) else f"{x:.6f}"  # noqa: E731
    rows = (",".join(map(text, row)) for row in zip(time, strain, stress, strict=True))
    (folder / f"{name}.csv").write_text("\n".join(["time_s,strain,stress_kPa", *rows]) + "\n")
    (folder / f"{name}.toml").write_text(sidecar or SIDECAR.format(role="fit", noise=NOISE))
    return folder
