"""Linear-Gaussian worlds: campaigns whose outputs are linear in all numbers, so that every answer is known.

A world takes the place of the compiled function only. Program, fits, scores, evidence, cross-validation and rules
are those of the package. Sensitivities and noise are in standard deviations of the noise.
"""

from dataclasses import dataclass, field, replace

import jax.numpy as jnp
import numpy as np

from fitting.data.recordings import Recording
from fitting.diagnose.evaluate.evaluation import Raw
from fitting.diagnose.evaluate.program import Program
from fitting.diagnose.evaluate.unknowns import Unknowns
from fitting.inference.channels import Channel
from fitting.inference.parameters import Parameter, Parameters, Prior
from fitting.specimens.rows import Rows

SIGMA = 1e-6
"""1-sigma of the output, m."""
CONSTANT, ANOTHER, DELAY, SWELLING = "wall_eccentricity", "thick_wall", "channel_lag", "radial_expansion"
"""Effects of tubes: one strength, two strengths, and two of one positive strength. Shapes are left out."""


class Strengths(Unknowns):
    """The base constants and the strengths of effects. A world is linear, so it has no shapes."""

    def __init__(self, base, slugs, letter):
        super().__init__(base, slugs, letter)
        self.items = tuple(item for item in self.items if not item.shape)
        self._places = {slug: [k for k, item in enumerate(self.items) if item.effect == slug] for slug in ("", *slugs)}
        self.base = np.array(self._places[""], int)
        self.low, self.high = (np.array([getattr(item, end) for item in self.items]) for end in ("low", "high"))
        self.neutral = np.zeros(len(self.items))


@dataclass(frozen=True)
class World:
    """A base model and effects.

    Attributes:
        base: sensitivities to base constants, whose priors are of unit size, (recordings, rows, constants).
        effects: sensitivities to the scaled strengths of every effect, (recordings, rows, strengths).
        roles: of the recordings.
        stated: whether the size of the noise is.
    """

    base: np.ndarray
    effects: dict[str, np.ndarray] = field(default_factory=dict)
    roles: tuple[str, ...] = ()
    stated: bool = True

    def run(self, u, columns, stacked, chosen=None):
        """What `Compiled.run` returns, in closed form; numbers of no meaning for recordings that nobody asks for."""
        J = np.concatenate([self.base, *self.effects.values()], axis=2)
        J = J if chosen is None else np.where(chosen[:, None, None], J, 1e3)
        slopes = np.moveaxis(SIGMA * J[:, :, columns], 2, 0)
        return Raw(stacked, {"length": SIGMA * (J @ u)}, {"length": slopes}, {"length": slopes[:0]}, self.drivers)

    width, one_by_one = 64, True

    @property
    def drivers(self):
        count, rows, _ = self.base.shape
        return {"pressure": np.tile(1e3 * np.sin(np.linspace(0.0, 3.0, rows)), (count, 1))}

    def truth(self, rng, base=(), **strengths):
        """Measured outputs of a truth with noise, in standard deviations, (recordings, rows).

        Args:
            rng: of the noise; None for none.
            base: base constants, in standard deviations from nominal; zero if not given.
            strengths: scaled, by effect.
        """
        constants = np.zeros(self.base.shape[2])
        constants[: len(base)] = base
        y = self.base @ constants + sum(self.effects[slug] @ np.atleast_1d(s) for slug, s in strengths.items())
        return y + (0.0 if rng is None else rng.standard_normal(y.shape))

    def program(self, measured):
        """The campaign that measured this, (recordings, rows)."""
        count, rows, constants = self.base.shape
        roles = self.roles or ("fit",) * count
        time, pressure = np.arange(rows) * 1.0, self.drivers["pressure"]
        columns = [
            {"time_s": time, "pressure_kPa": p / 1e3, "length_mm": 1e3 * SIGMA * y}
            for p, y in zip(pressure, measured, strict=True)
        ]
        noise = {"length_mm": 1e3 * SIGMA} if self.stated else {}
        recordings = [
            Recording(f"r{k}", None, "tube", role, "T", columns=c, noise=noise)
            for k, (c, role) in enumerate(zip(columns, roles, strict=True))
        ]
        names = [f"constant_{j}" for j in range(constants)]
        prior = Prior(1.0, 0.1, -np.inf, np.inf)
        unknowns = Strengths(Parameters(*(Parameter(n, 1.0, prior=prior) for n in names)), tuple(self.effects), "T")
        stacked = Rows(
            mask=jnp.ones((count, rows), bool), time=jnp.tile(time, (count, 1)), inputs={},
            measured={"length": jnp.asarray(SIGMA * measured)}, weight={"length": jnp.full((count, rows), 1.0 / SIGMA)},
            base={n: jnp.ones(count) for n in names}, extra={}, specimen=jnp.ones(count, int),
        )  # fmt: skip
        channels = [[Channel("length", SIGMA * y, np.full(rows, SIGMA), 0.0)] for y in measured]
        fitted = np.array([role == "fit" for role in roles])
        program = Program("tube", recordings, stacked, channels, unknowns, fitted, _compiled=self)
        return replace(program, trajectory_degrees_of_freedom=np.zeros(count), process_noise=np.zeros((count, 0)), bare=channels)

    def design(self, slugs=(), chosen=None):
        """Sensitivities of chosen recordings to base constants and effects, (values, numbers)."""
        J = np.concatenate([self.base, *(self.effects[slug] for slug in slugs)], axis=2)
        return (J if chosen is None else J[chosen]).reshape(-1, J.shape[2])


def smooth(rng, *shape):
    """Random smooth courses of unit root mean square over the rows, (recordings, rows, numbers)."""
    count, rows, numbers = shape
    t = np.linspace(0.0, 1.0, rows)
    waves = np.stack([np.cos(np.pi * k * t) for k in range(1, 6)], axis=1)
    found = np.einsum("rk,ckn->crn", waves, rng.standard_normal((count, 5, numbers)))
    return found / np.sqrt(np.mean(found**2, axis=1, keepdims=True))


def tubes(recordings=4, rows=60, constants=2, effects=(CONSTANT, ANOTHER, DELAY, SWELLING), seed=0, **more):
    """A world with effects of random smooth sensitivities."""
    rng = np.random.default_rng(seed)
    counts = {ANOTHER: 2}
    sensitivities = {slug: smooth(rng, recordings, rows, counts.get(slug, 1)) for slug in effects}
    return World(smooth(rng, recordings, rows, constants), sensitivities, **more)


def fast(recordings=4, rows=60, effects=(CONSTANT, DELAY), **more):
    """A world whose effects change from row to row, which no drift does."""
    rng = np.random.default_rng(0)
    base = smooth(rng, recordings, rows, 2)
    return World(base, {slug: rng.standard_normal((recordings, rows, 1)) for slug in effects}, **more)


def ridge(A, y):
    """Posterior mean and covariance of unit priors and unit noise."""
    covariance = np.linalg.inv(A.T @ A + np.eye(A.shape[1]))
    return covariance @ A.T @ y, covariance


def log_density(y, covariance):
    """Of a Gaussian of mean zero."""
    return -0.5 * (y @ np.linalg.solve(covariance, y) + np.linalg.slogdet(covariance)[1] + len(y) * np.log(2.0 * np.pi))
