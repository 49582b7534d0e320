"""The table `[uncertainty]` of a study."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pneusma_jax.calibration.keys import QUANTITIES
from pneusma_jax.documents import check_keys, finite_number
from pneusma_jax.errors import InputError, nearest
from pneusma_jax.units import to_si

from . import fields
from .bodies import Plan
from .study import Tolerance, Uncertainty

KEYS = (
    "objective", "constraints", "k", "level", "draws", "fresh_draws", "posterior", "fresh_posterior",
    "posterior_specimen", "priors", "tolerance",
)  # fmt: skip
OBJECTIVE = ("mean", "mean_plus_sigma", "cvar")
CONSTRAINTS = ("mean", "cvar", "counted")
KINDS = ("alloy", "silicone")


def read_uncertainty(table: Any, plans: Sequence[Plan], path: Path) -> Uncertainty:
    """Uncertain inputs of a file, and the rule by which their spread counts.

    Raises:
        InputError: one line, for an unknown measure, a level outside of 0 to 1, a tolerance of nothing, a
            file that is not there.
    """
    where = f"{path}: [uncertainty]"
    table = fields.table_of(table, where)
    check_keys(table, KEYS, where)
    priors = fields.names_of(table["priors"], f"{where}: priors") if "priors" in table else ()
    for name in priors:
        if name not in KINDS:
            raise InputError(f"{where}: priors has {name!r}, {nearest(name, KINDS)}")
    k = finite_number(table.get("k", 1.0), f"{where}: k")
    if k < 0.0:
        raise InputError(f"{where}: k must not be negative, but it is {k:g}")
    specimen = None
    if "posterior_specimen" in table:
        specimen = fields.whole(table, "posterior_specimen", 1, 1, 10_000, where)
    for key in ("posterior_specimen", "fresh_posterior"):
        if key in table and "posterior" not in table:
            raise InputError(f"{where}: {key} needs a posterior")
    objective = fields.word(table, "objective", OBJECTIVE, where, "mean")
    constraints = fields.word(table, "constraints", CONSTRAINTS, where, "cvar")
    if "k" in table and objective != "mean_plus_sigma":
        raise InputError(f"{where}: 'k' has no meaning; it is that of objective = \"mean_plus_sigma\"")
    if "level" in table and "cvar" not in (objective, constraints):
        raise InputError(f"{where}: 'level' has no meaning; it is that of \"cvar\", and nothing has it")
    file = lambda key: fields.file_of(table, key, path.parent, where) if key in table else None  # noqa: E731
    return Uncertainty(
        tolerances=_tolerances(table.get("tolerance", {}), plans, where),
        posterior=file("posterior"),
        fresh_posterior=file("fresh_posterior"),
        specimen=specimen,
        priors=priors,
        objective=objective,
        constraints=constraints,
        k=k,
        level=fields.share(table, "level", 0.95, where),
        draws=fields.whole(table, "draws", 64, 2, 4096, where),
        fresh=fields.whole(table, "fresh_draws", 10_000, 100, 1_000_000, where),
    )


def _tolerances(table: Any, plans: Sequence[Plan], where: str) -> tuple[Tolerance, ...]:
    known = set.intersection(*(plan.dimensions() for plan in plans))
    found = []
    for name, entry in fields.table_of(table, f"{where} tolerance").items():
        here = f"{where} tolerance.{name}"
        if name not in known:
            raise InputError(f"{here}: no such dimension of all designs, {nearest(name, known)}")
        entry = fields.table_of(entry, here)
        check_keys(entry, ("sd", "half_width", "unit"), here)
        given = [key for key in ("sd", "half_width") if key in entry]
        if len(given) != 1:
            raise InputError(f"{here}: needs either 'sd' or 'half_width', and not both")
        unit = fields.unit_of(entry, QUANTITIES["actuator"][name], here)
        size = to_si(finite_number(entry[given[0]], f"{here}: {given[0]}"), unit)
        if size <= 0.0:
            raise InputError(f"{here}: {given[0]} must be positive")
        found.append(Tolerance(name, **{given[0]: size}))
    return tuple(found)
