"""The user's wishes for a simulated campaign, and the resulting campaign."""

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
    """Settings of a simulated campaign. None or empty leaves the choice to the kind.

    Attributes:
        seed: seed of every random number; the same seed gives the same campaign.
        alloy: name or path of the nominal alloy. The default is `krl35` (wire: `niti_wire`), and
            uncharacterised nitinol for a spring of an alloy drawn from its priors.
        design: design of an actuator.
        spread: distance of the truth from the nominal parameters: the `tolerance`, the `prior` of the alloy's
            table (a new alloy), or zero (`none`).
        tolerance: relative standard deviation by parameter, over the kind's own; 0 for exact.
        truth: parameters that are set, not drawn; in the unit of the alloy's table or of the geometry key.
        noise: marginal standard deviation of an instrument by canonical column, over the kind's own; 0 for
            none.
        noise_time_s: correlation time of an instrument's noise [s]; 0 for white noise.
        drift: standard deviation of an instrument's zero at the end of a test, in units of its noise.
        tests: number of intermediate tests (spring), stresses (wire), pulls or runs.
        interval_s: time between recorded samples [s].
        ambient_degC: temperature of the laboratory [degC].
        reveal: true if the files may say from what the truth follows.
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
    """A simulated campaign and its truth.

    Attributes:
        title: title of the campaign.
        recordings: recordings labelled `real = false`.
        truth: content of `truth.json`.
        fractions: true martensite fraction of a spring in every row, by recording; no file has it.
    """

    title: str
    recordings: list[Recording]
    truth: dict[str, Any]
    fractions: dict[str, np.ndarray] = field(default_factory=dict)

    @property
    def campaign(self) -> Campaign:
        """The recordings as `read_campaign` would return them."""
        return Campaign(self.title, [replace(r) for r in self.recordings], Path(self.title))


def stream(seed: int, *words: str) -> np.random.Generator:
    """Random numbers for one purpose. A separate stream for each keeps them unchanged when a test is
    added."""
    return np.random.default_rng([seed, *(zlib.crc32(word.encode()) for word in words)])
