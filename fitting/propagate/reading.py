"""Reading a study from TOML, with every check that needs no model. `docs/propagate.md` shows the format."""

import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Any

from pneusma_jax.calibration.keys import KINDS
from pneusma_jax.documents import check_keys, finite_number, read_document, shipped_names, word_of
from pneusma_jax.errors import InputError
from pneusma_jax.units import UNITS, suggested_unit

from .quantities import REDUCTIONS, Limit, Quantity
from .sampling import METHODS
from .study import LEAST_CHUNK, MOST_CHUNK, MOST_ROWS, Indices, Rare, Sampling, Study, Vary

SCHEMA = "pneusma-study/1"
TOP = (
    "schema", "name", "description", "model", "vary", "input", "correlation", "output", "limit", "sampling",
    "indices", "rare", "noise",
)  # fmt: skip
THROUGH = ("state", "workspace", "protocol", "recording", "chain", "closed_loop", "expression")
METHODS_OF_RARE = ("subset", "form")
_EXAMPLES = resources.files("calibration_data").joinpath("examples", "studies")


def study_examples() -> list[str]:
    """Names of the studies that come with the package, sorted."""
    return shipped_names(_EXAMPLES)


def read_study(path: str | Path) -> Study:
    """Read and check a study.

    Args:
        path: path of a file, or the name of a study that comes with the package.

    Raises:
        InputError: one line with file, table, key and what would be right.
    """
    shipped = str(path) in study_examples()
    place = _EXAMPLES.joinpath(f"{path}.toml") if shipped else Path(path)
    path = Path("calibration_data", "examples", "studies", f"{path}.toml") if shipped else Path(path)
    document = read_document(place, path, "a study", SCHEMA, TOP)
    model = _table(document, "model", path)
    if "through" not in model:
        raise InputError(f"{path}: [model] needs through, one of {', '.join(THROUGH)}")
    word_of(model["through"], THROUGH, f"{path}: [model] through")
    inputs = _table(document, "input", path)
    for name, entry in inputs.items():
        if not isinstance(entry, dict):
            raise InputError(
                f"{path}: [input.{name}] must be a table with a distribution, but it is {entry!r}"
            )
    vary = _vary(_table(document, "vary", path), path)
    noise = _noise(_table(document, "noise", path), path)
    if not (inputs or vary.priors or vary.posterior or vary.tolerance or noise):
        raise InputError(
            f"{path}: nothing varies: add a table [input.NAME], or [vary] with priors, tolerance or"
            " posterior, or [noise]"
        )
    indices = document.get("indices")
    rare = document.get("rare")
    return Study(
        path=path,
        name=_text(document, "name", path.stem, path),
        description=_text(document, "description", "", path),
        model=model,
        vary=vary,
        inputs=inputs,
        correlations=_correlations(document, path),
        outputs=tuple(_output(entry, k, path) for k, entry in _entries(document, "output", path)),
        limits=_limits(document, path),
        sampling=_sampling(_table(document, "sampling", path), path),
        indices=None if indices is None else _indices(_table(document, "indices", path), path),
        rare=None if rare is None else _rare(_table(document, "rare", path), path),
        noise=noise,
    )


def _table(document: Mapping[str, Any], key: str, path: Path) -> dict[str, Any]:
    entry = document.get(key, {})
    if not isinstance(entry, dict):
        raise InputError(f"{path}: {key} must be a table, [{key}], but it is {entry!r}")
    return entry


def _entries(document: Mapping[str, Any], key: str, path: Path) -> list[tuple[int, dict[str, Any]]]:
    entries = document.get(key, [])
    if not isinstance(entries, list) or not all(isinstance(entry, dict) for entry in entries):
        raise InputError(f"{path}: {key} must be tables [[{key}]], with two brackets")
    return list(enumerate(entries, 1))


def _text(document: Mapping[str, Any], key: str, usual: str, path: Path) -> str:
    entry = document.get(key, usual)
    if not isinstance(entry, str):
        raise InputError(f"{path}: {key} must be text, but it is {entry!r}")
    return entry


def number_in(table: Mapping[str, Any], key: str, where: str, usual: float | None = None) -> float:
    """A finite number of a table.

    Raises:
        InputError: if it is missing and there is no usual one, or is none.
    """
    entry = table.get(key, usual)
    if entry is None:
        raise InputError(f"{where}: {key} is missing")
    return finite_number(entry, f"{where}: {key}")


