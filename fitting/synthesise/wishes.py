"""What a person may ask of a simulated campaign, and the campaign that comes out."""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fitting.data.recordings import Campaign, Recording

SPREADS = ("tolerance", "prior", "none")


@dataclass(frozen=True)
class Wishes:
    """Settings of a simulated campaign; what is None or empty is left to the kind.

    Attributes:
        seed: of every random number; the same seed gives the same campaign.
        alloy: name or path of the nominal alloy; `krl35` (wire: `niti_wire`) by default, and nitinol that
            nobody has characterised for a spring of an alloy drawn from its priors.
        design: of an actuator.
        spread: how far the truth lies from the nominal numbers: within the `tolerance`, as wide as the
            `prior` of the alloy's table (a new alloy), or not at all (`none`).
        tolerance: relative 1-sigma by parameter, over the kind's own; 0 for exact.
        truth: numbers that are set, not drawn; in the unit of the alloy's table or of the geometry key.
        noise: marginal 1-sigma of an instrument by canonical column, over the kind's own; 0 for none.
        noise_time_s: time over which an instrument's noise is correlated [s]; 0 for white noise.
        drift: how far an instrument's zero has wandered at the end of a test, 1-sigma in units of its noise.
        tests: number of intermediate tests (spring), stresses (wire), pulls or runs.
        interval_s: between recorded samples [s].
        ambient_degC: temperature of the laboratory.
        reveal: whether the files may say what the truth follows from.
    """

    seed: int = 0
    alloy: str | None = None
    design: str | None = None
    spread: str = "tolerance"
    tolerance: Mapping[str, float] = field(default_factory=dict)
    truth: Mapping[str, float] = field(default_factory=dict)
    noise: Mapping[str, float] = field(default_factory=dict)
    noise_time_s: float = 0.0
    drift: float = 0.0
    tests: int | None = None
    interval_s: float | None = None
    ambient_degC: float | None = None
    reveal: bool = True


@dataclass(frozen=True)
class Synthetic:
    """A simulated campaign and what it was made from.

    Attributes:
        title: of the campaign.
        recordings: labelled `real = false`.
        truth: the document of `truth.json`.
    """

    title: str
    recordings: list[Recording]
    truth: dict[str, Any]

    @property
    def campaign(self) -> Campaign:
        """The recordings as `read_campaign` would return them."""
        return Campaign(self.title, [replace(r) for r in self.recordings], Path(self.title))


def stream(seed: int, *words: str) -> np.random.Generator:
    """Random numbers of their own for each purpose, so that one more test does not change the others."""
    return np.random.default_rng([seed, *(zlib.crc32(word.encode()) for word in words)])
