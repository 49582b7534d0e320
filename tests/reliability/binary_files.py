"""Small binary files of every kind that the project reads back, how each is read, and how it is damaged.

Each kind has a reader that is the one of a command, and the numbers of the undamaged file. A damaged file must be
refused, or its numbers must be the same to the last bit.
"""

import functools
import io
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import h5py
import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import Recording, read_recording
from fitting.data.sealed import SEAL, sealed
from fitting.design.posterior_file import posterior_draws as read_design_posterior
from fitting.engine import objects
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.propagate import build_problem, read_study
from fitting.propagate.chunk import chunk_bytes, read_summary
from fitting.propagate.inputs_of import read_draws
from fitting.report.posterior.netcdf import _group
from fitting.sample import Settings, Target, sample
from pneusma_jax.errors import InputError
from pneusma_jax.precision import enable_float64

ROOT = Path(__file__).resolve().parents[2]
STUDY = """schema = "pneusma-study/1"
name = "plain"
[model]
through = "expression"
outputs = {y = "a + 2*b"}
[input]
a = {mean = 1.0, sd = 0.5}
b = {mean = 0.0, sd = 1.0}
[sampling]
rows = 100
chunk = 100
"""
STEPS = 20


class Binary(NamedTuple):
    """A kind of binary file.

    Attributes:
        name: of the file.
        content: of the undamaged file.
        read: every number of a file, as arrays.
    """

    name: str
    content: bytes
    read: Callable[[Path], list[np.ndarray]]


@functools.cache
def kinds() -> dict[str, Binary]:
    """All kinds; made once, since sampling and studies compile."""
    enable_float64()
    study_chunk, fingerprint = _chunk()
    posterior = _posterior_file()
    return {
        "chain of emcee": Binary("chain.h5", _chain("emcee"), lambda path: _resumed(path, "emcee")),
        "chain of nuts": Binary("chain.h5", _chain("nuts"), lambda path: _resumed(path, "nuts")),
        "posterior, for studies": Binary("posterior.nc", posterior, lambda path: [read_draws(path).table]),
        "posterior, for designs": Binary(
            "posterior.nc", posterior, lambda path: [*read_design_posterior(path)[0].values()]
        ),
        "chunk of a study": Binary(
            "chunk.h5", study_chunk,
            lambda path: [*read_summary(path.read_bytes(), fingerprint, 0, path.name).arrays().values()],
        ),
        "stored result": Binary("member", _result(), _columns),
    }  # fmt: skip


def _line(values, data):
    return (values["offset"] + values["slope"] * data["x"] - data["y"]) / data["sigma"]


@functools.cache
def _problem() -> tuple[Target, Parameters]:
    parameters = Parameters(
        Parameter("offset", 0.0, prior=Prior(0.0, 1.0)), Parameter("slope", 1.0, prior=Prior(1.0, 0.5))
    )
    x = np.linspace(-0.4, 1.6, 12)
    noise = np.random.default_rng(0).standard_normal(12)
    data = {"x": jnp.asarray(x), "y": jnp.asarray(0.3 + 1.4 * x + 0.4 * noise), "sigma": jnp.asarray(0.4)}
    return Target.from_residual(_line, parameters, data), parameters


def _settings(sampler: str) -> Settings:
    return Settings(walkers=8, ensembles=2, max_steps=STEPS, seed=7, chunk=STEPS, sampler=sampler)


@functools.cache
def _chain(sampler: str) -> bytes:
    target, parameters = _problem()
    with tempfile.TemporaryDirectory() as place:
        sample(target, parameters, _settings(sampler), file=Path(place) / "chain.h5", progress=False)
        return (Path(place) / "chain.h5").read_bytes()


def _resumed(path: Path, sampler: str) -> list[np.ndarray]:
    target, parameters = _problem()
    found = sample(target, parameters, _settings(sampler), file=path, resume=True, progress=False)
    return [found.chains, found.log_probabilities]


def _posterior_file() -> bytes:
    rng, stream = np.random.default_rng(3), io.BytesIO()
    draws = {
        "G_m": 3.1 + 0.1 * rng.standard_normal((4, 8)),
        "silicone_stiffness": rng.normal(1, 0.05, (4, 8)),
    }
    with h5py.File(stream, "w", track_order=True) as file:
        file.attrs["inference_library"] = "emcee"
        variables = {name: (("chain", "draw"), values) for name, values in draws.items()}
        _group(file, "posterior", {"chain": 4, "draw": 8}, variables, {"G_m": "GPa"})
    return sealed(stream.getvalue())


def _chunk() -> tuple[bytes, str]:
    with tempfile.TemporaryDirectory() as place:
        (Path(place) / "study.toml").write_text(STUDY)
        problem = build_problem(read_study(Path(place) / "study.toml"))
        return chunk_bytes(problem, problem.sampler(), 0), problem.fingerprint


def _columns(path: Path) -> list[np.ndarray]:
    """Columns of a stored recording. Any other object is refused, as a run that goes on computes it again."""
    found = objects.load(path.read_bytes())
    if not isinstance(found, Recording) or not hasattr(found, "columns"):
        raise InputError(f"{path}: no recording")
    return [*found.columns.values()]


def _result() -> bytes:
    return objects.dump(read_recording(ROOT / "calibration_data" / "examples" / "elastomer" / "pull_1.csv"))


def binary_mutation(rng: np.random.Generator, content: bytes) -> bytes:
    """A binary file whose bytes are damaged in one of eight ways."""
    kind, at = int(rng.integers(8)), int(rng.integers(len(content)))
    length = int(min(len(content) - at, rng.integers(1, 600)))
    if kind == 0:  # a bit is another
        return content[:at] + bytes([content[at] ^ (1 << int(rng.integers(8)))]) + content[at + 1 :]
    if kind == 1:  # cut off
        return content[:at]
    if kind == 2:  # a block is zero, as after a crash of the system
        return content[:at] + bytes(length) + content[at + length :]
    if kind == 3:  # a block is missing
        return content[:at] + content[at + length :]
    if kind == 4:  # bytes between others
        return content[:at] + rng.bytes(length) + content[at:]
    if kind == 5:  # a block is noise
        return content[:at] + rng.bytes(length) + content[at + length :]
    if kind == 6:  # several bits are others
        damaged = bytearray(content)
        for place in rng.integers(len(content), size=int(rng.integers(2, 20))):
            damaged[int(place)] ^= 1 << int(rng.integers(8))
        return bytes(damaged)
    return (b"", bytes(len(content)), rng.bytes(200), content * 2)[int(rng.integers(4))]


def without_seal(content: bytes) -> bytes:
    """The file as another program would have written it, without a digest."""
    return content[:-SEAL]