def _whole(table: Mapping[str, Any], key: str, usual: int, least: int, most: int, where: str) -> int:
    """A whole number; `1e6` is one, too."""
    value = number_in(table, key, where, usual)
    if value != int(value) or not least <= value <= most:
        raise InputError(f"{where}: {key} = {table[key]!r} must be a whole number from {least:,} to {most:,}")
    return int(value)


def _names(table: Mapping[str, Any], key: str, where: str) -> tuple[str, ...]:
    entry = table.get(key, [])
    if not isinstance(entry, list) or not all(isinstance(name, str) for name in entry):
        raise InputError(f"{where}: {key} must be a list of names, but it is {entry!r}")
    return tuple(entry)


def _vary(table: Mapping[str, Any], path: Path) -> Vary:
    where = f"{path}: [vary]"
    known_keys = ("priors", "leave_out", "posterior", "posterior_as", "posterior_specimen", "tolerance")
    check_keys(table, known_keys, where)
    known = (*KINDS, "recording", "effect")
    priors = table.get("priors", False)
    if isinstance(priors, bool):
        kinds = known if priors else ()
    else:
        kinds = _names(table, "priors", where)
        for kind in kinds:
            word_of(kind, known, f"{where} priors")
    posterior = table.get("posterior")
    if posterior is not None and not isinstance(posterior, str):
        raise InputError(f"{where}: posterior must be the folder of a posterior, but it is {posterior!r}")
    how = word_of(table.get("posterior_as", "draws"), ("draws", "copula"), f"{where} posterior_as")
    for key in ("posterior_as", "posterior_specimen"):
        if key in table and posterior is None:
            raise InputError(f"{where}: {key} says how a posterior is taken, but no posterior is named")
    specimen = None
    if "posterior_specimen" in table:
        specimen = _whole(table, "posterior_specimen", 1, 1, 10_000, where)
    tolerance = table.get("tolerance", {})
    if not isinstance(tolerance, dict):
        raise InputError(f"{where}: tolerance must be a table, such as {{wall_thickness = 0.03}}")
    relative = {}
    for name in tolerance:
        relative[name] = number_in(tolerance, name, f"{where} tolerance")
        if not 0.0 < relative[name] < 1.0:
            raise InputError(f"{where} tolerance: {name} = {relative[name]:g} is relative: 3 percent is 0.03")
    left_out = _names(table, "leave_out", where)
    return Vary(kinds, left_out, posterior, how, specimen, relative)


def _noise(table: Mapping[str, Any], path: Path) -> dict[str, float]:
    where = f"{path}: [noise]"
    found = {name: number_in(table, name, where) for name in table}
    for name, sd in found.items():
        if sd <= 0.0:
            raise InputError(f"{where}: {name} = {sd:g} is a standard deviation, so more than 0")
    return found


def _correlations(document: Mapping[str, Any], path: Path) -> tuple[tuple[str, str, float], ...]:
    found = tuple(_correlation(entry, k, path) for k, entry in _entries(document, "correlation", path))
    pairs = [{first, second} for first, second, _ in found]
    for number, pair in enumerate(pairs, 1):
        if pairs.index(pair) + 1 < number:
            raise InputError(
                f"{path}: [[correlation]] {number}: {' and '.join(sorted(pair))} have a correlation already, "
                f"in [[correlation]] {pairs.index(pair) + 1}; keep one"
            )
    return found


def _correlation(entry: Mapping[str, Any], number: int, path: Path) -> tuple[str, str, float]:
    where = f"{path}: [[correlation]] {number}"
    check_keys(entry, ("between", "value"), where)
    pair = _names(entry, "between", where)
    if len(pair) != 2 or pair[0] == pair[1]:
        raise InputError(f"{where}: between must name two inputs, but it is {entry.get('between')!r}")
    value = number_in(entry, "value", where)
    if not -1.0 < value < 1.0:
        raise InputError(f"{where}: value = {value:g} must be a correlation between -1 and 1, both excluded")
    return pair[0], pair[1], value


