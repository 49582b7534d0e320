"""A campaign before its simulation: test plan, the laboratory's assumptions, and instruments."""

from dataclasses import dataclass, field

import numpy as np


@dataclass
class Take:
    """One planned recording: its drives by name (N,), its clock, its role, and its number of kept rows."""

    name: str
    role: str
    time: np.ndarray
    drive: dict
    rows: int


@dataclass
class Bench:
    """A campaign: `nominal` constants, `tolerance` (relative standard deviation), `noise` (standard deviation
    by column), and the sidecar."""

    kind: str
    recordings: list
    nominal: dict
    tolerance: dict
    noise: dict
    flavour: str
    geometry: dict = field(default_factory=dict)
    specimen: str = "A"
    drives: tuple = ()
    inputs: tuple = ()
    outputs: tuple = ()
    extra: tuple = ()
    noise_stated: bool = True

    @property
    def times(self):
        """Clocks (K, N)."""
        return np.stack([take.time for take in self.recordings])

    @property
    def measured(self):
        """Columns that are written."""
        return self.inputs + self.outputs + self.extra

    @property
    def scored(self):
        """Columns in which the base can be wrong. A measured resistance must be possible for the spring."""
        return self.outputs + ((self.hidden[0],) if self.hidden else ())

    @property
    def hidden(self):
        """Measured resistance and drive of the unmeasured martensite fraction, or None."""
        found = {"spring": ("resistance_ohm", "xi0"), "actuator": ("resistance_2_ohm", "xi0_2")}.get(self.kind)
        return found if found and found[0] in self.measured else None

    def stack(self, name):
        """A drive of all recordings (K, N)."""
        return np.stack([take.drive[name] for take in self.recordings])

    def kept(self):
        """Mask of the kept rows (K, N)."""
        count = np.array([take.rows for take in self.recordings])
        return np.arange(self.times.shape[1]) < count[:, None]

    def fitted(self):
        """Mask of the recordings that may be fitted (K,)."""
        return np.array([take.role == "fit" for take in self.recordings])
