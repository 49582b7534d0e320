"""Zeros that a fit finds: the strain at which a specimen becomes taut, and the load cell's reading at no
load.

A table `[zero]` of a recording states the standard deviation of each. They are nuisance parameters: the fit
estimates them with everything else, so that their uncertainty is part of every standard error.
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
"""Number of standard deviations at which the prior of a zero is truncated."""
LONGEST = 0.9
"""Maximum magnitude of a strain zero [1]; beyond it the specimen would have no length."""
NEAR, ROWS = 0.01, 2.5
"""Maximum distance of an uninformative row from the estimated start of the rise, as part of the range and in
rows.

The start is estimated to a standard deviation of 0.0025 of the range. Without these rows the misfit is
smooth.
"""


@dataclass(frozen=True)
class Zeros:
    """Prior knowledge of a recording's zeros.

    Attributes:
        sd: standard deviation by quantity, SI.
        start: start values of a fit by quantity, SI, from the slack in the data.
        first: strain of the first row [1].
        near: maximum distance in strain of a row that is near the start of the rise [1].
    """

    sd: dict[str, float]
    start: dict[str, float]
    first: float
    near: float

    def flat(self, strain: np.ndarray) -> np.ndarray:
        """Mask of the rows at which the specimen hung slack, or was not touched yet, shape (n,)."""
        begun = self.start.get("strain", 0.0)
        return ("strain" in self.sd) & (np.sign(begun) * (strain - begun) < -self.near)

    def unsure(self, strain: np.ndarray) -> np.ndarray:
        """Mask of the rows that cannot be assigned to slack or rise, shape (n,)."""
        return ("strain" in self.sd) & (np.abs(strain - self.start.get("strain", self.first)) <= self.near)

    def prior(self, quantity: str) -> Prior:
        """Gaussian prior about zero, truncated at four standard deviations."""
        sd = self.sd[quantity]
        reach = min(CUT * sd, LONGEST) if quantity == "strain" else CUT * sd
        return Prior(0.0, sd, -reach, reach)

    def begin(self, quantity: str) -> float:
        """Start value inside the prior."""
        prior = self.prior(quantity)
        return float(np.clip(self.start.get(quantity, 0.0), 0.99 * prior.min, 0.99 * prior.max))


def zeros_of(recording: Recording) -> Zeros:
    """Zeros of a coupon that its sidecar leaves to the fit. Where slack is seen in the data, a fit starts
    there."""
    sd = {}
    for column, size in recording.zero.items():
        quantity, unit = schema.quantity_and_unit(column)
        sd[quantity] = float(to_si(size, unit))
    strain = recording.si("strain")
    finite = strain[np.isfinite(strain)]
    moves = np.abs(np.diff(finite))
    usual = float(np.median(moves[moves > 0.0])) if moves.any() else 0.0
    near = max(NEAR * float(np.ptp(finite)), ROWS * usual)
    slack = find_slack(strain, recording.si("stress")) if sd else None
    start = {"strain": slack.start, "stress": slack.zero} if slack else {}
    return Zeros(sd, start, float(finite[0]), near)


def offered(recordings: Sequence[Recording]) -> list[str]:
    """Sentences that offer `[zero]` where a coupon hung slack and no zero of it is fitted."""
    found = []
    for recording in recordings:
        if recording.kind not in schema.with_zeros() or recording.zero:
            continue
        slack = find_slack(recording.columns["strain"], recording.columns["stress_kPa"])
        if slack:
            start, zero = 2.0 * abs(slack.start), max(2.0 * abs(slack.zero), 0.1)
            found.append(
                f"{recording.name}: stress is flat at {slack.zero:.3g} kPa up to strain {slack.start:.3g}, "
                "as of a specimen that hung slack. Fits take that for its law. A table [zero] in the sidecar "
                f"(strain = {start:.2g}, stress_kPa = {zero:.2g}) lets them find both zeros"
            )
    return found


def strain_from_taut(
    strain: Float[Array, " n"], zero: Float[Array, "..."], flat: Bool[Array, " n"]
) -> Float[Array, " n"]:
    """Strain from the length at which a specimen is taut, `(strain - zero) / (1 + zero)` [1].

    Args:
        strain: strain as read [1].
        zero: reading at which the specimen is neither slack nor strained [1].
        flat: mask of the rows at which it hung slack; their strain is zero.
    """
    return jnp.where(flat, 0.0, (strain - zero) / (1.0 + zero))
