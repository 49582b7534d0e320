"""Bayesian posteriors by Markov chain Monte Carlo on one compiled log-probability, with a Laplace
approximation beside them.

>>> target = Target.from_residual(residual, parameters, data)
>>> posterior = sample(target, parameters)
>>> posterior.converged, posterior.summary["stiffness"].sd
"""

from .laplace import Laplace, laplace
from .result import Posterior, Summary
from .sampling import sample
from .settings import Settings
from .target import Target

__all__ = ["Laplace", "Posterior", "Settings", "Summary", "Target", "laplace", "sample"]
