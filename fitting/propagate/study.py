"""A study as data: what varies, through what, to what, and how many rows."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .quantities import Limit, Quantity

SUMS = 2
"""Number of the form in which chunks keep their sums: those of another form are of another study."""

ROWS, CHUNK = 10_000, 10_000
"""Rows of a study that states none: enough for the mean to a hundredth of the spread. Rows of a chunk."""
LEAST_CHUNK, MOST_CHUNK = 100, 1_000_000
"""Smaller chunks make too many files; larger ones need gigabytes."""
MOST_ROWS = 10**10


@dataclass(frozen=True)
class Sampling:
    """Sampling of the rows.

    Attributes:
        method: one of `sampling.METHODS`.
        rows: wanted; whole blocks are made of them.
        chunk: rows of a file, likewise.
        seed: seed of all random numbers.
        keep: `outputs` keeps the columns of every row on disk, `summary` only their sums.
    """

    method: str = "sobol"
    rows: int = ROWS
    chunk: int = CHUNK
    seed: int = 0
    keep: str = "outputs"


@dataclass(frozen=True)
class Indices:
    """Requested sensitivity indices.

    Attributes:
        kind: `sobol` or `shapley`.
        of: quantities; all if empty.
        groups: members by name; an input in none is its own.
    """

    kind: str = "sobol"
    of: tuple[str, ...] = ()
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class Rare:
    """Small probabilities: of which limit, by what.

    Attributes:
        methods: any of `subset`, `form`.
        samples: number of samples of a level of subset simulation, and of importance sampling.
        runs: independent subset simulations, whose spread is the interval.
        starts: number of searches for design points.
    """

    methods: tuple[str, ...] = ("subset", "form")
    samples: int = 1000
    runs: int = 10
    starts: int = 8


@dataclass(frozen=True)
class Vary:
    """Varied numbers besides single inputs.

    Attributes:
        priors: kinds of table whose priors are drawn; `recording` for those of a fit.
        leave_out: names that stay at their values.
        posterior: file or folder of `pneusma posterior`, or None.
        posterior_as: `draws` picks joint draws; `copula` has their marginals and rank correlations.
        posterior_specimen: number of the specimen, where the posterior is of several; else None.
        tolerance: relative 1-sigma by name.
    """

    priors: tuple[str, ...] = ()
    leave_out: tuple[str, ...] = ()
    posterior: str | None = None
    posterior_as: str = "draws"
    posterior_specimen: int | None = None
    tolerance: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Study:
    """A study, checked as far as it can be without the model.

    Attributes:
        path: path of its file.
        name, description: texts for people.
        model: its `[model]`, through what.
        vary: its `[vary]`.
        inputs: its `[input.NAME]`, as read.
        correlations: pairs and their correlation.
        outputs: the requested quantities.
        limits: limits at which quantities fail.
        sampling: settings of the sampling.
        indices: or None.
        rare: or None.
        noise: 1-sigma of white noise along channels, by column with its unit.
    """

    path: Path
    name: str
    model: Mapping[str, Any]
    vary: Vary = Vary()
    inputs: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    correlations: tuple[tuple[str, str, float], ...] = ()
    outputs: tuple[Quantity, ...] = ()
    limits: tuple[Limit, ...] = ()
    sampling: Sampling = Sampling()
    indices: Indices | None = None
    rare: Rare | None = None
    description: str = ""
    noise: Mapping[str, float] = field(default_factory=dict)

    @property
    def folder(self) -> Path:
        """Folder from which relative paths in the study count."""
        return self.path.parent


def fingerprint(study: Study, files: tuple[Path, ...], version: str) -> str:
    """Fingerprint of all that rows of a study depend on: the study without the number of rows, its files, the
    version.

    Args:
        study: without its own place.
        files: files that the model comes from.
        version: version of the program.
    """
    parts = {
        name: repr(getattr(study, name))
        for name in ("model", "vary", "inputs", "correlations", "outputs", "limits", "indices", "noise")
    }
    sampling = study.sampling
    parts["sampling"] = repr((sampling.method, sampling.chunk, sampling.seed, sampling.keep))
    contents = [hashlib.sha256(Path(file).read_bytes()).hexdigest() for file in files if Path(file).is_file()]
    text = json.dumps([version, SUMS, parts, contents], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
