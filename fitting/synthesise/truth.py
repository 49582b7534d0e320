"""True parameters of a simulated specimen: drawn about the nominal ones, or set by name."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from fitting.data.recordings import schema
from pneusma_jax.calibration import Calibration
from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import TEMPERATURE_DIFFERENCE, from_si, to_si

from .wishes import Wishes, stream

LARGEST = 4.0  # Number of standard deviations at which a draw is truncated, as in the format
COMMON = 0.9  # Correlation of both phases' moduli; most of their scatter is the specimen's
PARTNER = {"G_a": "G_m", "E_a": "E_m"}
MOST_TRIES = 200  # Maximum number of draws until an alloy is possible
DIGITS = 6  # Number of significant digits of a drawn number


class Truth:
    """Draws the true parameters of specimens and records them.

    Attributes:
        tolerance: relative standard deviation by name, complete, for the sidecars.
        record: drawn values, for `truth.json`.
    """

    def __init__(self, wishes: Wishes, tolerance: Mapping[str, float]) -> None:
        """Take the kind's own tolerances, by the format's keys, overridden by the user's wishes.

        Raises:
            InputError: for a tolerance of something that the format does not know.
        """
        for name in wishes.tolerance:
            if name not in schema.tolerance_keys():
                raise InputError(
                    f"--tolerance {name}: no such parameter, {nearest(name, schema.tolerance_keys())}"
                )
        self.wishes = wishes
        if wishes.spread == "prior":  # an unknown alloy: its constants have no tolerance
            tolerance = {k: v for k, v in tolerance.items() if k not in schema.ALLOY_PARAMETERS}
        self.tolerance = {k: v for k, v in {**tolerance, **wishes.tolerance}.items() if v > 0.0}
        self.record: dict[str, Any] = {}
        self._known: set[str] = set()

    def alloy(
        self, table: Calibration, names: list[str], possible: Callable[[dict[str, float]], bool]
    ) -> dict[str, float]:
        """True constants of an alloy, SI.

        Args:
            table: nominal values, units and priors.
            names: constants to draw.
            possible: function that is true if an alloy with these constants (SI) can exist; others are drawn
                again.

        Raises:
            InputError: if no possible alloy is found near the nominal one.
        """
        for attempt in range(MOST_TRIES):
            values = {name: self._constant(table, name, attempt) for name in names}
            if possible(values):
                break
        else:
            raise InputError(
                f"{table.name}: no alloy near these numbers has stress that rises with strain and phases that"
                " differ in resistance; ask for less --tolerance or other --truth"
            )
        units = {name: table.quantities[name].unit for name in names}
        self.record["alloy"] = table.name
        self.record["parameters"] = {
            name: {
                "value": _file_unit(values[name], name, units[name]),
                "nominal": _file_unit(table.quantities[name].value, name, units[name]),
                "unit": units[name],
            }
            for name in names
        }
        return values

    def _constant(self, table: Calibration, name: str, attempt: int) -> float:
        """True value of one constant of an alloy, SI: as the user sets it, or drawn."""
        quantity = table.quantities[name]
        difference = _is_difference(name)
        self._known.add(name)
        if name in self.wishes.truth:
            return to_si(self.wishes.truth[name], quantity.unit, difference)
        prior, mean = quantity.prior, quantity.value
        if self.wishes.spread != "prior":
            drawn = self._draw(name, mean, self.tolerance.get(name, 0.0) * abs(mean), attempt)
        elif prior is None:
            drawn = mean
        else:
            drawn = self._draw(name, prior.mean, prior.sd, attempt, prior.min, prior.max)
        shown = from_si(drawn, quantity.unit, difference)
        return to_si(_neat(shown) if drawn != quantity.value else shown, quantity.unit, difference)

    def geometry(self, nominal: dict[str, Any], specimen: str = "") -> dict[str, Any]:
        """True dimensions of a specimen by canonical key; words stay unchanged."""
        self._known |= nominal.keys() & schema.GEOMETRY_NUMBERS.keys()
        true = dict(nominal)
        for key, value in nominal.items():
            if key in self.wishes.truth:
                true[key] = self.wishes.truth[key]
            elif key in self.tolerance and key in schema.GEOMETRY_NUMBERS:
                true[key] = _neat(self._draw(specimen + key, value, self.tolerance[key] * value))
        numbers = [key for key in nominal if key in schema.GEOMETRY_NUMBERS]
        pairs = {key: {"value": true[key], "nominal": nominal[key]} for key in numbers}
        self._record_of(specimen)["geometry"] = pairs
        return true

    def factor(self, name: str, specimen: str = "") -> float:
        """True factor on a nominal quantity, such as `silicone_stiffness`; each specimen has its own."""
        self._known.add(name)
        if name in self.wishes.truth:
            value = float(self.wishes.truth[name])
        else:
            value = _neat(self._draw(specimen + name, 1.0, self.tolerance.get(name, 0.0)))
        self._record_of(specimen)[name] = {"value": value, "nominal": 1.0}
        return value

    def _record_of(self, specimen: str) -> dict[str, Any]:
        """Part of the record about one specimen; the whole record without a name."""
        return self.record.setdefault("specimens", {}).setdefault(specimen, {}) if specimen else self.record

    def _draw(
        self, name: str, mean: float, sd: float, attempt: int = 0, low: float = -math.inf, high=math.inf
    ) -> float:
        """A normal number within bounds and `LARGEST` standard deviations, in the unit of its mean.

        Drawn by tolerance, the moduli of both phases of one specimen are correlated by `COMMON`.

        Args:
            name: name of the number; equal names of one attempt draw the same.
            mean, sd: of the distribution.
            attempt: number of earlier draws that were impossible.
            low, high: bounds.
        """
        if sd == 0.0 or self.wishes.spread == "none":
            return mean
        random = stream(self.wishes.seed, "truth", name, str(attempt))
        common = stream(self.wishes.seed, "truth", PARTNER.get(name, name), str(attempt))
        partner = PARTNER.get(name) is not None and self.wishes.spread == "tolerance"
        while True:
            z = random.standard_normal()
            if partner:
                z = COMMON * common.standard_normal() + math.sqrt(1.0 - COMMON**2) * z
            if abs(z) <= LARGEST and low <= mean + sd * z <= high:
                return mean + sd * z

    def finish(self) -> None:
        """Refuse truths that no recording used.

        Raises:
            InputError: if a name of `--truth` is none of this campaign's.
        """
        for name in self.wishes.truth:
            if name not in self._known:
                raise InputError(
                    f"--truth {name}: this campaign has no such number, {nearest(name, sorted(self._known))}"
                )


def _is_difference(name: str) -> bool:
    return QUANTITIES["alloy"].get(name) == TEMPERATURE_DIFFERENCE


def _file_unit(value: float, name: str, unit: str) -> float:
    return float(f"{from_si(value, unit, _is_difference(name)):.12g}")


def _neat(value: float) -> float:
    """A drawn number with few digits, so that the file holds exactly the truth."""
    return float(f"{value:.{DIGITS}g}")
