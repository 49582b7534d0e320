"""One chunk of a study: rows drawn, computed, summed up, as the content of a file."""

import io
from dataclasses import dataclass

import h5py
import numpy as np

from fitting.data import hdf5
from fitting.data.sealed import sealed
from pneusma_jax.errors import InputError
from pneusma_jax.precision import enable_float64

from .problem import Problem, build_problem
from .quantities import exceeded
from .sampling import Sampler, stream
from .statistics.correlation import Correlation
from .statistics.failures import Failures
from .statistics.indices import Sums
from .statistics.moments import Moments, Sketches
from .statistics.summary import Summary
from .statistics.touching import Touching
from .study import Study

INDEPENDENT = 2
"""Rows of a block, its first, that are independent of each other: moments and quantiles are of these."""
ORDERS, NOISE, BOOTSTRAP = 1, 2, 3
"""Purposes of a chunk's streams of random numbers; 0 is that of its points."""
_PREPARED: dict[str, tuple[Problem, Sampler]] = {}
"""Problems of this process, by fingerprint: a worker compiles a study once."""


@dataclass(frozen=True)
class ChunkJob:
    """Computes chunks of a study by index; small enough to be sent to any worker.

    Attributes:
        study: the study as read. A worker elsewhere must see its files under the same paths.
        fingerprint: fingerprint that the worker's own reading must have.
    """

    study: Study
    fingerprint: str

    def __call__(self, index: int) -> bytes:
        """Content of a chunk's file.

        Raises:
            InputError: if the files of the study are others here.
        """
        if self.fingerprint not in _PREPARED:
            enable_float64()
            prepare(build_problem(self.study), self.fingerprint)
        problem, sampler = _PREPARED[self.fingerprint]
        return chunk_bytes(problem, sampler, index)


def prepare(problem: Problem, expected: str | None = None) -> ChunkJob:
    """Keep a problem for this process's chunks, and return the job.

    Args:
        problem: problem of a study.
        expected: fingerprint that it must have.

    Raises:
        InputError: if it has another.
    """
    own = problem.fingerprint
    if expected is not None and own != expected:
        raise InputError(
            f"{problem.study.path}: this worker reads other files or has another version of the program"
        )
    _PREPARED.clear()  # one study at a time: compiled programs are large
    _PREPARED[own] = problem, problem.sampler()
    return ChunkJob(problem.study, own)


def chunk_bytes(problem: Problem, sampler: Sampler, index: int) -> bytes:
    """A chunk's file; the same bytes wherever and whenever it is made with the same libraries."""
    summary, y, status = compute_chunk(problem, sampler, index)
    stream_ = io.BytesIO()
    with h5py.File(stream_, "w", track_order=True) as file:
        file.attrs["fingerprint"], file.attrs["index"] = problem.fingerprint, index
        if problem.study.sampling.keep == "outputs":
            file.create_dataset("outputs", data=y)
            file.create_dataset("status", data=status)
        for name, array in summary.arrays().items():
            file.create_dataset(f"summary/{name}", data=array)
    return sealed(stream_.getvalue())


def compute_chunk(problem: Problem, sampler: Sampler, index: int) -> tuple[Summary, np.ndarray, np.ndarray]:
    """Sums, columns of shape (rows, columns) and status of a chunk's rows."""
    study, block = problem.study, problem.design.block
    count = min(problem.chunk_points, problem.points - index * problem.chunk_points)
    seed = study.sampling.seed
    points = sampler.points(index, count)
    z, orders = problem.design.rows(points, stream(seed, index, ORDERS))
    y, status, touching = problem.evaluator.everything(problem.inputs.values(z))
    noise = problem.columns.noise
    if np.any(noise):
        y = y + noise * stream(seed, index, NOISE).standard_normal(y.shape)
    good = np.all(np.isfinite(y), axis=1)
    own = np.arange(len(y)) % block < INDEPENDENT
    kept = y[own & good]
    indices = None
    if study.indices is not None:
        blocks = y.reshape(count, block, -1)[:, :, problem.index_columns]
        centre = problem.centre[problem.index_columns]
        indices = Sums.of(study.indices.kind, blocks, centre, orders, stream(seed, index, BOOTSTRAP))
    summary = Summary(
        moments=Moments.of(kept),
        sketches=Sketches.of(kept),
        correlation=Correlation.of(z[own & good], kept, problem.centre),
        beyond={
            words: part.sum(axis=0) for words, part in exceeded(kept, study.limits, problem.columns).items()
        },
        failures=Failures.of(z, status, good),
        indices=indices,
        touching=Touching.of(touching),
    )
    return summary, y, status


def read_summary(content: bytes, fingerprint: str, index: int, name: str) -> Summary:
    """Sums of a chunk's file.

    Args:
        content: of the file.
        fingerprint: of the study.
        index: of the chunk.
        name: path of the file, for messages.

    Raises:
        InputError: if it is of another study, another chunk, or damaged.
    """
    with hdf5.opened(content, name, "a chunk of a study", "; remove it, then go on with --resume") as file:
        if file.attrs["fingerprint"] != fingerprint:
            raise InputError(f"{name}: this chunk is of another study; choose another folder, or --force")
        if file.attrs["index"] != index:
            raise InputError(
                f"{name}: this is chunk {file.attrs['index']} under the name of another; remove it, then go "
                "on with --resume"
            )
        arrays: dict[str, np.ndarray] = {}
        file["summary"].visititems(
            lambda key, part: arrays.update({key: part[()]}) if isinstance(part, h5py.Dataset) else None
        )
        return Summary.from_arrays(arrays)
