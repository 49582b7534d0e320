"""Time stepping row by row through a campaign, shared by every kind of stand.

Arrays run over (parameter sets B, recordings K). A series adds the rows as its last axis, (B, K, N). Every
recording starts at rest in a fresh state.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Row:
    """Inputs of one row before its equilibrium is solved; arrays (B, K) or (K,)."""

    index: int
    time: np.ndarray
    step: np.ndarray
    drive: dict = field(default_factory=dict)
    state: dict = field(default_factory=dict)


def rows(times, drives):
    """Rows of series: `times` (K, N), `drives` name -> (B, K, N)."""
    for n in range(times.shape[-1]):
        step = times[:, n] - times[:, n - 1] if n else np.zeros(times.shape[0])
        yield Row(n, times[:, n], step, {name: series[..., n] for name, series in drives.items()})


def columns(numbers):
    """Constants as arrays (B, 1), so that they broadcast over recordings."""
    size = max(np.size(value) for value in numbers.values())
    return {k: np.broadcast_to(np.reshape(np.asarray(v, float), (-1, 1)), (size, 1)) for k, v in numbers.items()}


def batch(series, size):
    """Series (K, N) or (B, K, N) as (size, K, N)."""
    series = np.asarray(series, float)
    series = series[None] if series.ndim == 2 else series
    return np.broadcast_to(series, (size,) + series.shape[1:])


class Effect:
    """Physics added to the base: the hooks that a stand calls. The hooks of this base class change nothing.

    `amplitude` is (B, 1), and zero means absent. Hooks inside the root search must be free of side effects.
    The memory of an effect changes only once a row is solved: in the `close_` hooks and in `solved`.

    Attributes:
        slug: name of the effect in a truth.
        kinds: kinds of specimen that can have it.
        component: part of the model that it changes, as in a report's `where`.
        drivers: quantities over which it acts, as in a report's `where`.
        ceiling: largest amplitude, in the effect's own unit.
        wants: what an actuator must have for it, arguments of `plans.plan`.
        maskable: kinds of specimen in which a recalibration can hide it in what is fitted.
    """

    slug = "none"
    kinds = ()
    component = "unknown"
    drivers = ()
    ceiling = 1.0
    wants = {}
    maskable = ()

    def where(self, bench):
        """Name of the component for a report."""
        if self.component == "spring":
            return {"spring": "spring", "wire": "wire"}.get(bench.kind, "spring_2")
        return self.component

    def __init__(self, rng, bench):
        self.amplitude = np.zeros((1, 1))
        self.draw(rng, bench)

    def draw(self, rng, bench):
        """Draw the shape of this effect in this specimen."""

    def begin(self, shape, numbers, bench):
        """Reset all memory; `shape` is (B, K)."""

    def prepare(self, rng, bench, clean):
        """Fit the effect's shape to this specimen without any effect: `clean` columns (K, N)."""

    def drives(self, bench, series):
        """Change the true inputs before the march."""
        return series

    def fibre(self, strain, stress, row):
        """Stress of silicone fibres (..., B, K, points)."""
        return stress

    def close_fibre(self, strain, stress, row):
        """Remember a solved row's fibres and the stress that this effect received there."""

    def opening(self, strain, row, which):
        """Spring strain in the metal for the strain of the geometry."""
        return strain

    def warmth(self, temperature, stress, row, q):
        """Temperature of a wire for its phases [degC]."""
        return temperature

    def phase(self, xi0, temperature, row, q):
        """Zero-stress martensite fraction of a wire; called once a row."""
        return xi0

    def shear(self, gamma, row, which):
        """Shear (or axial) strain in the law."""
        return gamma

    def metal(self, gamma, stress, xi0, row, which):
        """Stress of the metal [Pa]."""
        return stress

    def lever(self, strain, factor, row, which):
        """Force per stress [N/Pa]."""
        return factor

    def pull(self, strain, force, row, which):
        """Force of a spring [N]."""
        return force

    def solved(self, strain, force, row, which):
        """Remember the force of a solved row's spring."""

    def close_metal(self, strain, gamma, xi0, row, which):
        """Remember a solved row's spring or wire."""

    def resistance(self, ohm, gamma, xi0, row, which, memory):
        """Resistance of a spring [ohm] in a solved row."""
        return ohm

    def load(self, body, row):
        """Additional force and moment about side 2 that resist the pressure; `body` holds the trial
        configuration."""
        return 0.0, 0.0

    def close_load(self, body, row):
        """Remember a solved row's configuration."""

    def record(self, bench, series):
        """Change the recorded values: series by column (B, K, N)."""
        return series

    def describe(self):
        """Parameters of this effect for the truth, as scalars."""
        plain = {k: v for k, v in vars(self).items() if isinstance(v, (int, float, str)) and not k.startswith("_")}
        return plain | {"amplitude": float(np.ravel(self.amplitude)[0])}
