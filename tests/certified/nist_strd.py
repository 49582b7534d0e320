"""NIST Statistical Reference Datasets, nonlinear regression: the parser and the 27 model functions.

The numbers (data, starting points, certified parameters and standard deviations) are read from NIST's own
files; only the formulas are written here, each as the file's `Model:` section prints it.
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path

import jax.numpy as jnp
import numpy as np

REPOSITORY = Path(__file__).parents[2]


def folder() -> Path:
    """Where the files are: `PNEUSMA_CERTIFIED`, or `../shared/certified` beside the repository."""
    return Path(os.environ.get("PNEUSMA_CERTIFIED", REPOSITORY.parent / "shared" / "certified")) / "nist_strd"


@dataclass(frozen=True)
class Problem:
    name: str
    y: np.ndarray
    x: np.ndarray
    starts: tuple[np.ndarray, np.ndarray]
    certified: np.ndarray
    standard_errors: np.ndarray
    residual_sum_of_squares: float
    degrees_of_freedom: int


def read(path: Path) -> Problem:
    """Parse one file by the line ranges that its own header states."""
    lines = path.read_text().splitlines()
    header = "\n".join(lines[:10])

    def block(title: str) -> list[str]:
        first, last = re.search(rf"{title}\s+\(lines\s+(\d+)\s+to\s+(\d+)\)", header).groups()
        return lines[int(first) - 1 : int(last)]

    table = np.array(
        [[float(cell) for cell in line.split("=")[1].split()] for line in block("Starting Values")]
    )
    data = np.array([[float(cell) for cell in line.split()] for line in block("Data")])
    text = "\n".join(lines)
    return Problem(
        name=path.stem,
        y=data[:, 0],
        x=data[:, 1] if data.shape[1] == 2 else data[:, 1:].T,
        starts=(table[:, 0], table[:, 1]),
        certified=table[:, 2],
        standard_errors=table[:, 3],
        residual_sum_of_squares=float(re.search(r"Residual Sum of Squares:\s+(\S+)", text)[1]),
        degrees_of_freedom=int(re.search(r"Degrees of Freedom:\s+(\d+)", text)[1]),
    )


def bennett5(b, x):
    return b[0] * (b[1] + x) ** (-1 / b[2])


def saturating_exponential(b, x):
    return b[0] * (1 - jnp.exp(-b[1] * x))


def chwirut(b, x):
    return jnp.exp(-b[0] * x) / (b[1] + b[2] * x)


def dan_wood(b, x):
    return b[0] * x ** b[1]


def enso(b, x):
    def cycle(period):
        return 2 * jnp.pi * x / period

    return (
        b[0]
        + b[1] * jnp.cos(cycle(12))
        + b[2] * jnp.sin(cycle(12))
        + b[4] * jnp.cos(cycle(b[3]))
        + b[5] * jnp.sin(cycle(b[3]))
        + b[7] * jnp.cos(cycle(b[6]))
        + b[8] * jnp.sin(cycle(b[6]))
    )


def eckerle4(b, x):
    return (b[0] / b[1]) * jnp.exp(-0.5 * ((x - b[2]) / b[1]) ** 2)


def gauss(b, x):
    return (
        b[0] * jnp.exp(-b[1] * x)
        + b[2] * jnp.exp(-((x - b[3]) ** 2) / b[4] ** 2)
        + b[5] * jnp.exp(-((x - b[6]) ** 2) / b[7] ** 2)
    )


def cubic_over_cubic(b, x):
    return (b[0] + b[1] * x + b[2] * x**2 + b[3] * x**3) / (1 + b[4] * x + b[5] * x**2 + b[6] * x**3)


def kirby2(b, x):
    return (b[0] + b[1] * x + b[2] * x**2) / (1 + b[3] * x + b[4] * x**2)


def lanczos(b, x):
    return b[0] * jnp.exp(-b[1] * x) + b[2] * jnp.exp(-b[3] * x) + b[4] * jnp.exp(-b[5] * x)


def mgh09(b, x):
    return b[0] * (x**2 + x * b[1]) / (x**2 + x * b[2] + b[3])


def mgh10(b, x):
    return b[0] * jnp.exp(b[1] / (x + b[2]))


def mgh17(b, x):
    return b[0] + b[1] * jnp.exp(-x * b[3]) + b[2] * jnp.exp(-x * b[4])


def misra1b(b, x):
    return b[0] * (1 - (1 + b[1] * x / 2) ** (-2))


def misra1c(b, x):
    return b[0] * (1 - (1 + 2 * b[1] * x) ** (-0.5))


def misra1d(b, x):
    return b[0] * b[1] * x * ((1 + b[1] * x) ** (-1))


def nelson(b, x):
    return b[0] - b[1] * x[0] * jnp.exp(-b[2] * x[1])


def rat42(b, x):
    return b[0] / (1 + jnp.exp(b[1] - b[2] * x))


def rat43(b, x):
    return b[0] / ((1 + jnp.exp(b[1] - b[2] * x)) ** (1 / b[3]))


def roszman1(b, x):
    return b[0] - b[1] * x - jnp.arctan(b[2] / (x - b[3])) / jnp.pi


MODELS = {
    "Bennett5": bennett5,
    "BoxBOD": saturating_exponential,
    "Chwirut1": chwirut,
    "Chwirut2": chwirut,
    "DanWood": dan_wood,
    "ENSO": enso,
    "Eckerle4": eckerle4,
    "Gauss1": gauss,
    "Gauss2": gauss,
    "Gauss3": gauss,
    "Hahn1": cubic_over_cubic,
    "Kirby2": kirby2,
    "Lanczos1": lanczos,
    "Lanczos2": lanczos,
    "Lanczos3": lanczos,
    "MGH09": mgh09,
    "MGH10": mgh10,
    "MGH17": mgh17,
    "Misra1a": saturating_exponential,
    "Misra1b": misra1b,
    "Misra1c": misra1c,
    "Misra1d": misra1d,
    "Nelson": nelson,
    "Rat42": rat42,
    "Rat43": rat43,
    "Roszman1": roszman1,
    "Thurber": cubic_over_cubic,
}


def observed(problem: Problem) -> np.ndarray:
    """The response that the model predicts: Nelson's is the logarithm of y, as its file prints."""
    return np.log(problem.y) if problem.name == "Nelson" else problem.y


def certified_digits(estimate: np.ndarray, certified: np.ndarray) -> float:
    """Log relative error: the number of correct significant digits of the worst entry, at most the 11
    certified."""
    error = np.abs(np.asarray(estimate, float) - certified) / np.abs(certified)
    if not np.all(np.isfinite(error)):
        return 0.0
    return float(np.clip(-np.log10(np.maximum(error, 1e-11)), 0, 11).min())
