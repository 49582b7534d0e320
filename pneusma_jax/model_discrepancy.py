"""A smooth function of one driver for a misfit that no named effect explains. It is added to one output or to
the stiffness of the silicone.

It describes and does not explain, so it is none of the catalogue: nothing tries it as a candidate. Beyond the
range of its driver it is unknown; there it is held at its end value, and the rows say so.
"""

from typing import Any, ClassVar

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .pipeline import TOLD, Effect, Known

EDGE = 0.01
"""Maximum distance of an unmarked row from the knots, as a share of the driver's range: averaged rows were
fitted."""
STRAINS = ("strain", "strain_rate", "max_strain")
UNITS = {
    "pressure": "Pa",
    "pressure_rate": "Pa/s",
    "curvature": "1/m",
    "bend_angle": "rad",
    "length": "m",
    "current": "A",
    "xi0": "1",
    "strain": "1",
    "strain_rate": "1/s",
    "max_strain": "1",
    "temperature": "degC",
    "force": "N",
    "resistance": "ohm",
    "stress": "Pa",
    "time": "s",
    "silicone_stiffness": "1",
}
"""SI units of drivers and of what is corrected; of `xi0_2` that of `xi0`."""
NUMBERED = ("current", "xi0", "resistance")
"""Quantities that each spring of an actuator has; their names may end in its number."""
CHANNELS = ("unmodelled_", "beyond_")
"""Prefixes of the channels that hold what was added, and the rows in which that is not known."""
WALL = "silicone_stiffness"
"""Quantity of a correction of the silicone's stiffness, which is its relative change."""
STIFFEST, SOFTEST = 10.0, 0.1
"""Factors on it that no correction exceeds."""


def unit_of(name: str) -> str | None:
    """SI unit of a driver or an output, None if there is no such one."""
    stem, _, number = name.rpartition("_")
    return UNITS.get(stem if stem in NUMBERED and number in ("1", "2", "3") else name)


class Unmodelled(Effect):
    """A piecewise linear function of one driver, added to one output.

    Channels of a simulation get two more. `unmodelled_<quantity>` is the added correction [unit of the
    quantity]. `beyond_<quantity>` is 1 in rows where the driver is unknown or outside the knots, else 0.

    Attributes:
        knots: knots of the driver, ascending, SI.
        values: added at each knot, SI; held beyond the first and the last one.
        element: kind of specimen in which it was seen: `actuator`, `spring`, `wire` or `silicone`. It does
            not act in others.
        quantity: output that it adds to.
        driver: quantity that the correction is a function of: `strain`, `strain_rate`, `pressure`, `xi0_2`,
            `time`, ...
    """

    knots: Float[Array, "knots"] = eqx.field(converter=jnp.asarray)
    values: Float[Array, "knots"] = eqx.field(converter=jnp.asarray)
    element: str = eqx.field(static=True)
    quantity: str = eqx.field(static=True)
    driver: str = eqx.field(static=True)

    slug: ClassVar[str] = "unmodelled"
    sentence: ClassVar[str] = "What is left, by what it goes with; no effect that is known explains it."

    @property
    def _told(self) -> str:
        return f"{TOLD}{self.driver}"

    def outputs(self, value: dict[str, Array], at: Known, memory: Any) -> dict[str, Array]:
        """See `Effect.outputs`; hands the driver's value on, because a rate needs the neighbouring rows."""
        if not self._acts(value, at):
            return value
        return value | {self._told: self._driver(at)}

    def recorded(self, value: dict[str, Array], time: Array) -> dict[str, Array]:
        """See `Effect.recorded`."""
        if self._told not in value:
            return value
        driver = self._course(value[self._told], time)
        known = jnp.isfinite(driver)
        x = jnp.where(known, driver, self.knots[0])
        added = self._at(driver)
        edge = EDGE * (self.knots[-1] - self.knots[0])
        outside = ~known | (x < self.knots[0] - edge) | (x > self.knots[-1] + edge)
        sums, marks = f"unmodelled_{self.quantity}", f"beyond_{self.quantity}"
        before, marked = value.get(sums, 0.0), value.get(marks, 0.0)
        return (
            value
            | self._changed(value, added)
            | {
                sums: before + added,
                marks: jnp.maximum(marked, outside.astype(float)),
            }
        )

    def _changed(self, value: dict[str, Array], added: Array) -> dict[str, Array]:
        return {self.quantity: value[self.quantity] + added}

    def _acts(self, value: dict[str, Array], at: Known) -> bool:
        return self.quantity in value and self.element in at

    def _at(self, driver: Array) -> Array:
        """Correction at values of the driver; zero where the driver is not known."""
        known = jnp.isfinite(driver)
        x = jnp.where(known, driver, self.knots[0])
        return jnp.where(known, jnp.interp(x, self.knots, self.values), 0.0)

    def _driver(self, at: Known) -> Array:
        """Value of one row, of which `_course` makes a rate or a largest one; NaN if it is not known."""
        name, unknown = self.driver, jnp.asarray(jnp.nan)
        stem, _, number = name.rpartition("_")
        if name in ("time", "temperature"):
            return at[name] if name in at else unknown
        if name in ("pressure", "pressure_rate"):
            return at["recorded_pressure"] if "recorded_pressure" in at else unknown
        if name in STRAINS:
            return self._strain(at)
        if stem == "current":
            return (at["currents"] if "currents" in at else {}).get(int(number), unknown)
        solved = at["solved"]  # which a slot before the row is solved does not know
        if stem == "xi0":
            found = dict(zip(at["actuator"].spring_numbers, solved.springs, strict=True))
            return found[int(number)].xi0 if int(number) in found else unknown
        return getattr(solved, name, unknown)

    def _strain(self, at: Known) -> Array:
        if "recorded_strain" in at:
            return at["recorded_strain"]
        solved = at["solved"]
        return solved.length / at["actuator"].length - 1.0 if "actuator" in at else solved.gamma

    def _course(self, values: Array, time: Array) -> Array:
        """The driver in all rows, as a diagnosis reads it."""
        if self.driver.startswith("max_"):
            return jax.lax.cummax(jnp.where(jnp.isfinite(values), values, -jnp.inf))
        if not self.driver.endswith("_rate"):
            return values
        if values.shape[0] < 2:
            return jnp.zeros_like(values)  # a single state is at rest
        return jnp.asarray(jnp.gradient(values)) / jnp.maximum(jnp.gradient(time), 1e-9)


class SoftenedWall(Unmodelled):
    """A relative change of the silicone's stiffness that is a piecewise linear function of one driver.

    Corrections are to first order in the measured quantity. A coupon's stress is proportional to the
    stiffness; the shape of a tube or an actuator is inversely proportional to it.
    """

    def wall(self, value: Array, at: Known, memory: Any) -> Array:
        """See `Effect.wall`."""
        if self.element not in at:
            return value
        change = self._at(self._driver(at))
        softer = 1.0 / jnp.maximum(1.0 - change, 1.0 / STIFFEST)
        factor = 1.0 + change if self.element == "silicone" else softer
        return value * jnp.clip(factor, SOFTEST, STIFFEST)

    def _acts(self, value: dict[str, Array], at: Known) -> bool:
        return self.element in at

    def _changed(self, value: dict[str, Array], added: Array) -> dict[str, Array]:
        return {}


def unmodelled(knots: Array, values: Array, element: str, quantity: str, driver: str) -> Unmodelled:
    """The effect of a model discrepancy; see `Unmodelled` for the arguments."""
    return (SoftenedWall if quantity == WALL else Unmodelled)(knots, values, element, quantity, driver)
