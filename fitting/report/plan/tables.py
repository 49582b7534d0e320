"""Tables of a plan: its tests, and their expected information about each constant."""

from fitting.plan.candidates import HELD
from fitting.plan.plan import Plan, PlannedTest
from fitting.synthesise.controller import rest_resistances
from pneusma_jax.units import from_si

from ..cells import number, percent, with_unit
from ..table import Table

TESTS = (
    "test", "phase", "strains [%]", "peaks [mm]", "speed [mm/s]", "set-point", "repeats", "minutes",
    "gain [nats]",
)  # fmt: skip
CONSTANTS = ("constant", "first guess", "1-sigma before", "expected after", "relative", "published tests")


def test_table(plan: Plan) -> Table:
    """Table of every test, in the order of the protocol."""
    return Table(TESTS, [_row(plan, test) for test in plan.tests])


def _row(plan: Plan, test: PlannedTest) -> list[str]:
    """One test as cells of `TESTS`."""
    candidate = test.candidate
    length = 1e3 * float(plan.spring.geometry.free_length)
    words = ("cold", "full current", "resistance held", "cold, then heated")
    return [
        candidate.name + (" (validation)" if test.role == "validation" else ""),
        words[candidate.hold],
        " ".join(f"{100.0 * s:.0f}" for s in candidate.strains),
        " ".join(f"{length * s:.1f}" for s in candidate.strains),
        f"{speed(plan, test):.2g}",
        f"{candidate.share:.3g} ({setpoint(plan, test):.3f} ohm)" if candidate.hold == HELD else "",
        str(test.repeats),
        f"{test.minutes:.0f}",
        f"{test.gain:.1f}" if test.role == "fit" else "",
    ]


def speed(plan: Plan, test: PlannedTest) -> float:
    """Speed of pulling [mm/s]."""
    return 1e3 * float(plan.spring.geometry.free_length) * test.rate


def setpoint(plan: Plan, test: PlannedTest) -> float:
    """Resistance to hold, for the nominal alloy [ohm]."""
    cold, hot = rest_resistances(plan.spring)
    return hot + test.candidate.share * (cold - hot)


def constant_table(plan: Plan) -> Table:
    """Table of every unknown constant: its uncertainty before and after the tests."""
    rows, relative = [], plan.relative_sd()
    for k, name in enumerate(plan.knowledge.names):
        unit = plan.knowledge.table.quantities[name].unit
        mean = from_si(plan.knowledge.mean[k], unit, difference=True)
        before = from_si(plan.knowledge.sd[k], unit, difference=True)
        cells = [number(x) for x in (mean, before, before * plan.sd[-1, k])]
        published = number(before * plan.published_sd[k])
        rows.append([with_unit(name, unit), *cells, percent(relative[name]), published])
    return Table(CONSTANTS, rows)
