"""A study with its model: everything that computes rows, made once in each process."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path

import numpy as np

from fitting.engine import Task
from pneusma_jax.documents import parse_toml, read_text
from pneusma_jax.errors import InputError, distrusted, nearest

from .evaluate import Evaluator
from .inputs import Inputs
from .inputs_of import POSTERIOR_FILE, inputs_of, plain_marginals, read_draws
from .quantities import Columns, check_quantities, row_function, without_unit
from .responses import Response
from .responses_of import response_of
from .sampling import MOST_POINTS, Design, Plain, Saltelli, Sampler, Shapley
from .statistics.indices import REPLICATES
from .study import Study, fingerprint

MOST_SUMS = 50_000_000
"""Numbers that the bootstrap of a chunk sums up (400 MB): groups times columns times replicates."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A study that can be computed.

    Attributes:
        study: the study as read.
        response: the model.
        inputs: the varied inputs.
        columns: the requested quantities.
        design: rule that makes rows from points.
        groups: inputs by group, for indices.
        notices: notices for the reader.
    """

    study: Study
    response: Response
    inputs: Inputs
    columns: Columns
    design: Design
    groups: dict[str, tuple[int, ...]]
    notices: tuple[str, ...]

    @property
    def chunk_points(self) -> int:
        """Base points of a whole chunk."""
        return max(1, self.study.sampling.chunk // self.design.block)

    @property
    def points(self) -> int:
        """Base points in all; whole blocks that hold at least the rows that are wanted."""
        return -(-self.study.sampling.rows // self.design.block)

    @property
    def rows(self) -> int:
        """Rows in all."""
        return self.points * self.design.block

    @cached_property
    def tasks(self) -> list[Task]:
        """A file for each chunk, named by its index and its number of points."""
        size, found = self.chunk_points, []
        for index in range(-(-self.points // size)):
            count = min(size, self.points - index * size)
            found.append(Task(f"chunk-{index:07d}-{count}.h5", count * self.design.block))
        return found

    def sampler(self) -> Sampler:
        """Sampler of base points."""
        sampling = self.study.sampling
        return Sampler(sampling.method, self.design.dimension, sampling.seed, self.chunk_points)

    @cached_property
    def evaluator(self) -> Evaluator:
        """Rows through the compiled model."""
        row = row_function(self.response, self.columns, self.inputs.value_names)
        known = {name: prior.value for name, prior in self.response.variables.items()}
        return Evaluator(row, self.response.batch_size, identity=f"{self.fingerprint}|{known!r}")

    @cached_property
    def nominal(self) -> np.ndarray:
        """Columns at the nominal values, shape (columns,); NaN where the model has no result there."""
        values = np.array([[self.response.variables[name].value for name in self.inputs.value_names]])
        return self.evaluator(values)[0][0]

    @cached_property
    def centre(self) -> np.ndarray:
        """Centre of the sums, so that they keep their digits: the nominal columns, else 0."""
        return np.nan_to_num(self.nominal, nan=0.0)

    @cached_property
    def fingerprint(self) -> str:
        """Fingerprint of everything that the rows of this study depend on."""
        files = self.response.files
        if self.study.vary.posterior is not None:
            place = self.study.folder / self.study.vary.posterior
            files = (*files, place / POSTERIOR_FILE if place.is_dir() else place)
        return fingerprint(self.study, tuple(map(Path, files)), version("pneusma-jax"))

    @cached_property
    def cautions(self) -> list[str]:
        """What tables and models on disk say against their own numbers; the command line has told it."""
        tables = [path for path in map(Path, self.response.files) if path.suffix == ".toml"]
        said = [(path, parse_toml(read_text(path, path), path).get("caution")) for path in tables]
        return [distrusted(path, caution) for path, caution in said if caution]

    @property
    def index_columns(self) -> np.ndarray:
        """Numbers of the columns that indices are of."""
        of = self.study.indices.of or tuple(q.name for q in self.columns.quantities)
        return np.concatenate([np.arange(self.columns.total)[self.columns.of(name)] for name in of])


def build_problem(study: Study) -> Problem:
    """A study with its model; float64 must be on.

    Raises:
        InputError: for anything in the study that cannot be, one line.
    """
    response = response_of(study, _names_of_expressions(study))
    inputs, notices = inputs_of(study, response)
    columns = check_quantities(study.outputs, study.limits, response, str(study.path))
    groups = _groups(study, inputs)
    design = _design(study, inputs, groups, columns)
    if study.sampling.method == "sobol" and -(-study.sampling.rows // design.block) > MOST_POINTS:
        raise InputError(
            f"{study.path}: [sampling] a Sobol sequence has {MOST_POINTS:,} points; take method = "
            "'monte_carlo'"
        )
    _check_rare(study, response, inputs)
    notices = [*response.notices, *notices]
    notices += without_unit(columns) if response.with_units else []
    return Problem(study, response, inputs, columns, design, groups, tuple(notices))


def _check_rare(study: Study, response: Response, inputs: Inputs) -> None:
    """Refuse small probabilities that cannot be found."""
    if study.rare is None:
        return
    where = f"{study.path}: [rare]"
    if not study.limits:
        raise InputError(f"{where} needs a [[limit]], which says what a failure is")
    noisy = {quantity.name for quantity in study.outputs if quantity.noise > 0.0}
    for limit in study.limits:
        if limit.on in noisy:
            raise InputError(
                f"{where} {limit.on!r} has the noise of a measurement, which small probabilities leave out; "
                "put the limit on an [[output]] without noise"
            )
    if "form" in study.rare.methods and not response.smooth:
        raise InputError(f"{where} FORM needs derivatives, and here are steps; take methods = ['subset']")
    if "form" in study.rare.methods and inputs.draws is not None:
        raise InputError(
            f"{where} FORM needs derivatives, which draws picked one by one have not; take posterior_as = "
            "'copula', or methods = ['subset']"
        )


def _names_of_expressions(study: Study) -> dict[str, float]:
    """Names that expressions may use, with the median of each: of `[input]` and of a posterior."""
    if study.model["through"] != "expression":
        return {}
    plain = plain_marginals(study)
    found = {name: float(marginal.at(np.zeros(1))[0]) for name, marginal in plain.items()}
    if study.vary.posterior is not None:
        draws = read_draws(study.folder / study.vary.posterior)
        found |= dict(zip(draws.names, map(float, np.median(draws.table, axis=0)), strict=True))
    return found


def _design(study: Study, inputs: Inputs, groups: dict[str, tuple[int, ...]], columns: Columns) -> Design:
    if study.indices is None:
        return Plain(inputs)
    where = f"{study.path}: [indices]"
    names = [quantity.name for quantity in columns.quantities]
    for name in study.indices.of:
        if name not in names:
            raise InputError(f"{where} of: no output is called {name!r}, {nearest(name, names)}")
    if len(groups) < 2:
        raise InputError(
            f"{where}: there is only one input or group, {next(iter(groups))!r}: it explains everything"
        )
    count = sum(columns.counts[names.index(name)] for name in (study.indices.of or names))
    if count * len(groups) * 3 * REPLICATES > MOST_SUMS:
        raise InputError(
            f"{where}: {count} columns times {len(groups)} groups are too many indices; choose outputs "
            "with of ="
            " [...], or 'reduce' and 'at' in [[output]]"
        )
    if study.indices.kind == "shapley":
        return Shapley(inputs, tuple(groups.values()))
    _check_independent(inputs, groups, where)
    return Saltelli(inputs, tuple(groups.values()))


def _groups(study: Study, inputs: Inputs) -> dict[str, tuple[int, ...]]:
    """Numbers of inputs by group; an input that is in none is its own."""
    if study.indices is None:
        return {}
    where, names = f"{study.path}: [indices] groups", list(inputs.names)
    taken: dict[str, str] = {}
    for group, members in study.indices.groups.items():
        if not members:
            raise InputError(f"{where}: {group} has no members")
        for name in members:
            if name not in names:
                raise InputError(f"{where}: {name!r} does not vary, {nearest(name, names)}")
            if name in taken:
                raise InputError(f"{where}: {name!r} is in {taken[name]} and in {group}; keep one")
            taken[name] = group
    found = {group: tuple(names.index(n) for n in members) for group, members in study.indices.groups.items()}
    for name in names:
        if name not in taken:
            if name in found:
                raise InputError(f"{where}: {name!r} is an input, too; give the group another name")
            found[name] = (names.index(name),)
    return found


def _check_independent(inputs: Inputs, groups: dict[str, Sequence[int]], where: str) -> None:
    """Sobol indices of correlated inputs have no meaning of their own: say what has."""
    home = {k: group for group, members in groups.items() for k in members}
    for i, j in zip(*np.nonzero(np.triu(inputs.correlation, 1)), strict=True):
        if home[int(i)] != home[int(j)]:
            raise InputError(
                f"{where}: {inputs.names[i]!r} and {inputs.names[j]!r} are correlated, so Sobol indices "
                "of each"
                " mean nothing: put them into one of groups, or take kind = 'shapley'"
            )
