"""Small problems with exact answers."""

import jax.numpy as jnp
import numpy as np

from fitting.inference.parameters import Parameter, Parameters, Prior


def line(values, data):
    """Residual of a straight line."""
    return (values["offset"] + values["slope"] * data["x"] - data["y"]) / data["sigma"]


def line_parameters() -> Parameters:
    return Parameters(
        Parameter("offset", 0.0, prior=Prior(0.0, 1.0)),
        Parameter("slope", 1.0, prior=Prior(1.0, 0.5)),
    )


def line_data(seed: int = 0, offset: float = 0.3, slope: float = 1.4, rows: int = 12) -> dict:
    x = np.linspace(-0.4, 1.6, rows)
    noise = np.random.default_rng(seed).standard_normal(rows)
    return {"x": x, "y": offset + slope * x + 0.4 * noise, "sigma": np.asarray(0.4)}


def line_posterior(data: dict) -> tuple[np.ndarray, np.ndarray]:
    """Exact mean and covariance of the line."""
    design = np.stack([np.ones_like(data["x"]), data["x"]], axis=1) / data["sigma"]
    precision = design.T @ design + np.diag([1.0, 4.0])
    pull = design.T @ (data["y"] / data["sigma"]) + np.array([0.0, 4.0])
    return np.linalg.solve(precision, pull), np.linalg.inv(precision)


def banana(values, data):
    """Log-likelihood whose draws are `x ~ N(0, 1)`, `y ~ b (x^2 - 1) + N(0, 1)`."""
    return -0.5 * values["x"] ** 2 - 0.5 * (values["y"] - data["bend"] * (values["x"] ** 2 - 1.0)) ** 2


def constant(values, data):
    """Nothing is learnt: what is sampled is the prior."""
    return jnp.zeros(()) * sum(values.values())


def within(posterior, name, mean, sd, sigmas=4.0):
    """The sampled mean and sd are within so many Monte Carlo standard errors of the exact ones."""
    found = posterior.summary[name]
    assert abs(found.mean - mean) < sigmas * found.mcse, (name, found.mean, mean, found.mcse)
    assert abs(found.sd / sd - 1.0) < sigmas * 1.5 / np.sqrt(2.0 * found.effective), (name, found.sd, sd)
