"""Zeros that a fit finds: the strain at which a specimen grew taut, and what the load cell read at no load.

A table `[zero]` of a recording says how far off each may be (one standard deviation). They are nuisance
numbers: the fit estimates them with everything else, so that their doubt is part of every standard error.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from fitting.data.recordings import Recording, schema
from fitting.data.slack import find_slack
from fitting.inference.parameters import Prior
from pneusma_jax.units import to_si

CUT = 4.0
"""Standard deviations at which the prior of a zero ends."""
LONGEST = 0.9
"""Strain that a zero stays within: a specimen that was stretched to nothing has none."""
NEAR, ROWS = 0.01, 2.5
"""Of its range, and in rows, how near to the seen start of the rise a row tells neither slack nor law.

The start is found to a standard deviation of 0.0025 of the range. Without these rows the misfit is smooth.
"""


@dataclass(frozen=True)
class Zeros:
    """What is known of a recording's zeros before a fit.

    Attributes:
        sd: one standard deviation by quantity, SI.
        start: where a fit starts, by quantity, SI; what is seen of slack.
        first: strain of the first row.
        near: strain by which a row is near to the start of the rise.
    """

    sd: dict[str, float]
    start: dict[str, float]
    first: float
    near: float

    def flat(self, strain: np.ndarray) -> np.ndarray:
        """Rows at which the specimen hung slack, or was not touched yet, (n,)."""
        begun = self.start.get("strain", 0.0)
        return ("strain" in self.sd) & (np.sign(begun) * (strain - begun) < -self.near)

    def unsure(self, strain: np.ndarray) -> np.ndarray:
        """Rows of which it cannot be told whether they are, (n,)."""
        return ("strain" in self.sd) & (np.abs(strain - self.start.get("strain", self.first)) <= self.near)

    def prior(self, quantity: str) -> Prior:
        """Gaussian about none, cut at four standard deviations."""
        sd = self.sd[quantity]
        reach = min(CUT * sd, LONGEST) if quantity == "strain" else CUT * sd
        return Prior(0.0, sd, -reach, reach)

    def begin(self, quantity: str) -> float:
        """Value to start from, inside the prior."""
        prior = self.prior(quantity)
        return float(np.clip(self.start.get(quantity, 0.0), 0.99 * prior.min, 0.99 * prior.max))


def zeros_of(recording: Recording) -> Zeros:
    """Zeros of a coupon that its sidecar leaves to the fit; where slack is seen, a fit starts there."""
    sd = {}
    for column, size in recording.zero.items():
        quantity, unit = schema.quantity_and_unit(column)
        sd[quantity] = float(to_si(size, unit))
    strain = recording.si("strain")
    known = strain[np.isfinite(strain)]
    moves = np.abs(np.diff(known))
    usual = float(np.median(moves[moves > 0.0])) if moves.any() else 0.0
    near = max(NEAR * float(np.ptp(known)), ROWS * usual)
    slack = find_slack(strain, recording.si("stress")) if sd else None
    start = {"strain": slack.start, "stress": slack.zero} if slack else {}
    return Zeros(sd, start, float(known[0]), near)


def offered(recordings: Sequence[Recording]) -> list[str]:
    """Where a coupon hung slack and no zero of it is asked for: what `[zero]` would find, a sentence each."""
    found = []
    for recording in recordings:
        if recording.kind not in schema.with_zeros() or recording.zero:
            continue
        slack = find_slack(recording.columns["strain"], recording.columns["stress_kPa"])
        if slack:
            start, zero = 2.0 * abs(slack.start), max(2.0 * abs(slack.zero), 0.1)
            found.append(
                f"{recording.name}: stress is flat at {slack.zero:.3g} kPa up to strain {slack.start:.3g}, "
                "as of a specimen that hung slack; fits take that for its law. A table [zero] in the sidecar "
                f"(strain = {start:.2g}, stress_kPa = {zero:.2g}) lets them find both zeros"
            )
    return found


def taut(
    strain: Float[Array, " n"], zero: Float[Array, "..."], flat: Bool[Array, " n"]
) -> Float[Array, " n"]:
    """Strain of a specimen whose length at rest is that of a reading, `(strain - zero) / (1 + zero)`.

    Args:
        strain: as it was read.
        zero: reading at which the specimen is neither slack nor strained.
        flat: rows at which it hung slack: no strain.
    """
    return jnp.where(flat, 0.0, (strain - zero) / (1.0 + zero))