def _output(entry: Mapping[str, Any], number: int, path: Path) -> Quantity:
    where = f"{path}: [[output]] {number}"
    check_keys(entry, ("name", "of", "unit", "reduce", "at", "noise"), where)
    name = entry.get("name", entry.get("of"))
    if not isinstance(name, str) or not name:
        raise InputError(f"{where}: name is missing, such as 'curvature_1pm'")
    if not name.isprintable():
        raise InputError(f"{where}: name {name!r} must be one line without control characters")
    expression = entry.get("of", name)
    if not isinstance(expression, str):
        raise InputError(
            f"{where}: of must be an expression of the model's outputs, but it is {expression!r}"
        )
    reduce: str | float | None = None
    if "reduce" in entry and "at" in entry:
        raise InputError(f"{where}: 'reduce' and 'at' both make one number of a course; keep one")
    if "reduce" in entry:
        reduce = word_of(entry["reduce"], REDUCTIONS, f"{where} reduce")
    if "at" in entry:
        reduce = number_in(entry, "at", where)
    noise = number_in(entry, "noise", where, 0.0)
    if noise < 0.0:
        raise InputError(f"{where}: noise = {noise:g} is a standard deviation, so 0 or more")
    return Quantity(name, expression, reduce, noise, _stated_unit(entry, where))


def _stated_unit(entry: Mapping[str, Any], where: str) -> str:
    """Unit that an output states; empty for none."""
    unit = entry.get("unit", "")
    if not isinstance(unit, str) or (unit and unit not in UNITS):
        raise InputError(f"{where}: unknown unit {unit!r}, {suggested_unit(str(unit))}")
    return unit


def _limits(document: Mapping[str, Any], path: Path) -> tuple[Limit, ...]:
    """All limits. Results are by a limit's words, so no two may read the same."""
    found = tuple(_limit(entry, k, path) for k, entry in _entries(document, "limit", path))
    words = [limit.words for limit in found]
    for number, word in enumerate(words, 1):
        if words.index(word) + 1 < number:
            raise InputError(
                f"{path}: [[limit]] {number} is [[limit]] {words.index(word) + 1} again ({word}); keep one"
            )
    return found


def _limit(entry: Mapping[str, Any], number: int, path: Path) -> Limit:
    where = f"{path}: [[limit]] {number}"
    check_keys(entry, ("on", "above", "below"), where)
    if not isinstance(entry.get("on"), str):
        raise InputError(f"{where}: on must name an output, but it is {entry.get('on')!r}")
    if "above" not in entry and "below" not in entry:
        raise InputError(f"{where}: say 'above' or 'below' which value {entry['on']!r} fails")
    above = number_in(entry, "above", where) if "above" in entry else math.inf
    below = number_in(entry, "below", where) if "below" in entry else -math.inf
    if below >= above:
        raise InputError(f"{where}: below = {below:g} and above = {above:g} leave nothing that does not fail")
    return Limit(entry["on"], above, below)


def _sampling(table: Mapping[str, Any], path: Path) -> Sampling:
    where, usual = f"{path}: [sampling]", Sampling()
    check_keys(table, ("method", "rows", "chunk", "seed", "keep"), where)
    return Sampling(
        method=word_of(table.get("method", usual.method), METHODS, f"{where} method"),
        rows=_whole(table, "rows", usual.rows, 1, MOST_ROWS, where),
        chunk=_whole(table, "chunk", usual.chunk, LEAST_CHUNK, MOST_CHUNK, where),
        seed=_whole(table, "seed", usual.seed, 0, 2**63 - 1, where),
        keep=word_of(table.get("keep", usual.keep), ("outputs", "summary"), f"{where} keep"),
    )


def _indices(table: Mapping[str, Any], path: Path) -> Indices:
    where = f"{path}: [indices]"
    check_keys(table, ("kind", "of", "groups"), where)
    groups = table.get("groups", {})
    if not isinstance(groups, dict) or not all(name.isprintable() for name in groups):
        raise InputError(f"{where}: groups must be a table, such as {{springs = ['wire_diameter']}}")
    of = _names(table, "of", where)
    for name in of:
        if of.count(name) > 1:
            raise InputError(f"{where} of: {name!r} is named twice; keep one")
    return Indices(
        kind=word_of(table.get("kind", "sobol"), ("sobol", "shapley"), f"{where} kind"),
        of=of,
        groups={name: _names(groups, name, f"{where} groups") for name in groups},
    )


def _rare(table: Mapping[str, Any], path: Path) -> Rare:
    where, usual = f"{path}: [rare]", Rare()
    check_keys(table, ("methods", "samples", "runs", "starts"), where)
    methods = _names(table, "methods", where) or usual.methods
    for method in methods:
        word_of(method, METHODS_OF_RARE, f"{where} methods")
    return Rare(
        methods=methods,
        samples=_whole(table, "samples", usual.samples, 100, 1_000_000, where),
        runs=_whole(table, "runs", usual.runs, 2, 1000, where),
        starts=_whole(table, "starts", usual.starts, 1, 1000, where),
    )
